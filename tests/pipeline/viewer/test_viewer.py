"""What the viewer is made of: locked packages without addresses, and all logs as one."""

import json
import re
from io import BytesIO
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from pipeline.storage.logs import Log, Series, write_log
from pipeline.viewer import view as install
from pipeline.viewer.view import merged

LOCK = json.loads((install.LOCKED / "package-lock.json").read_text(encoding="utf-8"))
PACKAGES = {name: about for name, about in LOCK["packages"].items() if name}


def test_each_package_is_locked_by_its_hash() -> None:
    assert len(PACKAGES) >= 3
    assert all(re.fullmatch(r"sha512-[\w+/]{86}==", about["integrity"]) for about in PACKAGES.values())
    wanted = json.loads((install.LOCKED / "package.json").read_text(encoding="utf-8"))["dependencies"]
    assert wanted == {name: PACKAGES[f"node_modules/{name}"]["version"] for name in wanted}
    assert LOCK["packages"][""]["dependencies"] == wanted


def test_no_address_is_committed() -> None:
    assert not any("resolved" in about for about in PACKAGES.values())
    for path in install.LOCKED.rglob("*"):
        if path.is_file() and path.suffix != ".pyc":
            assert not re.search(rb"https?://(?!\{)", path.read_bytes()), path


def log(path: Path, *series: Series) -> Path:
    write_log(path, Log(series, {}, {"a.json": b"0"}))
    return path


def test_logs_are_merged_in_the_order_of_time(tmp_path: Path) -> None:
    a = Series("/a", np.array([0.0, 0.2]), {"x": np.array([1.0, 2.0])})
    b = Series("/b", np.array([0.1, 0.3]), {"y": np.array([3.0, 4.0])})
    both = merged([log(tmp_path / "1.mcap", a), log(tmp_path / "2.mcap", b)])
    found = [
        (channel.topic, message.log_time, json.loads(message.data))
        for _, channel, message in make_reader(BytesIO(both)).iter_messages(log_time_order=False)
    ]
    assert found == [
        ("/a", 0, {"t": 0.0, "x": 1.0}),
        ("/b", 100_000_000, {"t": 0.1, "y": 3.0}),
        ("/a", 200_000_000, {"t": 0.2, "x": 2.0}),
        ("/b", 300_000_000, {"t": 0.3, "y": 4.0}),
    ]

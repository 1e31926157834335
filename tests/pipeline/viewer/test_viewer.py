"""What the viewer is made of: locked packages without addresses, and all logs as one."""

import json
import re
from io import BytesIO

from mcap.reader import make_reader

from pipeline.viewer import view as install
from pipeline.viewer.view import merged
from tests.pipeline.committed import RESULTS

LOCK = json.loads((install.LOCKED / "package-lock.json").read_text(encoding="utf-8"))
PACKAGES = {name: about for name, about in LOCK["packages"].items() if name}


def test_each_package_is_locked_by_its_hash_and_no_address_is_committed() -> None:
    assert len(PACKAGES) >= 3
    for about in PACKAGES.values():
        assert re.fullmatch(r"sha512-[\w+/]{86}==", about["integrity"])
        assert "resolved" not in about
    for path in install.LOCKED.glob("*.*"):
        assert not re.search(rb"https?://(?!\{)", path.read_bytes()), path


def test_logs_are_merged_in_the_order_of_time_and_lose_nothing() -> None:
    def messages(data: bytes) -> list[tuple[str, int, bytes]]:
        read = make_reader(BytesIO(data)).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in read]

    logs = [RESULTS["example1"].log(stage) for stage in ("fit", "verification")]
    both = messages(merged(logs))
    assert [time for _, time, _ in both] == sorted(time for _, time, _ in both)
    assert sorted(both) == sorted(message for log in logs for message in messages(log.read_bytes()))

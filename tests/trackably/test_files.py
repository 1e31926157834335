import math
import signal
import stat
import subprocess
import sys

import pytest

from trackably.files import write_atomically, write_json


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_a_result_has_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "ordinary").write_bytes(b"")
    write_atomically(tmp_path / "result", b"")
    modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("ordinary", "result")}
    assert len(modes) == 1


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill like that")
def test_a_kill_leaves_what_was_there_and_at_most_a_hidden_file(tmp_path):
    path = tmp_path / "result"
    path.write_bytes(b"before")
    killed_before_the_end = (
        "import os, signal, sys; from pathlib import Path; from trackably.files import write_atomically\n"
        "os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)\n"
        "write_atomically(Path(sys.argv[1]), b'after')"
    )
    done = subprocess.run([sys.executable, "-c", killed_before_the_end, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    visible = [name for name in names(tmp_path) if not (name.startswith(".result.") and name.endswith(".tmp"))]
    assert visible == ["result"]
    assert path.read_bytes() == b"before"


def test_a_link_is_replaced_and_its_target_kept(tmp_path):
    shared, path = tmp_path / "shared", tmp_path / "result"
    shared.write_bytes(b"shared")
    path.symlink_to(shared)
    write_atomically(path, b"own")
    assert (shared.read_bytes(), path.read_bytes(), path.is_symlink()) == (b"shared", b"own", False)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_json_without_a_number_is_not_written(tmp_path, value):
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "value.json", {"x": [value]})
    assert names(tmp_path) == []

"""Small files keep the time that a check is given, and a gigabyte, in every entry; what unpacks to more is refused.

`make attack` tries all of `HUGE`; here are those of which one was slow, or large, once.
"""

import os
import sys
from pathlib import Path

import pytest

from tests.attack.huge import HUGE, MOST_MEMORY, MOST_SECONDS, READ, RECORDINGS, answers, measured, write
from trackably import check
from trackably.checker import NotACertificate
from trackably.checker.__main__ import UNUSABLE, main
from trackably.errors import InputError
from trackably.files import from_json, from_yaml, read_bytes
from trackably.recordings import read_csv

LIBRARY = ("-m", "trackably", "check")
SLOW_ONCE = {
    "many rows of many weights": LIBRARY,
    "disturbances of 19,000 digits": LIBRARY,
    "endless periods": LIBRARY,
    "a counterexample of such pieces": LIBRARY,
    "a product of 100 kernels": LIBRARY,
    "a table of many rows": LIBRARY,
    "many denominators of multipliers": LIBRARY,
    "5,000 shifted signals in a flat form": LIBRARY,
    "a tower of a number": ("-m", "trackably.checker"),
    "100 angles": (*LIBRARY, "--exact"),
}


@pytest.mark.parametrize("what", SLOW_ONCE)
def test_a_small_file_keeps_its_time_and_a_gigabyte(what: str, tmp_path: Path) -> None:
    took = measured(write(HUGE[what](), tmp_path / "file.json"), "--seconds", "0.5", command=SLOW_ONCE[what])
    assert took.code in answers(what), took
    assert "Traceback" not in took.said
    assert took.seconds < MOST_SECONDS - 1.5
    assert took.memory < MOST_MEMORY


def test_what_unpacks_to_gigabytes_is_refused_in_a_sentence(tmp_path: Path) -> None:
    """One process reads all of them, as it takes a second to start."""
    paths = [tmp_path / f"{number} {packed.name}" for number, packed in enumerate(RECORDINGS.values())]
    for path, packed in zip(paths, RECORDINGS.values(), strict=True):
        packed.write(path)
        assert path.stat().st_size < 10**6
    took = measured(*paths, command=("-c", READ))
    for path, packed, said in zip(paths, RECORDINGS.values(), took.said.splitlines(), strict=True):
        assert said.startswith(str(path))
        assert packed.says in said
    assert took.memory < MOST_MEMORY


@pytest.mark.skipif(sys.platform == "win32", reason="there are other devices")
def test_what_has_no_end_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(pipe := tmp_path / "pipe")
    for path in (pipe, Path("/dev/zero")):
        for read in (check, read_bytes, lambda p: read_csv(p, "t", "s", {"x": "x"})):
            with pytest.raises(InputError, match="a device or a pipe"):
                read(path)
        assert main([str(path)]) == UNUSABLE
        assert "a device or a pipe, which may have no end" in capsys.readouterr().err


def test_a_key_that_is_there_twice_is_found_among_many() -> None:
    keys = ", ".join(f'"{i}": 0' for i in range(50_000))
    with pytest.raises(ValueError, match="key '49999' appears twice in one object"):
        from_json(f'{{{keys}, "49999": 1}}'.encode())


def test_yaml_may_repeat_a_little() -> None:
    assert from_yaml(b"a: &a [1, 2]\nb: *a\nc: [*a, *a]\n") == {"a": [1, 2], "b": [1, 2], "c": [[1, 2], [1, 2]]}


def test_a_list_that_holds_itself_is_no_yaml_and_no_certificate() -> None:
    with pytest.raises(ValueError, match="is not YAML"):
        from_yaml(b"a: &a [*a]")
    inner: dict[str, object] = {"type": "sum"}
    inner |= {"left": inner, "right": inner}
    assert isinstance(check({"format": "trackably certificate", "version": 3, "reference": inner}), NotACertificate)

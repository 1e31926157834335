"""The command line of the checker: answers of its own for what is undecided, refuted, too large, or interrupted."""

import json
import os
import pty
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tests.trackably.checker.edges import hostile
from tests.trackably.checker.edges.test_counterexamples import counterexample
from tests.trackably.checker.instances import scalar_certificate
from trackably.__main__ import main as library
from trackably.checker.__main__ import INTERRUPTED, PROVED, REFUTED, UNDECIDED, UNUSABLE, main
from trackably.checker.limits import BYTES

LONG = hostile.instants(100_000)
SOON = (
    "import runpy, sys\nimport trackably.checker.watch, trackably.checking\n"
    "for name in ('checker.watch', 'checking'): sys.modules[f'trackably.{name}']._PATIENCE = 0\n"
)
COMMANDS = {
    "checker": "from trackably.checker.__main__ import run\nrun()",
    "library": "sys.argv[1:1] = ['check']\nrunpy.run_module('trackably', run_name='__main__')",
}


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    contents = {"proved": scalar_certificate(), "refuted": counterexample("all_times"), "long": LONG}
    for name, data in contents.items():
        (tmp_path / name).write_text(json.dumps(data))
    (tmp_path / "huge").write_bytes(b" " * (BYTES + 1))
    return {path.name: path for path in tmp_path.iterdir()}


ANSWERS = [
    (["proved"], PROVED, ""),
    (["proved", "--seconds", "600"], PROVED, ""),
    (["refuted"], REFUTED, ""),
    (["proved", "--seconds", "1e-9"], UNDECIDED, "not decided within 1e-09 s"),
    (["long", "--seconds", "0.2"], UNDECIDED, "not decided within 0.2 s"),
    (["huge"], UNUSABLE, f"it has more than {BYTES} bytes"),
    *((["proved", "--seconds", number], UNUSABLE, "seconds must be ") for number in ("0", "-1")),
]


@pytest.mark.parametrize("command", [main, lambda given: library(["check", *given])], ids=["checker", "library"])
def test_answers_have_codes_of_their_own(files, capsys, command) -> None:
    for arguments, code, words in ANSWERS:
        assert command([str(files.get(argument, argument)) for argument in arguments]) == code
        said = capsys.readouterr()
        assert bool(said.out) == (code in (PROVED, REFUTED)) != bool(said.err)
        assert words in said.err
        assert said.err.count("\n") <= 1


def test_of_several_files_the_worst_answer_counts(files, capsys) -> None:
    for names, code in ((["proved", "proved"], PROVED), (["refuted", "proved", "huge"], REFUTED)):
        assert library(["check", *(str(files[name]) for name in names)]) == code
        assert capsys.readouterr().out


UNREADABLE = {
    b"{}": "certificate.format must be",
    b"no JSON": "expected JSON: Expecting value: line 1 column 1",
    b'{"a": 1, "a": 1}': "key 'a' appears twice",
    b'{"a": NaN}': "NaN is no JSON number",
    b"[" * 100_000: "expected JSON: maximum recursion depth exceeded",
    b"\xff": "expected JSON: 'utf-8' codec can't decode byte 0xff",
}


def test_what_cannot_be_read_is_said_in_words(tmp_path, capsys) -> None:
    for content, words in UNREADABLE.items():
        (tmp_path / "file").write_bytes(content)
        assert main([str(tmp_path / "file")]) == UNUSABLE
        said = capsys.readouterr().err
        assert said.startswith(f"error: {tmp_path / 'file'}: is ")
        assert words in said
    for arguments in ([str(tmp_path / "missing")], ["file", "--seconds", "soon"], ["file", "--seconds", "nan"], []):
        assert main(arguments) == UNUSABLE


@pytest.mark.parametrize("command", COMMANDS)
def test_an_interrupt_ends_it_at_once(files, command) -> None:
    """As Ctrl-C does, while instants are checked; on a terminal, where a line says how far it is."""
    leader, follower = pty.openpty()
    termios.tcsetwinsize(follower, (24, 80))
    with subprocess.Popen(
        [sys.executable, "-c", SOON + COMMANDS[command], str(files["long"])], stdout=subprocess.PIPE, stderr=follower
    ) as started:
        os.close(follower)
        said = b""
        while b" of 100001" not in said:
            said += os.read(leader, 1000)
        started.send_signal(signal.SIGINT)
        out, _ = started.communicate()
    os.close(leader)
    assert (started.returncode, out) == (INTERRUPTED, b"")
    assert b"Traceback" not in said


def test_a_file_name_that_is_no_text_is_printed_all_the_same(tmp_path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff\xfe.json"
    done = subprocess.run([sys.executable, "-m", "trackably.checker", path], capture_output=True, check=False)
    assert done.returncode == UNUSABLE
    assert b"Traceback" not in done.stderr

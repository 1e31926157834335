"""Workers end with their run: where it is killed, and where somebody interrupts it, which says one sentence."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.project import ROOT
from tests.trackably.fleet.recordings import TWO_MOTIONS, contents, learned

RUN = """
import sys, time
from pathlib import Path
from tests.trackably.fleet.recordings import learned, motion
from trackably import Source

def without_end():
    time.sleep(3600)

if __name__ == "__main__":
    sources = [Source("run 0", lambda: motion(0)), Source("run 1", without_end), Source("run 2", without_end)]
    learned(sources, Path(sys.argv[1]), workers=2)
"""
SECONDS = 60.0
"""That ending may take on a busy machine; without an end, it takes minutes or an hour."""


@contextmanager
def running(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A run of two processes, all in a group, that has answered the first recording and waits for others."""
    (folder / "run.py").write_text(RUN)
    command = [sys.executable, str(folder / "run.py"), str(folder / "fleet")]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    path = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, cwd=ROOT, env=path, text=True, start_new_session=True, **pipes) as run:
        try:
            while run.poll() is None and not (folder / "fleet" / "run 0" / "row.json").exists():
                time.sleep(0.02)
            time.sleep(0.5)  # an interrupt within the bookkeeping of the first would count it or not
            yield run
        finally:
            with_group(run, signal.SIGKILL)


def with_group(run: subprocess.Popen[str], sent: signal.Signals) -> None:
    try:
        os.killpg(run.pid, sent)
    except ProcessLookupError:
        assert run.poll() is not None


def test_workers_end_where_their_parent_is_killed_and_what_they_answered_is_kept(tmp_path, two):
    """Every process of the run holds its output open: the end of it is read when the last one has ended."""
    with running(tmp_path) as run:
        run.kill()
        run.communicate(timeout=SECONDS)
    fleet = tmp_path / "fleet"
    before = contents(fleet)
    assert {path.split("/")[0] for path in before} == {"run 0"}
    when = (fleet / "run 0" / "row.json").stat().st_mtime_ns
    learned(TWO_MOTIONS, fleet)
    assert (fleet / "run 0" / "row.json").stat().st_mtime_ns == when, "no work is done twice"
    assert contents(fleet) == contents(two.folder), "whoever learned it"


def test_an_interrupt_ends_all_processes_and_says_what_is_kept(tmp_path):
    with running(tmp_path) as run:
        with_group(run, signal.SIGINT)
        said, _ = run.communicate(timeout=SECONDS)
    # multiprocessing's tracker warns where two processes tidied up the same file
    said = re.sub(r".*resource_tracker.*\n( .*\n)?", "", said)
    kept = (
        f"learn_many: 1 of 3 recordings are answered and kept in {tmp_path / 'fleet'}; the same call goes on from there"
    )
    assert run.returncode == -signal.SIGINT
    assert said.splitlines()[-1] == f"KeyboardInterrupt: {kept}"
    assert said.count("Traceback") == 1
    assert "joblib" not in said
    assert "Warning" not in said

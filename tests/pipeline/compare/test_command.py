"""The command: exit codes, revisions, and what it writes."""

import re
import subprocess
from pathlib import Path

import pytest

from tests.pipeline.command import Done, call, refused
from tests.pipeline.compare.project import CLAIMS, RESULTS, edit_text, metric
from tests.project import ROOT

OPTIONS = ("--tolerances", str(ROOT / "tolerances.yaml"))


def run(folder: Path, *arguments: str) -> Done:
    claims = folder / "claims.yaml"
    if not claims.exists():  # JSON is YAML
        claims.write_text(CLAIMS.model_dump_json(exclude_unset=True))
    return call("compare", *arguments, folder=folder)


def git(folder: Path, *arguments: str) -> None:
    who = ("-c", "user.name=somebody", "-c", "user.email=somebody@example.org", "-c", "commit.gpgsign=false")
    subprocess.run(["git", *who, *arguments], cwd=folder, check=True, capture_output=True)


def test_every_format_says_what_moved(base: Path, new: Path, tmp_path: Path) -> None:
    metric(nlml=-3.7160132, final_step=None)(new)
    edit_text(RESULTS / "figures/margins.svg", "#d55e00", "#0072b2")(new)
    out = tmp_path / "out"
    done = run(new, str(base), ".", *OPTIONS, "--markdown", str(out / "c.md"))
    assert (done.returncode, done.stderr) == (1, "")
    assert "sound.final_step: 130 → null" in done.stdout
    assert "allowed no change (metrics)" in done.stdout

    report = (out / "c.md").read_text()
    assert re.match("### Artifacts: .* NOT within tolerance\n\n", report)
    assert "    DIFFERENT         example1/metrics.json\n" in report
    assert all(line.startswith("    ") for line in report.splitlines()[1:] if line), "nothing is read as Markdown"


def test_base_may_be_a_revision(new: Path) -> None:
    git(new, "init", "--quiet")
    git(new, "add", "--all")
    git(new, "commit", "--quiet", "--message", "results")
    assert run(new, "HEAD", *OPTIONS).returncode == 0
    metric(final_step=131)(new)
    done = run(new, "HEAD", *OPTIONS)
    assert done.returncode == 1
    assert "sound.final_step: 130 → 131" in done.stdout


REFUSED = {
    "tolerances that are no YAML": ("tolerances.yaml", "rules: [", "is not YAML"),
    "a misspelt tolerance": (
        "tolerances.yaml",
        "rules: [{name: all, absolut: 1e-6}]",
        "rules.0.absolut: is not a known field",
    ),
    "no tolerance for the rest": (
        "tolerances.yaml",
        "rules: [{name: one, artifact: x, absolute: 1}]",
        "the last rule has to match everything",
    ),
    "a claim of two kinds": (
        "claims.yaml",
        "{claims: [{claim: c, source: s, value: {file: a.json, path: x}, equals: 1, at_least: 0}]}",
        "expected one of equals, printed, at_least and at_most",
    ),
}


@pytest.mark.parametrize(("name", "text", "said"), REFUSED.values(), ids=REFUSED)
def test_a_broken_file_is_one_sentence(base: Path, new: Path, name: str, text: str, said: str) -> None:
    (new / "tolerances.yaml").write_bytes((ROOT / "tolerances.yaml").read_bytes())
    (new / name).write_text(text)
    refused(run(new, str(base)), said)


def test_what_has_no_results_is_one_sentence(new: Path) -> None:
    git(new, "init", "--quiet")
    for wrong in ("no-such-revision", "claims.yaml", "--not-an-option^{tree}"):
        refused(run(new, *OPTIONS, "--", wrong), "neither a folder nor a revision")
    (new / "empty").mkdir()
    refused(run(new, *OPTIONS, "--", str(new / "empty")), "holds no results")

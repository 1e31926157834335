"""The report for a pull request is never too long for a comment."""

from pipeline.compare.model import Comparison, Difference, JudgedClaim, Row, Rule, Status, Verdict
from pipeline.compare.reports import to_markdown

ACCEPTED = 65_536  # characters of a comment on the best-known host


def comparison(count: int) -> Comparison:
    name = "data/results/a-long-name/figures/with-a-long-name.svg"
    away = Difference("path/to/a/value/in/it", 1.0, 2.0, Rule(name="any", absolute=0.1))
    rows = [Row(name, f"t{i}", "f", status, (away,), notes=("a note " * 9,)) for i in range(count)
            for status in (Status.DIFFERENT, Status.WITHIN)]  # fmt: skip
    claims = [
        JudgedClaim(f"claim {i} " * 12, "a source", "at most 1", *2 * (Verdict(False, 2.0),)) for i in range(count)
    ]
    return Comparison("main", "new", tuple(rows), tuple(claims), ())


def test_what_does_not_fit_is_named() -> None:
    whole, much = to_markdown(comparison(5)), to_markdown(comparison(300))
    assert "too long" not in whole
    assert whole.count("\n| claim 4 ") == 2
    assert len(much) < ACCEPTED
    assert "Claims of the paper: 300: too long for a comment" in much
    assert much.startswith("### Artifacts: ")

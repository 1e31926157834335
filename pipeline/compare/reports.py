"""A comparison as text for a terminal, and for a pull request."""

from collections.abc import Collection, Iterator, Sequence
from math import isinf
from os.path import commonprefix
from textwrap import indent

from pipeline.compare.artifacts import Absent, Found
from pipeline.compare.model import FINE, Comparison, Difference, JudgedClaim, Row, Status, Verdict

_LONG = 48


def shown(value: Found) -> str:
    """Format a value with all its digits; long text is cut."""
    if isinstance(value, Absent):
        return "absent"
    text = "null" if value is None else repr(value)
    return text if len(text) <= _LONG else f"{text[: _LONG - 1]}…"


def differing_text(base: Found, new: Found) -> tuple[str, str]:
    """Format two values; long texts are cut so that their first difference is visible."""
    if isinstance(base, str) and isinstance(new, str) and max(len(base), len(new)) > _LONG - 2:
        same = len(commonprefix([base, new]))  # noqa: RUF071  letter by letter is meant
        base, new = (f"…{text[same - 8 :]}" if same > 8 else text for text in (base, new))
    return shown(base), shown(new)


def size(difference: Difference) -> str:
    """Say how far two numbers are apart, and how far the rule allows; of other values that no change is allowed."""
    if isinf(difference.absolute):
        return f"allowed no change ({difference.rule.name})"
    return f"off by {difference.absolute:.2g}, relative {difference.relative:.2g}; allowed {difference.rule}"


def verdict(found: Verdict) -> str:
    """Say pass or fail, with the value of the claim, or the reason why there is none."""
    word = "pass" if found.holds else "FAIL"
    value = f"{found.found:.10g}" if isinstance(found.found, float) else shown(found.found)
    return f"{word}: {found.reason or value}"


def closing(comparison: Comparison) -> str:
    """Return one line with the numbers of artifacts by outcome, and of claims that hold."""
    rows = ", ".join(f"{number} {status.value}" for status, number in comparison.counts.items())
    claims = comparison.claims
    held = [sum(side.holds for side in sides) for sides in zip(*((c.base, c.new) for c in claims), strict=True)]
    told = f"; of {len(claims)} claims {held[0]} hold in BASE and {held[1]} in NEW" if claims else ""
    return f"{rows}{told}: {'within tolerance' if comparison.within else 'NOT within tolerance'}"


_WIDTH = 24  # of a column of values; a reason in place of a value may be longer, and shifts the rest of its line


_WORST_FIRST = (Status.DIFFERENT, Status.MISSING, Status.EXTRA, Status.WITHIN, Status.IDENTICAL)


def to_text(comparison: Comparison, hidden: Collection[Status] = (Status.IDENTICAL,)) -> str:
    """Return artifacts, claims, environment and a closing line; artifacts with a `hidden` outcome are left out."""
    rows = [row for row in comparison.rows if row.status not in hidden]
    blocks = [
        [f"BASE {comparison.base}", f"NEW  {comparison.new}", *comparison.notes],
        [line for row in sorted(rows, key=lambda row: _WORST_FIRST.index(row.status)) for line in _row_lines(row)],
        list(_claim_lines(comparison.claims)),
        list(_environment_lines(comparison)),
        [closing(comparison)],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _row_lines(row: Row) -> Iterator[str]:
    yield f"{row.status.value:17} {row.name}"
    notes = [*row.notes]
    if worst := row.worst:
        base, new = differing_text(worst.base, worst.new)
        yield f"    {worst.place}: {base} → {new}"
        yield f"    {size(worst)}"
        beyond = f", {row.beyond} beyond tolerance" if row.beyond else ""
        notes.append(f"{row.differing} of {row.compared} values differ{beyond}")
    if notes:
        yield f"    {'; '.join(notes)}"


def _claim_lines(claims: Sequence[JudgedClaim]) -> Iterator[str]:
    """Yield the lines of a table of claims; the last column, of any width, is the claim with its source."""
    if not claims:
        return
    rows = [("expected", "BASE", "NEW", "claim [source]")]
    rows += [(c.expected, verdict(c.base), verdict(c.new), f"{c.text} [{c.source}]") for c in claims]
    for *cells, claim in rows:
        yield "  ".join((*(cell.ljust(_WIDTH) for cell in cells), claim))


def _environment_lines(comparison: Comparison) -> Iterator[str]:
    differing = {name: sides for name, sides in comparison.environment.items() if None in sides or len({*sides}) > 1}
    yield "Environment: differs, or is not recorded" if differing else "Environment: no difference known"
    for name, sides in differing.items():
        yield f"    {name}: {' | '.join(side or 'not recorded' for side in sides)}"


_MOST = 60_000  # characters: hosts of pull requests refuse longer comments


def to_markdown(comparison: Comparison) -> str:
    """Return a heading with all counts, and below it artifacts beyond tolerance, claims and environment as text.

    The text is indented, so that nothing in it is read as Markdown or HTML.
    """
    told = indent(to_text(comparison, FINE), "    ")
    cut = "\n\n… and more" if len(told) > _MOST else ""
    return f"### Artifacts: {closing(comparison)}\n\n{told[:_MOST]}{cut}\n"

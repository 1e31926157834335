"""Write a comparison as text for a terminal."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from pipeline.compare.model import Comparison, Difference, JudgedClaim, Row, Status, Version
from pipeline.compare.reports.wording import allowed, closing, differing_text, extent, remarkable, size, verdict

_WIDEST = 24  # a reason why there is no value is longer, and moves the rest of its line


def to_text(comparison: Comparison, listed: Callable[[Comparison], Iterable[Row]] = remarkable) -> str:
    """Return the `listed` artifacts, a table of the claims, the environment, and a closing line."""
    blocks = [
        [f"BASE {comparison.base}", f"NEW  {comparison.new}", *comparison.notes],
        [line for row in listed(comparison) for line in _row(row)],
        list(_claims(comparison.claims)),
        list(_environment(comparison.environment)),
        [closing(comparison)],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _row(row: Row) -> Iterator[str]:
    if row.status is Status.WITHIN and row.worst:
        worst = row.worst[0]
        absolute, relative = size(worst)
        found = f"off by {absolute}, relative {relative}, at {worst.place}; allowed {allowed(worst)}"
        yield f"{row.status.value:17} {row.name}: {'; '.join((*row.notes, found))}"
        return
    yield f"{row.status.value:17} {row.name}"
    for note in row.notes:
        yield f"    {note}"
    if row.worst:
        yield from _difference(row.worst[0])
        yield f"    {extent(row)}"


def _difference(difference: Difference) -> Iterator[str]:
    base, new = differing_text(difference.base, difference.new)
    absolute, relative = size(difference)
    far = "" if difference.absolute is None else f"off by {absolute}, relative {relative}; "
    yield f"    {difference.place}: {base} → {new}"
    yield f"    {far}allowed {allowed(difference)}"


def _claims(claims: Sequence[JudgedClaim]) -> Iterator[str]:
    """Yield a table; the claim and its source are the last column, since they have no fixed width."""
    if not claims:
        return
    rows = [("expected", "BASE", "NEW", "claim [source]")]
    rows += [(c.expected, verdict(c.base), verdict(c.new), f"{c.text} [{c.source}]") for c in claims]
    widths = [min(_WIDEST, max(len(row[column]) for row in rows)) for column in range(3)]
    for *cells, claim in rows:
        yield "  ".join((*(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)), claim))


def _environment(versions: Sequence[Version]) -> Iterator[str]:
    differing = [version for version in versions if version.differs]
    unknown = [version.name for version in versions if None in (version.base, version.new)]
    yield "Environment: " + ("BASE | NEW" if differing else "no difference known")
    for version in differing:
        yield f"    {version.name}: {version.base} | {version.new}"
    if unknown:
        yield f"    not recorded on both sides: {', '.join(unknown)}"

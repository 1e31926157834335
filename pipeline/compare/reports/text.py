"""A comparison as text for a terminal."""

from collections.abc import Iterator

from pipeline.compare.model import Comparison, Difference, Row, Status
from pipeline.compare.reports.wording import allowed, closing, differing_text, extent, remarkable, size, verdict


def to_text(comparison: Comparison, everything: bool = False) -> str:
    """Artifacts, claims, environment, and a closing line; identical artifacts only where `everything` is wanted."""
    blocks = [
        [f"BASE {comparison.base}", f"NEW  {comparison.new}", *comparison.notes],
        [line for row in (comparison.rows if everything else remarkable(comparison)) for line in _row(row)],
        list(_claims(comparison)),
        list(_environment(comparison)),
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


def _claims(comparison: Comparison) -> Iterator[str]:
    if comparison.claims:
        yield "Claims of the paper: BASE | NEW"
    for claim in comparison.claims:
        yield f"    {claim.text} [{claim.source}], {claim.expected}"
        yield f"        {verdict(claim.base)} | {verdict(claim.new)}"


def _environment(comparison: Comparison) -> Iterator[str]:
    differing = [version for version in comparison.environment if version.differs]
    unknown = [version.name for version in comparison.environment if None in (version.base, version.new)]
    yield "Environment: " + ("BASE | NEW" if differing else "no difference known")
    for version in differing:
        yield f"    {version.name}: {version.base} | {version.new}"
    if unknown:
        yield f"    not recorded on both sides: {', '.join(unknown)}"

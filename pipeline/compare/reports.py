"""A comparison as text for a terminal, and as Markdown for a pull request."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence

from pipeline.compare.model import Absent, Comparison, Difference, Found, JudgedClaim, Row, Status, Verdict, Version

_LONG = 48


def shown(value: Found) -> str:
    """Show a value with all its digits; long text is cut."""
    if isinstance(value, Absent):
        return "absent"
    text = "null" if value is None else repr(value)
    return text if len(text) <= _LONG else f"{text[: _LONG - 1]}…"


def differing_text(base: Found, new: Found) -> tuple[str, str]:
    """Show two values; long texts are cut such that the first difference is seen."""
    if isinstance(base, str) and isinstance(new, str) and max(len(base), len(new)) > _LONG - 2:
        start = next((i for i, (a, b) in enumerate(zip(base, new, strict=False)) if a != b), min(len(base), len(new)))
        start = max(0, start - 8)
        return ("…" if start else "") + shown(base[start:]), ("…" if start else "") + shown(new[start:])
    return shown(base), shown(new)


def size(difference: Difference | None) -> tuple[str, str]:
    """Show the absolute and the relative difference; a dash where there is none."""
    absolute, relative = (difference.absolute, difference.relative) if difference else (None, None)
    return "–" if absolute is None else f"{absolute:.2g}", "–" if relative is None else f"{relative:.2g}"


def allowed(difference: Difference) -> str:
    """Show how far the values may be apart, and the rule that says so."""
    rule = difference.rule
    return f"no change ({rule.name})" if difference.absolute is None else str(rule)


def extent(row: Row) -> str:
    """Say how many values of a row differ."""
    if not row.differing:
        return ""
    of = f"{row.differing} of {row.compared} values differ"
    return of + (f", {row.beyond} beyond tolerance" if row.beyond else "")


def verdict(found: Verdict) -> str:
    """Say pass or fail, with the value or the reason why there is none."""
    word = "pass" if found.holds else "FAIL"
    value = f"{found.found:.10g}" if isinstance(found.found, float) else shown(found.found)
    return f"{word}: {found.reason or value}"


def closing(comparison: Comparison) -> str:
    """Return one line with all counts."""
    rows = ", ".join(f"{number} {status.value}" for status, number in comparison.counts.items())
    claims = comparison.claims
    held = [sum(side.holds for side in sides) for sides in zip(*((c.base, c.new) for c in claims), strict=True)]
    told = f"; of {len(claims)} claims {held[0]} hold in BASE and {held[1]} in NEW" if claims else ""
    return f"{rows}{told}: {'within tolerance' if comparison.within else 'NOT within tolerance'}"


def remarkable(comparison: Comparison) -> list[Row]:
    """Return the rows that are not identical, the worst first."""
    order = (Status.DIFFERENT, Status.MISSING, Status.EXTRA, Status.WITHIN)
    return sorted((r for r in comparison.rows if r.status in order), key=lambda row: order.index(row.status))


def beyond(comparison: Comparison) -> list[Row]:
    """Return the rows that are neither identical nor within tolerance, the worst first."""
    return [row for row in remarkable(comparison) if row.status is not Status.WITHIN]


def everything(comparison: Comparison) -> tuple[Row, ...]:
    """Return all rows."""
    return comparison.rows


def failing(claims: tuple[JudgedClaim, ...]) -> list[JudgedClaim]:
    """Return the claims that fail on one side or both."""
    return [claim for claim in claims if not (claim.base.holds and claim.new.holds)]


_WIDEST = 24  # a reason why there is no value is longer, and moves the rest of its line


def to_text(comparison: Comparison, listed: Callable[[Comparison], Iterable[Row]] = remarkable) -> str:
    """Return the `listed` artifacts, a table of the claims, the environment, and a closing line."""
    blocks = [
        [f"BASE {comparison.base}", f"NEW  {comparison.new}", *comparison.notes],
        [line for row in listed(comparison) for line in _row_lines(row)],
        list(_claim_lines(comparison.claims)),
        list(_environment_lines(comparison.environment)),
        [closing(comparison)],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _row_lines(row: Row) -> Iterator[str]:
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
        yield from _difference_lines(row.worst[0])
        yield f"    {extent(row)}"


def _difference_lines(difference: Difference) -> Iterator[str]:
    base, new = differing_text(difference.base, difference.new)
    absolute, relative = size(difference)
    far = "" if difference.absolute is None else f"off by {absolute}, relative {relative}; "
    yield f"    {difference.place}: {base} → {new}"
    yield f"    {far}allowed {allowed(difference)}"


def _claim_lines(claims: Sequence[JudgedClaim]) -> Iterator[str]:
    """Yield a table; the claim and its source are the last column, since they have no fixed width."""
    if not claims:
        return
    rows = [("expected", "BASE", "NEW", "claim [source]")]
    rows += [(c.expected, verdict(c.base), verdict(c.new), f"{c.text} [{c.source}]") for c in claims]
    widths = [min(_WIDEST, max(len(row[column]) for row in rows)) for column in range(3)]
    for *cells, claim in rows:
        yield "  ".join((*(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)), claim))


def _environment_lines(versions: Sequence[Version]) -> Iterator[str]:
    differing = [version for version in versions if version.differs]
    unknown = [version.name for version in versions if None in (version.base, version.new)]
    yield "Environment: " + ("BASE | NEW" if differing else "no difference known")
    for version in differing:
        yield f"    {version.name}: {version.base} | {version.new}"
    if unknown:
        yield f"    not recorded on both sides: {', '.join(unknown)}"


_MOST = 60  # rows
_LONGEST = 65_000  # characters; of more than 65,536, a comment is refused by the best-known host


def to_markdown(comparison: Comparison) -> str:
    """Return the verdict, what is not identical, the claims and the environment; what seldom matters is folded."""
    rows = remarkable(comparison)
    bad = beyond(comparison)
    fine = [row for row in rows if row.status is Status.WITHIN]
    doubtful = failing(comparison.claims)
    moved = ", ".join(version.name for version in comparison.environment if version.differs)
    blocks = [
        f"### Artifacts: {closing(comparison)}",
        "; ".join((f"BASE `{comparison.base}`, NEW `{comparison.new}`", *comparison.notes)),
        _artifacts(bad) if bad else "",
        f"**Claims that do not hold on both sides**\n\n{_claim_table(doubtful)}" if doubtful else "",
        _folded(f"Within tolerance: {len(fine)}", _artifacts(fine)) if fine else "",
        _folded(f"Claims of the paper: {len(comparison.claims)}", _claim_table(comparison.claims)),
        _folded(
            f"Environment: {moved + ' differ' if moved else 'no difference known'}", _environment_table(comparison)
        ),
    ]
    return "\n\n".join(fitting(block for block in blocks if block)) + "\n"


def fitting(blocks: Iterable[str]) -> Iterator[str]:
    """Yield the blocks of a comment while there is room for them, and their first lines where there is none."""
    room = _LONGEST
    for block in blocks:
        title = re.sub(r"<[^>]+>|\*", "", block.partition("\n")[0])
        shown = block if len(block) <= room else f"{title[:200]}: too long for a comment; `compare --json` has it all"
        room -= len(shown) + 200
        yield shown


def _artifacts(rows: Sequence[Row]) -> str:
    header = ("", "artifact", "where", "BASE", "NEW", "absolute", "relative", "allowed (rule)", "")
    table = _table(header, [_cells(row) for row in rows[:_MOST]])
    return table + (f"\n\n… and {len(rows) - _MOST} more" if len(rows) > _MOST else "")


def _cells(row: Row) -> list[str]:
    remarks = "; ".join((*row.notes, extent(row))).strip("; ")
    if not row.worst:
        return [row.status.value, row.name, *[""] * 6, remarks]
    worst = row.worst[0]
    return [
        row.status.value,
        row.name,
        worst.place,
        *differing_text(worst.base, worst.new),
        *size(worst),
        allowed(worst),
        remarks,
    ]


def _claim_table(claims: Iterable[JudgedClaim]) -> str:
    rows = [[c.text, c.source, c.expected, verdict(c.base), verdict(c.new)] for c in claims]
    return _table(("claim", "source", "expected", "BASE", "NEW"), rows)


def _environment_table(comparison: Comparison) -> str:
    rows = [[v.name, v.base or "not recorded", v.new or "not recorded"] for v in comparison.environment]
    return _table(("", "BASE", "NEW"), rows)


def _folded(title: str, content: str) -> str:
    return f"<details><summary>{title}</summary>\n\n{content}\n\n</details>"


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *([_cell(text) for text in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(text: str) -> str:
    """Escape what has a meaning in Markdown or HTML."""
    for character in "\\`*_|[]":
        text = text.replace(character, f"\\{character}")
    return " ".join(text.replace("&", "&amp;").replace("<", "&lt;").split())

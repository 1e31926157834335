"""A comparison as text for a terminal, and as Markdown for a pull request."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from pipeline.compare.artifacts import Absent, Found
from pipeline.compare.model import Comparison, Difference, JudgedClaim, Row, Status, Verdict

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


def size(difference: Difference) -> str:
    """Say how far the values are apart, where they are numbers, and how far the rule lets them be."""
    if (absolute := difference.absolute) is None:
        return f"allowed no change ({difference.rule.name})"
    relative = "" if difference.relative is None else f", relative {difference.relative:.2g}"
    return f"off by {absolute:.2g}{relative}; allowed {difference.rule}"


def remarks(row: Row) -> str:
    """Return the notes of a row, and say how many of its values differ."""
    beyond = f", {row.beyond} beyond tolerance" if row.beyond else ""
    extent = f"{row.differing} of {row.compared} values differ{beyond}"
    return "; ".join((*row.notes, *([extent] if row.differing else [])))


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


_WIDEST = 24  # a reason why there is no value is longer, and moves the rest of its line


def to_text(comparison: Comparison, listed: Callable[[Comparison], Iterable[Row]] = remarkable) -> str:
    """Return the `listed` artifacts, a table of the claims, the environment, and a closing line."""
    blocks = [
        [f"BASE {comparison.base}", f"NEW  {comparison.new}", *comparison.notes],
        [line for row in listed(comparison) for line in _row_lines(row)],
        list(_claim_lines(comparison.claims)),
        list(_environment_lines(comparison)),
        [closing(comparison)],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _row_lines(row: Row) -> Iterator[str]:
    yield f"{row.status.value:17} {row.name}"
    if row.worst:
        worst = row.worst[0]
        base, new = differing_text(worst.base, worst.new)
        yield f"    {worst.place}: {base} → {new}"
        yield f"    {size(worst)}"
    if said := remarks(row):
        yield f"    {said}"


def _claim_lines(claims: Sequence[JudgedClaim]) -> Iterator[str]:
    """Yield a table; the claim and its source are the last column, since they have no fixed width."""
    if not claims:
        return
    rows = [("expected", "BASE", "NEW", "claim [source]")]
    rows += [(c.expected, verdict(c.base), verdict(c.new), f"{c.text} [{c.source}]") for c in claims]
    widths = [min(_WIDEST, max(len(row[column]) for row in rows)) for column in range(3)]
    for *cells, claim in rows:
        yield "  ".join((*(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)), claim))


def _environment_lines(comparison: Comparison) -> Iterator[str]:
    unknown = [version.name for version in comparison.environment if None in (version.base, version.new)]
    yield f"Environment: {_moved(comparison)}"
    for version in comparison.environment:
        if version.differs:
            yield f"    {version.name}: {version.base} | {version.new}"
    if unknown:
        yield f"    not recorded on both sides: {', '.join(unknown)}"


def _moved(comparison: Comparison) -> str:
    names = [version.name for version in comparison.environment if version.differs]
    return f"{', '.join(names)} differ" if names else "no difference known"


_MOST = 40  # rows of a table: of more than 65,536 characters, a comment is refused by the best-known host


def to_markdown(comparison: Comparison) -> str:
    """Return the verdict, what is not identical, the claims and the environment; what seldom matters is folded."""
    bad, claims = beyond(comparison), comparison.claims
    fine = [row for row in comparison.rows if row.status is Status.WITHIN]
    doubtful = [claim for claim in claims if not (claim.base.holds and claim.new.holds)]
    versions = [[v.name, v.base or "not recorded", v.new or "not recorded"] for v in comparison.environment]
    blocks = [
        f"### Artifacts: {closing(comparison)}",
        "; ".join((f"BASE `{comparison.base}`, NEW `{comparison.new}`", *comparison.notes)),
        _artifacts(bad) if bad else "",
        f"**Claims that do not hold on both sides**\n\n{_claims(doubtful)}" if doubtful else "",
        _folded(f"Within tolerance: {len(fine)}", _artifacts(fine)) if fine else "",
        _folded(f"Claims of the paper: {len(claims)}", _claims(claims)),
        _folded(f"Environment: {_moved(comparison)}", _table(("", "BASE", "NEW"), versions)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


def _artifacts(rows: Sequence[Row]) -> str:
    table = _table(("", "artifact", "where", "BASE", "NEW", "apart", ""), [_cells(row) for row in rows[:_MOST]])
    return table + (f"\n\n… and {len(rows) - _MOST} more" if len(rows) > _MOST else "")


def _cells(row: Row) -> list[str]:
    found = [[of.place, *differing_text(of.base, of.new), size(of)] for of in row.worst[:1]]
    return [row.status.value, row.name, *(found[0] if found else [""] * 4), remarks(row)]


def _claims(claims: Iterable[JudgedClaim]) -> str:
    rows = [[c.text, c.source, c.expected, verdict(c.base), verdict(c.new)] for c in claims]
    return _table(("claim", "source", "expected", "BASE", "NEW"), rows)


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

"""Write a comparison as Markdown, for a comment on a pull request."""

import re
from collections.abc import Iterable, Iterator, Sequence

from pipeline.compare.model import Comparison, JudgedClaim, Row, Status
from pipeline.compare.reports.wording import (
    allowed,
    beyond,
    closing,
    differing_text,
    extent,
    failing,
    remarkable,
    size,
    verdict,
)

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
        f"**Claims that do not hold on both sides**\n\n{_claims(doubtful)}" if doubtful else "",
        _folded(f"Within tolerance: {len(fine)}", _artifacts(fine)) if fine else "",
        _folded(f"Claims of the paper: {len(comparison.claims)}", _claims(comparison.claims)),
        _folded(f"Environment: {moved + ' differ' if moved else 'no difference known'}", _environment(comparison)),
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


def _claims(claims: Iterable[JudgedClaim]) -> str:
    rows = [[c.text, c.source, c.expected, verdict(c.base), verdict(c.new)] for c in claims]
    return _table(("claim", "source", "expected", "BASE", "NEW"), rows)


def _environment(comparison: Comparison) -> str:
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

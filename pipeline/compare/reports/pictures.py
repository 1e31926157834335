"""Draw the figures that differ: BASE, NEW, and their difference, side by side."""

from base64 import b64encode
from html import escape
from pathlib import Path
from xml.etree import ElementTree

from pipeline.compare.artifacts import artifacts
from pipeline.compare.model import Comparison, Row, Status
from pipeline.compare.reports.wording import differing_text, extent
from trackably.files import write_text

_MEDIA = {".svg": "image/svg+xml", ".png": "image/png"}
_WIDTH, _HEADING, _GAP = 480.0, 24.0, 12.0


def write_pictures(comparison: Comparison, base: Path, new: Path, folder: Path) -> list[Path]:
    """Write one SVG for each figure that is DIFFERENT, and an index.html that says what differs in them.

    The third panel is black where both agree: the viewer subtracts, no picture is computed here. Raises OSError.
    """
    sides = artifacts(base), artifacts(new)
    entries, written = [], []
    for row in comparison.rows:
        if row.status is not Status.DIFFERENT or Path(row.artifact).suffix not in _MEDIA:
            continue
        path = folder / (Path(row.artifact).with_suffix("").as_posix().replace("/", "--") + ".svg")
        write_text(path, side_by_side(*(side[row.artifact] for side in sides)))
        written.append(path)
        entries.append(_entry(row, path.name))
    if written:
        write_text(folder / "index.html", _page(comparison, entries))
    return written


def side_by_side(base: Path, new: Path) -> str:
    """Return one SVG that holds both figures and their difference."""
    links = [f"data:{_MEDIA[path.suffix]};base64,{b64encode(path.read_bytes()).decode()}" for path in (base, new)]
    height = _WIDTH * _aspect(base)
    places = [i * (_WIDTH + _GAP) for i in range(3)]

    def panel(x: float, link: str, style: str = "") -> str:
        box = f'x="{x:g}" y="{_HEADING:g}" width="{_WIDTH:g}" height="{height:g}"'
        return f'<image {box} preserveAspectRatio="xMidYMin" href="{link}"{style}/>'

    blend = ' style="mix-blend-mode: difference"'
    heads = "".join(
        f'<text x="{x:g}" y="16" font-family="sans-serif" font-size="14">{title}</text>'
        for x, title in zip(places, ("BASE", "NEW", "difference"), strict=True)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {places[2] + _WIDTH:g} {_HEADING + height:g}">'
        f'<rect width="100%" height="100%" fill="#ffffff"/>{heads}'
        f"{panel(places[0], links[0])}{panel(places[1], links[1])}"
        f'<g style="isolation: isolate">{panel(places[2], links[0])}{panel(places[2], links[1], blend)}</g></svg>\n'
    )


def _aspect(path: Path) -> float:
    """Return height divided by width."""
    if path.suffix == ".png":
        header = path.read_bytes()[16:24]
        return int.from_bytes(header[4:]) / max(int.from_bytes(header[:4]), 1)
    try:
        box = ElementTree.parse(path).getroot().get("viewBox", "0 0 4 3").split()
        return float(box[3]) / float(box[2])
    except (ElementTree.ParseError, ValueError, IndexError, ZeroDivisionError):
        return 0.75


def _entry(row: Row, name: str) -> str:
    lines = [
        f"<li>{escape(d.place)}: {' → '.join(escape(text) for text in differing_text(d.base, d.new))}</li>"
        for d in row.worst
    ]
    title = escape(f"{row.artifact}: {row.status.value}")
    remarks = escape("; ".join((*row.notes, extent(row))).strip("; "))
    return f'<h2>{title}</h2><p>{remarks}</p><ul>{"".join(lines)}</ul><img src="{escape(name)}" alt="{title}">'


def _page(comparison: Comparison, entries: list[str]) -> str:
    title = f"Figures: BASE {escape(comparison.base)}, NEW {escape(comparison.new)}"
    style = "body {font-family: sans-serif; margin: 2em} img {width: 100%; border: 1px solid #b8b8b8}"
    head = f'<meta charset="utf-8"><title>{title}</title><style>{style}</style>'
    return f"<!doctype html><html lang=en><head>{head}</head><body><h1>{title}</h1>{''.join(entries)}</body></html>\n"

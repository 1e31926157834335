"""A reference as HTML, for notebooks: what is proved, and how near each quantity comes to its bounds."""

from html import escape

from trackably.exports.proved import Proved
from trackably.exports.shown.curve import curve
from trackably.exports.shown.extent import Reached, ends, reached

_HEADINGS = ("", "bounds", "from", "to", "least margin", "at", "")
_CELL = 'style="text-align:{side};padding:0.15em 0.8em 0.15em 0;border:none;color:inherit;background:none"'


def html(proved: Proved) -> str:
    """Return an HTML element whose colours follow the page: names are escaped.

    Margins are the smallest that were found at up to 2000 times, so evidence; that no margin is negative is proved.
    """
    first, last = ends(proved)
    said = proved.certificate.explanation
    others = [sentence for sentence in proved.explanation.split("; ") if sentence not in said]
    details = "".join(f"<li>{escape(sentence)}</li>" for sentence in others)
    more = f"<details><summary>what else is known of it</summary><ul>{details}</ul></details>"
    rows = "".join(map(_row, reached(proved)))
    head = "".join(f"<th {_style(i)}>{name}</th>" for i, name in enumerate(_HEADINGS))
    return (
        '<div class="trackably-reference" style="color:inherit;background:none;line-height:1.45">'
        f"<p><strong>Trackably</strong>: {escape(said)}</p>"
        f'<table style="border-collapse:collapse;color:inherit"><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table>"
        f"<p><small>Values and least margins as found from {first:.6g} s to {last:.6g} s. That bounds are kept is "
        f"proved. T<sub>s</sub> = {proved.reference.plant.sampling_time:g} s.</small></p>{more if others else ''}</div>"
    )


def _row(found: Reached) -> str:
    margin, time = found.least
    bounds = found.quantity.bounds
    cells = (
        f"<strong>{escape(found.quantity.name)}</strong>",
        escape(str(bounds)),
        f"{found.values.min():.4g}",
        f"{found.values.max():.4g}",
        f"{margin:.3g}",
        f"{time:.4g} s",
        curve(found),
    )
    return f"<tr>{''.join(f'<td {_style(i)}>{cell}</td>' for i, cell in enumerate(cells))}</tr>"


def _style(column: int) -> str:
    """Return the style of a cell: numbers stand to the right, as they are compared down the column."""
    return _CELL.format(side="right" if 2 <= column <= 5 else "left")

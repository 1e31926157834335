"""The display of a reference in notebooks: a figure, and a table of its bounds with small pictures."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from trackably.arrays import Array
from trackably.checker.certificate import TrueSignal
from trackably.exports.proved import Proved, Reached, ends, margins_found, proved_times, shown_times
from trackably.extras import optional

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH, _HEIGHT, _EDGE = 160.0, 34.0, 4.0
_POINTS = 160


def curve(reached: Reached) -> str:
    """Return an SVG element: the curve, its bounds as lines, and a dot at its least margin.

    Lines have the colour of the surrounding text, so that the picture suits light and dark pages.
    """
    bounds = reached.quantity.bounds
    low, high = _vertical_ends(reached)
    x = _scaled(reached.times, reached.times[0], reached.times[-1], 0.0, _WIDTH)
    y = _scaled(reached.values, low, high, _HEIGHT - _EDGE, _EDGE)
    chosen = np.unique(np.linspace(0, x.size - 1, _POINTS).round().astype(int))
    points = " ".join(f"{x[i]:.1f},{y[i]:.1f}" for i in chosen)
    levels = _scaled(np.array([b for b in (bounds.lower, bounds.upper) if low <= b <= high]), low, high,
                     _HEIGHT - _EDGE, _EDGE)  # fmt: skip
    lines = "".join(
        f'<line x1="0" x2="{_WIDTH:g}" y1="{level:.1f}" y2="{level:.1f}" stroke="currentColor" stroke-opacity="0.45" '
        'stroke-dasharray="3 2"/>'
        for level in levels.tolist()
    )
    nearest = int(np.argmin(bounds.margin(reached.values)))
    return (
        f'<svg width="{_WIDTH:g}" height="{_HEIGHT:g}" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        f'role="img" aria-label="curve between its bounds" style="overflow:visible">{lines}'
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1.4"/>'
        f'<circle cx="{x[nearest]:.1f}" cy="{y[nearest]:.1f}" r="2.6" fill="#d55e00"/></svg>'
    )


def _vertical_ends(reached: Reached) -> tuple[float, float]:
    """Return the ends of the vertical axis: the bounds; in place of a distant bound, the least or largest value."""
    bounds, values = reached.quantity.bounds, reached.values
    least, most = float(np.min(values)), float(np.max(values))
    reach = max(most - least, 1e-9 * max(abs(least), abs(most)), 1e-300)
    low = bounds.lower if least - bounds.lower <= 2 * reach else least
    high = bounds.upper if bounds.upper - most <= 2 * reach else most
    return (low, high) if low < high else (low - reach, high + reach)


def _scaled(values: np.ndarray, low: float, high: float, first: float, last: float) -> np.ndarray:
    return np.asarray(first + (values - low) / (high - low) * (last - first))


_HEADINGS = ("", "bounds", "from", "to", "least margin", "at", "")
_CELL = 'style="text-align:{side};padding:0.15em 0.8em 0.15em 0;border:none;color:inherit;background:none"'


def html(proved: Proved) -> str:
    """Return an HTML element whose colours follow the page; names are escaped.

    Margins are the smallest ones found at up to 2000 times, which is evidence. Only that no margin is negative is
    proved.
    """
    first, last = ends(proved)
    said = proved.certificate.explanation
    others = [sentence for sentence in proved.explanation.split("; ") if sentence not in said]
    details = "".join(f"<li>{escape(sentence)}</li>" for sentence in others)
    more = f"<details><summary>what else is known of it</summary><ul>{details}</ul></details>"
    rows = "".join(map(_row, margins_found(proved)))
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
    """Return the style of a cell: numbers are aligned right, for comparison down the column."""
    return _CELL.format(side="right" if 2 <= column <= 5 else "left")


_COUNT = 801


def figure(proved: Proved, start: float | None = None, end: float | None = None) -> Figure:
    """Draw a reference from `start` to `end` [s] with the samples of its states.

    ValueError: a time is not proved.
    """
    with optional("plot"):
        from trackably.exports.figures import Observed, tracking  # noqa: PLC0415  tables need no matplotlib
    times = proved_times(proved, shown_times(proved, _COUNT, start, end))
    bands = {truth.state: _band(proved, truth, times) for truth in proved.certificate.truth}
    names = {**proved.sampled, **bands}
    observed = {name: Observed(proved.sampled.get(name), band=bands.get(name)) for name in names}
    return tracking({"reference": proved.reference}, observed, times)


def _band(proved: Proved, truth: TrueSignal, times: Array) -> tuple[Array, Array]:
    """Return the reference minus and plus its proved error.

    Every true signal that explains the samples lies between them.
    """
    cell = np.searchsorted(truth.ends, times, side="right") - 1
    inside = (times >= truth.ends[0]) & (times <= truth.ends[-1])
    errors = np.where(inside, np.array([*truth.errors, truth.errors[-1]])[np.maximum(cell, 0)], np.nan)
    x = proved.reference.state_at(times)[:, proved.reference.plant.system.states.index(truth.state)]
    return x - errors, x + errors

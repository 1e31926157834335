"""A small picture of a quantity between its bounds, as SVG in the colours of the page that shows it."""

import numpy as np

from trackably.exports.shown.extent import Reached

_WIDTH, _HEIGHT, _EDGE = 160.0, 34.0, 4.0
_POINTS = 160


def curve(reached: Reached) -> str:
    """Return an SVG element: the curve, its bounds as lines, and a dot where it is nearest to one of them.

    Lines have the colour of the text around them, so the picture suits light and dark pages.
    """
    bounds = reached.quantity.bounds
    low, high = _shown(reached)
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


def _shown(reached: Reached) -> tuple[float, float]:
    """Return the ends of the vertical axis: the bounds, or the values where a bound is further away than these are."""
    bounds, values = reached.quantity.bounds, reached.values
    least, most = float(np.min(values)), float(np.max(values))
    reach = max(most - least, 1e-9 * max(abs(least), abs(most)), 1e-300)
    low = bounds.lower if least - bounds.lower <= 2 * reach else least
    high = bounds.upper if bounds.upper - most <= 2 * reach else most
    return (low, high) if low < high else (low - reach, high + reach)


def _scaled(values: np.ndarray, low: float, high: float, first: float, last: float) -> np.ndarray:
    return np.asarray(first + (values - low) / (high - low) * (last - first))

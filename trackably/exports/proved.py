"""The parts of a proved reference that exports need: values by name, proved times, and the times worth showing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from html import escape
from typing import TYPE_CHECKING, Protocol

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import Certificate
from trackably.checker.certificate import AllTimes, Cover, Instants, TrueSignal
from trackably.extras import optional
from trackably.gp.samples import Samples
from trackably.systems.pieces import PolynomialPieces, piece_at
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity, Signals

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Proved(Protocol):
    """A `reference`, the `certificate` that proves its bounds, and the samples that it was learned from (`sampled`).

    Samples are given by the name of the state.
    """

    @property
    def reference(self) -> Reference: ...

    @property
    def certificate(self) -> Certificate: ...

    @property
    def explanation(self) -> str: ...

    @property
    def sampled(self) -> Mapping[str, Samples]: ...


def proved_times(proved: Proved, times: ArrayLike, steps: ArrayLike | None = None) -> Array:
    """Return times t [s] as an array of float64, of any shape.

    TypeError: they are no numbers. ValueError: a time is not proved; the message names its step, if `steps` are given.
    """
    t = numbers("times", times)
    if (found := proved.certificate.first_unproved(t)) is not None:
        i, why = found
        at = f"t = {t.flat[i]:g} s" if steps is None else f"step {numbers('steps', steps).flat[i]:g} ({t.flat[i]:g} s)"
        raise ValueError(f"{at} is {why}; `reference.reference` has values there, without any guarantee")
    return t


_MOST = 2000  # margins are computed at no more than this many times
_TINY = 1e-9  # in sampling times: an end that rounding puts past a step by less than this counts as the step


def ends(proved: Proved) -> tuple[float, float]:
    """Return the first and the last time [s] worth showing, within the claim.

    For a window or a period, they are its ends. Otherwise, the first time precedes the first centre (or breakpoint of
    pieces) by the time from the first to the last, but is not negative. The last time is when the reference has
    settled, but at most twice as far from the first time as the last centre (or 200 steps if that is more), because
    kernels with heavy tails settle for hours and hardly move.
    """
    claim, proof = proved.certificate.claim, proved.certificate.proof
    if isinstance(proof, Cover) and not isinstance(claim, AllTimes):
        return proof.start, proof.end
    every = [z.breakpoints if isinstance(z, PolynomialPieces) else z.centres for z in proved.reference.signals]
    first, last = float(min(map(np.min, every))), float(max(map(np.max, every)))
    start, step = max(2 * first - last, 0.0), proved.reference.plant.sampling_time
    settled = proof.end if isinstance(proof, Cover) else float(proved.reference.instants(max(proof.last, 1)))
    return start, min(settled, start + 2 * max(last - start, 100 * step))


def shown_times(proved: Proved, count: int, start: float | None = None, end: float | None = None) -> Array:
    """Return `count` times from `start` to `end` [s], by default `ends`; sampling instants if only these are proved."""
    first, last = (given if given is not None else left for given, left in zip((start, end), ends(proved), strict=True))
    if not first < last:
        raise ValueError(f"plot: needs start < end, got {first:g} s and {last:g} s")
    if not isinstance(proved.certificate.claim, Instants):
        return np.linspace(first, last, count)
    from_step, to_step = _steps_between(proved, first, last)
    stride = max(1, math.ceil((to_step - from_step) / count))
    return np.asarray(proved.reference.instants(np.arange(float(from_step), to_step + 1, stride)))


def _steps_between(proved: Proved, start: float, end: float) -> tuple[int, int]:
    """Return the first and the last step from `start` to `end` [s]."""
    step = proved.reference.plant.sampling_time
    return math.ceil(start / step - _TINY), math.floor(end / step + _TINY)


def values_at(proved: Proved, steps: Array) -> dict[str, Array]:
    """Return the values (K,) of each state, then of each input, by name, at K consecutive steps. Angles do not jump.

    ValueError: a step is not proved.
    """
    proved_times(proved, proved.reference.instants(steps), steps)
    reference, plant = proved.reference, proved.reference.plant
    values = np.hstack([plant.unwrap(reference.state(steps)), reference.input(steps)])
    return dict(zip(plant.names, values.T, strict=True))


def chosen_steps(proved: Proved, first: int | None, count: int | None) -> Array:
    """Return `count` steps from `first` on, by default those between the `ends` worth showing."""
    shown, last = _steps_between(proved, *ends(proved))
    begin = shown if first is None else whole("first", first)
    return begin + np.arange(float(max(last - begin + 1, 1) if count is None else whole("count", count, least=1)))


def require_known(what: str, named: Iterable[str], proved: Proved) -> None:
    """Raise ValueError for the first name that is neither a state nor an input."""
    known = proved.reference.plant.names
    if unknown := [name for name in named if name not in known]:
        raise ValueError(f"{what}: {unknown[0]} is neither a state nor an input ({', '.join(known)})")


# The display of a reference in notebooks: a figure, and a table of its bounds.


def html(proved: Proved) -> str:
    """Return an HTML element with the proved statement, a table of the bounds, and what else is known of a reference.

    Colours follow the page, and names are escaped. Margins are the smallest ones found at up to 2000 times, which is
    evidence. Only that no margin is negative is proved.
    """
    first, last = ends(proved)
    said = proved.certificate.explanation
    others = [sentence for sentence in proved.explanation.split("; ") if sentence not in said]
    details = "".join(f"<li>{escape(sentence)}</li>" for sentence in others)
    more = f"<details><summary>what else is known of it</summary><ul>{details}</ul></details>"
    times = shown_times(proved, _MOST)
    rows = "".join(_row(quantity, times, proved.reference.signals) for quantity in proved.reference.quantities)
    head = "<th></th><th>bounds</th><th>from</th><th>to</th><th>least margin</th><th>at</th>"
    return (
        '<div class="trackably-reference" style="color:inherit;background:none;line-height:1.45">'
        f"<p><strong>Trackably</strong>: {escape(said)}</p>"
        f'<table style="color:inherit"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
        f"<p><small>Values and least margins as found from {first:.6g} s to {last:.6g} s. That bounds are kept is "
        f"proved. T<sub>s</sub> = {proved.reference.plant.sampling_time:g} s.</small></p>{more if others else ''}</div>"
    )


def _row(quantity: Quantity, times: Array, signals: Signals) -> str:
    """Return a table's row in HTML: a quantity's bounds, and its extreme values and least margin at `times` [s]."""
    values = quantity(signals, times)
    margins = quantity.bounds.margin(values, times)
    nearest = int(np.argmin(margins))
    cells = (
        f"<strong>{escape(quantity.name)}</strong>",
        escape(str(quantity.bounds)),
        f"{values.min():.4g}",
        f"{values.max():.4g}",
        f"{margins[nearest]:.3g}",
        f"{times[nearest]:.4g} s",
    )
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


_COUNT = 801  # times at which a figure draws a curve


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
    """Return a state of the reference at `times` [s], minus and plus its proved error: two arrays of their shape.

    Every true signal that explains the samples lies between them. They are NaN where no error is proved.
    """
    ends = np.array(truth.ends)
    inside = (times >= ends[0]) & (times <= ends[-1])
    errors = np.where(inside, np.array(truth.errors)[piece_at(ends, times)], np.nan)
    x = proved.reference.state_at(times)[:, proved.reference.plant.system.states.index(truth.state)]
    return x - errors, x + errors

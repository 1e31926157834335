"""Warnings about input that is valid, but probably a mistake."""

import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from trackably.arrays import Array
from trackably.certificates.judge import NotTrackableError
from trackably.checker.certificate import AllTimes, Claim, Window
from trackably.checker.formulas import Formula, Function, Number, Operation, Power, names, parts, text
from trackably.checker.intervals import is_multiplied
from trackably.errors import DoubtfulInputWarning
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples, recorded_span
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.formulas import evaluate_floats
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem

_OUTLYING = 1e3  # a sample is an outlier if its distance from the median exceeds this many times the others' spread
_FEW = 0.1  # if more than this part of the samples is far off, none is called an outlier
_FEWEST = 5  # with fewer samples, outliers cannot be told from the others
_FEWEST_BESIDE = 10  # with fewer samples, the usual distance of neighbours is not known
# A sample is also an outlier if its distance from its neighbours exceeds three limits: _TIMES_USUAL times the usual
# distance, _TIMES_NOISE times the noise, and _TIMES_MOVES times the largest change between samples nearby.
_TIMES_USUAL, _TIMES_NOISE, _TIMES_MOVES = 20.0, 10.0, 5.0
_NORMAL = 0.6745  # the median of |x| of standard normal x
_LATE = 1e4  # times start late if they exceed this many times the span of the samples
_SLOW = 500.0  # units are in doubt if samples are at least this many time steps apart; about 0.5 is usual
_TURNS = {2 * np.pi: "np.unwrap(values)", 360.0: "np.unwrap(values, period=360)"}  # a whole turn: how to unwrap it
# A jump between two samples counts as a whole turn if it differs from a turn by at most _OF_TURN of a turn plus the
# largest other change between two samples, and if this largest other change is at most _LARGEST_MOVE of a turn.
_OF_TURN, _LARGEST_MOVE = 0.02, 0.15
_BEYOND = 1.0  # widths of the bounds: units are in doubt if most samples are further outside than this
_FAR_BEYOND = 10.0  # the same for prior means and for the fit without bounds, to which noise may contribute
_MOST = 0.5  # more than this part of the samples counts as most of them
_INSIDE = 0.01  # part of a width: a value that is further than this from both bounds is well within them
_DEEPEST = 6  # levels of nesting to which a formula is written out in a message
_FAR = 10.0  # a window reaches far beyond the samples if it does so by more than this many times their span
_LONGEST, _SHORTEST = 50.0, 0.1  # a length scale is at most this many spans of the samples, and this part of a step
_LAST = 0.1  # this last part of the samples shows whether they still move at their end
_FEWEST_LAST = 4  # at least this number of last samples, and at most half of all, shows whether samples still move
_MOVED = 20.0  # last samples still move if a line through them rises by over this many times their distance from it
_ROUNDING = 1e-9  # part of a rate by which rounding may change it


def warn_about(questions: Iterable[str], frames: int) -> tuple[str, ...]:
    """Issue each of the texts `questions` as a warning, and return them.

    Warnings point to the line of the user's call, which is `frames` stack frames up.
    """
    asked = tuple(questions)
    for question in asked:
        warnings.warn(question, DoubtfulInputWarning, stacklevel=frames + 1)
    return asked


@contextmanager
def repeated(questions: Sequence[str]) -> Iterator[None]:
    """Append `questions`, texts of warnings that were issued, to the message of an error raised in this context.

    Texts that the caller adds to `questions` within this context are appended too.
    """
    try:
        yield
    except (NotTrackableError, ValueError) as error:
        if questions:
            error.args = (f"{error}. Warnings before this error: {'; '.join(questions)}",)
        raise


def doubts(
    claim: Claim,
    samples: Mapping[str, Samples],
    plant: ConstrainedSystem,
    noise_std: Mapping[str, float] | None = None,
    mean: Mapping[str, float] | None = None,
    learned: Collection[str] = (),
    prior: JointPrior | None = None,
) -> Iterator[str]:
    """Yield a sentence for each property of the input that is probably a mistake.

    `samples`, the known `noise_std` and the prior `mean` are given by sampled name. Means of the names in `learned` are
    not examined, because they are still to be learned.
    """
    yield from _of_system(plant)
    yield from _of_window(claim, *recorded_span(samples.values()))
    if prior:
        for name, part in zip(prior.names, prior.parts, strict=True):
            yield from _of_lengthscale(name, part.kernel, samples[name].times)
    bounds, noise_std, mean = {q.name: q.bounds for q in plant.quantities}, noise_std or {}, mean or {}
    for name, of_name in samples.items():
        yield from _of_times(claim, name, of_name, plant.sampling_time)
        yield from _of_outliers(name, of_name, noise_std.get(name), bounds.get(name))
        yield from _of_turns(name, of_name)
        known = mean.get(name) if isinstance(claim, Window) and name not in learned else None
        yield from _of_units(name, of_name, bounds.get(name), noise_std.get(name), known)
        if name in learned:
            yield from _of_end(claim, name, of_name)


def far_beyond(likeliest: JointPosterior | None, plant: ConstrainedSystem, sampled: Collection[str]) -> Iterator[str]:
    """Yield a warning's text for each state or input whose bounds are far too tight for most samples to be followed.

    Its values follow from the fit without bounds, `likeliest`; without this fit, there are no warnings. States that are
    `sampled` are examined by `doubts`.
    """
    if likeliest is None:
        return
    t = np.unique(np.concatenate([of.times for of in likeliest.samples]))
    for quantity in plant.quantities:
        off = _reached_by_most(-quantity.margin(likeliest.signals, t))
        if quantity.name not in sampled and _FAR_BEYOND * quantity.bounds.width < off < np.inf:
            yield (
                f"samples: to follow most of them, {quantity.name} would have to be more than {off:.3g} outside of its "
                f"bounds {quantity.bounds}: are samples, their times and bounds in the units of the system?"
            )


def _of_end(claim: Claim, name: str, samples: Samples) -> Iterator[str]:
    """Yield a warning's text if all times t ≥ 0 are claimed, but the samples still move at their end.

    A line through the last samples then rises by far more than their distance from it, which may be noise, and no
    slower than the mean rate: the range of the samples divided by their duration. A motion that ends is slower.
    """
    last = max(_FEWEST_LAST, int(_LAST * len(samples)))
    if not isinstance(claim, AllTimes) or len(samples) < 2 * last:
        return
    t, y = samples.times[-last:] - samples.times[-1], samples.values[-last:]
    level, rate = np.polynomial.polynomial.polyfit(t, y, 1).tolist()
    off = float(np.sqrt(np.mean((y - level - rate * t) ** 2)))
    mean_rate = np.ptp(samples.values) / (samples.times[-1] - samples.times[0])
    if abs(rate) >= mean_rate * (1 - _ROUNDING) and abs(rate * t[0]) > _MOVED * off:
        yield (
            f"claim: all times are claimed, but {name} still moves at its last sample, by {rate:.3g} per second at "
            f"{samples.times[-1]:g} s: after it, the reference comes to rest at a mean that is learned. Is that meant? "
            'Give the mean, or the claim "recorded", which ends with the samples'
        )


def _of_system(plant: ConstrainedSystem) -> Iterator[str]:
    """Yield a text if A is singular, a speed cannot reverse, or a formula has no derivative within the bounds.

    In discrete time, A is singular only for systems with delays. The user may have given the A of a differential
    equation in place of exp(A T_s), which is never singular.
    """
    system = plant.system
    if isinstance(system, LinearSystem) and np.linalg.matrix_rank(system.A) < len(system.A):
        yield (
            "system: A is singular, which happens in x(k+1) = A x(k) + B u(k) only with delays: are these the A and "
            "B of ẋ = A x + B u? Then use LinearSystem.discretised(A, B, sampling_time)"
        )
    for quantity in plant.quantities:
        match quantity.formula:
            case Operation("/", Function("sqrt"), Number()) if quantity.bounds.hull.lower < 0:
                yield (
                    f"system: the flat form has {quantity.name} as a square root, so it is never negative, and no "
                    f"reference is proved that stops or reverses, though its bounds are {quantity.bounds}. Split "
                    "samples where they stop, and give a lower bound above zero"
                )
    if isinstance(system, NonlinearSystem) and (part := _part_without_slope(system, plant)) is not None:
        yield (
            f"system: the argument of {text(part, _DEEPEST)} may be zero or less within the bounds: at zero it is "
            "undefined or has no slope, and no reference is proved that comes there; np.abs and np.hypot are square "
            "roots too. Can bounds exclude it, or another formula, such as np.sqrt(x**2 + 1e-6) in place of np.abs(x)?"
        )


def _part_without_slope(system: NonlinearSystem, plant: ConstrainedSystem) -> Formula | None:
    """Return a root or fractional power in f whose argument is zero or negative well within the bounds, or None.

    Such a part is returned if its argument is zero or negative at a point whose coordinates are zero or near their
    bounds. An argument that is zero only on the bounds is accepted: a tank may be empty, if the reference never comes
    there. Arguments that depend on a state or input without bounds are not examined.
    """
    sides = ((system.states, plant.state_set.hull), (system.inputs, plant.input_set.hull))
    extents = {name: bounds.extent(i) for names, bounds in sides for i, name in enumerate(names)}
    inner = {name: of.shrunk(_INSIDE * of.width) for name, of in extents.items() if of}
    at = {name: sorted({of.lower, of.upper, min(max(0.0, of.lower), of.upper)}) for name, of in inner.items()}
    for part in (part for formula in system.f for part in parts(formula)):
        match part:
            case Function("sqrt" | "log", argument):
                pass
            case Power(argument, exponent) if not is_multiplied(exponent):
                pass
            case _:
                continue
        if at.keys() >= (used := names(argument)):
            points = dict(zip(used, np.meshgrid(*(at[name] for name in used)), strict=True))
            if np.any(evaluate_floats(argument, points) <= 0):
                return part
    return None


def _of_window(claim: Claim, first: float, last: float) -> Iterator[str]:
    if isinstance(claim, Window) and claim.start <= last and first <= claim.end:
        beyond = max(claim.end - last, first - claim.start)
        if beyond > _FAR * (last - first) > 0:
            yield (
                f"claim: the window from {claim.start:g} s to {claim.end:g} s reaches {beyond:g} s beyond the samples, "
                f"which last {last - first:g} s: is it in seconds? What is learned there follows from kernel, mean and "
                "bounds alone"
            )


def _of_lengthscale(name: str, kernel: Kernel, times: Array) -> Iterator[str]:
    """Yield a warning's text if the known length scale of a single kernel does not fit the samples' times [s].

    Sums and products of kernels are not examined, as one of them may be meant for a trend.
    """
    lengthscale, span = vars(kernel).get("lengthscale"), float(np.ptp(times))
    if lengthscale is None or isinstance(lengthscale, Learned) or kernel.period is not None or not span:
        return
    usual = float(np.median(np.diff(times)))
    if not _SHORTEST * usual <= lengthscale <= _LONGEST * span:
        yield (
            f"kernel: the lengthscale of {name} is {lengthscale:g}, but its samples last {span:.4g} s, with one every "
            f"{usual:.4g} s: is it in seconds?"
        )


def _of_times(claim: Claim, name: str, samples: Samples, sampling_time: float) -> Iterator[str]:
    """Yield questions about the times of samples: their zero, their unit, and the longest gap."""
    first, last = float(samples.times[0]), float(samples.times[-1])
    span, usual = last - first, float(np.median(np.diff(samples.times))) if len(samples) > 1 else 0.0
    if isinstance(claim, Window):
        gap = max(first - claim.end, claim.start - last)
        if gap > span > 0:
            yield (
                f"claim: the window from {claim.start:g} s to {claim.end:g} s is {gap:g} s away from the samples of "
                f"{name}, which lie between {first:g} s and {last:g} s: are both counted from the same zero?"
            )
    if isinstance(claim, AllTimes) and last < 0:
        yield (
            f"samples: all of {name} lie before t = 0, where the claim begins (from {first:g} s to {last:g} s): should "
            "times count from the first sample?"
        )
    if first > _LATE * span > 0:
        yield (
            f"samples: those of {name} begin {first:.10g} s after t = 0, and last only {span:.4g} s: float64 "
            f"tells such times apart by {np.spacing(first):.2g} s, which may not suffice for smooth kernels; if these "
            'stamps count from 1970, subtract the first, as read_csv(..., origin="first") does'
        )

    if len(samples) > 1 and span < sampling_time:
        yield (
            f"samples: those of {name} last {span:g} s, less than one step of the system, {sampling_time:g} s: are "
            "their times in seconds?"
        )
    if usual >= _SLOW * sampling_time:
        yield (
            f"samples: one of {name} comes every {usual:.4g} s, which is {usual / sampling_time:.4g} steps of the "
            f"system, {sampling_time:g} s each: are their times in milliseconds?"
        )

    if gaps := samples.gaps:
        start, end = max(gaps, key=lambda gap: gap[1] - gap[0])
        yield (
            f"samples: there is none of {name} for {end - start:.4g} s after {start:.6g} s, where there is usually one "
            f"every {usual:.3g} s: is a part missing? What is learned in this gap follows from kernel and bounds alone"
        )


def _of_outliers(name: str, samples: Samples, noise_std: float | None, bounds: Interval | None) -> Iterator[str]:
    """Yield a warning's text about the sample that is farthest off, if only a few samples are far off.

    Three measures are tried in turn, until a few samples are far off by one of them: the distance from the median,
    compared with the spread of all samples; the distance from neighbours in time, if the noise is known (otherwise the
    fit without bounds shows outliers later); and the distance outside of the bounds, if both neighbours are inside.
    """
    if len(samples) < _FEWEST:
        return
    t, y = samples.times, samples.values
    few, middle = max(1, int(_FEW * len(y))), float(np.median(y))
    away = np.abs(y - middle)
    spread = float(np.sort(away)[-few - 1])
    beside = _off_neighbours(samples, noise_std) if noise_std and len(y) >= _FEWEST_BESIDE else np.zeros(len(y))
    outside = _outside(samples, bounds) if bounds else np.zeros(len(y))
    if bounds and np.count_nonzero(outside > bounds.width) <= few:
        outside = _alone(outside)
    for off, least, where in (
        (
            away,
            _OUTLYING * spread or np.inf,
            f"more than {_OUTLYING:g} times as far from the median as most others, which lie within {spread:.3g} of "
            f"{middle:g}",
        ),
        (beside, 0.0, f"{np.max(beside):.3g} off those before and after it, with a noise of {noise_std or 0.0:g}"),
        (outside, bounds.width if bounds else np.inf, f"{np.max(outside):.3g} outside of its bounds {bounds}"),
    ):
        far = np.flatnonzero(off > least)
        if 0 < len(far) <= few:
            i = int(far[np.argmax(off[far])])
            yield f"samples: {name} is {y[i]:.6g} at {t[i]:.6g} s, {where}: is it an outlier to be left out?"
            return


def _alone(outside: Array) -> Array:
    """Return the distances `outside` of bounds (n,), set to 0 unless the samples before and after are inside."""
    beside = np.pad(outside, 1)
    return np.where((beside[:-2] <= 0) & (beside[2:] <= 0), outside, 0.0)


def _off_neighbours(samples: Samples, noise_std: float) -> Array:
    """Return how far each sample lies outside the range of the samples beside it, shape (n,); 0 if it is not far off.

    A sample is far off if this distance exceeds the noise, the usual distance from the middle of its neighbours, and
    the changes between samples nearby, each times a factor. The first and the last sample are never far off, because
    the signal may have a step beside them.
    """
    y, noise = samples.values, noise_std * samples.relative_noise[1:-1]
    off, steps = beyond_neighbours(y)[1:-1], np.pad(np.abs(np.diff(y)), 2)
    nearby = np.max([np.abs(y[2:] - y[:-2]), *(steps[k : k + len(off)] for k in (0, 1, 4, 5))], axis=0)
    usual = float(np.median(np.abs(y[1:-1] - (y[:-2] + y[2:]) / 2))) / _NORMAL
    # In a signal that is mostly constant, no sample counts as far off: single other values may be intended.
    least = np.maximum(_TIMES_NOISE * noise, _TIMES_USUAL * usual or np.inf)
    return np.pad(np.where(off > np.maximum(least, _TIMES_MOVES * nearby), off, 0.0), 1)


def beyond_neighbours(values: Array) -> Array:
    """Return how far each value lies outside the range of the two beside it, negative inside: shape (n,)."""
    beside = np.stack([np.insert(values[:-1], 0, values[1]), np.append(values[1:], values[-2])])
    return np.asarray(np.maximum(values - beside.max(axis=0), beside.min(axis=0) - values))


def _of_turns(name: str, samples: Samples) -> Iterator[str]:
    """Yield a warning's text if a value jumps by a whole turn between two samples, and changes little elsewhere."""
    moves = np.abs(np.diff(samples.values))
    for turn, remedy in _TURNS.items():
        jumps = moves > turn / 2
        largest = float(np.max(moves[~jumps], initial=0.0))
        are_turns = np.all(np.abs(moves[jumps] - turn) <= largest + _OF_TURN * turn)
        if np.any(jumps) and are_turns and largest <= _LARGEST_MOVE * turn:
            i = int(np.argmax(jumps))
            yield (
                f"samples: {name} jumps from {samples.values[i]:.6g} to {samples.values[i + 1]:.6g} at "
                f"{samples.times[i + 1]:.6g} s, nearly a whole turn: is it an angle? {remedy} counts turns"
            )


def _of_units(
    name: str, samples: Samples, bounds: Interval | None, noise_std: float | None, mean: float | None
) -> Iterator[str]:
    """Yield warnings' texts about units that may be mixed up, such as metres and millimetres.

    There is one if most samples are outside of the bounds by more than their width, one if the known σ_n exceeds the
    range of the samples, and one if the prior mean is far outside of the bounds: `mean` is given for windows only, as
    other claims refuse such a mean.
    """
    off = _reached_by_most(_outside(samples, bounds)) if bounds else 0.0
    if bounds and off > _BEYOND * bounds.width:
        yield (
            f"samples: most of {name} are more than {off:.3g} outside of its bounds {bounds}, around "
            f"{np.median(samples.values):.6g}: are both in the same unit? Column(..., scale=) and np.radians change it"
        )
    extent = float(np.ptp(samples.values))
    if noise_std and len(samples) >= _FEWEST_BESIDE and 0 < extent < noise_std * np.min(samples.relative_noise):
        yield (
            f"noise_std: that of {name} is {noise_std:g}, but its samples differ by no more than {extent:.3g}, so that "
            "they say little: are both in the same unit?"
        )
    if bounds and mean is not None and -bounds.rest.margin(np.array(mean)) > _FAR_BEYOND * bounds.width:
        yield (
            f"mean: that of {name} is {mean:g}, far outside of its bounds {bounds}, and where there are no samples the "
            "reference tends to it: are both in the same unit?"
        )


def _reached_by_most(values: Array) -> float:
    """Return the largest of `values` that most of them reach."""
    return float(np.quantile(values, 1 - _MOST, method="lower"))


def _outside(samples: Samples, bounds: Interval) -> Array:
    """Return how far each sample is outside of the bounds, shape (n,); negative inside."""
    return -bounds.margin(samples.values, samples.times)

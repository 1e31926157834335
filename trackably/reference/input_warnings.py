"""Warnings about input that is valid, but probably a mistake."""

import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from trackably.arrays import Array, Flags
from trackably.certificates.judge import NotTrackableError
from trackably.checker.certificate import AllTimes, Claim, Window
from trackably.checker.formulas import Function, Number, Operation
from trackably.errors import DoubtfulInputWarning
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples, recorded_span
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem

_OUTLYING = 1e3  # a sample is an outlier if its distance from the median exceeds this many times the others' spread
_FEW = 0.1  # if more than this part of the samples is far off, none is called an outlier
_FEWEST = 5  # with fewer samples, outliers cannot be told from the others
_FEWEST_BESIDE = 10  # with fewer samples, the usual distance from a polynomial through neighbours is not known
# A sample is also an outlier if its distance from a cubic polynomial through its neighbours exceeds _TIMES_USUAL times
# the usual distance, _TIMES_NOISE times the noise and _TIMES_CHANGES times the changes between these neighbours, and if
# the part _BESIDE of it is beyond the nearest neighbours.
_TIMES_USUAL, _TIMES_NOISE, _TIMES_CHANGES, _BESIDE = 9.0, 5.0, 1.5, 0.6
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
_FAR = 10.0  # a window reaches far beyond the samples if it does so by more than this many times their span
_LONGEST, _SHORTEST = 50.0, 0.1  # a length scale is at most this many spans of the samples, and this part of a step


def warn_about(questions: Iterable[str], frames: int) -> tuple[str, ...]:
    """Issue each of the texts `questions` as a warning, and return them.

    Warnings point to the line of the user's call, which is `frames` stack frames up.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # samples may be so large that their differences overflow
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
        yield from _of_outliers(name, of_name, noise_std.get(name, 0.0))
        yield from _of_turns(name, of_name)
        known = mean.get(name) if isinstance(claim, Window) and name not in learned else None
        yield from _of_units(name, of_name, bounds.get(name), noise_std.get(name), known)


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


def _of_system(plant: ConstrainedSystem) -> Iterator[str]:
    """Yield a text if A is singular, or if a speed cannot reverse.

    In discrete time, A is singular only for systems with delays. The user may have given the A of a differential
    equation in place of exp(A T_s), which is never singular.
    """
    system = plant.system
    if isinstance(system, LinearSystem) and np.linalg.matrix_rank(system.A) < len(system.A):
        yield (
            "system: A is singular, which happens in x(k+1) = A x(k) + B u(k) only with delays: are these the A and "
            "B of ẋ = A x + B u? Then use LinearSystem.discretised(A, B, sampling_time), in a file `continuous: true`"
        )
    for quantity in plant.quantities:
        match quantity.formula:
            case Operation("/", Function("sqrt"), Number()) if quantity.bounds.hull.lower < 0:
                yield (
                    f"system: the flat form has {quantity.name} as a square root, so it is never negative, and no "
                    f"reference is proved that stops or reverses, though its bounds are {quantity.bounds}. Split "
                    "samples where they stop, and give a lower bound above zero"
                )


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
        start, duration = gaps[0]
        yield (
            f"samples: there is none of {name} for {duration:.4g} s after {start:.6g} s, where there is usually one "
            f"every {usual:.3g} s: is a part missing? What is learned in this gap follows from kernel and bounds alone"
        )


def _of_outliers(name: str, samples: Samples, noise_std: float) -> Iterator[str]:
    """Yield a warning's text about the sample that is farthest off, if only a few samples are far off.

    A sample is far off by its distance from the median, compared with the spread of most samples, or by its distance
    from its neighbours in time.
    """
    if len(samples) < _FEWEST:
        return
    t, y, few = samples.times, samples.values, max(1, int(_FEW * len(samples)))
    away = np.abs(y - np.median(y))
    is_far = away > (_OUTLYING * np.sort(away)[-few - 1] or np.inf)
    if len(samples) >= _FEWEST_BESIDE:
        is_far[2:-2] |= _is_off_neighbours(samples, noise_std)
    far = np.flatnonzero(is_far)
    if 0 < len(far) <= few:
        i = int(far[np.argmax(away[far])])
        beside = " and ".join(f"{value:.6g}" for value in (*y[max(i - 1, 0) : i], *y[i + 1 : i + 2]))
        yield f"samples: {name} is {y[i]:.6g} at {t[i]:.6g} s, beside {beside}: is it an outlier to be left out?"


def _is_off_neighbours(samples: Samples, noise_std: float) -> Flags:
    """Whether each sample but the first two and the last two is far off the cubic polynomial through four neighbours.

    This is so if the distance exceeds the noise, the usual distance and the changes between these neighbours, each
    times a factor, and if most of it lies outside of the range of the samples before and after: at a jump of the
    signal, samples lie within this range. At corners and beside gaps, these neighbours change more.
    """
    y, noise = samples.values, noise_std * samples.relative_noise
    off = np.abs(y[2:-2] - (4 * (y[1:-3] + y[3:-1]) - y[:-4] - y[4:]) / 6)
    usual = float(np.median(off)) / _NORMAL
    low, high = np.sort([y[1:-3], y[3:-1]], axis=0)
    beyond = np.maximum(y[2:-2] - high, low - y[2:-2])
    # In a signal that is mostly constant, no sample counts as far off: single other values may be intended.
    is_far = off > np.maximum(_TIMES_USUAL * usual or np.inf, _TIMES_NOISE * noise[2:-2])
    changes = np.max(np.abs([y[1:-3] - y[:-4], y[3:-1] - y[1:-3], y[4:] - y[3:-1]]), axis=0)
    return np.asarray(is_far & (off > _TIMES_CHANGES * changes) & (beyond > _BESIDE * off))


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
    off = _reached_by_most(-bounds.margin(samples.values, samples.times)) if bounds else 0.0
    if bounds and off > _BEYOND * bounds.width:
        yield (
            f"samples: most of {name} are more than {off:.3g} outside of its bounds {bounds}, around "
            f"{np.median(samples.values):.6g}: are both in the same unit? Column(..., scale=, offset=) and "
            "np.radians change it"
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
    """Return the largest of `values` for which more than half of them are at least as large."""
    return float(np.quantile(values, 1 - _MOST, method="lower"))

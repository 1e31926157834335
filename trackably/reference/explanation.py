"""The explanation of a fit in plain sentences."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.prior import NOISE
from trackably.gp.samples import Samples
from trackably.learning.problem import LEAST_GAP
from trackably.reference.fit import Fit
from trackably.reference.waypoints import Waypoint
from trackably.systems.tightening import Tightening

_DEAREST = 3  # most contacts (bounds that are active for some time) that a sentence names, by decreasing price
_SHOWN = 4  # number of times with given values that are named if others are left out
_OF_NOISE = 0.5  # a question is asked if σ_n learned with bounds differs from σ_n without by more than this part

_LAST = 0.1  # this last part of the samples shows the level at which a motion ends
_FEWEST_LAST = 3  # at least this number of last samples shows the level at which a motion ends
_AWAY = 5.0  # the last samples are away from the mean if they differ from it by more than this many times their noise


class IgnoresSamplesWarning(UserWarning):
    """A reference keeps its bounds, but does not follow the samples from which it was learned."""


def ignores_samples(fit: Fit) -> str | None:
    """Return a sentence with advice if the reference ignores its samples; None if it follows them."""
    large = [misfit for misfit in fit.misfits if misfit.is_large]
    if not large:
        return None
    off = "; ".join(
        f"it is {m.size:.3g} off those of {m.name} (root mean square), and {m.size_unconstrained:.3g} without bounds"
        for m in large
    )
    return f"the reference keeps its bounds but does not follow its samples: {off}; {_help(fit)}"


def kept_free(tightening: Tightening | None) -> str | None:
    """Return a sentence on the margin (the part of each bound's width that is kept free); None without a margin."""
    if tightening is None or not tightening.margin:
        return None
    return f"{tightening.margin:g} of each width is kept free at either bound"


def given_values(pinned: Sequence[Waypoint]) -> list[str]:
    """Return a sentence for each time with given values.

    Of more than 5 times, only the first 3 and the last have one; the number of the other times is between them.
    """
    said = list(map(str, pinned))
    left_out = len(said) - _SHOWN
    return said if left_out < 2 else [*said[: _SHOWN - 1], f"{left_out} more such times", said[-1]]


def distances(fit: Fit) -> Iterator[str]:
    """Yield a sentence on the distance of the reference from the samples of each name.

    It is compared with the samples' noise and with the distance of the fit without bounds.
    """
    for misfit in fit.misfits:
        noise = "learned noise" if misfit.is_learned else "noise"
        yield (
            f"it is {misfit.size:.3g} off the samples of {misfit.name}, which spread by "
            f"{misfit.samples.values.std():.3g} (root mean squares), and {misfit.in_noise:.3g} times their {noise}; "
            f"without bounds {misfit.size_unconstrained:.3g}"
        )


def search_limits(fit: Fit) -> Iterator[str]:
    """Yield a sentence on each limit of the search: ends of intervals, float64, and a budget that ended it.

    The sentence on the budget says how far the objective J may be from its minimum.
    """
    yield from map(str, fit.edges)
    theta = fit.prior.hyperparameters
    for name in fit.limited:
        yield f"{name} = {theta[name]:.4g}: its search was limited, as float64 cannot prove values twice as long"
    if fit.budget is not None:
        yield (
            f"the budget of {fit.budget:g} s ended the search: −2 ln p is at most {fit.price:.3g} above its least "
            "value with bounds, if a short search found the least one without bounds"
        )


def means(prior: JointPrior, samples: tuple[Samples, ...], likeliest: JointPrior) -> Iterator[str]:
    """Yield a sentence on each prior mean; it also names the likeliest mean if that is no admissible equilibrium."""
    for name, of, *priors in zip(prior.names, samples, prior.parts, likeliest.parts, strict=True):
        mean, likely = (float(of.of_level.stencil.at_rest(part.mean)) for part in priors)
        said = f"the prior mean of {name} is {mean:.6g}"
        yield said if mean == likely else f"{said}, as the likeliest, {likely:.6g}, is no admissible equilibrium"


def leaves_last_samples(fit: Fit) -> Iterator[str]:
    """Yield a sentence for each name whose last samples are not where the reference comes to rest.

    A reference that is proved for all times comes to rest at its prior mean. Only names whose mean was learned are
    examined.
    """
    for name, samples, prior in zip(fit.prior.names, fit.samples, fit.prior.parts, strict=True):
        of = samples.of_level
        last = slice(-max(_FEWEST_LAST, int(_LAST * len(of))), None)
        noise = float(prior.noise_std) * float(np.max(of.relative_noise[last]))
        level = round(float(np.median(of.values[last])), 1 - math.floor(math.log10(noise))) + 0.0  # + 0.0: no −0
        apart = abs(level - float(of.stencil.at_rest(prior.mean)))
        if name in fit.free and apart > _AWAY * noise:
            yield (
                f"{name} comes to rest at its mean, {apart:.3g} away from its last samples, around {level:.6g}: give "
                "this as mean, if the system can rest there, or claim a window, which ends with the samples"
            )


def noise_questions(fit: Fit) -> Iterator[str]:
    """Yield a warning's text for each name whose σ_n with bounds differs by more than half from σ_n without bounds.

    Only a σ_n that was learned with the bounds is examined.
    """
    parts = zip(fit.prior.names, fit.prior.parts, fit.unconstrained_prior.parts, strict=True)
    for name, own, free in parts:
        if NOISE in own.learned and abs(own.noise_std - free.noise_std) > _OF_NOISE * free.noise_std:
            is_given = isinstance(own.noise_std, Learned) and own.noise_std.interval is not None
            left_out = ", or nothing: it is then learned without them" if is_given else ""
            yield (
                f"noise_std: that of {name} is {own.noise_std:.3g} as it is learned with the bounds, and "
                f"{free.noise_std:.3g} without them: do the samples have this noise? If not, give a number{left_out}"
            )


def costs(fit: Fit) -> str:
    """Return sentences on the cost of the bounds, and on which bounds are active when."""
    of = "bounds and given values" if fit.pinned else "bounds"
    of += " and limits of length scales" if fit.limited else ""
    said = [f"the {of} cost {fit.price:.3g} in −2 ln p"]
    if not fit.active_bounds and fit.price > LEAST_GAP:
        said = [f"no bound is active; −2 ln p is {fit.price:.3g} less for other hyperparameters, found without bounds"]
    if fit.contacts:
        said.append(", ".join(map(str, fit.contacts[:_DEAREST])))
    if fit.duality_gap > 0:
        is_convex = all(quantity.functional is not None for quantity in fit.reference.quantities)
        of = "" if is_convex else ", with formulas linearised at this one,"
        said.append(f"for these hyperparameters{of} no function costs less by more than {fit.duality_gap:.2g}")
    if fit.spread > LEAST_GAP:
        said.append(
            f"−2 ln p of functions from several starts differed by {fit.spread:.2g}; the search went on from the least"
        )
    if fit.backoff > 0:
        said.append(
            f"the search tightened some bounds by up to {fit.backoff:.2g} times their width, so that it examined no "
            "functions closer to these bounds"
        )
    return "; ".join(said)


def _help(fit: Fit) -> str:
    dearest = f"{fit.contacts[0]}: " if fit.contacts else ""
    values = ", other given values" if fit.pinned else ""
    return f"{dearest}wider bounds{values}, a slower motion or another prior mean may help"

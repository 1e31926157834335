"""The table: one row for each problem and rival, and how it is written down."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np

from benchmarks.rivals.model import Found, NotFound, Problem, Rival
from benchmarks.rivals.tables import markdown, number, percent, seconds
from trackably.arrays import Array, root_mean_square
from trackably.gp.joint import JointPosterior

_HEAD = ("", "rival", "answer", "its objective", "J", "misfit", "held out", "error", "time", "asked at")


@dataclass(frozen=True)
class Row:
    """What one rival did with one problem; None where there is nothing to say.

    `objective` is its own (`minimises` says what it is) and `J` ours, −2 ln p of function and samples. `misfit`,
    `held_out` and `error` (against the truth) are root mean squares, as parts of the spread of the samples. `seconds`
    are of processor time. Bounds were asked for at `places` times. The largest violation is between `least` and
    `most`, as a part of a bound's width.
    """

    problem: str
    letter: str
    rival: str
    answer: str
    says: str = ""
    objective: float | None = None
    minimises: str = ""
    J: float | None = None
    misfit: float | None = None
    held_out: float | None = None
    error: float | None = None
    seconds: float | None = None
    places: int | None = None
    least: float | None = None
    most: float | None = None
    quantity: str = ""
    at: float | None = None
    at_steps: bool = False
    tightness: float | None = None


def measured(problem: Problem, rival: Rival) -> Row:
    """Let a rival solve a problem, and find out what it did."""
    problem = problem.forgotten()
    row = Row(problem.name, rival.letter, rival.name, "found", tightness=problem.tightness)
    started = process_time()
    try:
        answer = rival.solve(problem)
    except NotFound as no:
        taken = None if no.kind == "does not apply" else process_time() - started
        return replace(row, answer=no.kind, says=no.why, seconds=taken)
    row = replace(row, seconds=process_time() - started)
    start, end = problem.window
    broken = answer.curve.violation((start, end if answer.last is None else min(end, answer.last)))
    row = replace(row, least=broken.least, most=broken.most, at_steps=answer.curve.at_steps)
    where: dict[str, Any] = {"quantity": broken.quantity, "at": broken.time} if broken.least > 0 else {}
    return replace(row, **_numbers(problem, answer), **where)


def _numbers(problem: Problem, found: Found) -> dict[str, Any]:
    off: dict[str, list[float | None]] = {"misfit": [], "held_out": [], "error": []}
    times, later = np.linspace(*problem.window, 401), problem.sampled.held_out
    each = zip(problem.sampled.names, problem.task.samples, problem.truths, strict=True)
    for i, (name, samples, truth) in enumerate(each):
        wanted = {"misfit": (samples.times, samples.values)}
        if name in later:
            wanted["held_out"] = later[name].times, later[name].values
        if truth is not None:
            wanted["error"] = times, truth(times)
        for what, shown in wanted.items():
            off[what].append(_off(found, i, *shown, float(np.ptp(samples.values))))
    return {
        "says": found.says,
        "objective": found.objective,
        "minimises": found.minimises,
        "J": objective_of(problem, found),
        "places": found.places,
        **({} if found.ignores_samples else {name: _largest(of) for name, of in off.items()}),
    }


def _off(found: Found, i: int, times: Array, values: Array, spread: float) -> float | None:
    """Return the root mean square, as a part of the spread; None where the curve ends before the last time."""
    if found.last is not None and times[-1] > found.last * (1 + 1e-9):
        return None
    return root_mean_square(found.curve.sampled(i, times) - values) / spread


def _largest(values: Sequence[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None) if None not in values else None


def objective_of(problem: Problem, found: Found) -> float | None:
    """Return J = ln|K + Σ| + n ln 2π + ‖y − S g‖²/σ² + ‖g − m‖²; None where g is not a sum of kernels of a prior.

    It is l(θ) for a posterior mean. The norm is infinite for piecewise polynomials: there is nothing to compare.
    """
    if found.prior is None:
        return None
    posterior = JointPosterior(found.prior, problem.task.samples)
    total = posterior.negative_log_marginal_likelihood()[0]
    for c, (part, signal) in enumerate(zip(posterior.parts, found.curve.reference.signals, strict=True)):
        samples, prior = part.samples, part.prior
        total -= float(part.weights @ (samples.values - samples.stencil.at_rest(prior.mean)))
        off = (samples.values - found.curve.sampled(c, samples.times)) / (
            float(prior.noise_std) * samples.relative_noise
        )
        covariance = signal.kernel(signal.centres[:, None] - signal.centres)
        total += float(off @ off + signal.weights @ covariance @ signal.weights)
    return float(np.round(total, 9))


def page(rows: Iterable[Row]) -> str:
    """Return the rows as Markdown, one table a problem."""
    rows, lines = list(rows), []
    for problem in dict.fromkeys(row.problem for row in rows):
        own = [row for row in rows if row.problem == problem]
        lines += [
            f"### {problem}",
            "",
            markdown((*_HEAD, "largest violation", "time"), "lllrrrrrrrrr", map(_cells, own)),
        ]
        lines += ["", *(f"- {row.rival}: {row.says}" for row in own if row.says), ""]
    return "\n".join(lines)


def _cells(row: Row) -> list[str]:
    own = f"{row.objective:.6g} ({row.minimises})" if row.objective is not None else ""
    cells = [
        row.letter,
        row.rival,
        row.answer,
        own,
        number(row.J),
        *map(percent, (row.misfit, row.held_out, row.error)),
    ]
    return [*cells, seconds(row.seconds), "" if row.places is None else str(row.places), *_violation(row)]


def _violation(row: Row) -> list[str]:
    if row.least is None:
        return ["", ""]
    if row.least == 0:
        # Nothing is broken for certain: either that is proved, or only up to `most`.
        proved = "none at its steps" if row.at_steps else "**none: proved**"
        return [proved if row.most == 0 else f"none found, < {percent(row.most) or '?'}", ""]
    exact = "" if row.most is not None else "at least "
    return [f"{exact}{percent(row.least)} of {row.quantity}", f"{row.at:.4g} s"]

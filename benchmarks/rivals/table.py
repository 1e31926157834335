"""The table: one row for each problem and rival, and how it is written down."""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.rivals.model import Curve, Found, NotFound, Problem, Rival, Violation
from benchmarks.rivals.objective import objective_of
from trackably.arrays import Array

HEAD = (
    "| | rival | answer | its objective | J | misfit | held out | error | time | asked at | largest violation | time |",
    "|---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
)


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
    family: str = ""
    tightness: float | None = None


def measured(problem: Problem, rival: Rival) -> Row:
    """Let a rival solve a problem, and find out what it did."""
    problem = problem.forgotten()
    started = process_time()
    answer = rival.solve(problem)
    seconds = process_time() - started
    row = Row(problem.name, rival.letter, rival.name, "found", family=problem.family, tightness=problem.tightness)
    if isinstance(answer, NotFound):
        gone = None if answer.kind == "does not apply" else seconds
        return Row(**{**asdict(row), "answer": answer.kind, "says": answer.why, "seconds": gone})
    violation = answer.curve.violation(_window(problem, answer))
    return Row(**{**asdict(row), "seconds": seconds, **_numbers(problem, answer), **_facts(violation)})


def _window(problem: Problem, found: Found) -> tuple[float, float]:
    start, end = problem.window
    return start, end if found.last is None else min(end, found.last)


def _facts(violation: Violation) -> dict[str, object]:
    return {
        "least": violation.least,
        "most": violation.most,
        "quantity": violation.quantity if violation.least > 0 else "",
        "at": violation.time if violation.least > 0 else None,
        "at_steps": violation.at_steps,
    }


def _numbers(problem: Problem, found: Found) -> dict[str, object]:
    misfit, held_out, error = [], [], []
    for i, (name, samples) in enumerate(zip(problem.sampled.names, problem.task.samples, strict=True)):
        spread = float(np.ptp(samples.values))
        misfit.append(_off(found.curve, i, samples.times, samples.values, spread, found.last))
        if later := problem.sampled.held_out_by_name.get(name):
            held_out.append(_off(found.curve, i, later.times, later.values, spread, found.last))
        if (truth := problem.truths[i]) is not None:
            times = np.linspace(*problem.window, 401)
            error.append(_off(found.curve, i, times, truth(times), spread, found.last))
    return {
        "says": found.says,
        "objective": found.objective,
        "minimises": found.minimises,
        "J": objective_of(problem, found),
        "misfit": None if found.ignores_samples else _largest(misfit),
        "held_out": None if found.ignores_samples else _largest(held_out),
        "error": None if found.ignores_samples else _largest(error),
        "places": found.places,
    }


def _off(curve: Curve, i: int, times: Array, values: Array, spread: float, last: float | None) -> float | None:
    """Return the root mean square, as a part of the spread; None where the curve ends before the last time."""
    if last is not None and times[-1] > last * (1 + 1e-9):
        return None
    return float(np.sqrt(np.mean((curve.sampled(i, times) - values) ** 2))) / spread


def _largest(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def page(rows: Iterable[Row]) -> str:
    """Return the rows as Markdown, one table a problem."""
    rows, lines = list(rows), []
    for problem in dict.fromkeys(row.problem for row in rows):
        lines += [f"### {problem}", "", *HEAD]
        lines += [_line(row) for row in rows if row.problem == problem]
        lines += [""] + [f"- {row.rival}: {row.says}" for row in rows if row.problem == problem and row.says] + [""]
    return "\n".join(lines)


def _line(row: Row) -> str:
    own = f"{row.objective:.6g} ({row.minimises})" if row.objective is not None else ""
    cells = [row.letter, row.rival, row.answer, own, _number(row.J), *map(_percent, (row.misfit, row.held_out))]
    cells += [_percent(row.error), _seconds(row.seconds), "" if row.places is None else str(row.places)]
    return f"| {' | '.join([*cells, *_violation(row)])} |"


def _violation(row: Row) -> list[str]:
    if row.least is None:
        return ["", ""]
    if row.least == 0:
        # Nothing is broken for certain: either that is proved, or only up to `most`.
        proved = "none at its steps" if row.at_steps else "**none: proved**"
        shown = proved if row.most == 0 else f"none found, < {_percent(row.most) or '?'}"
        return [shown, ""]
    exact = "" if row.most is not None else "at least "
    return [f"{exact}{_percent(row.least)} of {row.quantity}", f"{row.at:.4g} s"]


def _number(value: float | None) -> str:
    return "" if value is None else ("∞" if math.isinf(value) else f"{value:.6g}")


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.3g} %"


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3g} s"


def write(rows: Sequence[Row], path: Path) -> None:
    """Write the rows as JSON; what is None is left out."""
    known = [
        {name: value for name, value in asdict(row).items() if value is not None and value is not False and value != ""}
        for row in rows
    ]
    path.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read(path: Path) -> list[Row]:
    """Return the rows that were written."""
    return [Row(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))]

"""What a study says: counts, and errors with confidence bands, for each system and rival."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.rivals.study.draws import CASES, Run
from benchmarks.rivals.study.outcome import SOLVERS, Outcome

_RESAMPLES, _COVERAGE = 1000, 0.95


@dataclass(frozen=True)
class Entry:
    """One rival on one system: counts of runs, and the median error with its confidence band.

    `none` counts runs without a curve, `violated` curves that certainly break a bound, by at most `worst` of its width.
    Errors are of the same runs for all rivals: of those in which each of them found a curve.
    """

    system: str
    rival: str
    runs: int
    none: int
    collapsed: int
    violated: int
    worst: float
    error: float | None
    lower: float | None
    upper: float | None
    compared: int


def summary(found: Sequence[Outcome]) -> list[Entry]:
    """Return one entry for each system and rival, in the order of both."""
    entries = []
    for case in CASES:
        of_case = [outcome for outcome in found if Run.of(outcome.index).case is case]
        by_rival = {name: {o.index: o for o in of_case if o.rival == name} for name in SOLVERS}
        common = sorted({i for i in by_rival["ours, joint"] if all(_has_curve(by_rival[n], i) for n in SOLVERS)})
        for name, outcomes in by_rival.items():
            if outcomes:
                entries.append(_entry(case.name, name, list(outcomes.values()), [outcomes[i] for i in common]))
    return entries


def _has_curve(outcomes: dict[int, Outcome], index: int) -> bool:
    return index in outcomes and outcomes[index].error is not None


def _entry(system: str, rival: str, outcomes: list[Outcome], common: list[Outcome]) -> Entry:
    violations = [o.violation for o in outcomes if o.violation]
    errors = np.array([o.error for o in common], dtype=float)
    middle = [float(v) for v in _band(errors)] if len(errors) else [None] * 3
    return Entry(
        system,
        rival,
        len(outcomes),
        sum(o.answer != "found" for o in outcomes),
        sum(o.collapsed for o in outcomes),
        len(violations),
        max(violations, default=0.0),
        *middle,
        len(common),
    )


def _band(values: np.ndarray) -> tuple[float, float, float]:
    """Return the median and the ends of its confidence band, by resampling with a fixed seed."""
    rng = np.random.default_rng(0)
    drawn = np.median(rng.choice(values, (_RESAMPLES, len(values))), axis=1)
    outside = (1 - _COVERAGE) / 2
    return float(np.median(values)), *np.quantile(drawn, [outside, 1 - outside]).tolist()


def write(entries: Sequence[Entry], runs: int, path: Path) -> None:
    """Write the summary as JSON."""
    text = json.dumps({"runs": runs, "entries": [asdict(entry) for entry in entries]}, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def read(path: Path) -> list[Entry]:
    """Return what was written."""
    return [Entry(**entry) for entry in json.loads(path.read_text(encoding="utf-8"))["entries"]]


def page(entries: Sequence[Entry]) -> str:
    """Return the summary as Markdown, one table a system."""
    lines = []
    for system in dict.fromkeys(entry.system for entry in entries):
        shown = [entry for entry in entries if entry.system == system]
        title = f"#### {system}: {shown[0].runs} runs, errors of {shown[0].compared} in which all found a curve"
        lines += [title, "", "| | no curve | collapsed | violated | worst | median error | 95 % band |"]
        lines += ["|---|--:|--:|--:|--:|--:|---|", *map(_line, shown), ""]
    return "\n".join(lines)


def _line(entry: Entry) -> str:
    worst = f"{100 * entry.worst:.2g} %" if entry.violated else ""
    error, band = "", ""
    if entry.error is not None and entry.lower is not None and entry.upper is not None:
        error, band = f"{100 * entry.error:.2f} %", f"{100 * entry.lower:.2f} … {100 * entry.upper:.2f} %"
    counts = f"{entry.none} | {entry.collapsed} | {entry.violated}"
    return f"| {entry.rival} | {counts} | {worst} | {error} | {band} |"

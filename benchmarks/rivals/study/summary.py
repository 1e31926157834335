"""What a study says: counts, and errors with confidence bands, for each system and rival."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, astuple, dataclass
from itertools import zip_longest
from math import isclose
from pathlib import Path

import numpy as np
import scipy

from benchmarks.rivals.study.draws import CASES, LEVELS, Run
from benchmarks.rivals.study.outcome import SOLVERS, Outcome
from benchmarks.rivals.tables import markdown

_OUTSIDE = 0.025  # on either side of a confidence band
_SAME = 1e-6  # relative: numbers that are closer are reproduced

ALL, TIGHTNESS = "all", "tightness"


@dataclass(frozen=True)
class Entry:
    """One rival on one system, in all runs or in those of one `level` of one `factor`.

    `infeasible` counts runs in which it says that there is no curve, `failed` those in which it has none for another
    reason, and `violated` curves that certainly break a bound, by at most `worst` of its width. The median `error` has
    the confidence band `lower` … `upper`. Errors are of the same runs for all rivals: of the `compared` ones, in which
    each of them found a curve.
    """

    system: str
    factor: str
    level: str
    rival: str
    runs: int
    infeasible: int
    failed: int
    collapsed: int
    violated: int
    worst: float
    compared: int
    error: float | None = None
    lower: float | None = None
    upper: float | None = None


def summary(found: Sequence[Outcome]) -> list[Entry]:
    """Return the entries of each system: all runs first, then those of each tightness; rivals in their order."""
    by_run: dict[int, dict[str, Outcome]] = {}
    for outcome in found:
        by_run.setdefault(outcome.index, {})[outcome.rival] = outcome
    runs = {index: Run.of(index) for index in by_run}
    entries: list[Entry] = []
    for case in CASES:
        for factor, level in ((ALL, ""), *((TIGHTNESS, level) for level in LEVELS)):
            chosen = [i for i, run in runs.items() if run.case is case and level in ("", LEVELS[run.tightness])]
            common = [i for i in chosen if all(outcome.error is not None for outcome in by_run[i].values())]
            for rival in SOLVERS if chosen else ():
                own = [by_run[i][rival] for i in chosen]
                entries.append(_entry((case.name, factor, level, rival), own, [by_run[i][rival].error for i in common]))
    return entries


def _entry(of: tuple[str, str, str, str], outcomes: list[Outcome], errors: list[float | None]) -> Entry:
    broken = [outcome.violation for outcome in outcomes if outcome.violation]
    answers = [outcome.answer for outcome in outcomes]
    infeasible = answers.count("infeasible")
    return Entry(
        *of,
        len(outcomes),
        infeasible,
        len(answers) - answers.count("found") - infeasible,
        sum(outcome.collapsed for outcome in outcomes),
        len(broken),
        max(broken, default=0.0),
        len(errors),
        *_band(np.array(errors, dtype=float)),
    )


def _band(values: np.ndarray) -> tuple[float | None, float | None, float | None]:
    """Return the median and the two order statistics that enclose the true one with 95 % confidence, at least."""
    n = len(values)
    if not n:
        return None, None, None
    ordered = np.sort(values)
    k = max(int(scipy.stats.binom.ppf(_OUTSIDE, n, 0.5)) - 1, 0)
    return float(np.median(values)), float(ordered[k]), float(ordered[n - 1 - k])


def write(summaries: Iterable[Sequence[Entry]], path: Path) -> None:
    """Write summaries, one entry a line: of the first runs, by which a part can be compared, and of all."""
    parts = [",\n".join(json.dumps(asdict(e), ensure_ascii=False) for e in entries) for entries in summaries]
    path.write_text("[[" + "\n],[\n".join(parts) + "]]\n", encoding="utf-8")


def read(path: Path) -> list[list[Entry]]:
    """Return what was written."""
    return [[Entry(**entry) for entry in entries] for entries in json.loads(path.read_text(encoding="utf-8"))]


def differences(ours: Sequence[Entry], theirs: Sequence[Entry]) -> list[str]:
    """Return a line for each entry that is not reproduced: counts have to be equal, numbers up to rounding."""
    pairs = zip_longest(ours, theirs)
    return [f"{before} became {now}" for now, before in pairs if not (now and before and _is_same(now, before))]


def _is_same(one: Entry, other: Entry) -> bool:
    pairs = zip(astuple(one), astuple(other), strict=True)
    return all(isclose(a, b, rel_tol=_SAME) if type(a) is type(b) is float else a == b for a, b in pairs)


def page(entries: Sequence[Entry]) -> str:
    """Return the summary of all runs as Markdown, a table for each system; a figure shows each tightness."""
    head, lines = ("", "infeasible", "failed", "collapsed", "violated", "worst", "median error", "95 % band"), []
    for system in dict.fromkeys(entry.system for entry in entries):
        whole = [entry for entry in entries if (entry.system, entry.factor) == (system, ALL)]
        title = f"#### {system}: {whole[0].runs} runs, errors of {whole[0].compared} in which all found a curve"
        lines += [title, "", markdown(head, "lrrrrrrl", map(_cells, whole)), ""]
    return "\n".join(lines)


def _cells(entry: Entry) -> list[str]:
    counts = entry.infeasible, entry.failed, entry.collapsed, entry.violated
    worst = f"{100 * entry.worst:.2g} %" if entry.violated else ""
    band = "" if entry.lower is None or entry.upper is None else f"{100 * entry.lower:.2f} … {_percent(entry.upper)}"
    return [entry.rival, *map(str, counts), worst, _percent(entry.error), band]


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.2f} %"

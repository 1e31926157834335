"""What a study says: counts, and errors with confidence bands, for each system and rival."""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import scipy

from benchmarks.rivals.study.draws import CASES, LEVELS, Run
from benchmarks.rivals.study.outcome import SOLVERS, Outcome
from benchmarks.rivals.tables import markdown

_OUTSIDE = 0.025  # on either side of a confidence band
_SAME = 1e-6  # relative: numbers that are closer are reproduced

ALL, TIGHTNESS, NOISE, SAMPLES = "all", "tightness", "noise", "samples"


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
    """Return the entries of each system: all runs first, then the levels of each factor; rivals in their order."""
    by_run: dict[int, dict[str, Outcome]] = {}
    for outcome in found:
        by_run.setdefault(outcome.index, {})[outcome.rival] = outcome
    runs = {index: Run.of(index) for index in by_run}
    entries: list[Entry] = []
    for case in CASES:
        for factor, level in _levels():
            chosen = [i for i, run in runs.items() if run.case is case and _level(run, factor) == level]
            common = [i for i in chosen if all(outcome.error is not None for outcome in by_run[i].values())]
            for rival in SOLVERS if chosen else ():
                own = [by_run[i][rival] for i in chosen]
                entries.append(_entry((case.name, factor, level, rival), own, [by_run[i][rival].error for i in common]))
    return entries


def _levels() -> Iterator[tuple[str, str]]:
    yield ALL, ""
    yield from ((TIGHTNESS, level) for level in LEVELS)
    yield from ((NOISE, level) for level in ("0.5 %", "2 %", "5 %"))
    yield from ((SAMPLES, level) for level in ("few", "some", "many"))


def _level(run: Run, factor: str) -> str:
    noise, samples = f"{100 * run.noise:g} %", ("few", "some", "many")[run.density]
    return {ALL: "", TIGHTNESS: LEVELS[run.tightness], NOISE: noise, SAMPLES: samples}[factor]


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


def runs_in(entries: Sequence[Entry]) -> int:
    """Return of how many runs a summary is: every rival is in all of them."""
    return sum(entry.runs for entry in entries if entry.factor == ALL and entry.rival == entries[0].rival)


def differences(ours: Sequence[Entry], theirs: Sequence[Entry]) -> list[str]:
    """Return a sentence for each value that is not reproduced: counts have to be equal, numbers up to rounding."""
    now, before = _by_place(ours), _by_place(theirs)
    places = [place for place in before | now if not _is_same(now.get(place), before.get(place))]
    return [f"{place} {before.get(place)} became {now.get(place)}" for place in places]


def _by_place(entries: Sequence[Entry]) -> dict[str, object]:
    return {
        f"{', '.join(filter(None, (e.system, e.factor, e.level, e.rival)))}: {name}": value
        for e in entries
        for name, value in asdict(e).items()
    }


def _is_same(one: object, other: object) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_SAME, abs_tol=1e-12)
    return one == other


def page(entries: Sequence[Entry]) -> str:
    """Return the summary as Markdown: a table for each system, and what each tightness does to it."""
    head, lines = ("", "infeasible", "failed", "collapsed", "violated", "worst", "median error", "95 % band"), []
    tight = ("collapsed / violated / median error", *LEVELS)
    for system in dict.fromkeys(entry.system for entry in entries):
        shown = [entry for entry in entries if entry.system == system]
        whole = [entry for entry in shown if entry.factor == ALL]
        title = f"#### {system}: {whole[0].runs} runs, errors of {whole[0].compared} in which all found a curve"
        by_level = markdown(tight, "l" * len(tight), _by_tightness(shown))
        lines += [title, "", markdown(head, "lrrrrrrl", map(_cells, whole)), "", by_level, ""]
    return "\n".join(lines)


def _cells(entry: Entry) -> list[str]:
    counts = entry.infeasible, entry.failed, entry.collapsed, entry.violated
    worst = f"{100 * entry.worst:.2g} %" if entry.violated else ""
    band = "" if entry.lower is None or entry.upper is None else f"{100 * entry.lower:.2f} … {_percent(entry.upper)}"
    return [entry.rival, *map(str, counts), worst, _percent(entry.error), band]


def _by_tightness(entries: Sequence[Entry]) -> Iterator[list[str]]:
    """Yield, for each rival and tightness, collapsed / violated / median error."""
    for rival in dict.fromkeys(entry.rival for entry in entries):
        at = {e.level: e for e in entries if e.factor == TIGHTNESS and e.rival == rival}
        yield [rival, *(_cell(at[level]) if level in at else "" for level in LEVELS)]


def _cell(entry: Entry) -> str:
    if entry.infeasible + entry.failed == entry.runs:
        return "no curve"
    parts = [f"{100 * n / entry.runs:.3g} %" if n else "0" for n in (entry.collapsed, entry.violated)]
    return " / ".join([*parts, _percent(entry.error) or "–"])


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.2f} %"

"""Random references with bounds that are kept or broken by a hair: what is said of them has to be true."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from tests.attack.counts import Counts
from tests.trackably.certificates import naive
from tests.trackably.certificates.instances import Case, case, compact_kernel, general_case
from tests.trackably.certificates.liars import LIES, telling
from tests.trackably.checker.edges.test_before_zero import chain
from tests.trackably.checker.test_soundness import ask, falsehood
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import evaluation_errors
from trackably.certificates.form import encode_certificate, encode_counterexample
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome, prove
from trackably.checker import Proved, Refuted
from trackably.checker.certificate import AllPhases, Steps, Window
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.reference import Reference

_FEW = 16
"""Boxes and instants of a certificate that the checker looks at too."""


def attack_reference(counts: dict[str, Counts], seed: int, number: int) -> None:
    """Draw a reference of one of five families, ask for a claim about it, and count whether what is said is true."""
    s = 10**6 * (seed + 1) + number
    if number % 10 == 9:
        _attack_long_arrays(counts.setdefault("random references, long arrays", Counts()), s)
        return
    name = list(FAMILIES)[number % len(FAMILIES)]
    chosen = FAMILIES[name](s)
    _attack(counts.setdefault(name, Counts()), chosen, answer(number, chosen), s)


def attack_by_liar(counts: dict[str, Counts], seed: int, number: int) -> None:
    """Ask for the same while some function of the proposer lies: what is said all the same has to be true."""
    s = 10**6 * (seed + 1) + number
    chosen = list(FAMILIES.values())[number % len(FAMILIES)](s)
    with telling(list(LIES)[number % len(LIES)], np.random.default_rng(s)):
        found = answer(number, chosen)
    _attack(counts.setdefault("liars", Counts()), chosen, found, s)


def _before_zero(s: int) -> Case:
    """A chain that looks up to four steps ahead, steep kernels near zero, and a window in which t and j T cancel."""
    rng = np.random.default_rng(s)
    n, step = int(rng.integers(1, 5)), 10 ** rng.uniform(-2, 1)
    length = step * 10 ** rng.uniform(-6, 0)
    kernel = (SquaredExponential, Matern32, Matern52)[int(rng.integers(3))](1.0, length)
    centres = np.sort(length * rng.normal(size=int(rng.integers(1, 4))))
    signal = KernelSum(kernel, 0.0, centres, rng.uniform(-1, 1, centres.size))
    middle = -int(rng.integers(1, n + 1)) * step
    window = (middle - length * rng.uniform(0.5, 3), middle + length * rng.uniform(0.5, 3))
    return Case(chain(signal, n, step), window=window)


FAMILIES: dict[str, Callable[[int], Case]] = {
    "random references": case,
    "random references, compact support": partial(case, drawn=compact_kernel),
    "random references, several states": general_case,
    "random references, windows before time zero": _before_zero,
}


def answer(number: int, chosen: Case) -> Outcome:
    """Return what is said of a case, of which a window or, by its number, some claim is asked."""
    if chosen.window:
        return prove(chosen.reference, Window(*chosen.window))
    return ask(number // len(FAMILIES), chosen)


def _attack(counts: Counts, chosen: Case, found: Outcome, seed: int) -> None:
    """A certificate has to be true and, if it is short, accepted; a counterexample likewise."""
    counts.tried += 1
    if not isinstance(found, Certificate | Counterexample):
        return
    counts.accepted += 1
    is_true = falsehood(found, chosen.reference) is None
    if isinstance(found, Certificate):
        counts.judged(f"seed {seed}", is_true and _is_evaluated(found, np.random.default_rng(seed)))
        proof = found.proof
        few = proof.last if isinstance(proof, Steps) else sum(len(of.radii) for of in proof.boxes.values())
        verdict = counts.checked(encode_certificate(found)) if few <= _FEW else None
    else:
        counts.judged(f"seed {seed}", is_true)
        verdict = counts.checked(encode_counterexample(found))
    if not isinstance(verdict, Proved | Refuted | None):
        counts.false.append(f"seed {seed}: the checker says {verdict}")


def _is_evaluated(found: Certificate, rng: np.random.Generator) -> bool:
    """Whether float64 values are as near as is certified.

    That is at times of the claim where a kernel is steep, and where it is about all phases, at a step up to 10¹⁰ too,
    which is moved by whole periods.
    """
    reference = found.reference
    signal = reference.signals[int(rng.integers(len(reference.signals)))]
    shift = int(rng.integers(max(reference.plant.flatness.orders) + 1)) * reference.plant.sampling_time
    near = rng.choice(signal.centres, 2) - shift + signal.kernel.correlation_time * rng.uniform(-1, 1, 2)
    times = np.clip(near, *found.claim.span)
    times = times[np.abs(times) <= found.evaluated_until].tolist()
    far = [int(10 ** rng.uniform(0, 10)) * int(rng.choice([-1, 1]))] if isinstance(found.claim, AllPhases) else []
    return all(off <= found.evaluation_error[name] for name, off in naive.evaluated(reference, times, far))


def _attack_long_arrays(counts: Counts, seed: int) -> None:
    """Regular centres and many regular times: float64 values have to be as near as is certified."""
    chosen, rng = case(seed), np.random.default_rng(seed)
    reference, count = chosen.reference, int(rng.integers(60, 120))
    step = reference.plant.sampling_time
    centres = step * float(rng.choice([0.5, 1, 2])) * np.arange(count)
    signal = KernelSum(chosen.reference.signals[0].kernel, 0.0, centres, rng.standard_normal(count))
    reference = Reference((signal,), replace(reference.plant))
    many = int(rng.integers(50_000, 70_000))
    times = step * np.arange(many) - step * many * rng.uniform(0, 1)
    errors = evaluation_errors(reference, float(np.max(np.abs(times))))
    values = {"state": reference.state_at(times), "input": reference.input_at(times)}
    nearest = int(np.searchsorted(times, 0.0))
    for i in (*rng.integers(0, many, 2).tolist(), min(nearest + int(rng.integers(count)), many - 1)):
        counts.tried += 1
        counts.accepted += 1
        off = {name: naive.off(reference, name, of[i, 0], times[i]) for name, of in values.items()}
        counts.judged(f"seed {seed}, time {times[i]!r}", all(off[name] <= errors[name] for name in off))

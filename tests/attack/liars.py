"""The liar's law at length: `python -m tests.attack.liars --problems 2000`; exit code 1: something false came out.

What proposes proofs, counterexamples and contradictions is replaced by what lies: by a fault in each of its functions,
and at random. What is handed out all the same has to be true: extremes are sought in many digits, signals and plants
are driven to their ends.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from tests.attack.command import run
from tests.attack.signals import WIDE
from tests.attack.truth import distance, distances, largest
from tests.splines.trials import Counts, try_one
from tests.trackably.certificates.instances import case, general_case
from tests.trackably.certificates.liars import LIES, LIES_ABOUT_PIECES, Lies, after, always, scaled, telling
from tests.trackably.checker.test_soundness import ask, falsehood
from tests.trackably.joints.trajectories import ORDERS
from tests.trackably.plants import AXIS
from tests.trackably.plants import SLIDE as PLANT
from tests.trackably.reference.feasibility.instances import trajectory
from tests.trackably.reference.test_truth import NOISE, BangBang
from tests.trackably.test_model_error import W, gain
from trackably import (
    BrokenLimits,
    CertifiedTable,
    CertifiedTrajectory,
    ConstrainedSystem,
    Joints,
    JointTrajectory,
    ModelError,
    NoSignal,
    RefutedTable,
    Samples,
    SquaredExponential,
    Table,
    certify_joints,
    certify_table,
    learn_reference,
    repair_joints,
    stretch_joints,
    worst_plant,
)
from trackably.certificates.certificate import Certificate
from trackably.certificates.judge import judge, judge_contradiction
from trackably.certificates.prove import prove
from trackably.checker.certificate import Measured, SignalClass, TrueSignal, Window
from trackably.given import table as tables
from trackably.gp.signal import KernelSum
from trackably.joints import certify as joints
from trackably.joints import repair as repairing
from trackably.joints.certify import BrokenLimit
from trackably.learning.problem import NoSolution
from trackably.reference import feasibility, truth
from trackably.reference.truth import no_signal, with_truth
from trackably.reference.waypoints import waypoints
from trackably.systems import tightening
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening

STUMBLES = ValueError, ArithmeticError, IndexError, AssertionError
"""What may be raised where somebody lies: then nothing is handed out."""

_SIGNALS = 4

Found = Iterator[tuple[str, str | None]]
"""What was handed out, and what is false in it."""


# Kernel sums, pieces and tables.


def of_kernels(rng: np.random.Generator) -> Found:
    make, seed = (case, general_case)[rng.integers(2)], int(rng.integers(2**31))
    found = ask(seed, chosen := make(seed))
    yield type(found).__name__, falsehood(found, chosen.reference)


def of_pieces(rng: np.random.Generator) -> Found:
    counts: dict[str, Counts] = {}
    try_one(counts, int(rng.integers(2**31)), int(rng.integers(100)))
    for found in counts.values():
        yield from (("Certificate", None) for _ in range(found.certificates))
        yield from (("Counterexample", None) for _ in range(found.counterexamples))
        yield from (("false", what) for what in found.false)


def of_tables(rng: np.random.Generator) -> Found:
    """Of a step that is off by a known defect, say of a tolerance near it whether it is kept."""
    defect = float(10 ** rng.uniform(-6, -1))
    tolerance = defect * float(1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-9, -0.1))
    found = certify_table(Table([[0.0, 0.0], [0.0, defect]], [[0.0]]), AXIS, tolerance)
    is_kept, why = defect <= tolerance, None
    if isinstance(found, CertifiedTable) and not (is_kept and tolerance >= found.tolerance >= defect):
        why = f"{defect} is said to be within {tolerance}"
    if isinstance(found, RefutedTable) and (is_kept or found.violation > defect - tolerance):
        why = f"{defect} is said to be beyond {tolerance} by {found.violation}"
    yield type(found).__name__, why


def _other_differences(rng: np.random.Generator, found: Any) -> Any:
    return found * 10 ** rng.uniform(-3, 3) * (rng.random() < 0.8)


# Joints.


def _random_trajectory(rng: np.random.Generator) -> JointTrajectory:
    t = np.cumsum(rng.uniform(0.05, 0.5, int(rng.integers(4, 8))))
    return JointTrajectory.of(CubicSpline(t, 0.3 * rng.normal(size=(len(t), 1)), bc_type="clamped"), rests=False)


def of_joints(rng: np.random.Generator) -> Found:
    """A limit is next to an extreme of a random spline, or cuts a part of it off."""
    given, order = _random_trajectory(rng), int(rng.integers(0, 3))
    most = max(float(largest(given, order, side)) for side in (1, -1))
    by = [10.0 ** rng.uniform(-12, -6) * rng.choice([-1, 1]), rng.uniform(-0.3, 0.1)][int(rng.integers(2))]
    limits: dict[str, Any] = {ORDERS[0]: [(-1e6, 1e6)]}
    limits[ORDERS[order]] = [(-most * (1 + by), most * (1 + by))]
    bounded = Joints(names=given.names, **limits)
    for certify in (certify_joints, repair_joints, stretch_joints):
        found = None
        with suppress(*STUMBLES):
            found = certify(given, bounded, tolerance=1e-6)
        yield f"{certify.__name__}: {type(found).__name__}", _false_of_joints(found, bounded)


def _false_of_joints(found: Any, bounded: Joints) -> str | None:
    if isinstance(found, CertifiedTrajectory):
        for r in range(bounded.order + 1):
            low, high = bounded.limits[r, 0].tolist()
            for side, end in ((1, high), (-1, -low)):
                if np.isfinite(end) and largest(found.trajectory, r, side) > end:
                    return f"the {ORDERS[r]} is beyond {end}"
    if isinstance(found, BrokenLimits):
        for broken in found.broken:
            if broken.jumps or broken.limits is None:
                continue
            r, (low, high) = ORDERS.index(broken.order), map(Fraction, broken.limits)
            if max(largest(found.trajectory, r) - high, largest(found.trajectory, r, -1) + low) < broken.violation:
                return f"the {broken.order} is not beyond {broken.limits} by {broken.violation}"
    return None


def _breaks_anywhere(rng: np.random.Generator, honest: Any) -> Any:
    def told(subject: Any, j: int, r: int, i: int) -> Any:
        limit, since = subject.joints[j].limits[r], float(subject.polynomial(j, i, r)[1]) * float(rng.random())
        by, t = 10.0 ** rng.uniform(-9, 0), subject.breakpoints[i]
        place = {"joint": j, "order": r, "piece": i, "since": since}
        return BrokenLimit(subject.joints[j].name, ORDERS[r], limit, t, t + since, by, False, place)

    return told


def _everything_open(rng: np.random.Generator, honest: Any) -> Any:
    return lambda subject: [
        (False, j, r, i)
        for j, of in enumerate(subject.joints)
        for r, limit in enumerate(of.limits)
        for i in range(len(subject.breakpoints) - 1)
        if limit is not None
    ]


def _solves_another(rng: np.random.Generator, honest: Any) -> Any:
    """Solve the problem of wider limits, or return any coefficients."""

    def solved(splines: Any, given: Any, bounded: Joints, held: Any, backoff: float, until: float) -> Any:
        for each in honest(splines, given, bounded, held, -float(rng.choice([1e-12, 1e-6, 1e-3, 0.1])), until):
            yield each + rng.normal(size=each.shape) * float(rng.choice([0.0, 1e-9, 1e-2]))

    return solved


OF_JOINTS: Lies = {
    "violations are larger": (joints, "_outside", scaled(0, 3, "violation")),
    "limits are broken anywhere": (joints, "_outside", _breaks_anywhere),
    "nothing is decided": (joints, "not_kept", _everything_open),
    "extremes are elsewhere": (
        joints, "_times_at", lambda rng, honest: lambda of, value: np.sort(rng.uniform(of.x[0], of.x[-1], 4)),
    ),
    "limits are left at any time": (joints, "_outside", scaled(-3, 0, "begins")),
    "exact values are larger": (joints, "_below", scaled(0, 2)),
    "any factor will do": (joints, "_least_factor", scaled(-2, 0)),
    "other splines are nearest": (repairing, "_solve", _solves_another),
}  # fmt: skip


# True signals.


@cache
def _learned_near(seed: int) -> tuple[Certificate, BangBang]:
    """Return a reference near a signal, of which nothing is said yet."""
    f, t = BangBang(seed, 0.48), np.arange(0.0, 2.0, 0.1)
    kernel = SquaredExponential(0.2, 0.4)
    found = learn_reference(Samples(t, f(t)), WIDE, kernel, "recorded", noise_std=NOISE, mean=0.0, progress=False)
    return found.certificate, f


def of_truth(rng: np.random.Generator) -> Found:
    """Another set of samples of the same signal, at the ends of their noise."""
    certificate, f = _learned_near(int(rng.integers(_SIGNALS)))
    t = np.sort(rng.choice(np.arange(0.0, 2.0, 0.02), int(rng.integers(8, 25)), replace=False))
    values = f(t) + NOISE * rng.choice([-1.0, 1.0], len(t))
    of = SignalClass(Measured(tuple(t.tolist()), tuple(values.tolist()), NOISE * (1 + 1e-9)), None, None, 0.5)
    found = None
    with suppress(*STUMBLES, TypeError):  # a lie may take away all that is compared
        if (excluded := no_signal("position", of)) and isinstance(judge_contradiction(excluded), NoSignal):
            yield "NoSignal", f"samples of a signal are said to contradict each other: {excluded}"
        found = judge(with_truth(certificate, [TrueSignal("position", of, (t[0], t[-1]), (), 0, (), (), (np.inf,))]))
    is_claimed = isinstance(found, Certificate) and bool(found.truth)
    yield type(found).__name__, _false_of_truth(found, f) if is_claimed else None


def _false_of_truth(found: Certificate, f: BangBang) -> str | None:
    (claimed,) = found.truth
    t, apart, errors = distances(found, claimed, f)
    if np.any(apart > errors + 1e-12):
        return "the signal is further away"
    for k in np.argsort(apart - errors)[-3:].tolist():
        x = float(found.reference.state_at(t[k : k + 1])[0, 0])
        if distance(claimed.of, x, float(t[k])) > errors[k] * (1 + 1e-6):
            return f"a signal of the class is further away at {t[k]} s"
    return None


def _wrong_pairs(rng: np.random.Generator, honest: Any) -> Any:
    def chosen(known: TrueSignal, *more: Any) -> Any:
        found, most = honest(known, *more), len(known.of.samples.times)
        other = tuple(tuple(sorted(rng.choice(most, 2, replace=False).tolist())) for _ in found.upper)
        return replace(found, **{"upper" if rng.random() < 0.5 else "lower": other})

    return chosen


def _contradicts(rng: np.random.Generator, honest: Any) -> Any:
    return lambda of, cells: rng.normal(size=len(of.samples.times)) if rng.random() < 0.7 else None


OF_TRUTH: Lies = {
    "errors are smaller": (truth, "_largest", scaled(-2, 0)),
    "errors are a little smaller": (truth, "_largest", scaled(-1e-4, 0)),
    "other samples bound": (truth, "_with_sides", _wrong_pairs),
    "multipliers are others": (
        truth, "_rationals", after(lambda rng, found: [m * Fraction(float(rng.uniform(0.5, 1.5))) for m in found]),
    ),
    "there are no cells between": (truth, "_edges", after(lambda rng, ends: ends[[0, -1]])),
    "sides are elsewhere": (truth, "_around", lambda rng, honest: lambda times, at: np.arange(min(3, len(times)))),
    "signals contradict each other": (truth, "_contradicting", _contradicts),
}  # fmt: skip


# Wrong models.


def of_models(rng: np.random.Generator) -> Found:
    """A gain that is wrong by a random part: a reference next to the bounds that are left, and plants against them."""
    error, centres = gain(float(rng.uniform(0.05, 0.4))), np.sort(rng.uniform(0.0, 1.9, 6))
    found, why = None, None
    with suppress(*STUMBLES):
        left = tightening.tightening(PLANT, W, None, 0.0, None, error)
        signal = KernelSum(SquaredExponential(1.0, float(rng.uniform(0.4, 0.8))), 0.0, centres, rng.normal(size=6))
        t, limits = np.linspace(0.0, 1.9, 400), [(q, q.bounds) for q in left.plant.quantities]
        most = max(float(np.max(np.abs(q([signal], t))) / min(-of.lower, of.upper)) for q, of in limits)
        reference = Reference((replace(signal, weights=signal.weights * (0.999 / most)),), left.plant)
        found = prove(reference, Window(0.0, 1.9))
        found = judge(found.with_robust(left)) if isinstance(found, Certificate) else found
    if isinstance(found, Certificate) and left.invariant is not None:
        worst = worst_plant(reference, PLANT, error, left.invariant.feedback, 94, disturbance=W)
        why = str(worst) if worst.violation > 1e-12 else None
    yield type(found).__name__, why


def _part(rng: np.random.Generator, honest: Any) -> Any:
    def generators(self: ModelError, plant: ConstrainedSystem) -> list[Any]:
        return [each for each in honest(self, plant) if rng.random() < 0.5]

    return generators


OF_MODELS: Lies = {
    "the model adds nothing": (ModelError, "generators", always([])),
    "the model adds a part": (ModelError, "generators", _part),
    "nothing is taken": (Tightening, "taken_from", always((Fraction(0), Fraction(0)))),
    "less is taken": (
        Tightening,
        "taken_from",
        after(lambda rng, row: tuple(end * Fraction(float(rng.uniform(0.3, 1))) for end in row)),
    ),
    "the set is smaller": (
        tightening,
        "invariant_set",
        after(lambda rng, Z: replace(Z, box=[p * 10 ** rng.uniform(-3, -0.01) for p in Z.box])),
    ),
    "errors decay faster": (
        tightening, "_contraction", after(lambda rng, found: (max(1, found[0] // 2), found[1] * rng.uniform(0.1, 0.9))),
    ),
    "one step is enough": (tightening, "_head", always(1)),
    "any feedback will do": (tightening, "best_feedback", after(lambda rng, K: K * rng.uniform(0.5, 1.5))),
}  # fmt: skip


# Contradictions.


def of_contradictions(rng: np.random.Generator) -> Found:
    """Values on a trajectory that keeps all bounds."""
    plant, claim, at = trajectory(rng)
    pinned = waypoints(at, 1e-9, plant, claim)
    found: NoSolution | None = feasibility.impossible(plant, claim, pinned, [0.0] * plant.signal_count)
    yield type(found).__name__, None if found is None else f"what a trajectory does is excluded: {found}"


def _any_multipliers(rng: np.random.Generator, found: Any) -> Any:
    count = len(found.multipliers)
    upper, lower = (10.0 ** rng.uniform(-9, 3, count) * (rng.random(count) < 0.5) for _ in range(2))
    return replace(found, missing=10.0 ** rng.uniform(-5, 1), multipliers=upper - lower)


OF_CONTRADICTIONS: Lies = {
    "multipliers are any numbers": (feasibility, "least", after(_any_multipliers)),
    "more is missing": (
        feasibility,
        "least",
        after(lambda rng, found: replace(found, missing=found.missing + 10.0 ** rng.uniform(-9, 0))),
    ),
}

KINDS: dict[str, tuple[Callable[[np.random.Generator], Found], Lies]] = {
    "kernels": (of_kernels, LIES),
    "pieces": (of_pieces, LIES_ABOUT_PIECES),
    "tables": (of_tables, {"differences are others": (tables, "_differences", after(_other_differences))}),
    "joints": (of_joints, OF_JOINTS),
    "true signals": (of_truth, OF_TRUTH),
    "wrong models": (of_models, OF_MODELS),
    "contradictions": (of_contradictions, OF_CONTRADICTIONS),
}


def attack(kind: str, seed: int) -> tuple[Counter[str], list[str]]:
    """Ask about a problem of a kind, of a seed, while somebody lies; return what was handed out, and what was false."""
    problem, lies = KINDS[kind]
    rng, lie = np.random.default_rng([seed, 11]), list(lies)[seed % len(lies)]
    counts, false = Counter[str](), list[str]()
    if kind == "true signals":
        for base in range(_SIGNALS):
            _learned_near(base)  # honestly
    with telling(lie, rng, lies):
        for what, why in problem(rng):
            counts[what] += 1
            false += [f"{kind}, seed {seed}, {lie}: {what}: {why}"] if why else []
    return counts, false


def attack_in_turn(problems: int, seed: int) -> tuple[str, list[str]]:
    """Ask about problems of all kinds in turn."""
    counts, false, kinds = {kind: Counter[str]() for kind in KINDS}, list[str](), list(KINDS)
    for number in range(problems):
        kind = kinds[number % len(kinds)]
        found, wrong = attack(kind, seed + number // len(kinds))
        counts[kind] += found + Counter(problems=1)
        false += wrong
    return "".join(f"\n{kind}: {dict(sorted(found.items()))}" for kind, found in counts.items()), false


if __name__ == "__main__":
    sys.exit(run("tests.attack.liars", {"problems": (2000, attack_in_turn)}, sys.argv[1:]))

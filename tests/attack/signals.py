"""Attack what is said of true signals and of wrong models: `python -m tests.attack.signals`; exit code 1: it was false.

Signals are drawn with bang-bang second derivatives, and sampled with noise at its bounds; adversarial ones are found by
a linear program. Plants switch between vertices of their hull such that it hurts. Certificates are changed at random,
and what the checker still accepts is compared with what signals and plants do.
"""

import copy
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from tests.attack.command import run
from tests.attack.tampering import random_change
from tests.attack.truth import distance, distances
from tests.trackably.certificates.decoded import decode_certificate, decode_disturbances
from tests.trackably.checker.changes import with_changes
from tests.trackably.checker.files import CERTIFICATES, file_of
from tests.trackably.plants import SLIDE as PLANT
from tests.trackably.reference.test_truth import LIMIT, NOISE, BangBang, measured, nearly_known
from tests.trackably.test_model_error import A, B, W, gain
from trackably import (
    ConstrainedSystem,
    ModelError,
    NoSignal,
    Plan,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    Truth,
    TubeController,
    Zonotope,
    learn_reference,
    worst_plant,
)
from trackably.certificates.form import encode_certificate
from trackably.checker import Contradicted, Proved, check
from trackably.checker.certificate import SignalClass, TrueSignal
from trackably.checker.form import read_certificate
from trackably.checker.truth import read_contradicted
from trackably.codec import decode
from trackably.reference.truth import Signals, no_signal

SYSTEM = PLANT.system
WIDE = ConstrainedSystem(SYSTEM, Polytope.box([-5.0, -5.0], [5.0, 5.0]), Polytope.box([-40.0], [40.0]))
ENTRIES = {("velocity", "velocity"): (0.998, 1.002), ("velocity", "acceleration"): (0.018, 0.022)}


def learn_signal(seed: int, plant: ConstrainedSystem = WIDE, **more: object) -> tuple[TrackableReference, BangBang]:
    samples, f = nearly_known(seed)
    kernel = SquaredExponential(signal_std=0.2, lengthscale=0.4)
    window = float(samples.times[0]), float(samples.times[-1])
    truth = Truth(NOISE * (1 + 1e-9), second_derivative=LIMIT)  # a little more than it takes: programs find signals
    found = learn_reference(
        samples, plant, kernel, window, noise_std=NOISE, mean=0.0, truth=truth, progress=False, **more
    )
    return found, f


def attack_signals(count: int, seed: int) -> tuple[object, list[str]]:
    """Compare what is said with what was drawn, and with adversarial signals."""
    false, drawn, adversarial = list[str](), [], []
    for i in range(count):
        found, f = learn_signal(seed + i)
        (truth,) = found.certificate.truth
        _, apart, errors = distances(found, truth, f)
        drawn.append(float(np.max(apart)) / truth.error)
        reached = 0.0
        for cells, at in product(_CELLS, _worst_times(truth)):
            x = float(found.reference.state_at(np.array([at]))[0, 0])
            reached = max(reached, distance(truth.of, x, at, cells))
            if reached > _NEAR * truth.error:
                break
        adversarial.append(reached / truth.error)
        if np.any(apart > errors + 1e-12) or reached > truth.error * (1 + 1e-6):
            false.append(f"signal {seed + i} is further away than is said")
        if reached <= _NEAR * truth.error:
            false.append(f"signal {seed + i}: no signal that is found is as far away as is said, only {reached:.3g}")
    return {
        "largest of drawn / ε": max(drawn),
        "adversarial / ε: least, median, largest": [*np.percentile(adversarial, [0, 50, 100]).round(4).tolist()],
        "adversarial within 10 %": int(np.sum(np.array(adversarial) > _NEAR)),
    }, false


_NEAR, _ASKED, _CELLS = 0.9, 6, (6, 60)
"""Part of ε that an adversarial signal reaches; cells of the proof that are searched for it, and cells of its program
between two measurements (with few of them no signal may explain the samples).
"""


def _worst_times(truth: TrueSignal) -> list[float]:
    """Return ends and middles of the cells with the largest errors, the largest first."""
    worst = np.argsort(truth.errors)[::-1][:_ASKED].tolist()
    cells = [truth.ends[k : k + 2] for k in worst]
    return list(dict.fromkeys(t for a, b in cells for t in (a, b, (a + b) / 2)))


def attack_contradictions(count: int, seed: int) -> tuple[object, list[str]]:
    """Look for contradictions among samples of a signal, and after one is planted there."""
    false, sizes = list[str](), Counter[int]()
    for i in range(count):
        of, found = _planted(seed, i)
        false += [f"{i}: a signal is contradicted"] if no_signal("position", of) is not None else []
        if found:
            sizes[len(found.among)] += 1
            false += [] if isinstance(check(found.contradiction), Contradicted) else [f"{i}: it is refused"]
    return {"found": sizes.total(), "sizes": dict(sizes)}, false


def _planted(seed: int, i: int) -> tuple[SignalClass, NoSignal | None]:
    """Return the class of a signal, and a proof that no signal explains its samples after one is moved."""
    draw = np.random.default_rng([seed, i])
    of = measured(BangBang(seed + i), draw, 20)
    curved = replace(of, slope=None)
    of = [curved, replace(curved, rates=None), of, replace(of, second_derivative=None, rates=None)][i % 4]
    values = list(of.samples.values)
    k = int(draw.integers(1, len(values) - 1))
    values[k] += float(draw.choice([-1.0, 1.0])) * (2.0 if of.second_derivative is None else 1.2)
    return of, no_signal("position", replace(of, samples=replace(of.samples, values=tuple(values))))


def attack_changed(count: int, seed: int) -> tuple[object, list[str]]:
    """Change certificates about bounds that move, and contradictions of samples; what is accepted has to be true."""
    contradictions = [found.contradiction for i in range(12) if (found := _planted(seed, i)[1])]
    moving = [kind for kind in CERTIFICATES if kind.startswith("moving bounds")]

    def changes() -> Iterator[Change]:
        for i in range(count):
            rng, kind = np.random.default_rng([seed, 4, i]), moving[i // 2 % len(moving)]
            if i % 2:
                yield kind, *random_change(file_of(kind), rng), _moving_bounds_are_broken
            else:
                known = contradictions[i // 2 % len(contradictions)]
                yield "contradiction", *random_change(known, rng), _is_explained

    return _judged(changes())


Change = tuple[str, str, dict, Callable[[dict], bool]]
"""A kind of file, what is changed in it, what comes out, and whether that is false."""


def _judged(changes: Iterator[Change]) -> tuple[object, list[str]]:
    """Count what the checker says of changed files, and return what is false in what it accepts."""
    counts, false = Counter[str](), []
    for kind, what, content, is_false in changes:
        verdict = check(content)
        counts[f"{kind}: {type(verdict).__name__}"] += 1
        if isinstance(verdict, Proved | Contradicted) and is_false(content):
            false.append(f"{kind}; {what}: it is accepted")
    return dict(sorted(counts.items())), false


def _moving_bounds_are_broken(content: dict) -> bool:
    """Whether a bound is broken at one of many times that are claimed, in float64."""
    reference, claim = decode_certificate(content).reference, content["claim"]
    times = np.linspace(claim.get("start", 0.0), claim.get("end", 30.0), 40_001)
    if claim["kind"] == "instants":
        times = reference.plant.sampling_time * np.arange(2001)
    elif claim["kind"] == "window":
        times = times[:-1]  # a piece that begins at the end does not count
    return any(float(np.min(q.margin(reference.signals, times))) < -1e-9 for q in reference.quantities)


def _is_explained(content: dict) -> bool:
    """Whether a linear program finds a signal of the class."""
    of = read_contradicted(content).of
    return Signals.of(of, (), 64).extreme(of.samples.times[0], 1) is not None


def attack_models(steps: int, seed: int) -> tuple[object, list[str]]:
    """Let plants switch such that it hurts."""
    t = np.arange(0.0, 4.0, 0.1)
    samples = Samples(t, 0.05 * np.sin(1.8 * t) * np.exp(-0.3 * t))
    broken, taken, least, both = 0, 0, np.inf, ModelError.intervals(SYSTEM, ENTRIES)
    for plant_error, more in ((gain(0.2), {"disturbance": W}), (gain(0.3), {}), (both, {"disturbance": W})):
        found = learn_reference(
            samples, PLANT, SquaredExponential(), "all_times", mean=0.0, noise_std=0.001, progress=False,
            model_error=plant_error, **more,
        )  # fmt: skip
        assert found.tightening is not None
        assert found.tightening.invariant is not None
        K = found.tightening.invariant.feedback
        policies, count = 42 + len(plant_error.vertices) + 1, 0
        while count < steps / 3:
            length = int(min(8000, steps / 3 / policies + 1))
            worst = worst_plant(found, PLANT, plant_error, K, length, **more)
            broken += worst.breaks
            least, count = min(least, -worst.violation), count + length * policies
        taken += count
    return {"steps": taken, "least that is left": least}, [f"{broken} bounds are broken"] * bool(broken)


def attack_end_to_end(runs: int, seed: int) -> tuple[object, list[str]]:
    """Feed back noisy states of plants at vertices, and every twentieth run by the tube controller."""
    noise = np.array([2e-4, 5e-4])
    further, without_plan, largest, bounds = 0, 0, 0.0, []
    K, every = np.array([[-60.0, -16.0]]), 20
    plant = replace(WIDE, input_set=Polytope.box([-4.0], [4.0]))
    for i in range(0, runs, every):
        found, f = learn_signal(
            seed + i, plant, model_error=gain(0.2), disturbance=W, feedback=K,
            measurement_noise=Zonotope.box(-noise, noise),
        )  # fmt: skip
        (truth,), draw = found.certificate.truth, np.random.default_rng([seed, i])
        assert truth.plant is not None
        assert found.tightening is not None
        bounds.append(truth.plant)
        first = int(np.ceil(truth.ends[0] / 0.02 - 1e-9))
        last = int(np.floor(truth.ends[-1] / 0.02 + 1e-9))
        window = found.window(first, last - first)
        times = 0.02 * np.arange(first, last + 1)
        tube = TubeController(found.tightening, 6)
        for number in range(every):
            x, kind = window.states[0], number % 4
            for k in range(last - first):
                side = np.sign(x - window.states[k]) + (x == window.states[k])
                v = -noise * side if kind == 0 else noise * draw.choice([-1.0, 1.0], 2)
                seen = x + v
                if number == 0 and k < last - first - 7:
                    plan = tube.step(first + k, seen, found)
                    if not isinstance(plan, Plan):
                        without_plan += 1
                        break
                    u = plan.input
                else:
                    u = window.inputs[k] + K @ (seen - window.states[k])
                factor = [0.8, 1.2][int(u[0] * side[0] > 0)] if kind < 2 else draw.choice([0.8, 1.2])
                w = np.array([0.0, 5e-4 * (side[1] if kind < 2 else draw.choice([-1.0, 1.0]))])
                x = np.array(A) @ x + factor * B @ u + w
                apart = abs(x[0] - f(times[k + 1 : k + 2])[0])
                largest = max(largest, apart / truth.plant)
                further += apart > truth.plant
    said = {"without a plan": without_plan, "largest distance / δ": largest, "δ from, to": [min(bounds), max(bounds)]}
    return said, [f"{further} times further than is said"] * bool(further)


def attack_tamperings(count: int, seed: int) -> tuple[object, list[str]]:
    """Change numbers of truths and of models; what is accepted has to be true."""
    found, _ = learn_signal(seed)
    whole = encode_certificate(found.certificate)
    t = np.arange(0.0, 2.0, 0.1)
    robust = learn_reference(
        Samples(t, 0.08 * np.sin(1.8 * t)), PLANT, SquaredExponential(), (0.0, 1.9), noise_std=0.001, progress=False,
        model_error=gain(0.2), disturbance=W, truth=Truth(0.001, second_derivative=0.5),
    )  # fmt: skip
    other = encode_certificate(robust.certificate)

    def changes() -> Iterator[Change]:
        for i in range(count):
            draw, kind = np.random.default_rng([seed, 3, i]), ("model", "truth")[i % 2]
            content = copy.deepcopy(whole if i % 2 else other)
            if i % 4 < 2:  # any part, which hardly ever leaves anything consistent
                what, (part, key) = "anything", (content["truth"], 0) if i % 2 else (content["disturbance"], "model")
                part[key] = random_change(part[key], draw)[1]
            else:
                what, content = _moved(content, kind, draw)
            is_false = partial(_truth_is_false, found=found) if i % 2 else partial(_model_is_false, robust=robust)
            yield f"{kind}, {what}", f"tampering {i}", content, is_false

    return _judged(changes())


def _moved(content: dict, kind: str, draw: np.random.Generator) -> tuple[str, dict]:
    """Say a little less than what is proved, or a little more; return which."""
    side, by = int(draw.choice([-1, 1])), float(10.0 ** draw.uniform(-12, -0.3))
    more, less = 1 + side * by, 1 - side * by
    k, bounds = draw.integers(len(content["truth"][0]["errors"])), draw.choice(["state_set", "input_set"])
    ways: dict[str, list[dict]] = {
        "truth": [
            {"truth.0.errors": more},
            {f"truth.0.errors.{k}": more},
            {"truth.0.of.samples.noise": less},
            {"truth.0.of.second_derivative": less},
        ],
        "model": [
            {"disturbance.model": lambda of: [{**v, "B": (B + less * (np.array(v["B"]) - B)).tolist()} for v in of]},
            {"disturbance.set.generators": less},
            {f"disturbance.{bounds}.lower": more, f"disturbance.{bounds}.upper": more},
            {"truth.0.plant": more},
        ],
    }
    chosen = ways[kind][int(draw.integers(4))]
    changes = {path: by if callable(by) else partial(_scaled, by=by) for path, by in chosen.items()}
    return "less" if side > 0 else "more", with_changes(content, changes)


def _scaled(value: Any, by: float) -> Any:
    """Return a number, a rational one, or all numbers in lists, times a factor."""
    if isinstance(value, list):
        return [_scaled(each, by) for each in value]
    return str(Fraction(value) * Fraction(by)) if isinstance(value, str) else value * by


def _truth_is_false(content: dict, found: TrackableReference) -> bool:
    (truth,) = read_certificate(content).truth
    for k in np.argsort(truth.errors)[-2:]:
        at = (truth.ends[k] + truth.ends[k + 1]) / 2
        x = float(found.reference.state_at(np.array([at]))[0, 0])
        if distance(truth.of, x, at) > truth.errors[k] * (1 + 1e-6):
            return True
    return False


def _model_is_false(content: dict, robust: TrackableReference) -> bool:
    said = content["disturbance"]
    hull = ModelError.of([(v["A"], v["B"], v["c"]) for v in said["model"]])
    plant = ConstrainedSystem(SYSTEM, *(decode(Polytope, said[name]) for name in ("state_set", "input_set")))
    worst = worst_plant(robust, plant, hull, said["feedback"], 94, disturbance=decode_disturbances(said["set"]))
    apart = np.abs(worst.states[:, 0] - robust.window(worst.first_step, len(worst.states) - 1).states[:, 0])
    return worst.violation > 1e-12 or float(np.max(apart)) > content["truth"][0]["plant"]


ATTACKS = {
    "steps": (10**6, attack_models),
    "planted": (200, attack_contradictions),
    "changed": (2400, attack_changed),
    "tamperings": (2000, attack_tamperings),
    "runs": (1000, attack_end_to_end),
    "signals": (500, attack_signals),
}

if __name__ == "__main__":
    sys.exit(run("tests.attack.signals", ATTACKS, sys.argv[1:]))

"""Whether what a certificate says is true, by a dense search that looks at no box."""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np

from tests.trackably.certificates import naive
from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.certificates.instances import Case
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome, prove, prove_at_instants, prove_on_window
from trackably.checker.certificate import AllPhases, AllTimes, Cover, Steps, Window
from trackably.systems.linear import Flatness
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Functional


@cache
def is_true(statement: str) -> bool:
    """Whether what the certificate says is true, by a dense search that looks at no box."""
    data = eval(statement)
    certificate = decode_certificate(data)
    reference = as_stored(certificate.reference, data["trajectories"])
    errors = data["evaluation"]["errors"]
    return naive.follows_exactly(reference) and all(
        smallest_margin(reference, certificate.claim, certificate.proof, quantity.name) >= errors[quantity.name]
        for quantity in reference.quantities
    )


def as_stored(reference: Reference, trajectories: dict) -> Reference:
    """With the trajectories of a file, whatever the system's own are."""

    def functionals(parts: list) -> tuple[Functional, ...]:
        t_s = reference.plant.sampling_time
        return tuple(
            Functional(tuple(tuple(map(Fraction, w)) for w in q["weights"]), Fraction(q["offset"]), t_s) for q in parts
        )

    states, inputs = functionals(trajectories["states"]), functionals(trajectories["inputs"])
    plant = replace(reference.plant)
    plant.__dict__["flatness"] = Flatness(states, inputs, tuple(len(w) for w in inputs[0].weights))
    return Reference(reference.signals, plant)


def statement(data: dict) -> str:
    """All that the statement depends on: everything but the boxes."""
    claim = {key: value for key, value in data["claim"].items() if key not in {"covers", "terms"}}
    return repr({**data, "claim": claim})


def ask(seed: int, chosen: Case) -> Outcome:
    question = (prove, prove_at_instants, prove, lambda reference: prove_on_window(reference, 0.0, chosen.end))
    return question[seed % 4](chosen.reference)


def smallest_margin(reference: Reference, claim, proof, name: str):
    """The smallest margin that is found at any time for which the claim is made."""
    match claim, proof:
        case AllTimes(), Cover(end=end):
            # A heavy tail starts late: look closely where something happens, and here and there later.
            busy = min(end, 10 * max(float(np.max(s.centres)) for s in reference.signals) + end / 10)
            times = naive.extremes(reference, name, 0.0, busy) + np.geomspace(busy, 1e3 * end, 30).tolist()
        case AllPhases(), Cover(end=end):
            times = [t + k * end for t in naive.extremes(reference, name, 0.0, end) for k in (0, -3)]
        case Window(start=start, end=end), Cover():
            times = naive.extremes(reference, name, start, end)
        case _, Steps(last):
            steps = np.arange(min(last, 2000) + 20)
            values = naive.extended(reference, name, steps * np.longdouble(reference.plant.sampling_time))
            times = [naive.instant(reference, int(k)) for k in (np.argmax(values), np.argmin(values))]
            return min(naive.margin(reference, name, t) for t in times)
    return naive.smallest(reference, name, times)


def what_is_false(found: Outcome, of: Case) -> str | None:
    """What is said and not true: of a certificate any bound, of a counterexample by how much its bound is broken."""
    reference = of.reference
    if isinstance(found, Certificate):
        assert set(found.evaluation_error) == {q.name for q in reference.quantities}
        for name, error in found.evaluation_error.items():
            if not smallest_margin(reference, found.claim, found.proof, name) >= error:
                return f"{name} has less room than {error}"
    elif isinstance(found, Counterexample):
        t = found.time if found.step is None else naive.instant(reference, found.step)
        is_claimed = found.claim.span[0] <= t <= found.claim.span[1]
        if not (is_claimed and naive.margin(reference, found.quantity, t) <= -found.violation < 0):
            return f"{found.quantity} is not broken at {t} by {found.violation}"
    return None

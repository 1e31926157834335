"""Attack: hundreds of random references whose bounds are kept or broken by a hair, and a search that knows no mercy."""

from collections import Counter
from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates import naive
from tests.trackably.certificates.instances import Case, case, compact_kernel, general_case
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import evaluation_errors
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome, prove
from trackably.checker.certificate import AllPhases, AllTimes, Cover, Instants, Steps, Window
from trackably.systems.reference import Reference


def ask(seed: int, chosen: Case) -> Outcome:
    question = (None, Instants(), None, Window(0.0, chosen.end))
    return prove(chosen.reference, question[seed % 4])


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


def falsehood(found: Outcome, reference: Reference) -> str | None:
    """Return what is false in what is said of a reference; None if it is true, or if nothing is said."""
    if isinstance(found, Certificate):
        assert set(found.evaluation_error) == {q.name for q in reference.quantities}
        for name, error in found.evaluation_error.items():
            if smallest_margin(reference, found.claim, found.proof, name) < error:
                return f"the {name} is not kept"
    elif isinstance(found, Counterexample):
        t = found.time if found.step is None else naive.instant(reference, found.step)
        if not (found.claim.span[0] <= t <= found.claim.span[1] and found.violation > 0):
            return f"nothing is claimed at {t} s, or nothing is broken"
        if naive.margin(reference, found.quantity, t) > -found.violation:
            return f"the {found.quantity} is not broken by {found.violation} at {t} s"
    return None


def assert_nothing_false_is_claimed(cases: dict[int, Case]) -> Counter[type]:
    said = Counter[type]()
    for seed, chosen in cases.items():
        found = ask(seed, chosen)
        said[type(found)] += 1
        assert (why := falsehood(found, chosen.reference)) is None, (seed, why)
    return said


DRAWN = {
    "kernels": (range(1000, 1024), case, 3),
    "compact support": (range(9000, 9009), partial(case, drawn=compact_kernel), 1),
    "general systems": (range(8000, 8009), general_case, 1),
}


@pytest.mark.parametrize(("seeds", "draw", "least"), DRAWN.values(), ids=DRAWN)
def test_nothing_false_is_ever_claimed(seeds, draw, least):
    said = assert_nothing_false_is_claimed({seed: draw(seed) for seed in seeds})
    assert min(said[Certificate], said[Counterexample]) >= least


@pytest.mark.parametrize("seed", range(5000, 5006))
def test_a_margin_of_a_millionth_is_enough_and_a_millionth_too_much_is_refuted(seed):
    for margin in (1e-6, -1e-6):
        chosen = case(seed, margin=margin)
        found = prove(chosen.reference, Window(0.0, chosen.end))
        errors = evaluation_errors(chosen.reference, 1e3 * chosen.end)
        if margin < 0:
            assert isinstance(found, Counterexample), found.explanation
            assert found.quantity == chosen.active
        elif all(errors[q.name] < 1e-7 * q.bounds.width for q in chosen.reference.quantities):
            assert isinstance(found, Certificate), found.explanation

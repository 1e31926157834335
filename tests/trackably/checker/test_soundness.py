"""Random references whose bounds are kept or broken by a hair, and a search that knows no mercy."""

from collections import Counter
from functools import partial

import pytest

from tests.trackably.certificates.instances import case, compact_kernel, general_case
from tests.trackably.checker.truth import ask, what_is_false
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import evaluation_errors
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove_on_window

DRAWN = {
    "kernels": (range(1000, 1032), case, 5),
    "compact support": (range(9000, 9015), partial(case, drawn=compact_kernel), 2),
    "general systems": (range(8000, 8010), general_case, 2),
}


@pytest.mark.parametrize(("seeds", "draw", "least"), DRAWN.values(), ids=DRAWN)
def test_nothing_false_is_ever_claimed(seeds, draw, least):
    said = Counter[type]()
    for seed in seeds:
        found = ask(seed, chosen := draw(seed))
        assert what_is_false(found, chosen) is None, seed
        said[type(found)] += 1
    assert min(said[Certificate], said[Counterexample]) >= least


@pytest.mark.parametrize("seed", range(5000, 5015))
def test_a_margin_of_a_millionth_is_enough_and_a_millionth_too_much_is_refuted(seed):
    chosen = case(seed, margin=1e-6)
    errors = evaluation_errors(chosen.reference, 1e3 * chosen.end)
    found = prove_on_window(chosen.reference, 0.0, chosen.end)
    if all(errors[q.name] < 1e-7 * q.bounds.width for q in chosen.reference.quantities):
        assert isinstance(found, Certificate), found.explanation
    chosen = case(seed, margin=-1e-6)
    found = prove_on_window(chosen.reference, 0.0, chosen.end)
    assert isinstance(found, Counterexample), found.explanation
    assert found.quantity == chosen.active

"""Whole proofs with enclosures in float64 are those with ball arithmetic, and the checker agrees with both."""

import numpy as np
import pytest

from tests.trackable.certificates.instances import case, compact_kernel, general_case
from tests.trackable.certificates.test_prove import reference
from trackable.certificates import cover
from trackable.certificates.boxes import decision
from trackable.certificates.boxes.positive import are_positive
from trackable.certificates.certificate import Certificate
from trackable.certificates.floats.balls import Balls
from trackable.certificates.outcome import Unproved
from trackable.certificates.prove import prove_on_window
from trackable.checker import Proved, check
from trackable.codec.certificates import encode_certificate
from trackable.gp.kernels.squared_exponential import SquaredExponential

MAKES = {"scalar": case, "general": general_case, "compact": lambda seed: case(seed, 1e-3, compact_kernel)}


def balls_alone(patch):
    """Nothing is believed of float64."""
    patch.setattr(decision, "are_positive", lambda polynomials: np.zeros(polynomials.mid.shape[1], dtype=bool))
    patch.setattr(decision, "_OPEN", 0.0)


@pytest.mark.parametrize("make", MAKES.values(), ids=MAKES)
def test_both_arithmetics_prove_the_same(make, monkeypatch):
    kinds = set()
    for seed in range(8000, 8012):
        chosen, found = make(seed), []
        for plant in (lambda patch: None, balls_alone):
            with monkeypatch.context() as patch:
                plant(patch)
                found.append(prove_on_window(chosen.reference, 0.0, chosen.end / 8))
        floats, balls = found
        assert type(floats) is type(balls)
        kinds.add(type(floats))
        if isinstance(floats, Certificate):
            counts = np.array([[len(f.covers[name].radii) for name in f.covers] for f in found])
            assert np.all(np.abs(counts[0] - counts[1]) <= 1 + 0.1 * counts[1])
    assert Certificate in kinds


@pytest.mark.parametrize("make", MAKES.values(), ids=MAKES)
def test_the_checker_agrees_with_float64(make):
    examined = 0
    for seed in range(8000, 8012):
        chosen = make(seed)
        found = prove_on_window(chosen.reference, 0.0, chosen.end / 32)
        if isinstance(found, Certificate) and sum(len(cover.radii) for cover in found.covers.values()) <= 8:
            assert isinstance(check(encode_certificate(found)), Proved), seed
            examined += 1
    assert examined >= 3


def test_where_rounding_leaves_too_much_open_ball_arithmetic_decides(monkeypatch):
    """Enclosures in float64 that are made too wide for any margin prove nothing by themselves."""
    learned = reference(SquaredExponential(1.0, 0.3))
    monkeypatch.setattr(cover, "_MOST_BOXES", 50)
    series = decision.Enclosures.polynomials
    wide = lambda *arguments: Balls(series(*arguments).mid, np.full_like(series(*arguments).mid, 9.0))  # noqa: E731
    monkeypatch.setattr(decision.Enclosures, "polynomials", wide)
    assert isinstance(prove_on_window(learned, 0.0, 1.0), Certificate)
    monkeypatch.setattr(decision, "_OPEN", np.inf)
    assert isinstance(prove_on_window(learned, 0.0, 1.0), Unproved)


@pytest.mark.parametrize("seed", range(3))
def test_positive_polynomials_are_positive_everywhere(seed):
    """Those that touch zero nearly are decided by halves; one that is negative anywhere is never called positive."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-1, 1, 4001)
    mid = rng.normal(size=(16, 300)) * 0.7 ** np.arange(16)[:, None]
    lowest = np.min(np.polynomial.polynomial.polyval(x, mid), axis=1)
    for above, wanted in ((1e-4, True), (-1e-7, False)):
        moved = mid.copy()
        moved[0] += above - lowest
        assert np.all(are_positive(Balls(moved, np.zeros_like(moved))) == wanted)
    assert not np.any(are_positive(Balls(mid, np.full_like(mid, np.nan))))

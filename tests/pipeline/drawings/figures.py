"""One of each figure that shows references, and their digests: `python -m tests.pipeline.drawings.figures`."""

import json
from hashlib import sha256

import numpy as np
from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, predictions, references
from pipeline.drawings.landscape import landscape
from pipeline.drawings.style import state_at_steps, tube_after_steps
from pipeline.published.algorithm1 import Trace
from pipeline.published.scalar import scalar, state_and_input
from pipeline.storage.archive import Conservatism, Tightness
from trackably.exports import figures
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.index_set import Steps
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.margins import margin_profile
from trackably.systems.polytopes import Interval
from trackably.systems.reference import Reference

SYSTEM = scalar(0.9, 0.5, state_set=Interval(-2, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
STATE, INPUT = state_and_input(SYSTEM)
SAMPLES = Samples(np.arange(7) / 10, np.array([-0.99306, -0.40789, -0.05, 0.0, 0.0, 0.0, 0.0]))
OPTIMA = {"unconstrained": (0.659325, 0.203472), "as_published": (0.701178, 0.219672), "sound": (0.702, 0.21990)}
UNITS = {"state": "m", "input": "m/s"}
STEPS = np.arange(151, dtype=float)
CONSTANT = np.minimum(np.sin(np.pi * np.minimum(STEPS, 25) / 50) - 1, 0)


def posterior(theta1: float, theta2: float) -> Posterior:
    return Posterior(Prior(SquaredExponential(theta1, theta2), 0.01), SAMPLES)


REFERENCES = {name: Reference((posterior(*theta).signal,), SYSTEM) for name, theta in OPTIMA.items()}
PUBLISHED = predictions.Published(
    STEPS,
    {
        "unconstrained": state_at_steps(REFERENCES["unconstrained"], STEPS),
        "constrained": state_at_steps(REFERENCES["sound"], STEPS),
    },
    *tube_after_steps(REFERENCES["sound"], STEPS),
)


def trace() -> Trace:
    """Bounds that shrink like those of Example 1, unknown until step 81."""
    k = np.arange(70.0, 131.0)
    known = np.where(k > 80, 1.0, np.nan)
    along = np.minimum((k - 70) / 30, 1)
    return Trace(
        k_bar=k,
        hyperparameters={"signal_std": 0.66 + 0.04 * along, "lengthscale": 0.203 + 0.017 * along},
        objective=-3.8 + 0.1 * along,
        mean_bound=known * 11 * np.exp(-0.11 * (k - 81)),
        growth_lower=known * (-25 + 110 * np.exp(-0.075 * (k - 81))),
        growth_upper=known * (25 - 110 * np.exp(-0.075 * (k - 81))),
        derivative_bound=known * 90 * np.exp(-0.1 * (k - 81)),
        keeps_states=(k > 129).astype(float),
        keeps_rates=(k > 107).astype(float),
    )


def problem() -> ConstrainedProblem:
    prior = JointPrior((Prior(SquaredExponential(0.7, 0.22).as_learned(), 0.01),))
    constraints = (Constraint(STATE, Steps(0, 130, 0.01)), Constraint(INPUT, Steps(0, 129, 0.01)))
    return ConstrainedProblem((SAMPLES,), prior, SearchSpace.around((SAMPLES,), prior), constraints)


def draw_tube() -> Figure:
    return algorithm1.tube(REFERENCES["sound"], np.arange(12))


def draw_asymptotic() -> Figure:
    return algorithm1.asymptotic(REFERENCES["sound"], SAMPLES, 25, 130, 200)


def draw_convergence() -> Figure:
    published = {"k_bar": trace().k_bar, **trace().hyperparameters, "mean_bound": trace().mean_bound}
    return algorithm1.convergence(trace(), STATE.bounds, 0.0, published)


def draw_prediction() -> Figure:
    return predictions.prediction(
        SAMPLES, REFERENCES, "sound", STEPS, true_reference=CONSTANT, published=PUBLISHED, final_step=130
    )


def draw_bare_prediction() -> Figure:
    return predictions.prediction(SAMPLES, {"sound": REFERENCES["sound"]}, "sound", STEPS)


def draw_landscape() -> Figure:
    grids = [landscape(problem(), np.geomspace(0.3, 2, 9), np.geomspace(0.1, 0.4, 9)) for _ in range(2)]
    return algorithm1.landscape(grids, trace(), REFERENCES)


def draw_margins() -> Figure:
    return references.margins(
        {name: [margin_profile(r, q, 150, 5) for q in r.quantities] for name, r in REFERENCES.items()}, UNITS
    )


PERIODIC_PLANT = scalar(0.9, 0.1, state_set=Interval(-2, 2), input_set=Interval(-3, 1.4), sampling_time=0.01)
PERIODIC_SAMPLES = Samples(np.arange(21) / 5, np.sin(2 * np.arange(21) / 5))
PERIODIC = {
    name: Reference((Posterior(Prior(Periodic(*theta), 0.1), PERIODIC_SAMPLES).signal,), PERIODIC_PLANT)
    for name, theta in {"unconstrained": (2.0, 0.3, 3.1), "exact": (1.0, 1.0, 3.14), "intervals": (1, 2, 3.2)}.items()
}


def draw_periodic_prediction() -> Figure:
    truth = np.sin(2 * PERIODIC["exact"].instants(np.arange(401)))
    return predictions.periodic_prediction(
        PERIODIC_SAMPLES, PERIODIC, "exact", np.arange(401.0), first_steps=50, true_reference=truth
    )


def draw_growth() -> Figure:
    times, edges = np.linspace(0, 4, 101), np.linspace(0, 4, 5)
    derivatives = {name: reference.signals[0].derivative(times) for name, reference in PERIODIC.items()}
    shown = predictions.GrowthIntervals(times, derivatives, edges, np.full(4, -30.0), np.arange(4) + 5.0)
    return predictions.growth_intervals({"ours": shown, "published": shown})


def draw_conservatism() -> Figure:
    counts = np.array([4.0, 8.0, 16.0])
    found = Conservatism(counts, 200 / np.sqrt(counts), counts, counts)
    return predictions.conservatism(found, {"unconstrained": 30.0, "exact form": 40.0})


def draw_tightness() -> Figure:
    bounds = np.array([0.05, 0.01, 0.002])
    found = {"alone": Tightness(bounds, 1 / bounds, 1 - bounds, 2 - bounds), "joint": Tightness(bounds, *3 * [bounds])}
    return references.tightness(found, "unconstrained", least=-1.0, noise_std=0.01)


FIGURES = [
    draw_periodic_prediction,
    draw_growth,
    draw_conservatism,
    draw_tightness,
    draw_tube,
    draw_asymptotic,
    draw_convergence,
    draw_prediction,
    draw_bare_prediction,
    draw_landscape,
    draw_margins,
]


if __name__ == "__main__":
    print(json.dumps({draw.__name__: sha256(figures.svg(draw())).hexdigest() for draw in FIGURES}))

"""Figures: the same bytes each time, axes that say what they show, and nothing that needs what may be missing."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path

import matplotlib as mpl
import matplotlib.style
import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline import figures
from pipeline.experiments import load_experiment
from pipeline.storage.results import Results
from tests.project import ROOT
from trackable import plots
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.posterior import Posterior
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.learning.constraint import Constraint
from trackable.learning.index_set import Steps
from trackable.learning.landscape import landscape
from trackable.learning.learned import Trace
from trackable.learning.problem import ConstrainedProblem
from trackable.learning.published.scalar import interval_sets, reachable_tube, scalar, state_and_input
from trackable.learning.space import SearchSpace
from trackable.learning.study import Conservatism
from trackable.plots.style import SHEETS
from trackable.systems.margins import margin_profile
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval

SYSTEM = scalar(0.9, 0.5, state_set=Interval(-2, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
STATE_SET, _ = interval_sets(SYSTEM)
SAMPLES = Samples(np.arange(7) / 10, np.array([-0.99306, -0.40789, -0.05, 0.0, 0.0, 0.0, 0.0]))
OPTIMA = {"unconstrained": (0.659325, 0.203472), "as_published": (0.701178, 0.219672), "sound": (0.702, 0.21990)}
STEPS = np.arange(151, dtype=float)
CONSTANT = np.minimum(np.sin(np.pi * np.minimum(STEPS, 25) / 50) - 1, 0)


def posterior(theta1: float, theta2: float) -> Posterior:
    return Posterior(Prior(SquaredExponential(theta1, theta2), 0.01), SAMPLES)


LEARNED = {name: Reference((posterior(*theta).signal,), SYSTEM) for name, theta in OPTIMA.items()}
PUBLISHED = plots.Published(
    STEPS,
    LEARNED["unconstrained"].state(STEPS)[:, 0],
    LEARNED["sound"].state(STEPS)[:, 0],
    *reachable_tube(LEARNED["sound"], LEARNED["sound"].instants(STEPS)),
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
    prior = JointPrior((Prior(SquaredExponential(0.7, 0.22), 0.01),))
    state, entry = state_and_input(SYSTEM)
    constraints = Constraint(state, Steps(0, 130, 0.01)), Constraint(entry, Steps(0, 129, 0.01))
    return ConstrainedProblem((SAMPLES,), prior, SearchSpace.around((SAMPLES,), prior), constraints)


def draw_tube() -> Figure:
    return plots.tube(LEARNED["sound"], np.arange(12))


def draw_asymptotic() -> Figure:
    return plots.asymptotic(LEARNED["sound"], SAMPLES, 25, 130, 200)


def draw_convergence() -> Figure:
    return plots.convergence(trace(), STATE_SET, 0.0)


def draw_prediction() -> Figure:
    return plots.prediction(
        SAMPLES, LEARNED, "sound", STEPS, true_reference=CONSTANT, published=PUBLISHED, final_step=130
    )


def draw_bare_prediction() -> Figure:
    return plots.prediction(SAMPLES, {"sound": LEARNED["sound"]}, "sound", STEPS)


def draw_landscape() -> Figure:
    grids = [landscape(problem(), np.geomspace(0.3, 2, 9), np.geomspace(0.1, 0.4, 9)) for _ in range(2)]
    return plots.landscape(grids, trace(), LEARNED)


def draw_margins() -> Figure:
    return plots.margins({name: [margin_profile(r, q, 150, 5) for q in r.quantities] for name, r in LEARNED.items()})


PERIODIC_PLANT = scalar(0.9, 0.1, state_set=Interval(-2, 2), input_set=Interval(-3, 1.4), sampling_time=0.01)
PERIODIC_SAMPLES = Samples(np.arange(21) / 5, np.sin(2 * np.arange(21) / 5))
PERIODIC = {
    name: Reference((Posterior(Prior(Periodic(*theta), 0.1), PERIODIC_SAMPLES).signal,), PERIODIC_PLANT)
    for name, theta in {"unconstrained": (2.0, 0.3, 3.1), "exact": (1.0, 1.0, 3.14), "intervals": (1, 2, 3.2)}.items()
}


def draw_periodic_prediction() -> Figure:
    truth = np.sin(2 * PERIODIC["exact"].instants(np.arange(401)))
    return plots.periodic_prediction(
        PERIODIC_SAMPLES, PERIODIC, "exact", np.arange(401.0), first_steps=50, true_reference=truth
    )


def draw_growth() -> Figure:
    times, edges = np.linspace(0, 4, 101), np.linspace(0, 4, 5)
    derivatives = {name: reference.signals[0].derivative(times) for name, reference in PERIODIC.items()}
    shown = plots.GrowthIntervals(times, derivatives, edges, np.full(4, -30.0), np.arange(4) + 5.0)
    return plots.growth_intervals({"ours": shown, "published": shown})


def draw_conservatism() -> Figure:
    counts = np.array([4.0, 8.0, 16.0])
    return plots.conservatism(Conservatism(counts, 200 / np.sqrt(counts), counts, counts), 40.0, 30.0)


FIGURES = [
    draw_periodic_prediction,
    draw_growth,
    draw_conservatism,
    draw_tube,
    draw_asymptotic,
    draw_convergence,
    draw_prediction,
    draw_bare_prediction,
    draw_landscape,
    draw_margins,
]


@cache
def drawn(draw: Callable[[], Figure]) -> Figure:
    return draw()


every_figure = pytest.mark.parametrize("draw", FIGURES, ids=lambda draw: draw.__name__.removeprefix("draw_"))


@cache
def digests_elsewhere() -> dict[str, str]:
    """What the figures are in another process, which orders sets in another way."""
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.trackable.test_plots"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, str] = json.loads(done.stdout)
    return found


@every_figure
def test_drawing_twice_gives_the_same_bytes(draw: Callable[[], Figure], tmp_path: Path) -> None:
    plots.save(drawn(draw), tmp_path / "once.svg")
    once = (tmp_path / "once.svg").read_bytes()
    assert sha256(once).hexdigest() == digests_elsewhere()[draw.__name__]
    assert once.startswith(b"<?xml")
    assert b"<text" not in once, "letters are paths, so that fonts do not matter"


def test_drawing_and_saving_twice_in_one_process_gives_the_same_bytes() -> None:
    once = plots.svg(drawn(draw_tube))
    assert once == plots.svg(drawn(draw_tube))
    assert once == plots.svg(draw_tube())


@every_figure
def test_every_axis_is_labelled_once(draw: Callable[[], Figure]) -> None:
    """The lowest panel of each column names x, the leftmost panel of each row names y; a unit belongs to each name."""
    axes = drawn(draw).axes
    for at_edge, label in (("is_last_row", "get_xlabel"), ("is_first_col", "get_ylabel")):
        named = [getattr(a, label)() for a in axes if getattr(a.get_subplotspec(), at_edge)()]
        assert named
        assert all("[" in name or "s)" in name or "s$)" in name for name in named), named


@every_figure
def test_nothing_is_cut_off_at_the_edge_of_the_page(draw: Callable[[], Figure]) -> None:
    figure = drawn(draw)
    with matplotlib.style.context(SHEETS):
        used, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(used.x0, used.y0, width - used.x1, height - used.y1) > -0.005


@pytest.mark.parametrize("name", LEARNED)
def test_all_of_a_prediction_is_in_sight(name: str) -> None:
    axes = plots.prediction(SAMPLES, LEARNED, name, STEPS).axes[0]
    x = LEARNED[name].state(STEPS)[:, 0]
    bottom, top = axes.get_ylim()
    assert bottom < min(x.min(), SAMPLES.values.min())
    assert max(x.max(), SAMPLES.values.max()) < top
    left, right = axes.get_xlim()
    assert left <= STEPS[0]
    assert right >= STEPS[-1]


@pytest.mark.parametrize("name", LEARNED)
def test_every_reference_can_be_drawn(name: str) -> None:
    assert plots.tube(LEARNED[name], np.arange(70, 80)).axes
    assert plots.asymptotic(LEARNED[name], SAMPLES, 60, 130, 200).axes


def test_a_closer_look_is_taken_only_where_a_reference_leaves_its_state_set() -> None:
    kept = {"sound": LEARNED["sound"]}
    assert len(plots.prediction(SAMPLES, kept, "sound", STEPS).axes) == 1
    both = plots.prediction(SAMPLES, LEARNED, "sound", STEPS)
    first, last = both.axes[1].get_xlim()
    assert first < 77
    assert last > 105


def test_the_first_step_at_which_each_test_holds_is_named() -> None:
    texts = [text.get_text() for axes in drawn(draw_convergence).axes for text in axes.texts]
    for test, k in ((r"$\zeta$-test", 81), ("rate test", 108), ("state test", 130)):
        assert any(test in text and f"= {k} " in text for text in texts)


def test_a_run_without_any_bounds_can_be_drawn() -> None:
    nothing = np.full(3, np.nan)
    early = replace(
        trace(),
        k_bar=np.arange(70.0, 73.0),
        hyperparameters={"signal_std": np.ones(3), "left.lengthscale": np.ones(3), "noise_std": np.ones(3)},
        mean_bound=nothing,
        growth_lower=nothing,
        growth_upper=nothing,
        derivative_bound=nothing,
        keeps_states=np.zeros(3),
        keeps_rates=np.zeros(3),
    )
    plots.svg(plots.convergence(early, STATE_SET, 0.0))


def test_the_worst_margins_are_written_out() -> None:
    profile = margin_profile(LEARNED["unconstrained"], state_and_input(SYSTEM)[0], 150, 5)
    labels = [text.get_text() for axes in drawn(draw_margins).axes for text in axes.get_legend().get_texts()]
    margin, time = profile.worst
    assert any(f"{margin:.3g}".replace("-", "−") in label and f"{time:.4g} s" in label for label in labels)


def test_the_sessions_own_style_neither_shows_nor_changes() -> None:
    expected = plots.svg(drawn(draw_tube))
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9}):
        assert plots.svg(draw_tube()) == expected
        assert mpl.rcParams["font.size"] == 30


def test_importing_touches_no_backend() -> None:
    code = "import sys, trackable.plots; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


if __name__ == "__main__":
    print(json.dumps({draw.__name__: sha256(plots.svg(draw())).hexdigest() for draw in FIGURES}))


def test_figures_of_an_earlier_run_do_not_stay(tmp_path, monkeypatch):
    """Where nothing is lost any more, say, there is no figure of how it was lost."""
    results = Results("example1", tmp_path)
    results.figures.mkdir(parents=True)
    results.figure("old").write_text("<svg/>")
    (results.figures / "notes.txt").write_text("mine")
    monkeypatch.setattr(figures, "drawings", lambda *_: {"new": lambda: Figure(figsize=(1, 1))})
    figures.figures(load_experiment("example1"), results)
    assert sorted(path.name for path in results.figures.iterdir()) == ["new.svg", "notes.txt"]

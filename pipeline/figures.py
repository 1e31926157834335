"""Stage 5: all results → figures, and the layout in which viewers show the logs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from pipeline.drawings import algorithm1, loops, predictions, references, style
from pipeline.experiments import Experiment
from pipeline.layout import layout_of
from pipeline.loops.trajectory import LOGGED, Courses, by_reference, read_loops
from pipeline.methods import (
    AS_PUBLISHED,
    EXACT,
    HYPERPARAMETERS,
    INTERVALS,
    JOINT,
    METHODS,
    ROBUST,
    SOUND,
    UNCONSTRAINED,
    methods_in_figures,
)
from pipeline.published.periodic import interval_growth_rates
from pipeline.published.scalar import interval_sets
from pipeline.storage.archive import Fitted, read_fit, topics_of
from pipeline.storage.logs import below
from pipeline.storage.results import Results, read_numbers
from pipeline.verify import margins_of
from trackably.arrays import Array
from trackably.checker.form import read_certificate
from trackably.control.error_set import ErrorSet
from trackably.exports import figures as curves
from trackably.files import read_json, write_json
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening

Drawings = dict[str, Callable[[], Figure]]
_POINTS = 1501
_STEPS_OF_TUBE = 12
_SCHEME, _POINTS_OF_SCHEME = 2.0, 301  # end of curves / time of the last sample, and number of points
_CURVE_POINTS = 1001


def figures(experiment: Experiment, results: Results) -> None:
    """Draw and save every figure of the experiment, and remove figures of an earlier run that are no longer drawn.

    The layout for viewers of the logs is written too.
    """
    drawn = drawings(experiment, results)
    for name, draw in tqdm(drawn.items(), desc=f"{experiment.name}: figures", disable=None):
        style.save(draw(), results.figure(name))
    for old in {*results.figures.glob("*.svg")} - {results.figure(name) for name in drawn}:
        old.unlink()
    write_json(results.layout, layout_of(experiment.plant, topics_of(results)))


def drawings(experiment: Experiment, results: Results) -> Drawings:
    """Return functions that draw the figures, by their names; the stage draws all of them.

    Raises as `read_fit` and `read_loops`.
    """
    of = _Figures(experiment, results, read_fit(results), read_loops(results, experiment.plant))
    return {**of.references(), **of.algorithm1(), **of.periodic(), **of.loops(), **of.disturbed()}


@dataclass(frozen=True)
class _Figures:
    """The data of an experiment's figures; each method returns, by name, functions that draw one kind of figures."""

    experiment: Experiment
    results: Results
    fitted: Fitted
    closed: Courses

    @cached_property
    def shown(self) -> dict[str, Reference]:
        """The references that figures of undisturbed results show, by the name of the method."""
        learned = self.fitted.learned
        return {method.name: learned[method.name].reference for method in methods_in_figures(learned)}

    @cached_property
    def with_curves(self) -> dict[str, Reference]:
        """The references in `shown` whose curves differ visibly from the other ones (`Method.has_own_curve`)."""
        return {name: reference for name, reference in self.shown.items() if METHODS[name].has_own_curve}

    @cached_property
    def counted(self) -> Any:
        """The metrics of the stage `control`."""
        return read_json(self.results.control)

    @property
    def last_step(self) -> int:
        return self.experiment.verified(self.fitted.sampled.samples).last_step

    def truth(self, times: Array) -> Array | None:
        """Return the ground truth of the first sampled name at `times` [s]; None if it is not known."""
        return next((truth(times) for truth in self.experiment.truths.values()), None)

    def references(self) -> Drawings:
        """Return the figures of references: margins, and states and inputs unless a figure of the paper shows them."""
        found: Drawings = {"margins": self._margins}
        if not {SOUND.name, EXACT.name} & {*self.fitted.traces, *self.fitted.learned}:
            found["tracking"] = self._tracking
        if self.experiment.truth:
            found["true-signal"] = self._true_signal
        if self.experiment.plane is not None:
            found["path"] = self._path
        if self.experiment.tightness:
            found["tightness"] = self._tightness
        return found

    def _margins(self) -> Figure:
        by_method = margins_of(self.experiment, self.fitted)
        return references.margins({name: by_method[name] for name in self.shown}, self.experiment.units)

    def _tightness(self) -> Figure:
        baseline = self.fitted.learned[UNCONSTRAINED.name]
        (part,) = baseline.prior.parts
        return references.tightness(self.counted["tightness"], baseline.method, baseline.nlml, float(part.noise_std))

    def _true_signal(self) -> Figure:
        """Draw the proved distance from true signals, of the robust reference if there is one."""
        name = ROBUST.name if ROBUST.name in self.fitted.learned else JOINT.name
        written = read_json(self.results.certificate(name))
        assert isinstance(written, Mapping), "the stage verify has written a certificate"
        reference, known = self.fitted.learned[name].reference, read_certificate(written).truth
        return references.true_signals(reference, known, self.fitted.sampled.by_name, self.experiment.units)

    def _path(self) -> Figure:
        plane = self.experiment.plane
        assert plane is not None, "drawn only where there is one"
        last = self.last_step * self.experiment.plant.sampling_time
        period = self.shown[JOINT.name].period
        times = np.linspace(0, last if period is None else min(period, last), _POINTS)
        truths, samples = self.experiment.truths, self.fitted.sampled.by_name
        known = (truths[plane[0]](times), truths[plane[1]](times)) if {*plane} <= truths.keys() else None
        sampled = [samples[name] for name in plane if name in samples]
        return references.path(self.shown, plane, times, sampled, known, self.experiment.units)

    def _tracking(self) -> Figure:
        times = np.linspace(0, self.last_step * self.experiment.plant.sampling_time, _POINTS)
        held_out, truths = self.fitted.sampled.held_out, self.experiment.truths
        observed = {
            name: references.Shown(
                samples, held_out=held_out.get(name), truth=truths[name](times) if name in truths else None
            )
            for name, samples in self.fitted.sampled.by_name.items()
        }
        return curves.tracking(self.shown, observed, times, partial(style.axis_label, units=self.experiment.units))

    def algorithm1(self) -> Drawings:
        """Return the figures of Algorithm 1, if there is a trace of the reading that its proof supports."""
        traces, learned, plant = self.fitted.traces, self.fitted.learned, self.experiment.plant
        if SOUND.name not in traces:
            return {}
        sound, samples = learned[SOUND.name], self.fitted.sampled.only
        final_step, last_sample = sound.final_step or 0, round(float(samples.times[-1]) / plant.sampling_time)
        (prior,) = sound.prior.parts
        found: Drawings = {
            "scheme": self._scheme,
            "tube": lambda: algorithm1.tube(sound.reference, np.arange(_STEPS_OF_TUBE, dtype=float)),
            "asymptotic": lambda: algorithm1.asymptotic(
                sound.reference, samples, last_sample, final_step, round(1.5 * final_step)
            ),
            "prediction": lambda: self._prediction(round(1.5 * final_step), final_step),
        }
        if AS_PUBLISHED.name in traces:
            printed = self.experiment.published.iterations
            found["convergence"] = lambda: algorithm1.convergence(
                traces[AS_PUBLISHED.name],
                sound.prior.learned,
                interval_sets(plant)[0],
                prior.mean,
                read_numbers(printed) if printed else None,
            )
        return found

    def _scheme(self) -> Figure:
        samples = self.fitted.sampled.only
        times = np.linspace(0, _SCHEME * float(samples.times[-1]), _POINTS_OF_SCHEME)
        return algorithm1.scheme(self.shown[JOINT.name], samples, times, self.truth(times))

    def _prediction(self, last_step: int, final_step: int | None = None) -> Figure:
        """Draw the references of a scalar system up to a step; a second panel shows some of the steps.

        These are the steps around those at which a reference leaves X, or without `final_step` the first ones.
        """
        published, steps = self.experiment.published.prediction, np.arange(last_step + 1.0)
        return predictions.prediction(
            self.fitted.sampled.only,
            self.with_curves if final_step is None else self.shown,
            HYPERPARAMETERS.name,
            steps,
            true_reference=self.truth(steps * self.experiment.plant.sampling_time),
            published=read_numbers(published) if published else None,
            final_step=final_step,
        )

    def periodic(self) -> Drawings:
        """Return the figures of periodic references, if one was learned at all phases."""
        learned = self.fitted.learned
        if EXACT.name not in learned:
            return {}
        wanted = self.experiment.periodic
        found: Drawings = {"prediction": lambda: self._prediction(wanted.last_step if wanted else self.last_step)}
        if INTERVALS.name in learned:
            found["growth"] = lambda: predictions.growth_intervals(self._growth())
        return found

    def _growth(self) -> dict[str, predictions.GrowthIntervals]:
        """Return derivatives and growth rates on the intervals of program (8), with published ones if there are any."""
        wanted, plant, published = self.experiment.periodic, self.experiment.plant, self.experiment.published
        assert wanted, "the method of these intervals needs it"
        end = wanted.last_step * plant.sampling_time
        times, edges = np.linspace(0, end, _CURVE_POINTS), np.linspace(0, end, wanted.intervals + 1)
        signals = {method: reference.kernel_sums[0] for method, reference in self.with_curves.items()}
        rates = interval_growth_rates(signals[INTERVALS.name], plant, tuple(edges.tolist()))
        derivatives = {method: signal.derivative(times) for method, signal in signals.items()}
        ours = predictions.GrowthIntervals(times, derivatives, edges, *rates)
        panels = {"ours (growth rates: those of the intervals)": ours}
        if published.derivative and published.growth_rates:
            columns, printed = read_numbers(published.derivative), read_numbers(published.growth_rates)
            panels["published"] = predictions.GrowthIntervals(
                columns["t"],
                {
                    "unconstrained": columns["derivative_unconstrained"],
                    "constrained (published)": columns["derivative_constrained"],
                },
                np.append(printed["interval_start"], printed["interval_end"][-1]),
                printed["growth_lower"],
                printed["growth_upper"],
            )
        return panels

    def loops(self) -> Drawings:
        """Return the figures of closed loops, and of references learned again."""
        experiment, closed = self.experiment, self.closed
        plant, wanted, units = experiment.plant, experiment.control, experiment.units
        courses, steps = by_reference(closed), experiment.loop_steps
        shown = steps.start + min(wanted.shown, LOGGED, len(steps))
        found: Drawings = {"closed-loop": lambda: loops.closed_loop(courses, plant, shown, units)}
        if "/online" in closed:
            found["relearning"] = lambda: loops.relearned(closed["/online"], closed["/offers"], plant, units)
        return found

    def disturbed(self) -> Drawings:
        """Return the figure of runs in the tube, if there are disturbances."""
        experiment, closed, tightening = self.experiment, self.closed, self.experiment.tightening
        if "/disturbed_range" not in closed or tightening is None:
            return {}
        runs, count = closed["/disturbed_range"], self.counted["disturbed"]["tube"]["runs"]
        window = self.fitted.learned[ROBUST.name].reference.window(int(runs.steps[0]), len(runs.steps))
        single, given = [*below(closed, "disturbed_runs").values()], tightening.given
        return {
            "tube-of-runs": lambda: loops.tube_runs(
                runs, single, count, window, room(tightening), given, experiment.units
            )
        }


def room(tightening: Tightening) -> tuple[Array, Array]:
    """Return how far states and inputs may be below and above a reference, each (n + m,), in float64."""
    Z = tightening.invariant
    assert Z is not None, "drawn only where there is a disturbance"
    n = Z.feedback.shape[1]
    rows = np.vstack([np.eye(n), Z.feedback])
    errors = ErrorSet.of(Z).support(np.stack([-rows, rows]))
    if (V := tightening.noise) is not None:  # measurement noise v: the true state is x = y − v
        errors[:, :n] += [V.support(rows[:n]), V.support(-rows[:n])]
    return errors[0], errors[1]

"""A user's program, as type checkers see it: `test_public.py` runs mypy --strict on it. Nothing here is executed."""

import sys
import warnings
from contextlib import suppress
from pathlib import Path
from typing import assert_type

import numpy as np
import numpy.typing as npt

from trackably import (
    BrokenLimit,
    BrokenLimits,
    BudgetExceeded,
    CertifiedReference,
    CertifiedTable,
    CertifiedTrajectory,
    Column,
    ConstrainedSystem,
    Controller,
    ConvexHull,
    Counterexample,
    CsvLayout,
    DoubtfulInputWarning,
    Failed,
    Field,
    FlatForm,
    Fleet,
    Gate,
    GateAnswer,
    IgnoresSamplesWarning,
    Impossible,
    Infeasible,
    InfeasibleTightening,
    InputError,
    Joints,
    JointTrajectory,
    Kernel,
    LinearSystem,
    Matern32,
    Matern52,
    Matern72,
    ModelError,
    NonlinearSystem,
    NoSignal,
    NotACertificate,
    NotTrackableError,
    Periodic,
    PiecewisePolynomial2,
    PiecewisePolynomial3,
    Plan,
    PolynomialPieces,
    Polytope,
    Product,
    Proved,
    RationalQuadratic,
    Recording,
    Refuted,
    RefutedTable,
    Relearner,
    Samples,
    Source,
    SquaredExponential,
    StreamReference,
    Sum,
    Table,
    TrackableReference,
    Truth,
    TubeController,
    Unchecked,
    Undecided,
    Unproved,
    Unsolved,
    Zonotope,
    certify,
    certify_joints,
    certify_table,
    check,
    kinematic_bicycle,
    learn_many,
    learn_reference,
    learn_stream,
    mobile_robot,
    parts_of_csv,
    parts_of_parquet,
    pendulum,
    read_csv,
    read_joint_trajectory,
    read_mcap,
    read_parquet,
    recordings_in,
    repair,
    repair_joints,
    simulate,
    stretch_joints,
    two_tanks,
    worst_plant,
    write_joint_trajectory,
)
from trackably import (
    tank as draining,
)
from trackably.checker import Contradicted

kernel = SquaredExponential(lengthscale=(0.1, 2.0))
assert_type(kernel.lengthscale, float)
assert_type(RationalQuadratic().shape + Periodic(period=2.0).period, float)
assert_type(PiecewisePolynomial2(lengthscale=2.0) * PiecewisePolynomial3(), Product)
assert_type(Matern32(1.0, 0.2) * Matern72() + Matern52(), Sum)
general: Kernel = kernel

assert_type(Samples([0.0, 1.0], [0.1, 0.2]).times, npt.NDArray[np.float64])
try:
    recording = read_csv("axis.csv", time="t", time_unit="s", signals={"position": Column("y")}, layout=CsvLayout())
except InputError as wrong:
    sys.exit(str(wrong))
assert_type(recording, Recording)
assert_type(read_mcap("axis.mcap", {"position": Field("/axis", "position")}).samples("position"), Samples)

axis = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.01, states=("position", "velocity"))
tank = NonlinearSystem.of(lambda x, u: [x[0] + u[0]], ["level"], ["inflow"], 5.0)
for system in (mobile_robot(0.1), kinematic_bicycle(0.1, wheelbase=2.7), two_tanks(1.0), pendulum(0.05), draining(1.0)):
    assert_type(system, NonlinearSystem)
chain = FlatForm.of(lambda z: ([z[0][0], z[1][0] - z[0][0]], [z[2][0] - 2 * z[1][0] + z[0][0]]), outputs=1)
NonlinearSystem.of(lambda x, u: [x[0] + x[1], x[1] + u[0]], ["x", "v"], ["a"], 1.0, flat=chain)
plant = ConstrainedSystem(axis, Polytope.box([-1.0, -1.0], [1.0, 1.0]), Polytope.box([-1.0], [1.0]))

try:
    reference = learn_reference(recording.samples("position"), plant, kernel, "all_times", noise_std=(0.01, 0.1))
    assert_type(reference, TrackableReference)
    assert_type(reference([0.0, 1.0]), npt.NDArray[np.float64])
    assert_type(reference.to_csv("r.csv", units={"position": "m"}), Path)
    assert_type(reference.to_ros2("r.mcap", {"slide": {"positions": "position"}}), Path)
    assert_type([bound.multiplier for bound in reference.active_bounds], list[float])
except NotTrackableError as error:
    assert_type(error.outcome.explanation, str)
    if isinstance(error.outcome, Impossible):
        assert_type(error.outcome.missing, float)
    if isinstance(error.outcome, InfeasibleTightening):
        assert_type(error.outcome.tightening.margin, float)
pushed, cut = Zonotope.box([0, -0.1], [0, 0.1]), ConvexHull([[0.1, 0], [-0.1, 0.1], [0, -0.1]])
learn_reference(Samples([0], [0]), plant, kernel, (0, 9), at={6.0: "rest"}, disturbance=cut, measurement_noise=pushed)
assert_type(learn_stream(Samples([0], [0]), plant, kernel, "all_times", window=20.0), StreamReference)
soon = TrackableReference.load("reference.json", seconds=1.0)
assert_type(soon, TrackableReference | Unchecked[TrackableReference])
several = recordings_in("measured/*.csv", lambda path: read_csv(path, "t", "s", {"position": "y"}))
fleet = learn_many(several, plant, kernel, "recorded", folder="learned", workers=2, noise_std=0.01)
assert_type(fleet, Fleet)
assert_type(fleet.reference("axis"), TrackableReference)
assert_type(learn_many(several, plant, kernel, "recorded", folder="l", learn=learn_stream).stream("a"), StreamReference)
for parts_of in (parts_of_csv, parts_of_parquet):
    assert_type(parts_of("all.parquet", "name", "t", "s", {"position": "y"}), tuple[Source, ...])
read_parquet("axis.parquet", "t", "ISO 8601", {"position": Column("y")})
curve = PolynomialPieces([0, 1, 2], [[0, 0.1], [0.1, 0]], "rest")
certified = certify({"position": curve}, plant, "all_times")
assert_type(certified, CertifiedReference | Counterexample | Unproved)
if isinstance(certified, CertifiedReference):
    assert_type(certified.off["position"], float)
repaired = repair(curve, plant, "all_times")
if isinstance(repaired, CertifiedReference) and repaired.moved is not None:
    assert_type(repaired.moved["position"].rms, float)
at_steps = certify_table(Table([[0.0, 0.0], [0.0, 0.1]], [[1.0]]), plant, tolerance=1e-3)
assert_type(at_steps, CertifiedTable | RefutedTable | Unproved)
arm = Joints(
    position={"elbow": (-2, 2)}, velocity=1.0, jerk={"elbow": 40}, continuous=["wrist"], names=["elbow", "wrist"]
)
assert_type(arm.plant(0.01), ConstrainedSystem)
Joints.from_urdf("arm.urdf", acceleration=4.0)
moves = JointTrajectory.through([0.0, 1.0], [[0.0, 0.0], [0.1, 0.2]], names=arm.names)
assert_type(write_joint_trajectory(read_joint_trajectory("moves.yaml"), "moves.mcap"), Path)
assert_type(repair_joints(moves, arm, start=[[0.0, 0.0]]), CertifiedTrajectory | Unproved)
for moved in (certify_joints(moves, arm), stretch_joints(moves, arm)):
    assert_type(moved, CertifiedTrajectory | BrokenLimits | Unproved)
    if isinstance(moved, BrokenLimits):
        assert_type(moved.first, BrokenLimit)
gate = Gate(arm, lead=0.02)
answered = gate(moves, gate.at_rest([0.0, 0.0], now=0.0), now=0.1)
assert_type(answered, GateAnswer)
near = learn_reference(
    {"position": recording.samples("position")},
    plant,
    kernel,
    (0.0, 1.0),
    truth={"position": Truth(0.002, second_derivative=0.5, rate="velocity", rate_noise=0.1)},
)
drift = np.eye(2)
hull = ModelError.of([(drift, [[0.0], [0.09]]), (drift, [[0.0], [0.11]])])
assert_type(ModelError.intervals(LinearSystem.scalar(1, 1, sampling_time=1), {("state", "input"): (0, 2)}), ModelError)
assert_type(worst_plant(near, plant, hull, [[-1, -1]], 100).violation, float)
assert_type(near.accuracy("position").error, float)
with suppress(NotTrackableError):
    learn_reference(recording.samples("position"), plant, kernel, (0, 1), truth=Truth(noise=0.002, slope=1))
assert_type(NoSignal("position", 0.1, (), {}, "slope", 0.1).growth, float)
warnings.simplefilter("error", IgnoresSamplesWarning)
warnings.simplefilter("ignore", DoubtfulInputWarning)

controller = Controller(plant, 10, [[1, 0], [0, 1]], [[0.1]])
assert_type(controller.step(0, [0.0, 0.0], reference.reference), Plan | Infeasible | Unsolved)
simulate(controller, reference.reference, [0, 0], 100)
if reference.tightening is not None:
    tube = TubeController(reference.tightening, 10)
    assert_type(tube.step(0, np.zeros(2), reference), Plan | Infeasible | Unsolved)
    simulate(tube, reference, np.zeros(2), 100, disturbances=lambda k, successor: 0.01 * successor)
relearn = Relearner(reference, budget=0.05, moving_every=10)
answer = relearn(recording.samples("position"))
if isinstance(answer, TrackableReference):
    assert_type(relearn.step(controller, 0, np.zeros(2)), Plan | Infeasible | Unsolved)
else:
    assert_type(answer.explanation, str)
    assert_type(answer.seconds if isinstance(answer, BudgetExceeded) else 0.0, float)
verdict = check(Path("proof.json"), seconds=9.0)
assert_type(verdict, Proved | Refuted | Contradicted | Failed | NotACertificate | Undecided)

# What is wrong is found: without the mistake, mypy complains of the comment.
SquaredExponential("long")  # type: ignore[arg-type]
LinearSystem(np.eye(1), np.eye(1), sampling_time="0.1")  # type: ignore[arg-type]
learn_reference(recording.samples("position"), plant, kernel, "for ever")  # type: ignore[arg-type]
kernel + 1.0  # type: ignore[operator]
print(reference.wieght)  # type: ignore[attr-defined]

"""Trackably: learn a reference from noisy samples, and guarantee that the controlled system can follow it.

The public names, by task:

- samples: `Samples`, or recordings by `read_csv`, `read_mcap` and `read_parquet`
- the plant: a `ConstrainedSystem` of a `LinearSystem` or a `NonlinearSystem`, and of sets such as `Polytope.box`
- the prior: kernels such as `SquaredExponential` and `Periodic`, which add and multiply
- learning with a proof: `learn_reference`, `learn_stream` for long recordings, `learn_many` for many of them
- what is known of the true signal: `Truth`, which learning takes
- trajectories from elsewhere: `certify`, `repair`, `certify_table`
- trajectories of robots: `Joints`, `JointTrajectory`, `certify_joints`, `repair_joints`, `stretch_joints`, `Gate`
- a plant that is not known exactly: `ModelError`, and `worst_plant` to search for one that breaks a bound
- proofs that others hand over: `check`
- control: `Controller`, `TubeController`, `simulate`, and `Relearner` to learn in the loop

A name is loaded when it is first used. If a package is missing, the error names the extra that installs it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trackably.certificates.judge import NotTrackableError as NotTrackableError
    from trackably.certificates.outcome import Counterexample as Counterexample
    from trackably.certificates.outcome import Impossible as Impossible
    from trackably.certificates.outcome import InfeasibleTightening as InfeasibleTightening
    from trackably.certificates.outcome import NoSignal as NoSignal
    from trackably.certificates.outcome import Unproved as Unproved
    from trackably.checker import Failed as Failed
    from trackably.checker import NotACertificate as NotACertificate
    from trackably.checker import Proved as Proved
    from trackably.checker import Refuted as Refuted
    from trackably.checker import Undecided as Undecided
    from trackably.checking import check as check
    from trackably.control.controller import Controller as Controller
    from trackably.control.simulation import simulate as simulate
    from trackably.control.simulation import worst_plant as worst_plant
    from trackably.control.stepping import Infeasible as Infeasible
    from trackably.control.stepping import Plan as Plan
    from trackably.control.stepping import Unsolved as Unsolved
    from trackably.control.tube import TubeController as TubeController
    from trackably.errors import DoubtfulInputWarning as DoubtfulInputWarning
    from trackably.errors import InputError as InputError
    from trackably.fleet.learn_many import Fleet as Fleet
    from trackably.fleet.learn_many import learn_many as learn_many
    from trackably.fleet.sources import Source as Source
    from trackably.fleet.sources import parts_of_csv as parts_of_csv
    from trackably.fleet.sources import parts_of_parquet as parts_of_parquet
    from trackably.fleet.sources import recordings_in as recordings_in
    from trackably.fleet.sources import topics_of as topics_of
    from trackably.given.certify import CertifiedReference as CertifiedReference
    from trackably.given.certify import certify as certify
    from trackably.given.repair import repair as repair
    from trackably.given.table import CertifiedTable as CertifiedTable
    from trackably.given.table import RefutedTable as RefutedTable
    from trackably.given.table import Table as Table
    from trackably.given.table import certify_table as certify_table
    from trackably.gp.kernels.base import Kernel as Kernel
    from trackably.gp.kernels.base import Product as Product
    from trackably.gp.kernels.base import Sum as Sum
    from trackably.gp.kernels.matern import Matern32 as Matern32
    from trackably.gp.kernels.matern import Matern52 as Matern52
    from trackably.gp.kernels.matern import Matern72 as Matern72
    from trackably.gp.kernels.periodic import Periodic as Periodic
    from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2 as PiecewisePolynomial2
    from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial3 as PiecewisePolynomial3
    from trackably.gp.kernels.rational_quadratic import RationalQuadratic as RationalQuadratic
    from trackably.gp.kernels.squared_exponential import SquaredExponential as SquaredExponential
    from trackably.gp.samples import Samples as Samples
    from trackably.joints.certify import BrokenLimit as BrokenLimit
    from trackably.joints.certify import BrokenLimits as BrokenLimits
    from trackably.joints.certify import CertifiedTrajectory as CertifiedTrajectory
    from trackably.joints.certify import certify_joints as certify_joints
    from trackably.joints.certify import stretch_joints as stretch_joints
    from trackably.joints.gate import Gate as Gate
    from trackably.joints.gate import GateAnswer as GateAnswer
    from trackably.joints.limits import Joints as Joints
    from trackably.joints.messages import read_joint_trajectory as read_joint_trajectory
    from trackably.joints.messages import write_joint_trajectory as write_joint_trajectory
    from trackably.joints.repair import repair_joints as repair_joints
    from trackably.joints.trajectory import JointTrajectory as JointTrajectory
    from trackably.recordings.csv_file import CsvLayout as CsvLayout
    from trackably.recordings.csv_file import read_csv as read_csv
    from trackably.recordings.mcap_file import Field as Field
    from trackably.recordings.mcap_file import read_mcap as read_mcap
    from trackably.recordings.parquet_file import read_parquet as read_parquet
    from trackably.recordings.recording import Recording as Recording
    from trackably.recordings.tables import Column as Column
    from trackably.reference.explanation import IgnoresSamplesWarning as IgnoresSamplesWarning
    from trackably.reference.learn import learn_reference as learn_reference
    from trackably.reference.saved import Unchecked as Unchecked
    from trackably.reference.trackable import TrackableReference as TrackableReference
    from trackably.reference.truth import Truth as Truth
    from trackably.streams.learn import learn_stream as learn_stream
    from trackably.streams.reference import StreamReference as StreamReference
    from trackably.streams.relearner import BudgetExceeded as BudgetExceeded
    from trackably.streams.relearner import Relearner as Relearner
    from trackably.systems.constrained import ConstrainedSystem as ConstrainedSystem
    from trackably.systems.disturbances import ConvexHull as ConvexHull
    from trackably.systems.disturbances import ModelError as ModelError
    from trackably.systems.disturbances import Zonotope as Zonotope
    from trackably.systems.flat_forms import FlatForm as FlatForm
    from trackably.systems.library import kinematic_bicycle as kinematic_bicycle
    from trackably.systems.library import mobile_robot as mobile_robot
    from trackably.systems.library import pendulum as pendulum
    from trackably.systems.library import tank as tank
    from trackably.systems.library import two_tanks as two_tanks
    from trackably.systems.linear import LinearSystem as LinearSystem
    from trackably.systems.nonlinear import NonlinearSystem as NonlinearSystem
    from trackably.systems.pieces import PolynomialPieces as PolynomialPieces
    from trackably.systems.polytopes import Polytope as Polytope

__version__ = "0.2.0"

_MODULES = {
    "BrokenLimit": "joints.certify",
    "BrokenLimits": "joints.certify",
    "BudgetExceeded": "streams.relearner",
    "CertifiedReference": "given.certify",
    "CertifiedTable": "given.table",
    "CertifiedTrajectory": "joints.certify",
    "Column": "recordings.tables",
    "ConstrainedSystem": "systems.constrained",
    "Controller": "control.controller",
    "ConvexHull": "systems.disturbances",
    "Counterexample": "certificates.outcome",
    "CsvLayout": "recordings.csv_file",
    "DoubtfulInputWarning": "errors",
    "Failed": "checker",
    "Field": "recordings.mcap_file",
    "FlatForm": "systems.flat_forms",
    "Fleet": "fleet.learn_many",
    "Gate": "joints.gate",
    "GateAnswer": "joints.gate",
    "IgnoresSamplesWarning": "reference.explanation",
    "Impossible": "certificates.outcome",
    "Infeasible": "control.stepping",
    "InfeasibleTightening": "certificates.outcome",
    "InputError": "errors",
    "JointTrajectory": "joints.trajectory",
    "Joints": "joints.limits",
    "Kernel": "gp.kernels.base",
    "LinearSystem": "systems.linear",
    "Matern32": "gp.kernels.matern",
    "Matern52": "gp.kernels.matern",
    "Matern72": "gp.kernels.matern",
    "ModelError": "systems.disturbances",
    "NoSignal": "certificates.outcome",
    "NonlinearSystem": "systems.nonlinear",
    "NotACertificate": "checker",
    "NotTrackableError": "certificates.judge",
    "Periodic": "gp.kernels.periodic",
    "PiecewisePolynomial2": "gp.kernels.piecewise_polynomial",
    "PiecewisePolynomial3": "gp.kernels.piecewise_polynomial",
    "Plan": "control.stepping",
    "PolynomialPieces": "systems.pieces",
    "Polytope": "systems.polytopes",
    "Product": "gp.kernels.base",
    "Proved": "checker",
    "RationalQuadratic": "gp.kernels.rational_quadratic",
    "Recording": "recordings.recording",
    "Refuted": "checker",
    "RefutedTable": "given.table",
    "Relearner": "streams.relearner",
    "Samples": "gp.samples",
    "Source": "fleet.sources",
    "SquaredExponential": "gp.kernels.squared_exponential",
    "StreamReference": "streams.reference",
    "Sum": "gp.kernels.base",
    "Table": "given.table",
    "TrackableReference": "reference.trackable",
    "Truth": "reference.truth",
    "TubeController": "control.tube",
    "Undecided": "checker",
    "Unchecked": "reference.saved",
    "Unproved": "certificates.outcome",
    "Unsolved": "control.stepping",
    "Zonotope": "systems.disturbances",
    "certify": "given.certify",
    "certify_joints": "joints.certify",
    "certify_table": "given.table",
    "check": "checking",
    "kinematic_bicycle": "systems.library",
    "learn_many": "fleet.learn_many",
    "learn_reference": "reference.learn",
    "learn_stream": "streams.learn",
    "mobile_robot": "systems.library",
    "parts_of_csv": "fleet.sources",
    "parts_of_parquet": "fleet.sources",
    "pendulum": "systems.library",
    "read_csv": "recordings.csv_file",
    "read_joint_trajectory": "joints.messages",
    "read_mcap": "recordings.mcap_file",
    "read_parquet": "recordings.parquet_file",
    "recordings_in": "fleet.sources",
    "repair": "given.repair",
    "repair_joints": "joints.repair",
    "simulate": "control.simulation",
    "stretch_joints": "joints.certify",
    "tank": "systems.library",
    "topics_of": "fleet.sources",
    "two_tanks": "systems.library",
    "worst_plant": "control.simulation",
    "write_joint_trajectory": "joints.messages",
}
"""The module of each public name. A test compares this table with the imports above, which only type checkers see."""

__all__ = [*_MODULES]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from trackably.extras import optional  # noqa: PLC0415  a bundle of the checker lacks this module

    with optional(name):
        value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

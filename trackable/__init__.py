"""Trackable: learn a reference from noisy samples, and guarantee that the controlled system can follow it.

All that a notebook or a program needs is imported from here:

- samples: `Samples`, or recordings by `read_csv`, `read_mcap` and `read_parquet`
- the plant: a `ConstrainedSystem` of a `LinearSystem` or a `NonlinearSystem`, and of sets such as `Polytope.box`
- the prior: kernels such as `SquaredExponential` and `Periodic`, which add and multiply
- learning with a proof: `learn_reference`, `learn_stream` for long recordings, `learn_many` for many of them
- trajectories from elsewhere: `certify`, `repair`, `certify_table`
- proofs of others: `check`
- control: `Controller`, `TubeController`, `simulate`, and `Relearner` to learn in the loop

A name is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trackable.certificates.judge import NotTrackableError as NotTrackableError
    from trackable.certificates.outcome import Counterexample as Counterexample
    from trackable.certificates.outcome import Unproved as Unproved
    from trackable.checker import Failed as Failed
    from trackable.checker import NotACertificate as NotACertificate
    from trackable.checker import Proved as Proved
    from trackable.checker import Refuted as Refuted
    from trackable.checker import Undecided as Undecided
    from trackable.checking import check as check
    from trackable.control.controller import Controller as Controller
    from trackable.control.simulation import simulate as simulate
    from trackable.control.step.result import Infeasible as Infeasible
    from trackable.control.step.result import Plan as Plan
    from trackable.control.step.result import Unsolved as Unsolved
    from trackable.control.tube.controller import TubeController as TubeController
    from trackable.control.windows import Late as Late
    from trackable.errors import DoubtfulInputWarning as DoubtfulInputWarning
    from trackable.errors import InputError as InputError
    from trackable.explanation import IgnoresSamplesWarning as IgnoresSamplesWarning
    from trackable.feasibility.impossible import Impossible as Impossible
    from trackable.feasibility.impossible import InfeasibleTightening as InfeasibleTightening
    from trackable.fleet.learn_many import Fleet as Fleet
    from trackable.fleet.learn_many import learn_many as learn_many
    from trackable.fleet.parts import parts_of_csv as parts_of_csv
    from trackable.fleet.parts import parts_of_parquet as parts_of_parquet
    from trackable.fleet.parts import topics_of as topics_of
    from trackable.fleet.sources import Source as Source
    from trackable.fleet.sources import recordings_in as recordings_in
    from trackable.given.certified import CertifiedReference as CertifiedReference
    from trackable.given.certify import certify as certify
    from trackable.given.repair import repair as repair
    from trackable.given.table import CertifiedTable as CertifiedTable
    from trackable.given.table import RefutedTable as RefutedTable
    from trackable.given.table import Table as Table
    from trackable.given.table_proof import certify_table as certify_table
    from trackable.gp.kernels.base import Kernel as Kernel
    from trackable.gp.kernels.base import Product as Product
    from trackable.gp.kernels.base import Sum as Sum
    from trackable.gp.kernels.matern import Matern32 as Matern32
    from trackable.gp.kernels.matern import Matern52 as Matern52
    from trackable.gp.kernels.periodic import Periodic as Periodic
    from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2 as PiecewisePolynomial2
    from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial3 as PiecewisePolynomial3
    from trackable.gp.kernels.rational_quadratic import RationalQuadratic as RationalQuadratic
    from trackable.gp.kernels.squared_exponential import SquaredExponential as SquaredExponential
    from trackable.gp.samples import Samples as Samples
    from trackable.learn import learn_reference as learn_reference
    from trackable.recordings.csv_files.reader import read_csv as read_csv
    from trackable.recordings.csv_files.reading import Column as Column
    from trackable.recordings.csv_files.table import CsvLayout as CsvLayout
    from trackable.recordings.mcap_files.reader import Field as Field
    from trackable.recordings.mcap_files.reader import read_mcap as read_mcap
    from trackable.recordings.parquet_files.reader import read_parquet as read_parquet
    from trackable.recordings.recording import Recording as Recording
    from trackable.reference import TrackableReference as TrackableReference
    from trackable.streams.learn import learn_stream as learn_stream
    from trackable.streams.reference import StreamReference as StreamReference
    from trackable.streams.relearner import Relearner as Relearner
    from trackable.systems.constrained import ConstrainedSystem as ConstrainedSystem
    from trackable.systems.disturbance.hull import ConvexHull as ConvexHull
    from trackable.systems.disturbance.zonotope import Zonotope as Zonotope
    from trackable.systems.flat.form import FlatForm as FlatForm
    from trackable.systems.library import kinematic_bicycle as kinematic_bicycle
    from trackable.systems.library import mobile_robot as mobile_robot
    from trackable.systems.library import pendulum as pendulum
    from trackable.systems.library import tank as tank
    from trackable.systems.library import two_tanks as two_tanks
    from trackable.systems.linear import LinearSystem as LinearSystem
    from trackable.systems.nonlinear import NonlinearSystem as NonlinearSystem
    from trackable.systems.sets.polytope import Polytope as Polytope
    from trackable.systems.signals.pieces import PolynomialPieces as PolynomialPieces

_MODULES = {
    "CertifiedReference": "given.certified",
    "CertifiedTable": "given.table",
    "Column": "recordings.csv_files.reading",
    "ConstrainedSystem": "systems.constrained",
    "Controller": "control.controller",
    "ConvexHull": "systems.disturbance.hull",
    "Counterexample": "certificates.outcome",
    "CsvLayout": "recordings.csv_files.table",
    "DoubtfulInputWarning": "errors",
    "Failed": "checker",
    "Field": "recordings.mcap_files.reader",
    "FlatForm": "systems.flat.form",
    "Fleet": "fleet.learn_many",
    "IgnoresSamplesWarning": "explanation",
    "Impossible": "feasibility.impossible",
    "Infeasible": "control.step.result",
    "InfeasibleTightening": "feasibility.impossible",
    "InputError": "errors",
    "Kernel": "gp.kernels.base",
    "Late": "control.windows",
    "LinearSystem": "systems.linear",
    "Matern32": "gp.kernels.matern",
    "Matern52": "gp.kernels.matern",
    "NonlinearSystem": "systems.nonlinear",
    "NotACertificate": "checker",
    "NotTrackableError": "certificates.judge",
    "Periodic": "gp.kernels.periodic",
    "PiecewisePolynomial2": "gp.kernels.piecewise_polynomial",
    "PiecewisePolynomial3": "gp.kernels.piecewise_polynomial",
    "Plan": "control.step.result",
    "PolynomialPieces": "systems.signals.pieces",
    "Polytope": "systems.sets.polytope",
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
    "TrackableReference": "reference",
    "TubeController": "control.tube.controller",
    "Undecided": "checker",
    "Unproved": "certificates.outcome",
    "Unsolved": "control.step.result",
    "Zonotope": "systems.disturbance.zonotope",
    "certify": "given.certify",
    "certify_table": "given.table_proof",
    "check": "checking",
    "kinematic_bicycle": "systems.library",
    "learn_many": "fleet.learn_many",
    "learn_reference": "learn",
    "learn_stream": "streams.learn",
    "mobile_robot": "systems.library",
    "parts_of_csv": "fleet.parts",
    "parts_of_parquet": "fleet.parts",
    "pendulum": "systems.library",
    "read_csv": "recordings.csv_files.reader",
    "read_mcap": "recordings.mcap_files.reader",
    "read_parquet": "recordings.parquet_files.reader",
    "recordings_in": "fleet.sources",
    "repair": "given.repair",
    "simulate": "control.simulation",
    "tank": "systems.library",
    "topics_of": "fleet.parts",
    "two_tanks": "systems.library",
}
"""The module of each public name. A test compares this table with the imports above, which only type checkers see."""

__all__ = [*_MODULES]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)

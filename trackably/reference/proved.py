"""A reference with its proof, however it was found: states and inputs at proved times, and the proof as a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import as_subject
from trackably.certificates.judge import found_or_raise, judge
from trackably.checker.floats.boxes import FIRST_PASS
from trackably.checker.statement import identity
from trackably.exports.proved import proved_times
from trackably.files import new_file, path_of, save_accepted, write_text
from trackably.gp.samples import Samples
from trackably.systems.reference import Reference, Window

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trackably.exports.acados import SlidingReferences
    from trackably.exports.control import FlatTrajectory
    from trackably.exports.do_mpc import TimeVarying
    from trackably.exports.ros2 import Joints
    from trackably.exports.table import Units


class Values(NamedTuple):
    """States x_r(t), shape (*t.shape, n), and inputs u_r(t), shape (*t.shape, m), in the units of the system."""

    states: Array
    inputs: Array


class ProvedReference(ABC):
    """A `reference` with its proof: the system can follow it at all times that `certificate` claims.

    `pin_certificates` prove required values at single times. Steps that are not proved are refused with a ValueError,
    and so are steps at |t| > `certificate.last_time`; `reference` has values there too, but without guarantee.

    Times are seconds, in any array, list or pandas Series. Modules of exports are loaded when they are first needed.
    """

    certificate: Certificate
    pin_certificates: tuple[Certificate, ...] = ()

    def __post_init__(self) -> None:
        """Let the checker judge the certificates.

        NotTrackableError: the checker refuses one. ValueError: a certificate is about another reference.
        """
        for certificate in (self.certificate, *self.pin_certificates):
            found_or_raise(judge(certificate))
            of = certificate.reference
            if of is not self.reference and as_subject(of).fingerprint != self.fingerprint:
                raise ValueError("certificate: expected one about this reference, got one about another reference")

    @property
    @abstractmethod
    def reference(self) -> Reference:
        """The reference itself, with values at all times."""

    @property
    @abstractmethod
    def explanation(self) -> str:
        """The proved statement as a sentence, and what else is known about the reference."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.explanation}; {self.identity})"

    def state(self, k: Array | int) -> Array:
        """Return x_r(k) at steps k of any shape: (*k.shape, n). ValueError: a step is not proved."""
        self._require_proved(k)
        return self.reference.state(k)

    def input(self, k: Array | int) -> Array:
        """Return u_r(k), which moves the state from x_r(k) to x_r(k + 1): shape (*k.shape, m).

        ValueError as for states.
        """
        self._require_proved(k)
        return self.reference.input(k)

    def window(self, k: int, horizon: int) -> Window:
        """Return states k … k + `horizon` and the inputs between them, for a predictive controller at step k.

        ValueError: a step is not proved, or the horizon is below one step. TypeError: the horizon is no whole number.
        """
        self._require_proved(np.array([whole("window: k", k), k + whole("window: horizon", horizon, least=1)]))
        return self.reference.window(k, horizon)

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of the data that define states and inputs; the checker prints it for each certificate of them."""
        return as_subject(self.reference).fingerprint

    @property
    def identity(self) -> str:
        """The reference's identity as the checker prints it: SHA-256, kernels or pieces with their times, first states.

        Kernels with the weight 0 do not count.
        """
        return identity(as_subject(self.reference), FIRST_PASS)

    def save_certificate(self, path: Path | str) -> tuple[Path, ...]:
        """Write the proof alone, for `python -m trackably check FILE`; return the files. Raises OSError.

        Certificates of required values are written beside it: proof.at1.json, proof.at2.json, … for proof.json.
        """
        file = path_of("save_certificate", path)
        beside = [file.with_suffix(f".at{i + 1}{file.suffix}") for i in range(len(self.pin_certificates))]
        every = zip((self.certificate, *self.pin_certificates), (file, *beside), strict=True)
        return tuple(save_accepted("save_certificate", certificate, path) for certificate, path in every)

    def _require_proved(self, k: Array | int) -> None:
        proved_times(self, self.reference.instants(numbers("steps", k)), k)

    # Evaluation at times, and exports in the conventions of common tools.

    @property
    def sampled(self) -> Mapping[str, Samples]:
        """The samples that the reference was learned from, by the name of the state; empty if it was not learned."""
        return {}

    def __call__(self, t: ArrayLike) -> Array:
        """Return the states x_r(t) at times t [s]: shape (*t.shape, n), and (n,) for one number."""
        return self.reference.state_at(proved_times(self, t))

    def eval(self, times: ArrayLike) -> Values:
        """Return states and inputs at times t [s]: shapes (*t.shape, n) and (*t.shape, m).

        The input u_r(t), held for one sampling time T_s, moves the state from x_r(t) to x_r(t + T_s).
        """
        t = proved_times(self, times)
        return Values(self.reference.state_at(t), self.reference.input_at(t))

    def plot(self, start: float | None = None, end: float | None = None) -> Figure:
        """Draw states and inputs between their bounds from `start` to `end` [s], and the samples if there are any.

        By default these are the first and the last proved time. If all times are proved, the default is one period, or
        the time until the reference has settled, but at most twice the time of its last kernel or polynomial piece.
        ValueError: a time is not proved. MissingExtra: matplotlib is not installed.
        """
        from trackably.exports.proved import figure  # noqa: PLC0415

        return figure(self, start, end)

    def _repr_html_(self) -> str:
        from trackably.exports.proved import html  # noqa: PLC0415  loaded for notebooks only

        return html(self)

    def to_do_mpc(self, controller: Any, start: float = 0.0) -> TimeVarying:
        """Return the `tvp_fun` of a do-mpc controller or simulator: states and inputs over its horizon.

        The model declares the parameters that it needs, for example by set_variable('_tvp', 'position_ref'): they are
        named after states and inputs, with _ref. The controller's time zero is `start` [s] of the reference. Stage j at
        time t holds x_r and u_r at t + j T_s.

        ValueError: the controller's t_step is not T_s, or no parameter is declared. The returned function raises
        ValueError if the horizon reaches times that are not proved.
        """
        from trackably.exports.do_mpc import tvp_function  # noqa: PLC0415

        return tvp_function(self, controller, start)

    def to_acados(self, horizon: int) -> SlidingReferences:
        """Return the references of an acados solver with N = `horizon` stages of T_s each.

        `.at(k)` returns the arrays yref (N, n + m) and yref_e (n,) at step k, and `.set_in(solver, k)` sets them in a
        solver. If a state is a heading, pass the plant's state too: whole turns are then added to bring the heading
        near that of the plant.
        """
        from trackably.exports.acados import SlidingReferences  # noqa: PLC0415

        return SlidingReferences(self, whole("to_acados: horizon", horizon, least=1))

    def to_control(self) -> FlatTrajectory:
        """Return the reference as a trajectory of a flat system in python-control, with its method `.eval(times)`.

        It returns states (n, N) and inputs (m, N): one row for each, and one column for each of N times [s].
        """
        from trackably.exports.control import FlatTrajectory  # noqa: PLC0415

        return FlatTrajectory(self)

    def to_csv(
        self, path: Path | str, first: int | None = None, count: int | None = None, units: Units | None = None
    ) -> Path:
        """Write time, states and inputs at `count` steps from `first` on as a CSV file; return its path.

        By default these are the steps that `plot` shows. `units` by name go into the header, for example {'position':
        'm'}. Reading the numbers gives the same float64 again. Raises OSError, and ValueError for steps that are not
        proved.
        """
        from trackably.exports.table import write_csv  # noqa: PLC0415

        return write_csv(self, path, first, count, units)

    def to_parquet(
        self, path: Path | str, first: int | None = None, count: int | None = None, units: Units | None = None
    ) -> Path:
        """Write the table of `to_csv` as a Parquet file. MissingExtra: pyarrow is not installed."""
        from trackably.exports.table import write_parquet  # noqa: PLC0415

        return write_parquet(self, path, first, count, units)

    def to_ros2(
        self,
        path: Path | str,
        joints: Joints,
        first: int | None = None,
        count: int | None = None,
        topic: str = "/joint_trajectory",
        stamp: int = 0,
    ) -> Path:
        """Write a `trajectory_msgs/msg/JointTrajectory` to an .mcap or .yaml file; return the path.

        `joints` names the state or input for each field of a joint's points: {'shoulder': {'positions': 'angle',
        'velocities': 'speed', 'effort': 'torque'}}, in the units that ROS expects (rad or m, and s). Points are steps,
        as in `to_csv`. `stamp` [ns] is the time of the message in an MCAP file, under `topic`.

        The proof holds at the points. Between them a ROS controller interpolates in its own way. MissingExtra: an MCAP
        file needs mcap-ros2-support.
        """
        from trackably.exports.ros2 import joint_points, write  # noqa: PLC0415

        points = joint_points(self, joints, first, count)
        return write("to_ros2", points, path, topic, stamp, self.certificate.explanation)

    def to_c(self, path: Path | str, name: str = "reference") -> Path:
        """Write a header in plain C99 with coefficients and functions; return its path.

        `name_at(t, x, u)` and `name_step(k, x, u)` use the operations whose rounding errors are certified: values
        differ from the exact ones by at most the certificate's `evaluation_error`. For times that are not proved, they
        return 1 and no values. If inputs are redundant, they give the smallest ones, as `input` does. ValueError: a
        formula has no counterpart in C.
        """
        from trackably.exports.c99 import header  # noqa: PLC0415

        write_text(file := new_file("to_c", path), header(self, name))
        return file

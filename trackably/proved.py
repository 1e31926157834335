"""A reference with its proof, however it was found: states and inputs at proved times, and the proof as a file."""

from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_subject
from trackably.certificates.judge import accepted_file, found_or_raise, judged
from trackably.checker.form import subject_of
from trackably.exports.mixin import ExportMixin
from trackably.files import new_file, write_atomically
from trackably.systems.reference import Reference, Window


def where_it_is(reference: Reference) -> str:
    """Return the times of a reference's kernels with nonzero weights, or of its pieces, and its
    first states, as text.
    """
    span = _pieces(reference) if reference.pieces else _kernels(reference)
    begun = max((float(z.breakpoints[0]) for z in reference.pieces if z.beyond == "end"), default=0.0)
    states = zip(reference.plant.system.states, reference.state_at(np.asarray(begun)), strict=True)
    return f"{span}, {', '.join(f'{name} = {value:.6g}' for name, value in states)} at t = {begun:g} s"


def _kernels(reference: Reference) -> str:
    used = np.concatenate([signal.centres[signal.weights != 0] for signal in reference.kernel_sums])
    return f"{used.size} kernels centred from {used.min():g} s to {used.max():g} s" if used.size else "no kernel at all"


def _pieces(reference: Reference) -> str:
    ends = np.concatenate([signal.breakpoints for signal in reference.pieces])
    count = sum(len(signal.coefficients) for signal in reference.pieces)
    return f"{count} polynomial pieces from {ends.min():g} s to {ends.max():g} s"


class ProvedReference(ExportMixin, ABC):
    """A `reference` with its proof: the system can follow it at all times that `certificate` claims.

    `pin_certificates` prove required values at single times. Steps that are not proved are refused with a ValueError,
    and so are steps at |t| > `certificate.last_time`; `reference` has values there too, but without guarantee.
    """

    certificate: Certificate
    pin_certificates: tuple[Certificate, ...] = ()

    def __post_init__(self) -> None:
        """Raise NotTrackableError if the checker refuses a certificate, ValueError if one is
        about another reference.
        """
        for certificate in (self.certificate, *self.pin_certificates):
            found_or_raise(judged(certificate))
            if certificate.reference is not self.reference and _fingerprint(certificate.reference) != self.fingerprint:
                raise ValueError("certificate: expected one about this reference, got one about another reference")

    @property
    @abstractmethod
    def reference(self) -> Reference:
        """The reference itself, with values at all times."""

    @property
    @abstractmethod
    def explanation(self) -> str:
        """The proved statement, and what else is known about the reference."""

    def state(self, k: Array | int) -> Array:
        """Return x_r(k) at steps k of any shape: (*k.shape, n). ValueError: a step is not proved."""
        self._refuse_unproved(k)
        return self.reference.state(k)

    def input(self, k: Array | int) -> Array:
        """Return u_r(k), which moves the state from x_r(k) to x_r(k + 1): shape (*k.shape, m).

        ValueError as for states.
        """
        self._refuse_unproved(k)
        return self.reference.input(k)

    def window(self, k: int, horizon: int) -> Window:
        """Return states k … k + `horizon` and the inputs between them, for a predictive controller at step k.

        ValueError: a step is not proved, or the horizon is below one step. TypeError: the horizon is no whole number.
        """
        if whole("window: horizon", horizon) < 1:
            raise ValueError(f"window: a horizon of one step at least is needed, got {horizon}")
        self._refuse_unproved(np.array([whole("window: k", k), k + horizon]))
        return self.reference.window(k, horizon)

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of the data that define states and inputs, as the checker prints it for
        certificates of this reference.
        """
        return _fingerprint(self.reference)

    @property
    def identity(self) -> str:
        """The reference's identity in the checker's words: its fingerprint, its times, and its first states."""
        return f"SHA-256 {self.fingerprint}, {where_it_is(self.reference)}"

    def save_certificate(self, path: Path | str) -> tuple[Path, ...]:
        """Write the proof alone, for `python -m trackably check FILE`; return the files. Raises OSError.

        Certificates of required values are written beside it: proof.at1.json, proof.at2.json, … for proof.json.
        """
        path = new_file("save_certificate", path)
        beside = [path.with_suffix(f".at{i + 1}{path.suffix}") for i in range(len(self.pin_certificates))]
        for file, certificate in zip((path, *beside), (self.certificate, *self.pin_certificates), strict=True):
            write_atomically(file, accepted_file(certificate))
        return path, *beside

    def _refuse_unproved(self, k: Array | int) -> None:
        t = self._times(k)
        if (found := self.certificate.first_unproved(t)) is not None:
            i, why = found
            step, when = np.asarray(k, dtype=float).flat[i], t.flat[i]
            raise ValueError(
                f"step {step:g} ({when:g} s) is {why}; the field `reference` has values there too, without any "
                "guarantee"
            )

    def _times(self, k: Array | int) -> Array:
        return np.asarray(self.reference.instants(numbers("steps", k)), dtype=float)


def _fingerprint(reference: Reference) -> str:
    return subject_of(encode_subject(reference)).fingerprint

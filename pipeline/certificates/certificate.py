"""A certificate: a claim about a stored reference, with everything that an independent checker needs to verify it."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.certificates.claim import AllPhases, AllTimes, AtInstants, Claim, OnWindow
from pipeline.certificates.cover import Cover
from pipeline.gp.combinations import Product, Sum
from pipeline.gp.kernel import Kernel
from pipeline.gp.periodic import Periodic
from pipeline.gp.radial import Matern32, Matern52, RationalQuadratic, SquaredExponential
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.reference import Reference
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear

FORMAT = "trackable certificate"
VERSION = 1

_KERNELS: dict[str, type[Kernel]] = {
    kernel.__name__: kernel
    for kernel in (SquaredExponential, Matern32, Matern52, RationalQuadratic, Periodic, Sum, Product)
}
_CLAIMS: dict[str, type[AllTimes | AllPhases | OnWindow | AtInstants]] = {
    "all_times": AllTimes,
    "all_phases": AllPhases,
    "window": OnWindow,
    "instants": AtInstants,
}


@dataclass(frozen=True)
class Certificate:
    """The state of `reference` stays in X, its input in U, at the times that `claim` names, with room for rounding.

    Each quantity keeps `evaluation_error` away from its bounds: what float64 evaluation gives at a float64 time
    |t| ≤ `evaluated_until` [s] stays inside too. `covers` holds the boxes of the proof (none for instants), `terms` is
    the number of Taylor coefficients with which each box was enclosed (0 without boxes).
    """

    reference: Reference
    claim: Claim
    terms: int
    covers: dict[str, Cover]
    evaluation_error: dict[str, float]
    evaluated_until: float

    @property
    def explanation(self) -> str:
        """What is proved, in a sentence."""
        boxes = {name: len(cover.radii) for name, cover in self.covers.items()}
        how = f" ({', '.join(f'{n} boxes for the {name}' for name, n in boxes.items())})" if boxes else ""
        x, u = self.reference.plant.state_set, self.reference.plant.input_set
        return f"proved for {self.claim}: the state stays in {x} and the input in {u}{how}"

    def to_dict(self) -> dict[str, Any]:
        """As nested dicts, lists, strings and numbers; every float64 as it is, so that `repr` keeps it."""
        signal, plant = self.reference.signal, self.reference.plant
        kind = next(kind for kind, cls in _CLAIMS.items() if isinstance(self.claim, cls))
        return {
            "format": FORMAT,
            "version": VERSION,
            "claim": {"kind": kind, **dataclasses.asdict(self.claim), **self._proof},
            "signal": {
                "kernel": _kernel_to_dict(signal.kernel),
                "mean": float(signal.mean),
                "centres": signal.centres.tolist(),
                "weights": signal.weights.tolist(),
            },
            "system": {**_floats(plant.system), "sampling_time": float(plant.sampling_time)},
            "state_set": _floats(plant.state_set),
            "input_set": _floats(plant.input_set),
            "evaluation": {"until": self.evaluated_until, **self.evaluation_error},
        }

    @property
    def _proof(self) -> dict[str, Any]:
        covers = {name: {"ends": list(cover.ends), "radii": list(cover.radii)} for name, cover in self.covers.items()}
        return {"covers": covers, "terms": self.terms} if covers else {}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> "Certificate":
        """The inverse of `to_dict`; KeyError, TypeError or ValueError where `data` is nothing that it returns."""
        if (data["format"], data["version"]) != (FORMAT, VERSION):
            raise ValueError(f"certificate: expected {FORMAT!r} version {VERSION}, got {data['format']!r}")
        claim, signal, system = dict(data["claim"]), data["signal"], dict(data["system"])
        evaluation = dict(data["evaluation"])
        covers, terms = claim.pop("covers", {}), claim.pop("terms", 0)
        sampling_time = system.pop("sampling_time")
        until = evaluation.pop("until")
        return cls(
            reference=Reference(
                KernelSum(
                    _kernel_from_dict(signal["kernel"]),
                    signal["mean"],
                    np.array(signal["centres"], dtype=float),
                    np.array(signal["weights"], dtype=float),
                ),
                ConstrainedSystem(
                    ScalarLinear(**system), Interval(**data["state_set"]), Interval(**data["input_set"]), sampling_time
                ),
            ),
            claim=_CLAIMS[claim.pop("kind")](**claim),
            terms=terms,
            covers={name: Cover(tuple(c["ends"]), tuple(c["radii"])) for name, c in covers.items()},
            evaluation_error=evaluation,
            evaluated_until=until,
        )


def _floats(value: ScalarLinear | Interval) -> dict[str, float]:
    return {name: float(number) for name, number in dataclasses.asdict(value).items()}


def _kernel_to_dict(kernel: Kernel) -> dict[str, Any]:
    fields = {field.name: getattr(kernel, field.name) for field in dataclasses.fields(kernel)}
    inner = {name: _kernel_to_dict(v) if isinstance(v, Kernel) else float(v) for name, v in fields.items()}
    return {"type": type(kernel).__name__, **inner}


def _kernel_from_dict(data: dict[str, Any]) -> Kernel:
    inner = {name: _kernel_from_dict(v) if isinstance(v, dict) else v for name, v in data.items() if name != "type"}
    return _KERNELS[data["type"]](**inner)

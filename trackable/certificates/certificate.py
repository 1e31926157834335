"""A certificate: a claim about a stored reference, with everything that an independent checker needs to verify it."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from trackable.certificates.claim import AllPhases, AllTimes, AtInstants, Claim, OnWindow
from trackable.certificates.cover import Cover
from trackable.gp.kernels import registry
from trackable.gp.kernels.base import Kernel
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem, Limit
from trackable.systems.flat.functional import Functional
from trackable.systems.formulas.algebra import from_lists, to_lists
from trackable.systems.linear import LinearSystem
from trackable.systems.nonlinear import Nonlinear
from trackable.systems.reference import Reference
from trackable.systems.sets.polytope import Polytope

FORMAT = "trackable certificate"
VERSION = 2

_KERNELS: dict[str, type[Kernel]] = {kernel.__name__: kernel for kernel in registry.KERNELS.values()}
_CLAIMS: dict[str, type[AllTimes | AllPhases | OnWindow | AtInstants]] = {
    "all_times": AllTimes,
    "all_phases": AllPhases,
    "window": OnWindow,
    "instants": AtInstants,
}


@dataclass(frozen=True)
class Certificate:
    """States and inputs of `reference` keep their bounds at the times that `claim` names, with room for rounding.

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
        kept = ", ".join(f"{q.name} in {q.bounds}" for q in self.reference.quantities)
        plant = self.reference.plant
        chosen = f", with inputs in {_box(plant)} that push alike" if plant.allocation else ""
        return f"proved for {self.claim}: {kept}{chosen}"

    def to_dict(self) -> dict[str, Any]:
        """As nested dicts, lists, strings and numbers; every float64 as it is, so that `repr` keeps it."""
        plant = self.reference.plant
        kind = next(kind for kind, cls in _CLAIMS.items() if isinstance(self.claim, cls))
        return {
            "format": FORMAT,
            "version": VERSION,
            "claim": {"kind": kind, **dataclasses.asdict(self.claim), **self._proof},
            "signals": [_signal_to_dict(signal) for signal in self.reference.signals],
            **_system_to_dict(plant),
            "bounds": [_limit_to_dict(limit, plant) for limit in plant.needed],
            **_input_set_to_dict(plant),
            "evaluation": {"until": self.evaluated_until, "errors": self.evaluation_error},
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
        claim, system = dict(data["claim"]), data["system"]
        covers, terms = claim.pop("covers", {}), claim.pop("terms", 0)
        of_states, of_inputs = ([b for b in data["bounds"] if b["of"] == kind] for kind in ("state", "input"))
        state_set = _set_from_dicts(of_states, len(system["states"]))
        input_set = _set_from_dicts(data.get("input_set", of_inputs), len(system["inputs"]))
        return cls(
            reference=Reference(
                tuple(_signal_from_dict(signal) for signal in data["signals"]),
                ConstrainedSystem(_system_from_dict(system), state_set, input_set),
            ),
            claim=_CLAIMS[claim.pop("kind")](**claim),
            terms=terms,
            covers={name: Cover(tuple(c["ends"]), tuple(c["radii"])) for name, c in covers.items()},
            evaluation_error=dict(data["evaluation"]["errors"]),
            evaluated_until=data["evaluation"]["until"],
        )


def _box(plant: ConstrainedSystem) -> str:
    return "{" + ", ".join(f"{limit.name} in {limit.bounds}" for limit in plant.limits if limit.of == "input") + "}"


def _limit_to_dict(limit: Limit, plant: ConstrainedSystem) -> dict[str, Any]:
    """Rows as they are given; what combines some for redundant inputs has exact numbers, as "p/q"."""
    number = str if plant.allocation and limit.of == "input" else float
    row = [number(r) for r in limit.row]
    return {"name": limit.name, "of": limit.of, "row": row, "lower": limit.bounds.lower, "upper": limit.bounds.upper}


def _input_set_to_dict(plant: ConstrainedSystem) -> dict[str, Any]:
    """U itself, where the bounded rows only say that inputs in it exist."""
    if plant.allocation is None:
        return {}
    rows = plant.input_set.intervals
    return {"input_set": [{"row": row.tolist(), "lower": bounds.lower, "upper": bounds.upper} for row, bounds in rows]}


def _system_to_dict(plant: ConstrainedSystem) -> dict[str, Any]:
    """A linear system with its exact trajectories; a nonlinear one needs none: its states are the signals."""
    system = plant.system
    about = {
        "states": list(system.states),
        "inputs": list(system.inputs),
        "sampling_time": float(plant.sampling_time),
    }
    if isinstance(system, Nonlinear):
        return {"system": {"f": [to_lists(formula) for formula in system.f], **about}}
    trajectories = {
        kind: [_functional_to_dict(q) for q in coordinates if isinstance(q, Functional)]
        for kind, coordinates in (("states", plant.flatness.states), ("inputs", plant.flatness.inputs))
    }
    matrices = {"A": system.A.tolist(), "B": system.B.tolist(), "c": system.c.tolist()}
    return {"system": {**matrices, **about}, "trajectories": trajectories}


def _system_from_dict(data: dict[str, Any]) -> LinearSystem | Nonlinear:
    names = tuple(data["states"]), tuple(data["inputs"])
    if "f" in data:
        return Nonlinear(tuple(from_lists(formula) for formula in data["f"]), *names, data["sampling_time"])
    return LinearSystem(data["A"], data["B"], data["c"], *names, sampling_time=data["sampling_time"])


def _set_from_dicts(bounds: list[dict[str, Any]], dimension: int) -> Polytope:
    rows = np.array([b["row"] for b in bounds], dtype=float).reshape(len(bounds), dimension)
    return Polytope(rows, np.array([b["lower"] for b in bounds]), np.array([b["upper"] for b in bounds]), dimension)


def _functional_to_dict(functional: Functional) -> dict[str, Any]:
    """Exact numbers as "p/q"."""
    weights = [[str(w) for w in of_signal] for of_signal in functional.weights]
    return {"offset": str(functional.offset), "weights": weights}


def _signal_to_dict(signal: KernelSum) -> dict[str, Any]:
    return {
        "kernel": _kernel_to_dict(signal.kernel),
        "mean": float(signal.mean),
        "centres": signal.centres.tolist(),
        "weights": signal.weights.tolist(),
    }


def _signal_from_dict(data: dict[str, Any]) -> KernelSum:
    centres, weights = np.array(data["centres"], dtype=float), np.array(data["weights"], dtype=float)
    return KernelSum(_kernel_from_dict(data["kernel"]), data["mean"], centres, weights)


def _kernel_to_dict(kernel: Kernel) -> dict[str, Any]:
    fields = {field.name: getattr(kernel, field.name) for field in dataclasses.fields(kernel)}
    inner = {name: _kernel_to_dict(v) if isinstance(v, Kernel) else float(v) for name, v in fields.items()}
    return {"type": type(kernel).__name__, **inner}


def _kernel_from_dict(data: dict[str, Any]) -> Kernel:
    inner = {name: _kernel_from_dict(v) if isinstance(v, dict) else v for name, v in data.items() if name != "type"}
    return _KERNELS[data["type"]](**inner)

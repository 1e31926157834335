"""Read what a certificate says of a disturbed system."""

from trackably.checker.limits import COORDINATES, POWERS, ROWS
from trackably.checker.reading.subjects import a_polytope
from trackably.checker.reading.values import (
    Fields,
    UnreadableError,
    many,
    rational_number,
    real_number,
    tag_of,
    whole_number,
)
from trackably.checker.robust import Hull, Robust, Zonotope

_FIELDS = ("state_set", "input_set", "feedback", "set", "head", "terms", "contraction", "box")
_KINDS = {"zonotope": ("centre", "generators"), "hull": ("vertices",)}


def read_robust(value: object, where: str) -> Robust:
    """Read a disturbance set, a feedback, the errors that they allow, and the sets that are kept."""
    noisy = ["noise"] if isinstance(value, dict) and "noise" in value else []
    found = Fields(value, where, *_FIELDS, *noisy)
    disturbance, noise = found("set", _disturbance), found("noise", _disturbance) if noisy else None
    if isinstance(noise, Hull) or (noise and isinstance(disturbance, Hull)):
        raise UnreadableError(f"{where}: with noise both sets must be zonotopes")
    return Robust(
        state_set=found("state_set", a_polytope),
        input_set=found("input_set", a_polytope),
        feedback=found("feedback", many(many(real_number, COORDINATES), COORDINATES)),
        disturbance=disturbance,
        noise=noise,
        head=found("head", whole_number(POWERS)),
        terms=found("terms", whole_number(POWERS)),
        contraction=found("contraction", real_number),
        box=found("box", many(real_number, COORDINATES)),
    )


def _disturbance(value: object, where: str) -> Zonotope | Hull:
    kind = tag_of(value, where, "kind", _KINDS)
    found, vector = Fields(value, where, "kind", *_KINDS[kind]), many(rational_number, COORDINATES)
    if kind == "hull":
        return Hull(found("vertices", many(vector, ROWS)))
    return Zonotope(found("centre", vector), found("generators", many(vector, ROWS, empty=True)))

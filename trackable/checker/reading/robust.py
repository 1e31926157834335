"""Read what a certificate says of a disturbed system."""

from trackable.checker.reading.limits import COORDINATES, POWERS, ROWS
from trackable.checker.reading.subjects import a_polytope
from trackable.checker.reading.values import Fields, many, rational_number, real_number, tag_of, whole_number
from trackable.checker.robust import Hull, Robust, Zonotope

_KINDS = {"zonotope": ("centre", "generators"), "hull": ("vertices",)}


def read_robust(value: object, where: str) -> Robust:
    """Read a disturbance set, a feedback, the errors that they allow, and the sets that are kept."""
    found = Fields(value, where, "state_set", "input_set", "feedback", "set", "head", "terms", "contraction", "box")
    return Robust(
        state_set=found("state_set", a_polytope),
        input_set=found("input_set", a_polytope),
        feedback=found("feedback", many(many(real_number, COORDINATES), COORDINATES)),
        disturbance=found("set", _disturbance),
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

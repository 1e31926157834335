import json
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackable.arrays import Array
from trackable.codec import CodecError, decode, dumps, encode, loads
from trackable.files import to_json
from trackable.gp.hyperparameter import Learned
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.base import Kernel, Product, Sum
from trackable.gp.kernels.elementary import Elementary
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.registry import KERNELS
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.gp.signal import KernelSum
from trackable.gp.stencil import Stencil
from trackable.learning.published.scalar import scalar
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope

ELEMENTARY: tuple[type[Elementary], ...] = (SquaredExponential, Matern32, Matern52, RationalQuadratic, Periodic)
positive = st.floats(1e-3, 1e3)
any_float = st.floats(allow_nan=False, allow_infinity=False)
elementary = st.one_of([st.builds(kernel, **{f.name: positive for f in fields(kernel)}) for kernel in ELEMENTARY])
kernels = st.recursive(
    elementary, lambda part: st.builds(Sum, part, part) | st.builds(Product, part, part), max_leaves=5
)
plants = st.builds(
    scalar,
    any_float,
    positive,
    any_float,
    state_set=st.builds(Interval, st.floats(-9, -1), st.floats(1, 9)),
    input_set=st.builds(Interval, st.floats(-9, -1), st.floats(1, 9)),
    sampling_time=positive,
)
vectors = st.lists(any_float, min_size=1, max_size=6).map(np.array)

KERNEL = Sum(Product(SquaredExponential(0.1 + 0.2, 1 / 3), Periodic(1.0, 2.0, 3.0)), RationalQuadratic(1.0, 2.0, 0.7))
PLANT = scalar(0.9, -0.1, state_set=Interval(-1.0, 1.0), input_set=Interval(-2.0, 2.0), sampling_time=0.1)
SIGNAL = KernelSum(KERNEL, -0.0, np.array([0.0, 0.1]), np.array([5e-324, -1e300]))
REFERENCE = Reference((SIGNAL,), PLANT)
GENERAL = Reference(
    (SIGNAL, KernelSum(Matern32(1.0, 1 / 3), 0.1, np.array([0.5]), np.array([-0.0]))),
    ConstrainedSystem(
        LinearSystem(
            np.array([[1.0, 0.1, 0.0], [0.0, 1 / 3, 0.0], [1e-300, 0.0, -0.9]]),
            np.array([[0.0, 0.0], [1.0, 0.2], [0.0, 0.7]]),
            np.array([0.1, -0.0, 0.3]),
            ("position", "velocity", "level"),
            ("force", "flow"),
            sampling_time=0.05,
        ),
        Polytope(np.array([[1.0, 0.0, 0.0], [0.0, 1 / 3, -1.0]]), np.array([-1.0, -2.0]), np.array([0.1, 2.0])),
        Polytope.box(np.array([-np.inf, -np.inf]), np.array([np.inf, np.inf])),
    ),
)
VALUES = [
    KERNEL,
    REFERENCE,
    GENERAL,
    SIGNAL,
    PLANT,
    GENERAL.plant,
    GENERAL.plant.system,
    GENERAL.plant.state_set,
    GENERAL.plant.input_set,
    Interval(-1.0, 2.0),
    Prior(KERNEL, 0.1).as_learned({"left.left.signal_std", "right.lengthscale"}),
    Prior(SquaredExponential(1.0, Learned(0.2, (1 / 3, 2.0))), Learned(0.3, (0.1, 0.2)), 1.0),
    Prior(KERNEL, 0.1).as_learned(),
    Samples(np.array([0.1, 0.2]), np.array([-0.0, 1e-300])),
    Samples(np.array([0.1, 0.2]), np.array([-0.0, 1e-300]), np.array([1 / 3, 2.0]), Stencil((0.1, -1 / 3), 0.1, -0.0)),
    JointPrior(
        (Prior(KERNEL, 0.1).as_learned(), Prior(SquaredExponential(0.1, 0.7), 0.1).as_learned()),
        ("x", "y"),
        frozenset({"noise_std"}),
    ),
]


def names(value: object) -> str:
    return type(value).__name__


def test_every_kernel_has_a_name() -> None:
    assert set(KERNELS.values()) == {*ELEMENTARY, Sum, Product}


@given(kernels)
def test_kernels_return(kernel: Kernel) -> None:
    assert loads(Kernel, dumps(kernel)) == kernel  # type: ignore[type-abstract]
    assert loads(type(kernel), dumps(kernel)) == kernel


def same_plant(one: ConstrainedSystem, other: ConstrainedSystem) -> bool:
    """Bit for bit."""
    pairs = [(one.system.A, other.system.A), (one.system.B, other.system.B), (one.system.c, other.system.c)]
    for ours, theirs in ((one.state_set, other.state_set), (one.input_set, other.input_set)):
        pairs += [(ours.rows, theirs.rows), (ours.lower, theirs.lower), (ours.upper, theirs.upper)]
    names = [(p.system.states, p.system.inputs, p.sampling_time, p.state_set.dimension) for p in (one, other)]
    return names[0] == names[1] and all(a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in pairs)


@given(kernels, plants, any_float, st.lists(st.tuples(any_float, any_float), max_size=6), vectors)
def test_references_return_bit_for_bit(
    kernel: Kernel, plant: ConstrainedSystem, mean: float, terms: list[tuple[float, float]], t: Array
) -> None:
    centres, weights = np.array([c for c, _ in terms]), np.array([w for _, w in terms])
    reference = Reference((KernelSum(kernel, mean, centres, weights),), plant)
    again = loads(Reference, dumps(reference))
    assert dumps(again.plant) == dumps(plant)
    assert same_plant(again.plant, plant)
    (signal,) = again.signals
    assert signal.centres.dtype == signal.weights.dtype == np.dtype(float)
    with np.errstate(all="ignore"):
        assert again.state_at(t).tobytes() == reference.state_at(t).tobytes()
        assert again.input_at(t).tobytes() == reference.input_at(t).tobytes()


@pytest.mark.parametrize("value", VALUES, ids=names)
def test_writing_what_was_read_gives_the_same_bytes(value: object) -> None:
    data = dumps(value)
    again = loads(type(value), data)
    assert type(again) is type(value)
    assert dumps(again) == data == to_json(encode(value))
    assert json.loads(data) == encode(value)


@given(kernels, positive, any_float, st.data())
def test_priors_return(kernel: Kernel, noise_std: float, mean: float, data: st.DataObject) -> None:
    learned = data.draw(st.sets(st.sampled_from([*kernel.hyperparameters, "noise_std"])))
    interval = data.draw(st.none() | st.tuples(positive, positive))
    prior = Prior(kernel, noise_std, mean).as_learned(learned)
    if "noise_std" in learned:
        prior = replace(prior, noise_std=Learned(noise_std, interval))
    again = loads(Prior, dumps(prior))
    assert again == prior
    assert set(again.learned) == learned
    intervals = [[v.interval for v in p.hyperparameters.values() if isinstance(v, Learned)] for p in (prior, again)]
    assert intervals[0] == intervals[1]


@given(st.builds(Stencil, st.lists(any_float).filter(any).map(tuple), any_float, any_float))
def test_stencils_return(stencil: Stencil) -> None:
    assert loads(Stencil, dumps(stencil)) == stencil


def test_references_of_general_systems_return() -> None:
    again = loads(Reference, dumps(GENERAL))
    assert same_plant(again.plant, GENERAL.plant)
    t = np.linspace(-1, 3, 20)
    with np.errstate(all="ignore"):
        assert again.state_at(t).tobytes() == GENERAL.state_at(t).tobytes()
        assert again.input_at(t).tobytes() == GENERAL.input_at(t).tobytes()
    assert [q.name for q in again.quantities] == ["position", "0.333velocity-level"]


def test_samples_return() -> None:
    samples = Samples(np.array([0.1, 0.1 + 0.2]), np.array([-0.0, 1e-300]))
    again = loads(Samples, dumps(samples))
    assert again.times.tobytes() == samples.times.tobytes()
    assert again.values.tobytes() == samples.values.tobytes()


def test_what_the_json_looks_like() -> None:
    assert encode(Prior(SquaredExponential(2.0, (0.5, 8.0)), Learned(0.3))) == {
        "kernel": {
            "type": "squared_exponential",
            "signal_std": 2.0,
            "lengthscale": {"learned": 2.0, "interval": [0.5, 8.0]},
        },
        "noise_std": {"learned": 0.3, "interval": None},
        "mean": 0.0,
    }
    assert encode(Stencil((1.0,), 0.5)) == {"weights": [1.0], "step": 0.5, "offset": 0.0}
    assert encode(REFERENCE)["signals"][0]["centres"] == [0.0, 0.1]
    system = {"A": [[0.9]], "B": [[-0.1]], "c": [0.0], "states": ["state"], "inputs": ["input"], "sampling_time": 0.1}
    assert encode(PLANT)["system"] == encode(PLANT.system) == system
    assert set(encode(PLANT)) == {"system", "state_set", "input_set"}
    assert encode(PLANT.state_set) == {"rows": [[1.0]], "lower": [-1.0], "upper": [1.0], "dimension": 1}


def test_numbers_of_numpy_are_written_as_numbers() -> None:
    data = encode(Interval(np.float64(0.1), np.float64(0.2)))
    assert {type(value) for value in data.values()} == {float}


def test_a_whole_number_is_a_number() -> None:
    assert decode(Interval, {"lower": 0, "upper": 1}) == Interval(0.0, 1.0)


def edited(value: object, *path: str | int, to: Any) -> Any:
    """The JSON of a value with one thing changed; what is set to KeyError is removed."""
    data = encode(value)
    *way, last = path
    inner = data
    for step in way:
        inner = inner[step]
    if to is KeyError:
        del inner[last]
    else:
        inner[last] = to
    return data


SE = SquaredExponential(1.0, 2.0)
PRIOR = Prior(SE.as_learned(), 0.1)
SAMPLES = Samples(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
STENCIL = Stencil((1.0, -2.0), 0.5)


@pytest.mark.parametrize(
    ("wanted", "data", "complaint"),
    [
        (Interval, [0.0, 1.0], "Interval: Interval must be an object, got [0.0, 1.0] @ $"),
        (Interval, {"lower": 0.0}, "Interval lacks upper @ $"),
        (Interval, {"lower": 0.0, "upper": 1.0, "middle": 0.5}, "Interval has no middle @ $"),
        (Interval, {"lower": "0", "upper": 1.0}, "must be a number, got '0' @ $.lower"),
        (Interval, {"lower": False, "upper": 1.0}, "must be a number, got False @ $.lower"),
        (Interval, {"lower": None, "upper": 1.0}, "must be a number, got None @ $.lower"),
        (Interval, {"lower": 0.0, "upper": math.nan}, "must be finite, and exact in float64, got nan @ $.upper"),
        (Interval, {"lower": -math.inf, "upper": 0.0}, "got -inf @ $.lower"),
        (Interval, {"lower": 0.0, "upper": 10**400}, "must be finite"),
        (Interval, {"lower": 0.0, "upper": 2**53 + 1}, "exact in float64, got 9007199254740993 @ $.upper"),
        (Interval, {"lower": 2.0, "upper": 1.0}, "an interval needs finite bounds"),
        (Prior, edited(PRIOR, "mean", to=KeyError), "Prior lacks mean @ $"),
        (
            Prior,
            edited(PRIOR, "noise_std", to={"learned": 0.1}),
            "an object with learned and interval, got {'learned': 0",
        ),
        (
            Prior,
            edited(PRIOR, "noise_std", to={"learned": "1", "interval": None}),
            "must be a number, got '1' @ $.noise",
        ),
        (
            Prior,
            edited(PRIOR, "noise_std", to={"learned": 1, "interval": [1]}),
            "must be two numbers, got [1] @ $.noise",
        ),
        (Prior, edited(PRIOR, "noise_std", to={"learned": -1, "interval": None}), "noise_std must be a positive"),
        (Prior, edited(PRIOR, "noise_std", to=None), "must be a number, got None @ $.noise_std"),
        (Prior, edited(PRIOR, "kernel", "type", to="Cosine"), "one of squared_exponential, matern32"),
        (Prior, edited(PRIOR, "kernel", "type", to=[]), "got [] @ $.kernel"),
        (Prior, edited(PRIOR, "kernel", "type", to=KeyError), "an object with a type"),
        (Prior, edited(PRIOR, "kernel", "period", to=1.0), "SquaredExponential has no period @ $.kernel"),
        (Prior, edited(PRIOR, "kernel", "lengthscale", to=-1.0), "lengthscale must be a positive"),
        (Prior, edited(PRIOR, "kernel", to=None), "an object with a type, got None @ $.kernel"),
        (Periodic, encode(SE), "must be one of periodic, got 'squared_exponential' @ $"),
        (Reference, edited(REFERENCE, "signals", 0, "kernel", "left", "right", "period", to="1"), "left.right.period"),
        (Reference, edited(REFERENCE, "signals", 0, "weights", 1, to="1"), "[1] must be a number, got '1'"),
        (
            Reference,
            edited(REFERENCE, "signals", 0, "weights", 0, to=[1.0]),
            "must be lists of one length, got [[1.0], ",
        ),
        (LinearSystem, edited(PLANT.system, "A", 0, to=1.0), "A must be a square matrix, got shape (1,)"),
        (
            LinearSystem,
            edited(GENERAL.plant.system, "A", 1, to=[1.0, 2.0]),
            "must be lists of one length, got [[1.0, 0.1",
        ),
        (LinearSystem, edited(GENERAL.plant.system, "A", 1, 2, to="0"), "[1] [2] must be a number, got '0' @ $.A"),
        (LinearSystem, edited(GENERAL.plant.system, "states", 1, to=2), "must be of type str, got 2 @ $.states"),
        (Polytope, edited(PLANT.state_set, "upper", 0, to=-1.0), "must have an interior"),
        (Reference, edited(REFERENCE, "signals", to=[]), "the system needs 1 signals, got 0"),
        (Reference, edited(REFERENCE, "signals", 0, "weights", 0, to=True), "[0] must be a number, got True"),
        (Reference, edited(REFERENCE, "signals", 0, "weights", to=1.0), "must be a list of numbers, got 1.0"),
        (Samples, edited(SAMPLES, "times", 1, to=0.0), "samples: times must increase strictly"),
        (LinearSystem, edited(PLANT.system, "states", to=""), "@ $.states"),
        (LinearSystem, edited(PLANT.system, "states", to={}), "@ $.states"),
        (Stencil, edited(STENCIL, "weights", 1, to="2"), "must be a number, got '2' @ $.weights"),
        (JointPrior, edited(JointPrior((PRIOR,)), "names", 0, to=1), "must be of type str, got 1 @ $.names"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(wanted: type, data: Any, complaint: str) -> None:
    with pytest.raises(CodecError) as caught:
        decode(wanted, data)
    assert str(caught.value).startswith(f"{wanted.__name__}: ")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("data", [b"", b"{", b"\xff", b'{"lower": NaN, "upper": 1}', b'{"lower": 0, "lower": 0}'])
def test_bytes_that_are_no_json_are_refused(data: bytes) -> None:
    with pytest.raises(CodecError, match="Interval: no valid JSON"):
        loads(Interval, data)


class Unknown(Elementary):
    def jet(self, r: Array, order: int) -> Array:
        raise NotImplementedError

    def jet_and_gradient(self, r: Array, order: int) -> tuple[Array, Array]:
        raise NotImplementedError

    @property
    def decay_distance(self) -> float:
        return 1.0


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: replace(SIGNAL, mean=math.nan), r"nan @ \$.mean"),
        (lambda: replace(SIGNAL, weights=np.array([1.0, np.inf])), r"\[1\] must be finite.* @ \$.weights"),
        (lambda: replace(SIGNAL, weights=np.array(1.0)), "list of numbers"),
        (lambda: replace(STENCIL, offset=True), r"got True @ \$.offset"),
        (lambda: JointPrior((PRIOR,), (3,)), r"got 3 @ \$.names"),
        (Unknown, "kernel: expected one of squared_exponential"),
        (lambda: Interval, "only a dataclass"),
        (lambda: [1.0], "only a dataclass"),
        (lambda: Strange(len), "Strange"),
    ],
)
def test_what_would_not_return_is_not_written(make: Callable[[], object], complaint: str) -> None:
    with pytest.raises(CodecError, match=complaint):
        encode(make())


@dataclass(frozen=True)
class Strange:
    function: Callable[[object], int]


@dataclass(frozen=True)
class Container:
    """Shapes of fields that later stages use."""

    step: int | None
    found: bool
    pair: tuple[float, float] | None
    bounds: dict[str, Interval]
    curves: tuple[Array, ...]
    parts: tuple[Interval, ...]


CONTAINER = Container(
    3, True, (0.1, 0.2), {"b": Interval(0.0, 1.0), "a": Interval(0.5, 1.0)}, (np.ones(2),), (Interval(0.0, 1.0),)
)


@pytest.mark.parametrize("value", [CONTAINER, replace(CONTAINER, step=None, pair=None, bounds={}, parts=())])
def test_other_shapes_of_fields_return(value: Container) -> None:
    again = loads(Container, dumps(value))
    assert replace(again, curves=()) == replace(value, curves=())
    assert [curve.tolist() for curve in again.curves] == [[1.0, 1.0]]
    assert list(again.bounds) == list(value.bounds)


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("step", True),
        ("step", 3.0),
        ("found", 1),
        ("pair", [0.1]),
        ("pair", [0.1, 0.2, 0.3]),
        ("pair", "ab"),
        ("bounds", []),
        ("bounds", {"a": {"lower": 0.0}}),
        ("curves", [[True]]),
        ("parts", {}),
        ("parts", 1.0),
    ],
)
def test_other_shapes_of_fields_are_strict(field: str, wrong: object) -> None:
    with pytest.raises(CodecError, match=rf"Container: .* @ \$.{field}"):
        decode(Container, edited(CONTAINER, field, to=wrong))

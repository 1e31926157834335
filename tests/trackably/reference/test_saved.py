"""What is damaged or changed is refused in a sentence that names the file; what is not checked yet says nothing."""

import json
from functools import cache, partial

import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.gp.instances import over
from tests.trackably.plants import AXIS, SAMPLES
from trackably import NotTrackableError, SquaredExponential, TrackableReference, Unchecked, Zonotope, learn_reference
from trackably.codec import CodecError

OPTIONS = {
    "plain": {},
    "pushed": {"disturbance": Zonotope.box([0.0, -0.005], [0.0, 0.005])},
    "pinned": {"at": {1.0: {"force": 0.5}, 0.0: {"position": -0.98, "velocity": 0.0}}},
}
SIGNAL, PLANT = ("fit", "reference", "signals", 0), ("fit", "reference", "plant")


@cache
def learned(name):
    kernel = SquaredExponential(0.1, 0.5)
    return learn_reference(SAMPLES, AXIS, kernel, (0.0, 1.0), noise_std=0.02, starts=1, **OPTIONS[name])


@pytest.fixture
def write(tmp_path):
    """Return what writes the file of a reference after some damage."""

    def written(name, damage):
        learned(name).save(path := tmp_path / "r.json")
        path.write_bytes(damage(path.read_bytes()))
        return path

    return written


def put(value, *path):
    return lambda content: json.dumps(changed(json.loads(content), path, value)).encode()


DAMAGES = {
    "empty": ("plain", lambda _: b"", "expected JSON: "),
    "an active bound": (
        "plain",
        put([{"name": "sped", "side": "upper", "time": 1.0, "multiplier": 1.0, "price": 1.0}], "fit", "active_bounds"),
        r"\$\.fit: active_bounds\[0\]\.name: expected one of position, velocity, force, got 'sped'",
    ),
    "a reversed set": (
        "plain",
        put([-9.0, -9.0], *PLANT, "state_set", "upper"),
        r"\$\.fit\.reference\.plant\.state_set: set: row 0 needs entries other than zero, and finite bounds, ",
    ),
    "a reversed window": ("plain", put(-1.0, "proved_until"), r"a window needs start < end, got \[0\.0, -1\.0\]"),
    "disturbance": (
        "pushed",
        put("1/100", "tightening", "disturbance", "generators", 0, 1),
        "tightening: it gives other bounds",
    ),
}


@over(DAMAGES, "of", "damage", "sentence")
def test_what_is_damaged_is_refused_by_the_name_of_its_file(of, damage, sentence, write):
    path = write(of, damage)
    with pytest.raises(CodecError, match=rf"^{path}: is no saved reference, or damaged: .*{sentence}"):
        TrackableReference.load(path)


BROKEN = {
    "a weight": ("plain", put(99.0, *SIGNAL, "weights", 3)),
    "a bound": ("plain", put([0.01], *PLANT, "input_set", "upper")),
    "a value": ("pinned", put(-0.979, "fit", "pinned", 0, "values", "position")),
}


@over(BROKEN, "of", "damage")
def test_what_breaks_its_bounds_is_refused_whenever_it_is_checked(of, damage, write):
    path = write(of, damage)
    for check in (partial(TrackableReference.load, path), TrackableReference.load(path, seconds=0.0).check):
        with pytest.raises(NotTrackableError, match=r"at t = .* s the \w+ certainly breaks"):
            check()


def test_what_is_not_checked_in_time_is_unchecked_until_it_is(write):
    """Nothing of a reference can be had before: neither its states, nor a certificate."""
    found = TrackableReference.load(path := write("plain", bytes), seconds=0.0)
    assert isinstance(found, Unchecked)
    assert f"{path}: is unchecked after 0 s" in str(found)
    assert "proved" not in str(found)
    again = TrackableReference.load(path, seconds=600.0)
    assert isinstance(again, TrackableReference)
    assert found.check().explanation == again.explanation

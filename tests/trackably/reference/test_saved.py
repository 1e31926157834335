"""Saving and loading go wrong in one sentence that names the file."""

import json

import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.plants import AXIS, SAMPLES
from trackably import NotTrackableError, SquaredExponential, TrackableReference, Unchecked, learn_reference
from trackably.codec import CodecError


@pytest.fixture(scope="module")
def reference():
    return learn_reference(SAMPLES, AXIS, SquaredExponential(0.1, 0.5), (0.0, 1.0), noise_std=0.02, starts=1)


@pytest.fixture(scope="module")
def content(reference, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "r.json"
    reference.save(path)
    return path.read_bytes()


def tampered(content: bytes, path: tuple, value) -> bytes:
    return json.dumps(changed(json.loads(content), path, value)).encode()


PLANT = ("fit", "reference", "plant")
BROKEN = {
    "empty": (lambda _: b"", r"expected JSON, got"),
    "cut off": (lambda content: content[:500], r"expected JSON, got"),
    "no samples": (lambda content: content.replace(b'"samples"', b'"sample"'), r"lacks samples @ \$\.fit$"),
    "a reversed set": (
        lambda content: tampered(content, (*PLANT, "state_set", "upper"), [-9.0, -9.0]),
        r"set: row 0 needs entries other than zero, and finite bounds, .* @ \$\.fit\.reference\.plant\.state_set",
    ),
    "half a window": (
        lambda content: tampered(content, ("proved_from",), None),
        r"proved_from and proved_until: expected both or none, got None",
    ),
    "a reversed window": (
        lambda content: tampered(content, ("proved_until",), -1.0),
        r"proved_from and proved_until: expected start < end, got 0\.0",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_named_with_its_file(name, content, tmp_path):
    damage, sentence = BROKEN[name]
    (tmp_path / "r.json").write_bytes(damage(content))
    with pytest.raises(CodecError, match=rf"^{tmp_path}/r\.json: is no saved reference, or damaged: .*{sentence}"):
        TrackableReference.load(tmp_path / "r.json")


def test_what_is_not_checked_in_time_is_unchecked_until_it_is(content, tmp_path):
    """Nothing of a reference can be had before: neither its states, nor a certificate."""
    (tmp_path / "r.json").write_bytes(content)
    found = TrackableReference.load(tmp_path / "r.json", seconds=0.0)
    assert isinstance(found, Unchecked)
    assert "r.json: is unchecked after 0 s" in str(found)
    assert "proved" not in str(found)
    checked = found.check()
    again = TrackableReference.load(tmp_path / "r.json", seconds=600.0)
    assert isinstance(again, TrackableReference)
    assert checked.explanation == again.explanation
    (tmp_path / "r.json").write_bytes(tampered(content, (*PLANT, "input_set", "upper"), [0.01]))
    found = TrackableReference.load(tmp_path / "r.json", seconds=0.0)
    assert isinstance(found, Unchecked)
    with pytest.raises(NotTrackableError, match="certainly breaks"):
        found.check()

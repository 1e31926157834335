"""Saving and loading go wrong in one sentence that names the file."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import Controller, SquaredExponential, TrackableReference, learn_reference, simulate
from trackably.codec import CodecError


@pytest.fixture(scope="module")
def reference() -> TrackableReference:
    return learn_reference(SAMPLES, AXIS, SquaredExponential(0.1, 0.5), (0.0, 1.0), noise_std=0.02, starts=1)


@pytest.fixture(scope="module")
def content(reference: TrackableReference, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("saved") / "r.json"
    reference.save(path)
    return path.read_bytes()


def changed(*keys: str, to: object) -> Callable[[bytes], bytes]:
    def change(content: bytes) -> bytes:
        data: Any = json.loads(content)
        node = data
        for key in keys[:-1]:
            node = node[key]
        if to is KeyError:
            del node[keys[-1]]
        else:
            node[keys[-1]] = to
        return json.dumps(data).encode()

    return change


BROKEN: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "empty": (lambda _: b"", r"expected JSON, got"),
    "a list": (lambda _: b"[]", r"must be an object, got \[\]"),
    "cut off": (lambda content: content[:500], r"expected JSON, got"),
    "binary": (lambda _: bytes(range(256)), r"expected JSON, got"),
    "no samples": (changed("fit", "samples", to=KeyError), r"lacks samples @ \$\.fit$"),
    "a text": (changed("fit", "objective", to="a"), r"must be a number, got 'a' @ \$\.fit\.objective"),
    "a reversed set": (
        changed("fit", "reference", "plant", "state_set", "upper", to=[-9.0, -9.0]),
        r"must have an interior, .* @ \$\.fit\.reference\.plant\.state_set",
    ),
    "half a window": (
        changed("proved_from", to=None),
        r"proved_from and proved_until: expected both or none, got None",
    ),
    "a reversed window": (
        changed("proved_until", to=-1.0),
        r"proved_from and proved_until: expected a window, got 0\.0",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_named_with_its_file(name: str, content: bytes, tmp_path: Path) -> None:
    damage, sentence = BROKEN[name]
    (tmp_path / "r.json").write_bytes(damage(content))
    with pytest.raises(CodecError, match=rf"^{tmp_path}/r\.json: is no saved reference, or damaged: .*{sentence}"):
        TrackableReference.load(tmp_path / "r.json")


def test_nothing_is_saved_where_no_file_can_be(reference: TrackableReference, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for save in (reference.save, reference.save_certificate):
        with pytest.raises(IsADirectoryError, match=rf"expected the name of a file, got a folder: '{tmp_path}'$"):
            save(tmp_path)
        with pytest.raises(NotADirectoryError, match=rf"expected a folder, got a file: '{tmp_path}/file'$"):
            save(tmp_path / "file" / "r.json")
        with pytest.raises(TypeError, match=r"^save.*: expected a path, got None$"):
            save(None)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_steps_that_are_none(reference: TrackableReference) -> None:
    controller = Controller(AXIS, 5, [[1, 0], [0, 1]], [[0.1]])
    wrong: dict[str, Callable[[], object]] = {
        "steps: expected numbers, got '1'": lambda: reference.state("1"),
        "window: horizon: expected a whole number, got 1.5": lambda: reference.window(0, 1.5),
        "window: k: expected a whole number, got 1.5": lambda: reference.window(1.5, 1),
        "draws: count: expected a whole number, got 1.5": lambda: reference.draws(0, count=1.5),
        "controller: k: expected a whole number, got 1.5": lambda: controller.step(1.5, [0, 0], reference),
        "controller: state: expected numbers, got 'x'": lambda: controller.step(1, "x", reference),
        "steps: expected numbers, got 'a'": lambda: reference.state_std("a"),
        "draws: seed: expected a whole number, got 'a'": lambda: reference.draws(0, count=9, seed="a"),
        "bands: coverage: expected a number, got 'a'": lambda: reference.bands(0, coverage="a", count=9),
        "controller: expected a reference, with `window(k, horizon)`, got NoneType": lambda: controller.step(
            1, [0, 0], None
        ),
        "simulate: expected a reference, with `window(k, horizon)`, got Samples": lambda: simulate(
            controller, SAMPLES, [0, 0], 3
        ),
        "simulate: controller: expected a Controller(plant, horizon, Q, R), got None": lambda: simulate(
            None, reference, [0, 0], 3
        ),
        "simulate: initial_state: expected numbers, got 'ab'": lambda: simulate(controller, reference, "ab", 3),
        "simulate: steps: expected a whole number, got 1.5": lambda: simulate(controller, reference, [0, 0], 1.5),
    }
    for sentence, call in wrong.items():
        with pytest.raises(TypeError) as caught:
            call()
        assert str(caught.value) == sentence
    with pytest.raises(ValueError, match=r"controller: initial_guess must have shape \(5, 1\), got \(1,\)"):
        controller.step(1, [0, 0], reference, initial_guess=[1])
    with pytest.raises(ValueError, match="simulate: steps must be at least 0, got -1"):
        simulate(controller, reference, [0, 0], -1)

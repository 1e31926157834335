"""One change is planted in a figure or a picture in each test."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.pipeline.compare.project import (
    RESULTS,
    compared,
    edit_text,
    only,
)


def test_a_recoloured_figure(base: Path, new: Path) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", "#d55e00", "#0072b2")
    row = only(compared(base, new))
    worst = row.worst[0]
    assert (row.artifact, row.beyond) == ("example1/figures/margins.svg", 1)
    assert (worst.place, worst.base, worst.new) == ("axes_1/line2d_1/path[1]: style stroke", "#d55e00", "#0072b2")


@pytest.mark.parametrize(
    ("old", "changed", "place"),
    [
        ("L 3 1", "L 3 1.2", "axes_1/line2d_1/path[1]: coordinate 6"),
        ("step $k$", "time", "axes_1/text_1/comment[1]: text"),
        (' y="122.2"/>', ' y="122.3"/>', "axes_1/use[1]: y, number 1"),
        ("L 4 2", "L 4 2 L 9 2", "axes_1/line2d_1/path[1]: distance between the outlines"),
        ('<g id="line2d_1">', '<g id="line2d_2">', "axes_1/line2d_1: id"),
    ],
)
def test_a_redrawn_figure(base: Path, new: Path, old: str, changed: str, place: str) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", old, changed)
    assert only(compared(base, new)).worst[0].place == place


@pytest.mark.parametrize(
    ("old", "changed"),
    [("L 2 2", "L 2.001 2"), ("M 1 1 L 2 2", "M 1 1 L 1.5 1.5 L 2 2"), ("m0772998e1b", "mffffffffff")],
    ids=["rounding", "a point on a line", "a name by hash"],
)
def test_a_figure_that_looks_the_same(base: Path, new: Path, old: str, changed: str) -> None:
    edit_text(new / RESULTS / "figures/margins.svg", old, changed)
    assert compared(base, new).within


def test_a_changed_picture(base: Path, new: Path) -> None:
    for root, level in ((base, 0), (new, 200)):
        pixels = np.zeros((4, 6, 3), dtype=np.uint8)
        pixels[2, 5, 1] = level
        Image.fromarray(pixels).save(root / RESULTS / "figures/landscape.png")
    worst = only(compared(base, new)).worst[0]
    assert (worst.place, worst.base, worst.new) == ("green of the pixel at column 5, row 2", 0, 200)


def test_letters_of_a_figure_are_those_of_its_text(base: Path, new: Path) -> None:
    """Other digits of a number within tolerance have other outlines."""
    for root, digits in ((base, "4.480001"), (new, "4.480002")):
        glyphs = "".join(f'<use xlink:href="#DejaVuSans-{ord(digit):x}"/>' for digit in digits)
        text = f'<!-- worst {digits} --><g transform="translate(4 5)"><defs/>{glyphs}</g>'
        edit_text(root / RESULTS / "figures/margins.svg", "<!-- step $k$ -->", text)
    assert compared(base, new).within
    edit_text(new / RESULTS / "figures/margins.svg", "translate(4 5)", "translate(4 6)")
    assert only(compared(base, new)).worst[0].place == "axes_1/text_1/g[1]: transform, number 2"

"""Read PNG pictures as values at places: their size, and the pixels that differ most."""

from io import BytesIO

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from pipeline.compare.content.values import Leaf, Leaves, Part, UnreadableError

SIZE, PIXELS = "size", "pixels"
"""The fields that rules know; pixels have four channels of 0 … 255."""

_CHANNELS = ("red", "green", "blue", "opacity")

Picture = npt.NDArray[np.uint8]


def read_picture(data: bytes) -> Picture:
    """Read a picture, shape (rows, columns, 4 channels). Raises UnreadableError."""
    try:
        with Image.open(BytesIO(data)) as image:
            return np.asarray(image.convert("RGBA"))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise UnreadableError(f"no picture: {error}") from error


def picture_parts(base: Picture, new: Picture) -> list[Part]:
    """Return one part, whose places are pixels."""
    return [Part("", "", *picture_leaves(base, new))]


def picture_leaves(base: Picture, new: Picture, place: str = "") -> tuple[Leaves, Leaves]:
    """Return the sizes of both, and for each channel the pixel that differs most where sizes agree.

    Places begin with `place`.
    """
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    for side, picture in zip(sides, (base, new), strict=True):
        side[f"{place}size"] = Leaf(SIZE, f"{picture.shape[1]} × {picture.shape[0]}")
    if base.shape == new.shape:
        apart = np.abs(base.astype(int) - new.astype(int))
        for i, channel in enumerate(_CHANNELS):
            row, column = divmod(int(np.argmax(apart[:, :, i])), base.shape[1])
            for side, picture in zip(sides, (base, new), strict=True):
                at = f"{place}{channel} of the pixel at column {column}, row {row}"
                side[at] = Leaf(PIXELS, int(picture[row, column, i]))
    return sides

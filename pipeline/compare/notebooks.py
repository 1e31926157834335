"""Read executed notebooks as values at places: sources, and the text, numbers and pictures of outputs."""

from base64 import b64decode
from binascii import Error as Base64Error
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from hashlib import sha256
from typing import Any

from pipeline.compare.content import Leaf, Leaves, Part, UnreadableError, json_leaves, prose_leaves, read_json
from pipeline.compare.figures import picture_leaves, read_picture

SOURCE, TEXT, NUMBERS, IMAGE, THEOREM = "source", "text", "numbers", "image", "theorem"
"""The fields that rules know, beside those of pictures."""

_PNG = "image/png"
_BY_COQ = "checked by Coq"  # in texts that are shown of these very bits of a certificate alone


@dataclass(frozen=True)
class Cell:
    """A source, and for each output its media type and content: pictures as bytes, everything else as text or JSON."""

    source: str
    outputs: tuple[tuple[str, Any], ...]


def read_notebook(data: bytes) -> list[Cell]:
    """Read the cells of a notebook of format 4, without counters and identifiers. Raises UnreadableError."""
    content = read_json(data)
    try:
        cells: list[dict[str, Any]] = content["cells"]  # type: ignore[index]
        return [
            Cell(_joined(cell["source"]), tuple(o for out in cell.get("outputs", ()) for o in _outputs(out)))
            for cell in cells
        ]
    except (KeyError, TypeError, AttributeError, Base64Error) as error:
        raise UnreadableError(f"no notebook: {error!r}") from error


def notebook_parts(base: list[Cell], new: list[Cell]) -> list[Part]:
    """Return one part, whose places are cells, outputs and lines; cells are paired by their sources."""
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    for i, j in _paired([cell.source for cell in base], [cell.source for cell in new]):
        cells = None if i is None else base[i], None if j is None else new[j]
        place = f"cell {i}" if i is not None else f"cell {j} of NEW"
        for side, leaves in zip(sides, _cell_leaves(*cells, place), strict=True):
            side.update(leaves)
    return [Part("", "", *sides)]


def _joined(written: str | list[str]) -> str:
    return written if isinstance(written, str) else "".join(written)


def _outputs(output: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    match output["output_type"]:
        case "stream":
            yield output["name"], _joined(output["text"])
        case "error":
            yield "error", f"{output['ename']}: {output['evalue']}"
        case _:
            for media, data in output["data"].items():
                binary = media.startswith("image/") and media != "image/svg+xml"
                textual = isinstance(data, str) or (isinstance(data, list) and not media.endswith("json"))
                yield media, b64decode(_joined(data)) if binary else _joined(data) if textual else data


def _paired(base: list[str], new: list[str]) -> Iterator[tuple[int | None, int | None]]:
    """Pair cells with equal sources, and those between them in their order."""
    for _, i, i_end, j, j_end in SequenceMatcher(None, base, new, autojunk=False).get_opcodes():
        for k in range(max(i_end - i, j_end - j)):
            yield i + k if i + k < i_end else None, j + k if j + k < j_end else None


def _cell_leaves(base: Cell | None, new: Cell | None, place: str) -> tuple[dict[str, Leaf], dict[str, Leaf]]:
    sides: tuple[dict[str, Leaf], dict[str, Leaf]] = ({}, {})
    contents = [_named(cell) if cell else {} for cell in (base, new)]
    for side, cell in zip(sides, (base, new), strict=True):
        if cell:
            side[f"{place}, source"] = Leaf(SOURCE, cell.source)
    for name in {**contents[0], **contents[1]}:
        both = [content.get(name) for content in contents]
        for side, leaves in zip(sides, _content_leaves(f"{place}, {name}", *both), strict=True):
            side.update(leaves)
    return sides


def _named(cell: Cell) -> dict[str, Any]:
    return {f"output {i}, {media}": content for i, (media, content) in enumerate(cell.outputs, start=1)}


def _content_leaves(place: str, base: Any, new: Any) -> tuple[Leaves, Leaves]:
    if place.endswith(_PNG) and isinstance(base, bytes) and isinstance(new, bytes) and base != new:
        return picture_leaves(read_picture(base), read_picture(new), f"{place}, ")
    return _output_leaves(place, base), _output_leaves(place, new)


def _output_leaves(place: str, content: Any) -> dict[str, Leaf]:
    match content:
        case None:
            return {}
        case bytes():
            return {place: Leaf(IMAGE, f"SHA-256 {sha256(content).hexdigest()[:16]}")}
        case str():
            return dict(_text_leaves(place, content))
    return {f"{place}, {path}": Leaf(TEXT, leaf.value) for path, leaf in json_leaves(content).items()}


def _text_leaves(place: str, text: str) -> Iterator[tuple[str, Leaf]]:
    """Yield the words and the numbers of each line."""
    fields = (THEOREM, THEOREM) if _BY_COQ in text else (TEXT, NUMBERS)
    for i, line in enumerate(text.splitlines(), start=1):
        yield from prose_leaves(f"{place}, line {i}", line, *fields)

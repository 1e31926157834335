"""Find fields in decoded messages by a path like `pose.position.x` or `joints[2].angle`: JSON, Protobuf, ROS 2.

An entry of a list is taken by its number, or by a field that names it: `transforms[child_frame_id=base].transform`.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from itertools import islice
from types import SimpleNamespace

from google.protobuf.message import Message as Protobuf

_NAME = re.compile(r"[^.\[]+")
_INDEX = re.compile(r"\[(\d+)\]\.?", re.ASCII)
_NUMBERED = re.compile(r"\[\d+\]", re.ASCII)
_NAMED = re.compile(r"\[(?P<field>[^=\[\]]+)=(?P<value>[^\]]*)\]\.?")
_LABELS = ("child_frame_id", "name")
_DEPTH = 8
_LISTED = 60


def find(node: object, path: str) -> object:
    """Return the value at `path`; None if it, or a message around it, is unset or null. LookupError: no such field.

    ValueError: several entries of a list have the name that the path gives.
    """
    if not path or node is None:
        return node
    if isinstance(node, Mapping):
        # A key may contain dots, such as "left.rate" in this project's logs: the longest key is tried first.
        for name, rest in _splits(path):
            if name in node:
                return find(node[name], rest)
        raise LookupError(path)
    if isinstance(node, Sequence) and not isinstance(node, str):
        if named := _NAMED.match(path):
            return find(_entry(node, named["field"], named["value"]), path[named.end() :])
        index = _INDEX.match(path)
        if index is None:
            raise LookupError(path)
        return find(node[int(index[1])], path[index.end() :])
    match = _NAME.match(path)
    if match is None:
        raise LookupError(path)
    return find(_attribute(node, match[0]), path[match.end() :].removeprefix("."))


def leaves(message: object) -> list[str]:
    """List the paths of numbers and texts in a message: of a list only its first entry, and not too many in all."""
    found = list(islice(_leaves(message, "", _DEPTH), _LISTED + 1))
    return found if len(found) <= _LISTED else [*found[:_LISTED], "…"]


def labels(message: object, path: str) -> tuple[str, ...]:
    """Return what names the entries that a path takes by their number: a transform's child frame, or a name."""
    entries = [find(message, path[: number.end()]) for number in _NUMBERED.finditer(path)]
    return tuple(label for entry in entries if (label := _label(entry)))


def label_field(message: object, path: str) -> str:
    """Return the path with a name instead of the first number in it."""
    number = _NUMBERED.search(path)
    assert number is not None
    entry = find(message, path[: number.end()])
    field = next(name for name in _LABELS if _text(entry, name))
    return f"{path[: number.start()]}[{field}={_text(entry, field)}]{path[number.end() :]}"


def _label(entry: object) -> str:
    return next((text for name in _LABELS if (text := _text(entry, name))), "")


def _text(entry: object, name: str) -> str:
    try:
        found = find(entry, name)
    except LookupError:
        return ""
    return found if isinstance(found, str) else ""


def _entry(entries: Sequence[object], field: str, value: str) -> object:
    """Return the entry with this text in a field. LookupError: there is none. ValueError: there are several."""
    found = [entry for entry in entries if _text(entry, field) == value]
    if len(found) > 1:
        raise ValueError(f"expected one entry with {field} = {value!r}, got {len(found)}")
    if not found:
        raise LookupError(value)
    return found[0]


def _splits(path: str) -> Iterator[tuple[str, str]]:
    """Yield each name that the path may start with, the longest first, and the rest of the path."""
    yield path, ""
    for end in range(len(path) - 1, 0, -1):
        if path[end] in ".[":
            yield path[:end], path[end:].removeprefix(".")


def _attribute(node: object, name: str) -> object:
    """Return a field of a Protobuf or ROS 2 message; None if it is unset and its type distinguishes that from zero."""
    if isinstance(node, Protobuf):
        field = node.DESCRIPTOR.fields_by_name[name]
        return None if field.has_presence and not node.HasField(name) else getattr(node, name)
    if isinstance(node, SimpleNamespace) and name in _slots(node):
        return getattr(node, name)
    raise LookupError(name)


def _slots(message: SimpleNamespace) -> Sequence[str]:
    return getattr(type(message), "__slots__", ())


def _leaves(node: object, path: str, depth: int) -> Iterator[str]:
    if depth == 0:
        return
    if isinstance(node, int | float | Decimal | str):
        yield path
    for name, child in _children(node):
        dot = "." if path and not name.startswith("[") else ""
        yield from _leaves(child, f"{path}{dot}{name}", depth - 1)


def _children(node: object) -> Iterator[tuple[str, object]]:
    if isinstance(node, Mapping):
        yield from ((str(key), child) for key, child in node.items())
    elif isinstance(node, Protobuf):
        for name, field in node.DESCRIPTOR.fields_by_name.items():
            # An unset message would list the fields of its type, endlessly if the type contains itself.
            if field.message_type is None or not field.has_presence or node.HasField(name):
                yield name, getattr(node, name)
    elif isinstance(node, SimpleNamespace):
        yield from ((name, getattr(node, name)) for name in _slots(node))
    elif isinstance(node, Sequence) and not isinstance(node, str) and node:
        yield "[0]", node[0]

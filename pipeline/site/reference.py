"""What pages say of the code, read from the code: docstrings in the markup of Sphinx, and lists of packages."""

import pkgutil
import re
from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

_CODE = re.compile(r"(`[^`]*`)")


def as_restructured_text(docstring: list[str]) -> list[str]:
    """Return lines of a docstring with `code` marked as code, and without any other mark.

    Docstrings of this project say x_r, |x| and *t.shape, which reStructuredText would take for links, substitutions and
    emphasis.
    """
    parts = _CODE.split("\n".join(docstring))
    plain = (re.sub(r"([*|\\<>])|_(?!\w)", r"\\\g<0>", part) for part in parts[::2])
    code = (f"\\ ``{part[1:-1]}``\\ " if part.strip("`").strip() else part for part in parts[1::2])
    return "".join(a + b for a, b in zip(plain, [*code, ""], strict=True)).splitlines()


def _clean(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = as_restructured_text(lines)


def rooms(package: str) -> dict[str, str]:
    """Return the modules and packages directly in a package, each with the first paragraph of its docstring."""
    path = import_module(package).__path__
    names = sorted(found.name for found in pkgutil.iter_modules(path) if not found.name.startswith("__"))
    return {name: _first_paragraph(import_module(f"{package}.{name}")) for name in names}


def _first_paragraph(module: Any) -> str:
    return " ".join((module.__doc__ or "").strip().split("\n\n")[0].split())


class Rooms(SphinxDirective):
    """`{rooms} trackably`: a table of what is in a package, in the words of the docstrings."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        items = nodes.definition_list()
        for name, about in rooms(self.arguments[0]).items():
            term = nodes.term("", "", nodes.literal(text=f"{self.arguments[0]}.{name}"))
            items += nodes.definition_list_item("", term, nodes.definition("", nodes.paragraph("", "", *_spans(about))))
        return [items]


def _spans(text: str) -> list[nodes.Node]:
    return [
        nodes.literal(text=part[1:-1]) if part.startswith("`") else nodes.Text(part)
        for part in _CODE.split(text)
        if part
    ]


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-process-docstring", _clean, priority=400)  # before sections become fields
    app.add_directive("rooms", Rooms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

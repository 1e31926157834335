"""An extension of Sphinx: formulas drawn by matplotlib, docstrings in its markup, and tables of packages."""

import pkgutil
import re
from functools import cache, partial
from html import escape
from importlib import import_module
from typing import Any

import numpy as np
from docutils import nodes
from docutils.nodes import SkipNode
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextToPath
from sphinx.util.docutils import SphinxDirective
from sphinx.util.logging import getLogger

_log = getLogger(__name__)
_SIZE = 16.0  # font size of a drawing in its own units: 16 units are one em of the page
_DIGITS = 2

# Replacements for TeX commands that matplotlib does not know.
_SAID_OTHERWISE = (
    (r"\\(ge|le|ne)(?![A-Za-z])", r"\\\1q"),
    (r"\\[bB]igg?[lr]?(?![A-Za-z])", ""),
    (r"\\[td]frac", r"\\frac"),
    (r"\\frac(\d)(\d)", r"\\frac{\1}{\2}"),
    (r"\\(underline|overline|sqrt|mathrm|mathcal|bar|dot)(?![A-Za-z])\s*(\\[A-Za-z]+|[A-Za-z])", r"\\\1{\2}"),
    (r"\^\+", r"^{\\mathrm{+}}"),
    (r"\^\\top", r"^{\\top}"),
)


def known(tex: str) -> str:
    """Return a TeX formula with commands that matplotlib knows."""
    for pattern, instead in _SAID_OTHERWISE:
        tex = re.sub(pattern, instead, tex)
    return " ".join(tex.split()).replace(r"\neqq", r"\neq")


@cache
def drawing(tex: str) -> str:
    """Return a TeX formula as SVG in the colour and size of the text. ValueError: matplotlib cannot read it."""
    text, font = f"${known(tex)}$", FontProperties(family="serif", size=_SIZE, math_fontfamily="cm")
    typesetter = TextToPath()
    width, height, descent = typesetter.get_text_width_height_descent(text, font, ismath=True)
    points, codes = typesetter.get_text_path(font, text, ismath=True)
    points = np.asarray(points)
    scale = _SIZE / typesetter.FONT_SCALE
    outline = _outline(points * scale, codes)
    box = f"0 {-(height - descent):.{_DIGITS}f} {width:.{_DIGITS}f} {height:.{_DIGITS}f}"
    style = f"width:{width / _SIZE:.3f}em;height:{height / _SIZE:.3f}em;vertical-align:{-descent / _SIZE:.3f}em"
    said = escape(" ".join(tex.split()), quote=True)
    return (
        f'<svg class="formula" role="img" aria-label="{said}" viewBox="{box}" style="{style}">'
        f'<path fill="currentColor" d="{outline}"/></svg>'
    )


def _outline(points: Any, codes: Any) -> str:
    """Return an outline as the path of an SVG, whose vertical axis points down."""
    letters = {Outline.MOVETO: "M", Outline.LINETO: "L", Outline.CURVE3: "Q", Outline.CURVE4: "C"}
    parts = []
    for ends, code in Outline(points, codes).iter_segments(simplify=False):
        numbers = " ".join(f"{x:.{_DIGITS}f} {-y:.{_DIGITS}f}" for x, y in ends.reshape(-1, 2))
        parts.append("Z" if code == Outline.CLOSEPOLY else letters[code] + numbers)
    return "".join(parts)


def _write(around: str, writer: Any, node: Any) -> None:
    writer.body.append(around.format(_shown(node)))
    raise SkipNode


def _shown(node: Any) -> str:
    """Return the drawing of a formula; if it cannot be read, warn and return its TeX."""
    tex = node.astext()
    try:
        return drawing(tex)
    except ValueError as error:
        _log.warning("formula %r cannot be drawn: %s", tex, str(error).strip().splitlines()[-1])
        return f"<code>{escape(tex)}</code>"


_CODE = re.compile(r"(`[^`]*`)")


def as_restructured_text(docstring: list[str]) -> list[str]:
    """Return the lines of a docstring with `code` marked as code in reStructuredText, and all other markup escaped.

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
    """Return by name the modules and packages directly in a package, with the first paragraph of each docstring."""
    path = import_module(package).__path__
    names = sorted(found.name for found in pkgutil.iter_modules(path) if not found.name.startswith("__"))
    return {name: _first_paragraph(import_module(f"{package}.{name}")) for name in names}


def _first_paragraph(module: Any) -> str:
    return " ".join((module.__doc__ or "").strip().split("\n\n")[0].split())


class Rooms(SphinxDirective):
    """The directive `{rooms} trackably`: a table of the modules in a package, with the heads of their docstrings."""

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
    """Register the extension with Sphinx."""
    inline, display = (partial(_write, around) for around in ("{}", '<div class="math">{}</div>'))
    app.add_html_math_renderer("drawn", (inline, None), (display, None))
    app.connect("autodoc-process-docstring", _clean, priority=400)  # before Sphinx reads sections
    app.add_directive("rooms", Rooms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

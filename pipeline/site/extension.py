"""An extension of Sphinx: formulas as MathML, docstrings in its markup, and tables of packages."""

import pkgutil
import re
from functools import partial
from html import escape
from importlib import import_module
from typing import Any

from docutils import nodes
from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util.docutils import SphinxDirective
from sphinx.util.logging import getLogger

_log = getLogger(__name__)

# Replacements for TeX commands that docutils does not know.
_SAID_OTHERWISE = (
    (r"\\[bB]igg?[lr]?(?![A-Za-z])", ""),
    (r"\\dots(?![A-Za-z])", r"\\ldots"),
    (r"frac(\d)(\d)", r"frac{\1}{\2}"),
)


def mathml(tex: str, display: bool = False) -> str:
    """Return a TeX formula as MathML, inline or on a line of its own. Raises MathError if it cannot be read."""
    for pattern, instead in _SAID_OTHERWISE:
        tex = re.sub(pattern, instead, tex)
    formula: str = tex2mathml(tex, as_block=display)
    return formula


def _write(display: bool, writer: Any, node: Any) -> None:
    """Write a formula; if it cannot be read, warn and write its TeX."""
    tex = node.astext()
    try:
        formula = mathml(tex, display)
    except MathError as error:
        _log.warning("formula %r cannot be drawn: %s", tex, error)
        formula = f"<code>{escape(tex)}</code>"
    writer.body.append(f'<div class="math">{formula}</div>' if display else formula)
    raise SkipNode


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


class Rooms(SphinxDirective):
    """The directive `{rooms} trackably`: a list of the modules in a package, with the heads of their docstrings."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        package = import_module(self.arguments[0])
        names = sorted(found.name for found in pkgutil.iter_modules(package.__path__) if found.name[:2] != "__")
        modules = [import_module(f"{package.__name__}.{name}") for name in names]
        heads = {of.__name__: " ".join((of.__doc__ or "").split("\n\n")[0].split()) for of in modules}
        return self.parse_text_to_nodes("\n".join(f"- `{name}`: {head}" for name, head in heads.items()))


def setup(app: Any) -> dict[str, bool]:
    """Register the extension with Sphinx."""
    app.add_html_math_renderer("mathml", (partial(_write, False), None), (partial(_write, True), None))
    app.connect("autodoc-process-docstring", _clean, priority=400)  # before Sphinx reads sections
    app.add_directive("rooms", Rooms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Formulas of pages as drawings, by matplotlib: they need no script and no font of the reader's."""

import re
from html import escape
from typing import Any

import numpy as np
from docutils.nodes import SkipNode
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextToPath
from sphinx.util.logging import getLogger

_log = getLogger(__name__)
_SIZE = 16.0  # units of a drawing for one em
_DIGITS = 2

# TeX that matplotlib's reading of it does not know, as TeX that it knows.
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
    """Return the same formula in the commands that matplotlib knows."""
    for pattern, instead in _SAID_OTHERWISE:
        tex = re.sub(pattern, instead, tex)
    return " ".join(tex.split()).replace(r"\neqq", r"\neq")


def drawing(tex: str) -> str:
    """Return a formula as SVG in the colour of the text, as high as the text. ValueError: it cannot be read."""
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
    """Return a path of SVG, whose vertical axis points down."""
    letters = {Outline.MOVETO: "M", Outline.LINETO: "L", Outline.CURVE3: "Q", Outline.CURVE4: "C"}
    many = {Outline.CURVE3: 2, Outline.CURVE4: 3}
    parts, i = [], 0
    while i < len(codes):
        if codes[i] == Outline.CLOSEPOLY:
            parts.append("Z")
            i += 1
            continue
        count = many.get(codes[i], 1)
        numbers = " ".join(f"{x:.{_DIGITS}f} {-y:.{_DIGITS}f}" for x, y in points[i : i + count])
        parts.append(letters[codes[i]] + numbers)
        i += count
    return "".join(parts)


def _inline(writer: Any, node: Any) -> None:
    writer.body.append(_shown(node))
    raise SkipNode


def _display(writer: Any, node: Any) -> None:
    writer.body.append(f'<div class="math">{_shown(node)}</div>')
    raise SkipNode


def _shown(node: Any) -> str:
    """Return the drawing, or with a warning the TeX, where it cannot be read."""
    tex = node.astext()
    try:
        return drawing(tex)
    except ValueError as error:
        _log.warning("formula %r cannot be drawn: %s", tex, str(error).strip().splitlines()[-1])
        return f"<code>{escape(tex)}</code>"


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_html_math_renderer("drawn", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

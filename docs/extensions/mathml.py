"""Formulas as MathML, which browsers draw themselves: no script, no image, no network.

latex2mathml converts them; the converter of docutils sets the index of ``\\dot x_i`` below the x.
A formula with a command that it does not know is a warning.
"""

from __future__ import annotations

import re

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator


def _spaced(formula: str) -> str:
    """Set names of functions apart from what they stand beside, and signs near, as TeX does."""
    formula = re.sub(r"(=|&#x0003D;)</mo><mo>&#x02212;", r'\1</mo><mo form="prefix">&#x02212;', formula)
    thin = '<mspace width="0.17em"/>'
    name = r"(<m[io]>[a-z]{2,}</m[io]>)"
    before = r"(</(?:mi|mn|mrow|msub|msup|mfrac)>|\)</mo>)"
    # The base of a script takes no further child: no space there.
    base = "".join(f"(?<!<{tag}>)" for tag in ("msup", "msub", "msubsup", "munder", "munderover"))
    formula = re.sub(before + name, rf"\1{thin}\2", formula)
    return re.sub(f"{base}{name}(?!<mo[^>]*>&#x00028;)", rf"\1{thin}", formula)


def _write(translator: HTML5Translator, node: nodes.math | nodes.math_block, display: str) -> None:
    text = node.astext()
    try:
        formula = _spaced(convert(text, display=display))
        unknown = "\\" in formula
    except Exception as error:  # the converter has no common class of errors
        formula, unknown = str(error), True
    if unknown:
        logging.getLogger(__name__).warning("formula %r: not understood: %s", text, formula, location=node)
    translator.body.append(f'<div class="math">{formula}</div>' if display == "block" else formula)
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer `mathml`."""
    app.add_html_math_renderer(
        "mathml",
        (lambda translator, node: _write(translator, node, "inline"), None),
        (lambda translator, node: _write(translator, node, "block"), None),
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}

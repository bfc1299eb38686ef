"""Equations as MathML: well formed, the same symbols as the LaTeX that stands beside them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter

import pytest
import sympy as sp

from synchain.models.presentation.mathml import GAP, formula, mathml
from synchain.models.presentation.writer import ExpressionWriter, Latex
from synchain.models.scenes.file import load_scene, scene_names


def tree(latex: str) -> ET.Element:
    """The presentation part of a formula."""
    return ET.fromstring(formula(latex))[0][0]


def flat(latex: str) -> str:
    """The text of a formula, as it is read from left to right."""
    return "".join(tree(latex).itertext())


@pytest.mark.parametrize(
    ("latex", "expected"),
    [
        ("x", "<mi>x</mi>"),
        ("12.5", "<mn>12.5</mn>"),
        (r"\frac{a}{2}", "<mfrac><mrow><mi>a</mi></mrow><mrow><mn>2</mn></mrow></mfrac>"),
        (r"\sqrt{x}", "<msqrt><mrow><mi>x</mi></mrow></msqrt>"),
        ("x_1^2", "<msubsup><mi>x</mi><mn>1</mn><mn>2</mn></msubsup>"),
        ("x^2_1", "<msubsup><mi>x</mi><mn>1</mn><mn>2</mn></msubsup>"),
        (r"\vartheta_b", "<msub><mi>ϑ</mi><mi>b</mi></msub>"),
        (r"\mathrm{end}", f'<mrow>{GAP}<mi mathvariant="normal">end</mi>{GAP}</mrow>'),
        (r"\sin^2", f'<msup><mrow>{GAP}<mi mathvariant="normal">sin</mi></mrow><mn>2</mn></msup>'),
        (r"\text{ of 1}", "<mtext>\u00a0of\u00a01</mtext>"),
        ("a < b", "<mi>a</mi><mo>&lt;</mo><mi>b</mi>"),
        ("-x", '<mo form="prefix">−</mo><mi>x</mi>'),
        ("a - x", "<mi>a</mi><mo>−</mo><mi>x</mi>"),
    ],
)
def test_the_pieces_of_a_formula(latex: str, expected: str) -> None:
    assert f"<mrow>{expected}</mrow><annotation" in formula(latex)


def test_primes_stand_behind_the_index() -> None:
    assert flat(r"\chi_1''") == "χ1′′"


def test_a_formula_keeps_its_latex_for_those_who_copy_it() -> None:
    latex = r"\chi_1' < \frac{2}{\pi}"
    assert ET.fromstring(formula(latex))[0][1].text == latex


def test_what_is_not_written_here_is_refused() -> None:
    with pytest.raises(ValueError, match=r"found \\oint; expected LaTeX as this package writes it"):
        formula(r"\oint x")


def test_cases_become_a_table() -> None:
    x = sp.Symbol("x", real=True)
    written = ExpressionWriter(Latex(), {}, frozenset()).write(sp.Piecewise((x, x > 0), (-x / 2, True)))
    rows = tree(written).findall(".//mtr")
    assert [len(row) for row in rows] == [2, 2]
    assert "".join(rows[0][0].itertext()) == "x"


@pytest.mark.parametrize("name", scene_names())
def test_the_equations_of_a_scene_have_every_number_and_greek_letter_of_their_latex(name: str) -> None:
    for line in mathml(load_scene(name).equations).splitlines():
        element = ET.fromstring(line)
        latex = element[0][1].text or ""
        shown = [e.text for e in element[0][0].iter() if e.tag == "mn"]
        assert Counter(shown) == Counter(re.findall(r"\d+(?:\.\d+)?", re.sub(r"\\(text|mathrm){[^}]*}", "", latex)))
        names = [e.text for e in element[0][0].iter() if e.tag == "mi"]
        assert names.count("σ") == len(re.findall(r"\\sigma(?![a-z])", latex))
        assert names.count("ω") == len(re.findall(r"\\omega(?![a-z])", latex))

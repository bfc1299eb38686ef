"""Numbers read straight into sums of cosines are those that SymPy reads; everything else is left to it."""

from __future__ import annotations

from fractions import Fraction

import pytest

from synchain.models.algebra.cosine_sums import AngleSum, expression
from synchain.models.algebra.equality import equal
from synchain.models.claims.cosine_text import cosine_sum
from synchain.models.claims.language import _line
from synchain.models.claims.number_text import exact_number
from synchain.models.claims.verdict import verify
from synchain.models.graphs.families import topology


@pytest.mark.parametrize(
    "text",
    [
        "-4*sin(k*pi/n)**2",
        "-2+2*cos(2*pi*k/n)",
        "cos(pi/7)*sin(2*pi/5)",
        "3*cos(pi*k/5)/(n-1)",
        "-sin(-pi/9)**3",
        "cos(pi/5)-cos(2*pi/5)",
        "sin(pi*(k+1)/n)",
        "1/2-cos(3*pi/4)",
        "-1-4*sin(k*pi/(n-1))**2",
    ],
)
def test_the_number_is_that_of_sympy(text: str) -> None:
    for values in ({"n": 5, "k": 2}, {"n": 12, "k": 7}, {"n": 31, "k": 0}):
        number = cosine_sum(text, values)
        assert number is not None
        assert equal(expression(number), exact_number(text, values))


@pytest.mark.parametrize(
    "text",
    [
        "2",
        "sqrt(2)*cos(pi/7)",
        "cos(1)",
        "cos(pi/0)",
        "cos(x*pi)",
        "cos(pi/10000000001)",
        "exp(I*pi)",
        "cos(pi*pi)",
        "cos(pi+1)",
        "cos(pi/7)**9",
        "1/cos(pi/7)",
        "cos(0.5*pi)",
        "cos(pi/7",
        "cos(pi, pi)",
        "+".join(f"cos(pi/{p})" for p in range(7, 40)),
        "__import__('os').cos(pi)",
    ],
)
def test_other_texts_are_left(text: str) -> None:
    assert cosine_sum(text, {"n": 5}) is None


def test_folded_sums_of_one_number_are_the_same() -> None:
    half = Fraction(1, 2)
    assert AngleSum.cosine(0, 1, 2, 5).folded == AngleSum.cosine(0, -1, 1, 10).folded
    assert AngleSum.cosine(1, half, 3, 7).folded != AngleSum.cosine(1, half, 2, 7).folded


@pytest.mark.parametrize("n", [5, 12, 61])
def test_right_claims_need_no_separation_bounds(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ring's claims are found by their sums of cosines; only the short radicals are compared by bounds."""
    compared = []
    monkeypatch.setattr("synchain.models.claims.verdict.equal", lambda a, b: compared.append(a) or equal(a, b))
    (claim,) = _line(1, f"ring {n}: -4*sin(k*pi/n)**2 for k=0..n-1", None)  # type: ignore[arg-type]
    assert verify(claim).problems == ()
    assert len(compared) <= (0 if n == 61 else n)
    (wrong,) = _line(1, f"ring {n}: -4*sin(k*pi/(n+1))**2 for k=0..n-1", None)  # type: ignore[arg-type]
    verdict = verify(wrong)
    assert not verdict.right
    assert "claimed -4*sin" in " ".join(verdict.problems) or n < 61
    assert len(verdict.expected.split(",")) == len(topology("ring", n).spectrum)

"""Closed forms with symbols: proved for all sizes up to 30, their eigenvectors checked, and printed."""

from __future__ import annotations

import json
from itertools import product

import mpmath
import numpy as np
import pytest
import sympy as sp

from synchain.models.angle_sums import AngleSum
from synchain.models.claims import Claim, Claimed
from synchain.models.closed_forms import NODE, ClosedForm, Term, closed_form, formulas
from synchain.models.topology import topology
from synchain.models.verdict import verify
from synchain.runtime.cli import main

LARGEST = 30


def sizes(form: ClosedForm, largest: int = LARGEST) -> list[dict[str, int]]:
    """All numbers that make graphs of at most so many nodes."""
    names = [str(symbol) for symbol in form.symbols]
    each = range(form.least, largest + 1)
    found = (dict(zip(names, numbers, strict=True)) for numbers in product(each, repeat=len(names)))
    return [numbers for numbers in found if form.size.subs(numbers_of(form, numbers)) <= largest]


def numbers_of(form: ClosedForm, numbers: dict[str, int]) -> dict[sp.Symbol, int]:
    return {symbol: numbers[str(symbol)] for symbol in form.symbols}


def test_which_families_have_one() -> None:
    assert set(formulas()) == {
        "chain", "circulant", "complete", "complete_bipartite", "feed_forward", "grid", "hypercube", "ladder",
        "one_way_ring", "ring", "star", "torus", "wheel",
    }  # fmt: skip


@pytest.mark.parametrize("name", formulas())
def test_every_closed_form_is_proved_up_to_thirty_nodes(name: str) -> None:
    form = closed_form(name)
    for numbers in (n for n in sizes(form) if len(n) == 1 or max(n.values()) <= 6):
        claimed = tuple(Claimed(sp.sstr(value), count, exact=value) for value, count in form.at(**numbers))
        found = verify(Claim(1, name, form.graph(name, **numbers), claimed))
        assert found.problems == (), numbers


@pytest.mark.parametrize("name", formulas())
def test_eigenvectors_to_fifty_digits(name: str) -> None:
    form = closed_form(name)
    for term in (term for term in form.terms if term.vector is not None):
        for numbers in sizes(form, 12)[-4:]:
            given = numbers_of(form, numbers)
            matrix = form.graph(name, **numbers).rows
            for value, _, chosen in term.at(given):
                entry = sp.lambdify(NODE, term.vector.subs(chosen), "mpmath")
                with mpmath.workdps(60):
                    vector = [mpmath.mpc(entry(i)) for i in range(len(matrix))]
                    gamma = mpmath.mpmathify(sp.N(value, 60))
                    for row, x in zip(matrix, vector, strict=True):
                        total = mpmath.fsum(
                            mpmath.mpf(a.numerator) / a.denominator * v for a, v in zip(row, vector, strict=True)
                        )
                        assert abs(total - gamma * x) < mpmath.mpf(10) ** -50
                    assert max(map(abs, vector)) > 0.1


def test_the_waves_of_a_chain_are_its_eigenvectors_exactly() -> None:
    """Up to 30 nodes, G v = gamma v entry by entry in the cyclotomic field."""
    for n in (1, 2, 3, 4, 7, 12, 30):
        for k in range(n):
            gamma = AngleSum.cosine(-2, 1, k, 2 * n)
            wave = [AngleSum.cosine(0, 1, (2 * i + 1) * k, 4 * n) for i in range(n)]
            for i in range(n):
                near = [wave[j] for j in (i - 1, i + 1) if 0 <= j < n]
                felt = sum((other + -wave[i] for other in near), AngleSum.rational(0))
                assert (felt + -(gamma * wave[i])).vanishes()


def test_numbers_that_cannot_be() -> None:
    with pytest.raises(ValueError, match=r"found numbers for \['p'\]; expected them for \['n'\]"):
        closed_form("chain").at(p=3)
    with pytest.raises(ValueError, match="found n = 2; expected at least 3"):
        closed_form("ring").at(n=2)
    with pytest.raises(ValueError, match="topology tree: no closed form with symbols; known for chain"):
        closed_form("tree")


def test_multiplicities_of_nothing_are_left_out() -> None:
    assert closed_form("star").at(n=2) == [(0, 1), (-2, 1)]
    assert list(Term(sp.S(-1), sp.S.Zero).at({})) == []


def test_large_sizes_are_those_of_floats() -> None:
    found = [float(value) for value, count in closed_form("torus").at(p=4, q=5) for _ in range(count)]
    rows = np.array([[float(x) for x in row] for row in topology("torus", 20, shape=(4, 5)).rows])
    assert sorted(found) == pytest.approx(np.linalg.eigvalsh(rows), abs=1e-12)


def test_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "chain", "--symbolic"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "chain of n nodes"
    assert out[1] == "  -4*sin(pi*k/(2*n))**2 for k = 0 … n - 1"
    assert out[2] == "    eigenvector: cos(pi*k*(2*i + 1)/(2*n)) at node i = 0 … n - 1"
    assert main(["spectrum", "hypercube", "--symbolic", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["topology"], found["n"]) == ("hypercube", "2**d")
    assert found["terms"] == [
        {"value": "-2*k", "multiplicity": "binomial(d, k)", "indices": [["k", "0", "d"]], "vector": None}
    ]
    assert main(["spectrum", "chain", "5", "--symbolic"]) == 2
    assert main(["spectrum", "tree", "--symbolic"]) == 2

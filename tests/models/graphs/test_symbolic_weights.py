"""Weights that are symbols: factors and roots, against numbers put in their place; nothing in a text is run."""

from __future__ import annotations

import json
import random
from fractions import Fraction
from pathlib import Path

import pytest
import sympy as sp

from synchain.graphs import chain, ring
from synchain.models.algebra.equality import equal
from synchain.models.graphs.symbolic import SymbolicTopology, from_symbols, read_symbols, weight
from synchain.models.graphs.topology import Topology
from synchain.models.spectra.characteristic import characteristic
from synchain.runtime.cli import main

A, B, C = sp.symbols("a b c")

PROBE = [[-A - B, A, B], [B, -A - B, A], [A, B, -A - B]]
"""Three cells with weights a and b in the two directions round a ring (Fink et al., Phys. Rev. E 61, 5080, 2000)."""


def graph_of(graph: Topology, weights: list[sp.Expr]) -> SymbolicTopology:
    """The graph with the k-th weight on its k-th undirected edge."""
    pairs = [(i, j) for i, j, _ in graph.links if i < j]
    rows = sp.zeros(graph.n)
    for (i, j), w in zip(pairs, weights, strict=True):
        for r, c, x in ((i, j, w), (j, i, w), (i, i, -w), (j, j, -w)):
            rows[r, c] += x
    return from_symbols(rows)


def test_the_universal_probe_has_the_published_eigenvalues() -> None:
    found = from_symbols(PROBE).spectrum
    expected = [-sp.Rational(3, 2) * (A + B) + s * sp.sqrt(3) / 2 * sp.I * (A - B) for s in (1, -1)]
    roots = [root for root, count in found.eigenvalues for _ in range(count)]
    assert len(roots) == 3
    for claimed in ([sp.S.Zero, *expected], roots):
        assert sp.expand(sp.prod(sp.Symbol("z") - r for r in claimed) - found.polynomial.as_expr()) == 0


def test_a_star_of_one_weight() -> None:
    rows = sp.zeros(5)
    for k in range(1, 5):
        for i, j in ((0, k), (k, 0)):
            rows[i, j] += A
            rows[i, i] -= A
    assert dict(from_symbols(rows).spectrum.eigenvalues) == {0: 1, -A: 3, -5 * A: 1}


def test_two_weights_in_a_chain_of_three() -> None:
    found = graph_of(chain(3), [A, B]).spectrum
    roots = {sp.expand(root) for root, _ in found.eigenvalues}
    root = sp.sqrt(A**2 - A * B + B**2)
    assert roots == {sp.S.Zero, -A - B + root, -A - B - root}
    assert found.unsolved == ()


@pytest.mark.parametrize("graph", [chain(4), ring(4), ring(5)])
def test_numbers_in_place_of_symbols_give_the_exact_polynomial(graph: Topology) -> None:
    stream = random.Random(graph.n)
    symbols = sp.symbols(f"w1:{sum(i < j for i, j, _ in graph.links) + 1}")
    weighted = graph_of(graph, list(symbols))
    found = weighted.spectrum
    for _ in range(3):
        values = {str(s): Fraction(stream.randint(1, 20), stream.randint(1, 5)) for s in symbols}
        exact = {s: sp.Rational(values[str(s)].numerator, values[str(s)].denominator) for s in symbols}
        polynomial = characteristic(weighted.at(**values)).coeffs()
        assert [sp.Rational(int(c.p), int(c.q)) for c in polynomial[::-1]] == [
            c.subs(exact) for c in found.polynomial.all_coeffs()
        ]


def test_roots_at_numbers_are_the_proved_eigenvalues() -> None:
    weighted = graph_of(chain(3), [A, B])
    exact = [e.exact for e in weighted.at(a=2, b="1/3").spectrum.eigenvalues]
    roots = [root.subs({A: 2, B: sp.Rational(1, 3)}) for root, _ in weighted.spectrum.eigenvalues]
    assert len(exact) == len(roots) == 3
    assert all(any(equal(sp.expand(root), number) for number in exact) for root in roots)


def test_rational_functions_and_one_way_links() -> None:
    found = from_symbols([["0", "0", "0"], ["1/(1+a)", "-1/(1+a)", "0"], ["0", "a/2", "-a/2"]])
    assert found.symbols == (A,)
    assert {sp.cancel(root) for root, _ in found.spectrum.eigenvalues} == {0, sp.cancel(-1 / (1 + A)), -A / 2}
    assert found.at(a=3).rows[1] == (Fraction(1, 4), Fraction(-1, 4), Fraction(0))
    with pytest.raises(ValueError, match="divides by zero"):
        found.at(a=-1)
    with pytest.raises(ValueError, match=r"found values of \['b'\]; expected them of \['a'\]"):
        found.at(b=1)


def test_weights_that_vanish_leave_no_link() -> None:
    assert len(graph_of(ring(4), [A, A, A, A - 1]).at(a=1).links) == 6


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        *((bad, "expected whole") for bad in ("a.b", "__import__('os')", "a b", "sqrt(a)", "a**b", "a**99", "1/0")),
        ("z", "rename the weight"),
        ("(" * 50 + "a" + ")" * 50 + "+", "expected whole"),
        ("-" * 30 + "a", "nested more than"),
        ("a" * 300, "expected whole"),
        (sp.sqrt(A), "expected whole"),
        (A + 0.5, "expected whole"),
    ],
)
def test_what_is_no_rational_function(entry: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        weight(entry, "here")


def test_wrong_matrices() -> None:
    with pytest.raises(ValueError, match=r"row 1 sums to a \+ b; expected 0"):
        from_symbols([["a", "b"], ["0", "0"]])
    with pytest.raises(ValueError, match="as many as there are rows"):
        from_symbols([["a", "-a"]])
    with pytest.raises(ValueError, match="expected a square of up to 30"):
        from_symbols([["0"] * 31] * 31)


def test_factors_of_higher_degree_are_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "G.txt"
    path.write_text("# three springs\n-a a 0 0\na -a-b b 0\n0 b -b-c c\n0 0 c -c\n")
    found = read_symbols(path).spectrum
    assert [(f.degree(), count) for f, count in found.unsolved] == [(3, 1)]
    assert found.eigenvalues == ((0, 1),)
    assert main(["spectrum", "--symbolic", "--matrix", str(path)]) == 0
    assert "the roots of " in capsys.readouterr().out
    numbers = [word for name in "abc" for word in ("--value", f"{name}=1")]
    assert main(["spectrum", "--symbolic", "--matrix", str(path), *numbers, "--json"]) == 0
    assert [e["exact"] for e in json.loads(capsys.readouterr().out)["eigenvalues"]] == [
        e.text for e in chain(4).spectrum
    ]
    assert main(["spectrum", "--symbolic", "--matrix", str(path), "--value", "a=1"]) == 2
    assert main(["spectrum", "chain", "4", "--value", "a=1"]) == 2

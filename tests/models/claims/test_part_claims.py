"""Claims about parts of spectra, of products, and of graphs of any size: decided exactly, without a list of eigenvalues."""

from __future__ import annotations

import json
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from claim_files import verdicts
from effort import effort

from synchain.graphs import chain, feed_forward, ring, star
from synchain.models.algebra.cosine_sums import AngleSum
from synchain.models.algebra.equality import sign
from synchain.models.claims.part_claims import interval, read_part
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import cartesian, factors
from synchain.runtime.cli import main

RIGHT = [
    "chain 1000000: largest = -4*cos(pi/(2*n))**2, slowest = -4*sin(pi/(2*n))**2, distinct = n",
    "chain 1000000: multiplicity(-2) = 1, multiplicity(-1) = 0, multiplicity(-4*sin(12345*pi/(2*n))**2) = 1",
    "chain 1000000: ratio > 405284734568.68, ratio < 405284734568.69, slowest = ~-9.8696e-12",
    "ring 999999: multiplicity(-1) = 0, multiplicity(-3) = 2, distinct = 500000, multiplicity(-4) = 0",
    "torus 1000 shape=10x10x10: largest = -12, slowest = (sqrt(5)-3)/2, multiplicity(-12) = 1, ratio < 31.5",
    "grid 1000000 shape=100x100x100: slowest = -4*sin(pi/200)**2, largest = -12*cos(pi/200)**2",
    "complete_bipartite 5000 left=300: largest = -n, slowest = -300, multiplicity(-300) = 4699, distinct = 4",
    "hypercube 65536: distinct = 17, multiplicity(-16) = 12870, ratio = 16",
    "cartesian(chain(300), ring(200)): largest = -4-4*cos(pi/600)**2, slowest = -4*sin(pi/600)**2",
    "cartesian(feed_forward(30), cartesian(chain(20), star(9))): largest = -10-4*cos(pi/40)**2",
    "star n=3..9: ratio = n, distinct = 3, multiplicity(-1) = n-2",
    "chain 4: ratio = 3+2*sqrt(2), ratio < 5.83, ratio > 5.82, slowest = ~-0.586, largest <= -2-sqrt(2)",
    "one_way_ring 5: slowest = -1+exp(-2*I*pi/5), multiplicity(-1+exp(4*I*pi/5)) = 1",
    "matrix G.txt: largest = -1-I/2, distinct = 3, multiplicity(-1+I/2) = 1",
    "matrix W.txt: largest = -8-sqrt(13), ratio < 2.65, ratio = (8+sqrt(13))/(8-sqrt(13)), slowest = ~-4.39",
    "wheel 1000: largest = -n, multiplicity(-4) = 2, slowest = -1-4*sin(pi/(n-1))**2",
    "cartesian(chain(2), ring(5)): 0, -2, (-5+sqrt(5))/2^2, (-5-sqrt(5))/2^2, (-9+sqrt(5))/2^2, (-9-sqrt(5))/2^2",
]


@pytest.mark.parametrize("text", RIGHT)
def test_right(text: str, tmp_path: Path) -> None:
    assert [v.problems for v in verdicts(tmp_path, text) if not v.right] == []


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "chain 1000000: largest = -4",
            "claimed largest = -4: largest is -4*sin(999999*pi/2000000)**2 = -3.99999999999",
        ),
        ("chain 1000000: ratio < 405284734568.4", "claimed ratio < 405284734568.4: ratio is 405284734569"),
        ("chain 1000000: largest >= -4*cos(pi/(2*n-1))**2", "claimed largest >="),
        ("chain 1000000: multiplicity(-4*sin(pi/(2*n+1))**2) = 1", "multiplicity(-4*sin(pi/2000001)**2) is 0"),
        ("hypercube 65536: distinct = 16", "claimed distinct = 16: distinct is 17"),
        ("chain 4: slowest = ~-0.587", "claimed slowest = ~-0.587: slowest is -2 + sqrt(2) = -0.585786437627"),
        ("chain 4: ratio <= 5.828427124746190", "ratio is 5.82842712475"),
        ("torus 1000000 shape=100x100x100: largest > -12", "claimed largest > -12: largest is -12"),
        ("matrix W.txt: ratio > 2.65", "claimed ratio > 2.65: ratio is 2.64"),
    ],
)
def test_wrong(text: str, problem: str, tmp_path: Path) -> None:
    (verdict,) = verdicts(tmp_path, text)
    assert len(verdict.problems) == 1
    assert problem in verdict.problems[0]


def test_what_is_right_is_itself_a_claim(tmp_path: Path) -> None:
    head = "grid 600 shape=20x30: "
    (first,) = verdicts(tmp_path, head + "largest = 1, slowest = 1, distinct = 1, multiplicity(-4) = 1")
    assert len(first.problems) == 4
    right = [part.rpartition(" = ")[0] if part.count("=") > 1 else part for part in first.expected.split(", ")]
    (again,) = verdicts(tmp_path, head + ", ".join(right))
    assert again.problems == ()


@pytest.mark.parametrize(
    ("name", "options"), [("torus", {"shape": (8, 9, 10)}), ("grid", {"shape": (20, 30)}), ("torus", {})]
)
def test_parts_of_large_products_are_those_of_floats(name: str, options: dict, tmp_path: Path) -> None:
    graph = topology(name, 720 if len(options.get("shape", ())) == 3 else 600, **options)
    eigenvalues = np.linalg.eigvalsh(np.array([[float(x) for x in row] for row in graph.rows]))
    text = "".join(f" {key}={'x'.join(map(str, value))}" for key, value in options.items())
    distinct = 1 + int(np.sum(np.diff(eigenvalues) > 1e-9))
    fourth = int(np.sum(abs(eigenvalues + 4) < 1e-9))
    (verdict,) = verdicts(
        tmp_path,
        f"{name} {graph.n}{text}: largest = ~{eigenvalues[0]:.8f}, slowest = ~{eigenvalues[-2]:.8f}, distinct = {distinct}, "
        f"multiplicity(-4) = {fourth}",
    )
    assert verdict.problems == ()


def test_a_million_nodes_are_not_listed(tmp_path: Path) -> None:
    """Warm: first calls load SymPy; the count is that of a few eigenvalues."""
    line = "chain 1000000: largest = -4*cos(pi/(2*n))**2, distinct = n, multiplicity(-2) = 1"
    verdicts(tmp_path, line)
    assert effort(lambda: verdicts(tmp_path, line))[1] < 60_000


def test_believed_closed_forms_are_called_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "claims.txt"
    path.write_text("chain 500: distinct = n\nchain 501: distinct = n\ncartesian(chain(2), chain(2)): ratio < 2.5\n")
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "line 1: chain 500: right",
        "line 2: chain 501: right (closed form, not multiplied out)",
        "line 3: cartesian(chain(2), chain(2)): right",
        "3 claims: 3 right, 0 wrong",
    ]
    assert main(["check", str(path), "--json"]) == 0
    claims = json.loads(capsys.readouterr().out)["claims"]
    assert [claim["graphs"][0]["proved"] for claim in claims] == [True, False, True]
    assert claims[2]["graphs"][0]["expected"] == "ratio = 2"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("chain 4: ratio", "found 'ratio'; expected e.g. largest = -4"),
        ("chain 4: ratio 3 = 4", "found '3' behind ratio"),
        ("chain 4: multiplicity = 4", "expected a number in parentheses"),
        ("chain 4: ratio < ~5", "expected an approximation behind = only"),
        ("chain 4: ratio = 5.8", "decimal '5.8'"),
        ("chain 4: largest = -2, 0", "found '0'; expected e.g."),
        ("chain 501: 0, -1", "those about parts of them: largest, slowest, ratio"),
        ("cartesian(chain(100), chain(100)): 0", "10000 nodes; expected at most 500"),
        ("tree 2000: largest < 0", "tree 2000: a graph without a closed form"),
        ("cartesian(chain(4), open(3)): largest = 0", "open"),
        ("one_way_ring 5: ratio < 3", "complex eigenvalues have no order"),
        ("one_way_ring 5: largest < 3", "complex eigenvalues have no order"),
        ("wheel 6000: distinct = 3000", "expected at most 5000 nodes for this part"),
        ("erdos_renyi 501: largest < 0", "without a closed form; expected at most 500 nodes"),
    ],
)
def test_what_cannot_be_decided_is_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        verdicts(tmp_path, text)


def test_factors_of_products() -> None:
    assert factors(cartesian(chain(3), ring(4))) == (chain(3), ring(4))
    assert factors(chain(3)) is None
    assert factors(cartesian(feed_forward(2), star(3))) is not None


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [("~-3.414", "-3.4145", "-3.4135"), ("~5", "4.5", "5.5"), ("~6e-1", "0.55", "0.65"), ("~1.20e2", "119.5", "120.5")],
)
def test_intervals_of_rounded_numbers(text: str, low: str, high: str) -> None:
    assert interval(text) == (Fraction(low), Fraction(high))


def test_signs_of_differences_of_products_are_exact() -> None:
    root = sp.sqrt(2)
    assert sign((root, root), (sp.Integer(2),)) == 0
    assert sign((root, root), (sp.Integer(2) + sp.Rational(1, 10**40),)) == -1
    assert sign((-root,), (-root, root)) == 1
    golden = AngleSum.cosine(0, 1, 1, 5) + AngleSum.cosine(0, 1, 2, 5) + AngleSum.rational(1)
    assert golden.sign() == 0
    assert (golden + AngleSum.rational(Fraction(-1, 10**60))).sign() == -1
    assert (AngleSum.cosine(0, 1, 1, 7) + AngleSum.cosine(0, -1, 2, 7)).sign() == 1


def test_exact_numbers_of_parts_are_sums_of_cosines_where_they_can() -> None:
    assert read_part("largest = -2-sqrt(2)", {}).number == AngleSum.cosine(-2, -1, 1, 8)
    assert read_part("ratio <= -0.5", {}).number == AngleSum.rational(Fraction(-1, 2))
    assert isinstance(read_part("ratio == sqrt(7)", {}).number, sp.Expr)

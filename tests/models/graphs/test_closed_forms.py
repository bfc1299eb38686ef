"""Closed forms with symbols: proved for all sizes up to 30, their eigenvectors checked, and printed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
import sympy as sp

from synchain.graphs import chain, circulant, erdos_renyi, ring, star, torus
from synchain.models.algebra.cosine_sums import AngleSum
from synchain.models.claims.language import Claim, Claimed
from synchain.models.claims.verdict import verify
from synchain.models.graphs.closed_forms import NODE, ClosedForm, Term, closed_form, formulas
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import cartesian, complement, kronecker, union, weighted
from synchain.models.graphs.graph_text import is_composed, read_form, read_graph
from synchain.models.graphs.topology import Topology
from synchain.runtime.cli import main

LARGEST = 30


FORMS = [
    *formulas(),
    "torus(shape=(3, 3, r))",
    "torus(shape=(p,))",
    "grid(shape=(2, q, r))",
    "grid(shape=(2, 2, 2, s))",
    "johnson(k=3)",
    "kneser(k=1)",
    "kneser(k=3)",
    "petersen(step=3)",
    "complete_multipartite(parts=(p, q))",
    "complete_multipartite(parts=(2, q, 3, s))",
    "cartesian(paley, chain)",
    "kronecker(kneser, ring)",
    "circulant(offsets=(1, 3))",
    "circulant(offsets=(1, s))",
    "circulant(offsets=(2, s, t))",
    "cartesian(chain, star)",
    "cartesian(ring, complete)",
    "cartesian(hypercube, torus(shape=(3, q)))",
    "cartesian(complete_bipartite, chain)",
    "cartesian(one_way_ring, chain)",
    "kronecker(ring, complete)",
    "kronecker(hypercube, circulant(offsets=(1, 2)))",
    "kronecker(one_way_ring, ring)",
    "kronecker(torus, complete)",
    "union(wheel, ladder)",
    "union(ring, ring)",
]
"""Families, some with options, and products, as `synchain spectrum … --symbolic` takes them."""


def form_of(text: str) -> ClosedForm:
    return read_form(text) if is_composed(text) else closed_form(text)


def sizes(form: ClosedForm, largest: int = LARGEST) -> list[dict[str, int]]:
    """All numbers that make graphs of at most so many nodes."""
    names = [str(symbol) for symbol in form.symbols]
    each = [range(form.least_of(symbol), largest + 1) for symbol in form.symbols]
    known = [{"primenu": sp.primenu}, "math"]
    size, where = (sp.lambdify(form.symbols, part, known) for part in (form.size, form.where))
    found = (numbers for numbers in product(*each) if size(*numbers) <= largest and where(*numbers))
    return [dict(zip(names, numbers, strict=True)) for numbers in found]


def test_which_families_have_one() -> None:
    assert set(formulas()) == {
        "chain", "circulant", "circular_ladder", "complete", "complete_bipartite", "complete_multipartite",
        "feed_forward", "grid", "hamming", "hypercube", "johnson", "kneser", "ladder", "one_way_ring", "paley",
        "petersen", "ring", "star", "torus", "wheel",
    }  # fmt: skip


def chosen_sizes(text: str) -> list[dict[str, int]]:
    """All sizes up to 30 of a family with one letter; some spread over them of options, of products and of several letters.

    Several letters are at most 6 each, or 16 where not all go together.
    """
    form = form_of(text)
    found = [n for n in sizes(form) if len(n) == 1 or max(n.values()) <= (6 if form.where == sp.true else 16)]
    return found if text in formulas() and len(form.symbols) == 1 else found[:: max(1, len(found) // 9)]


FEW_OR_ALL = pytest.mark.parametrize("few", [True, pytest.param(False, marks=pytest.mark.long)], ids=["few", "all"])
"""The first sizes and some of the others, or all."""


@FEW_OR_ALL
@pytest.mark.parametrize("text", FORMS)
def test_every_closed_form_is_proved_up_to_thirty_nodes(text: str, few: bool) -> None:
    form = form_of(text)
    tried = chosen_sizes(text)
    tried = [*tried[:5], *tried[5::5]] if few else tried
    assert tried
    for numbers in tried:
        claimed = tuple(Claimed(sp.sstr(value), count, exact=value) for value, count in form.at(**numbers))
        found = verify(Claim(1, text, form.graph(**numbers), claimed))
        assert found.problems == (), numbers


WITHOUT = ("feed_forward",)
"""Defective: it has fewer eigenvectors than nodes."""

SILENT = re.compile("johnson|kneser|paley")
"""Families whose closed forms have eigenvalues only."""


@pytest.mark.parametrize("text", [text for text in FORMS if SILENT.search(text)])
def test_forms_without_eigenvectors_have_none_for_some_eigenvalue(text: str) -> None:
    assert any(term.vector is None for term in form_of(text).terms)


@FEW_OR_ALL
@pytest.mark.parametrize("text", [text for text in FORMS if not SILENT.search(text)])
def test_eigenvectors_to_fifty_digits_and_as_many_as_nodes(text: str, few: bool) -> None:
    form = form_of(text)
    for numbers in sizes(form, 10 if few else 16)[-2 if few else -3 :]:
        graph = form.graph(**numbers)
        vectors = []
        for term in form.terms:
            assert term.vector is not None
            for value, count, chosen in term.at(form.by_symbol(numbers)):
                here = list(term.vectors(chosen))
                assert len(here) == count or text in WITHOUT
                gamma = mpmath.mpmathify(sp.N(value, 60))
                vectors += [_proved(graph, gamma, sp.lambdify(NODE, one, "mpmath")) for one in here]
        assert np.linalg.matrix_rank(np.array(vectors, complex), tol=1e-8) == (2 if text in WITHOUT else graph.n)


def _proved(graph: Topology, gamma: object, entry: Callable[[int], object]) -> list[complex]:
    """The entries of an eigenvector, after G v = gamma v has been seen to hold to fifty digits."""
    with mpmath.workdps(60):
        vector = [mpmath.mpc(entry(i)) for i in range(graph.n)]
        felt = [mpmath.mpc(0)] * graph.n
        for target, source, weight in graph.links:
            felt[target] += mpmath.mpf(weight.numerator) / weight.denominator * (vector[source] - vector[target])
        assert all(abs(total - gamma * x) < mpmath.mpf(10) ** -50 for total, x in zip(felt, vector, strict=True))
        assert max(map(abs, vector)) > 0.1
        return [complex(x) for x in vector]


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
        {
            "value": "-2*k",
            "multiplicity": "binomial(d, k)",
            "indices": [["k", "0", "d"]],
            "vector": "Product((-1)**((Mod(floor(i/2**j), 2))*(Mod(floor(m/2**j), 2))), (j, 0, d - 1))",
            "numbered": [["m", "0", "2**d - 1"]],
            "where": "Eq(Sum(Mod(floor(m/2**j), 2), (j, 0, d - 1)), k)",
        }
    ]
    assert main(["spectrum", "torus", "--symbolic", "--option", "shape=pxqxr"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "torus(shape=(p, q, r)), n = p*q*r nodes"
    assert out[1].startswith(
        "  -4*sin(pi*k/p)**2 - 4*sin(pi*k1/q)**2 - 4*sin(pi*k2/r)**2 for k = 0 … p - 1, k1 = 0 … q"
    )
    assert main(["spectrum", "cartesian(chain, ring)", "--symbolic"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "cartesian(chain, ring), n = n*n2 nodes"
    assert out[1] == "  -4*sin(pi*k/(2*n))**2 - 4*sin(pi*k2/n2)**2 for k = 0 … n - 1, k2 = 0 … n2 - 1"
    assert main(["spectrum", "cartesian(chain(2), ring(3))"]) == 0
    assert "6 eigenvalues, 4 distinct; characteristic polynomial: proved" in capsys.readouterr().out
    assert main(["spectrum", "chain", "5", "--symbolic"]) == 2
    assert main(["spectrum", "tree", "--symbolic"]) == 2
    assert main(["spectrum", "cartesian(chain(2), ring(3))", "6"]) == 2
    assert main(["spectrum", "cartesian(chain, ring)", "--symbolic", "--option", "shape=2"]) == 2


@pytest.mark.parametrize(
    "graph",
    [
        cartesian(chain(4), torus(12, shape=(3, 4))),
        union(star(4), complement(ring(5))),
        kronecker(erdos_renyi(5, p="1/10", seed=7), weighted(chain(3), "1/2")),
        cartesian(cartesian(chain(2), chain(2)), circulant(7, offsets=(1, 3))),
    ],
    ids=str,
)
def test_names_of_products_are_read_back(graph: Topology) -> None:
    assert read_graph(graph.name) == graph


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cartesian(chain(4))", "unreadable graph"),
        (
            "cartesian(ring(3), star(4)",
            "unreadable graph 'cartesian(ring(3), star(4)' with a ( that is not closed; expected",
        ),
        ("__import__('os')", "unreadable graph"),
        ("union(chain(2), open(3))", "open"),
        ("cartesian(chain(4), ring(n=5))", "unreadable graph"),
        ("complement(" * 9 + "chain(3)" + ")" * 9, "unreadable graph"),
        ("cartesian(chain(300), chain(300))", "90000 nodes; expected at most 500"),
        ("chain(501)", "501 nodes; expected at most 500"),
        ("union(chain(300), chain(300))", "600 nodes; expected at most 500"),
    ],
)
def test_texts_that_are_no_products(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        read_graph(text, largest=500)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kronecker(chain, ring)", "nodes of chain differ in their in-degrees"),
        ("cartesian(chain(4), ring)", "expected cartesian, kronecker, union of families without sizes"),
        ("complement(chain)", "complement has no closed form without sizes; expected a graph with its size"),
        ("cartesian(ring, weighted(chain, 2))", "weighted has no closed form without sizes"),
        ("torus(shape=(2, q))", "found n = 2; expected a larger number"),
        ("torus(shape=(p, i))", "expected whole numbers or letters other than i and x"),
        ("circulant(offsets=(1, n))", "letters other than n and k"),
        ("cartesian(tree, chain)", "topology tree: no closed form"),
        ("star(left=3)", "topology star: option 'left' with symbols; known: none"),
    ],
)
def test_texts_without_a_closed_form(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        read_form(text)


def test_letters_of_options_obey_their_conditions() -> None:
    form = closed_form("circulant", offsets="1,s")
    assert form.graph(n=9, s=4).options == (("offsets", (1, 4)),)
    with pytest.raises(ValueError, match=r"found \{'n': 9, 's': 5\}; expected"):
        form.at(n=9, s=5)
    with pytest.raises(ValueError, match="expected"):
        form.at(n=9, s=1)


def test_numbers_in_texts_keep_all_their_digits() -> None:
    links = read_graph("weighted(chain(2), 0.1234567890123456789)").links
    assert {weight for _, _, weight in links} == {Fraction("0.1234567890123456789")}
    assert read_graph(" torus(12, shape=(3, 4))") == topology("torus", 12, shape=(3, 4))
    assert read_graph("weighted(chain(4), 1e400)").spectrum.largest < -(10**400)


def test_products_do_not_repeat_what_is_said_of_the_blocks_of_their_factors() -> None:
    assert "one Jordan block of n - 1 for -1" in closed_form("feed_forward").text
    for text in ("cartesian(feed_forward, feed_forward)", "union(feed_forward, feed_forward)"):
        form = read_form(text)
        assert "one Jordan block" not in form.text
        assert "defective, as feed_forward is" in form.text
        assert form.as_dict()["note"] == "defective, as feed_forward is; Jordan blocks are found for given sizes"
    assert "defective" not in read_form("cartesian(chain, ring)").text

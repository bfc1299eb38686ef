"""Closed forms multiplied out modulo large primes: right ones agree, and every planted mistake shows."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
import sympy as sp
from catalogue import CLOSED
from family_sizes import size, sizes

from synchain.graphs import Topology, chain, one_way_ring, ring, star
from synchain.models.graphs.families import family, topology
from synchain.models.graphs.graph_products import cartesian, complement, kronecker, union, weighted
from synchain.models.spectra.eigenvalue import ProofError
from synchain.models.spectra.modular import check_modulo
from synchain.models.spectra.solve import Proof, spectrum
from synchain.models.spectra.spectrum import table
from synchain.runtime.cli import main

COMPOSED = [
    cartesian(chain(4), ring(5)),
    kronecker(ring(5), ring(7)),
    union(star(4), chain(5)),
    complement(ring(9)),
    weighted(cartesian(chain(4), ring(3)), "-5/7"),
]


def listed(graph: Topology) -> list[tuple[sp.Expr, int]]:
    pairs = graph.closed_form()
    assert pairs is not None
    return list(pairs)


@pytest.mark.parametrize(
    "graph",
    [topology(name, n) for name in CLOSED for n in (size(name, 12), sizes(name, range(31))[-1])] + COMPOSED,
    ids=str,
)
def test_closed_forms_agree(graph: Topology) -> None:
    chance = check_modulo(graph, listed(graph))
    assert chance is not None
    assert 0 < chance < 1e-40


@pytest.mark.parametrize(
    "graph", [ring(12), one_way_ring(9), topology("torus", 30), topology("paley", 37), *COMPOSED], ids=str
)
def test_any_small_mistake_shows(graph: Topology) -> None:
    right = listed(graph)
    (first, count), (second, other) = right[0], right[-1]
    tiny = sp.Rational(1, 10**30)
    wrong = [
        [(first + tiny, count), *right[1:]],
        [*right[:-1], (second - tiny, other)],
        [(first, count + 1), *right[1:]],
        [(first, count + 1), *right[1:-1], *([(second, other - 1)] if other > 1 else [])],
    ]
    for pairs in wrong:
        with pytest.raises(ProofError, match=r"do not multiply out to the characteristic polynomial modulo \d{19}"):
            check_modulo(graph, pairs)


def test_an_angle_of_another_ring_shows() -> None:
    with pytest.raises(ProofError):
        check_modulo(ring(300), listed(ring(301)))
    with pytest.raises(ProofError):
        check_modulo(topology("torus", 30), listed(topology("grid", 30)))


def test_radicals_of_short_angles_agree() -> None:
    """Eigenvalues 0, -2 and -2 ± sqrt(2) of the chain, 0, -2 and -1 ± I of the ring."""
    numbers = [-2 + sp.sqrt(2), -2 - sp.sqrt(2), -1 + sp.I, -1 - sp.I]
    pairs = [(sp.Integer(0), 2), (sp.Integer(-2), 2), *((number, 1) for number in numbers)]
    chance = check_modulo(union(chain(4), one_way_ring(4)), pairs)
    assert chance is not None
    assert 0 < chance < 1e-40


def prime_of(graph: Topology) -> int:
    """Return the prime at which a wrong closed form shows."""
    (first, count), *others = listed(graph)
    with pytest.raises(ProofError) as caught:
        check_modulo(graph, [(first + 1, count), *others])
    return int(str(caught.value).split("modulo ")[1].split(":")[0])


def test_the_modulus_is_a_prime_with_roots_of_unity() -> None:
    orders = {star(7): 1, topology("hypercube", 16): 1, ring(7): 7, ring(30): 30, ring(360): 360}
    primes = {graph: prime_of(graph) for graph in orders}
    assert len(set(primes.values())) == len(orders)
    for graph, m in orders.items():
        p = primes[graph]
        assert prime_of(graph) == p
        assert sp.isprime(p)
        assert p % m == 1 % m
        assert 2**61 <= p < 2**62


def test_numbers_that_are_no_sums_of_roots_of_unity_are_not_checked() -> None:
    assert check_modulo(chain(2), [(sp.sqrt(7), 1), (-sp.sqrt(7), 1)]) is None


def test_large_spectra_say_how_they_were_checked(capsys: pytest.CaptureFixture[str]) -> None:
    fresh = spectrum.__wrapped__
    assert (fresh(ring(200)).verified, fresh(ring(200)).error_probability) == (True, None)
    middle = fresh(topology("hypercube", 256))
    assert not middle.verified
    assert middle.error_probability is not None
    assert middle.error_probability < 1e-40
    assert fresh(topology("hypercube", 512)).error_probability is None
    assert fresh(topology("hypercube", 512), proof=Proof.MODULAR).error_probability is not None
    assert fresh(chain(600), proof=Proof.NONE).error_probability is None
    assert "the same modulo three large primes" in table(middle)
    assert main(["spectrum", "ring", "600"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert re.fullmatch(
        r"600 eigenvalues, 301 distinct; .* the same modulo three large primes \(.* of \de-\d\d\)", last
    )


def test_a_wrong_closed_form_of_a_large_graph_is_refused() -> None:
    wrong = listed(topology("star", 300))
    wrong[1:] = [(sp.Integer(-1), 297), (sp.Integer(-300), 2)]
    star = replace(family("star"), spectrum=lambda n: wrong)
    with pytest.raises(ProofError, match="star 300"):
        spectrum.__wrapped__(star(300))

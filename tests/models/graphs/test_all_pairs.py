"""Graphs that join all pairs alike say so without listing a link."""

from __future__ import annotations

from fractions import Fraction

import pytest

from synchain.models.graphs.families import family, names, topology
from synchain.models.graphs.graph_products import complement, union, weighted
from synchain.models.graphs.links import LINK_LIMIT, AllPairs
from synchain.models.graphs.topology import Topology

MILLION = 10**6


@pytest.mark.parametrize("n", [1, 2, 5])
def test_all_pairs_are_the_links_of_the_complete_graph(n: int) -> None:
    pairs = AllPairs(n, Fraction(1))
    assert tuple(pairs) == topology("complete", n).links
    assert len(pairs) == n * (n - 1)


@pytest.mark.parametrize("name", names())
def test_a_family_that_says_so_joins_all_pairs(name: str) -> None:
    """Checked for every family: one that begins to say so by mistake fails here."""
    said = family(name).all_to_all
    assert said == (name == "complete")
    if said:
        for n in range(1, 9):
            graph = topology(name, n)
            assert graph.links == tuple(AllPairs(n, graph.all_to_all or Fraction(0)))


def test_the_weight_of_operations() -> None:
    graph = topology("complete", 7)
    assert weighted(weighted(graph, "2/3"), -1).all_to_all == Fraction(-2, 3)
    assert weighted(graph, "2/3").links == tuple(AllPairs(7, Fraction(2, 3)))
    apart = union(topology("chain", 1), topology("chain", 1))
    assert complement(apart).all_to_all == 1
    assert complement(topology("chain", 3)).all_to_all is None
    assert union(graph, graph).all_to_all is None
    assert weighted(topology("ring", 5), 2).all_to_all is None
    assert Topology("listed", 7, graph.links).all_to_all is None


def test_a_million_nodes_cost_nothing() -> None:
    graph = weighted(topology("complete", MILLION), f"1/{MILLION}")
    assert graph.link_count == MILLION * (MILLION - 1)
    assert graph.spectrum.multiplicities == (1, MILLION - 1)
    assert (graph.spectrum.largest, graph.components, graph.leading_groups) == (-1, 1, 1)
    assert graph.undirected
    assert graph.symmetric
    assert graph == weighted(topology("complete", MILLION), f"1/{MILLION}")
    assert graph != weighted(topology("complete", MILLION), f"2/{MILLION}")
    with pytest.raises(ValueError, match=f"too many links, 999999000000 or more; expected at most {LINK_LIMIT}"):
        graph.links  # noqa: B018


def test_too_many_pairs_are_not_run_through() -> None:
    pairs = AllPairs(MILLION, Fraction(1))
    assert pairs.first(2) == ((0, 1, 1), (0, 2, 1))
    with pytest.raises(ValueError, match=r"found 999999000000 links .* expected at most 4000000 where they are listed"):
        iter(pairs)

"""Characteristic polynomials of chains, rings and forests against dense ones."""

from __future__ import annotations

import random

import pytest
from flint import fmpz_mat, fmpz_poly

from synchain.graphs import Topology, chain, complete, one_way_ring, ring, star, tree, union
from synchain.models.spectra.characteristic import banded, characteristic, cyclic, forest, sparse


def dense(n: int, entries: dict[tuple[int, int], int]) -> fmpz_poly:
    return fmpz_mat([[entries.get((i, j), 0) for j in range(n)] for i in range(n)]).charpoly()


def entries_of(graph: Topology) -> dict[tuple[int, int], int]:
    """All entries other than 0; weights are whole numbers."""
    return {(i, j): int(x) for i, row in enumerate(graph.rows) for j, x in enumerate(row) if x}


@pytest.mark.parametrize("n", [3, 4, 5, 8, 13, 40])
def test_random_matrices_with_corners(n: int) -> None:
    stream = random.Random(n)
    for share in (1.0, 0.7):
        near = [(i, (i + step) % n) for i in range(n) for step in (-1, 0, 1)]
        entries = {position: stream.randint(-9, 9) for position in near if stream.random() < share}
        assert banded(n, entries)
        assert cyclic(n, entries) == dense(n, entries)


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 40])
def test_random_forests(n: int) -> None:
    stream = random.Random(n)
    for share in (1.0, 0.7):
        names = stream.sample(range(n), n)
        links = [(names[i], names[stream.randrange(i)]) for i in range(1, n) if stream.random() < share]
        places = [(i, i) for i in range(n)] + links + [(j, i) for i, j in links if stream.random() < share]
        entries = {position: stream.randint(-9, 9) for position in places}
        assert forest(n, entries) == dense(n, entries)


def test_only_neighbours_and_ends() -> None:
    assert not banded(4, {(0, 2): 1})
    assert not banded(2, {(0, 1): 1})


def test_a_cycle_is_no_forest() -> None:
    assert forest(3, {(0, 1): 1, (1, 2): 1, (2, 0): 1}) is None
    assert forest(4, {(1, 2): 1, (2, 3): 1, (3, 1): 1}) is None


@pytest.mark.parametrize("graph", [chain(30), ring(30), one_way_ring(30), star(30), tree(30), union(tree(9), star(5))])
def test_chains_rings_and_forests_need_no_dense_matrix(graph: Topology) -> None:
    entries = entries_of(graph)
    assert sparse(graph.n, entries, fmpz_poly) == dense(graph.n, entries)
    assert characteristic(graph).degree() == graph.n


def test_other_graphs_need_one() -> None:
    assert sparse(30, entries_of(complete(30)), fmpz_poly) is None

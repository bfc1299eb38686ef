"""Characteristic polynomials of chains and rings against dense ones."""

from __future__ import annotations

import random

import pytest
from flint import fmpz_mat

from synchain.models import chain, one_way_ring, ring, star
from synchain.models.spectra.characteristic import banded, characteristic, cyclic


@pytest.mark.parametrize("n", [3, 4, 5, 8, 13, 40])
def test_random_matrices_with_corners(n: int) -> None:
    stream = random.Random(n)
    for share in (1.0, 0.7):
        near = [(i, (i + step) % n) for i in range(n) for step in (-1, 0, 1)]
        entries = {place: stream.randint(-9, 9) for place in near if stream.random() < share}
        dense = fmpz_mat([[entries.get((i, j), 0) for j in range(n)] for i in range(n)])
        assert banded(n, entries)
        assert cyclic(n, entries) == dense.charpoly()


def test_only_neighbours_and_ends() -> None:
    assert not banded(4, {(0, 2): 1})
    assert not banded(2, {(0, 1): 1})


def test_families_of_the_band_need_no_dense_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synchain.models.spectra.solve.fmpz_mat", None)
    for graph in (chain(30), ring(30), one_way_ring(30)):
        assert characteristic(graph).degree() == 30
    with pytest.raises(TypeError):
        characteristic(star(30))

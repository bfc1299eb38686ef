"""The benchmark of spectra: rows are what the columns say, and digits are counted right."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks import spectrum as bench
from synchain.models.graphs.families import names, topology


@pytest.fixture(scope="module")
def rows() -> list[tuple]:
    return bench.measure(quick=True)


def test_quick_rows(rows: list[tuple]) -> None:
    assert all(len(row) == len(bench.COLUMNS) for row in rows)
    assert {(row[0], row[1]) for row in rows} == {
        ("random integers", 4),
        ("random integers", 10),
        ("complete", 30),
        ("grid", 30),
    }
    methods = [row[2] for row in rows if row[:2] == ("random integers", 4)]
    assert methods == ["synchain", "numpy eigvalsh", "python-flint factors", "sympy eigenvals"]
    ours = [row for row in rows if row[2] == "synchain"]
    assert {row[6] for row in ours} == {"proved"}
    assert all(row[3] > 0 for row in ours)
    assert all(row[4] > 15.9 for row in ours)
    assert all(11 < row[4] < 16 for row in rows if row[2] == "numpy eigvalsh")


def test_the_families_are_those_that_have_closed_forms() -> None:
    assert set(bench.FAMILIES) <= set(names())


def test_digits_are_those_of_the_worst_eigenvalue() -> None:
    exact = topology("chain", 4).spectrum
    values = np.array(exact.values)
    values[2] *= 1 + 1e-7
    assert bench.digits(exact, values) == pytest.approx(7, abs=0.01)
    values[0] = 3.0  # zero does not count
    assert bench.digits(exact, values) == pytest.approx(7, abs=0.01)
    ring = topology("one_way_ring", 5).spectrum
    assert bench.digits(ring, ring.values) > 15.5
    assert bench.digits(ring, np.array(ring.values) + 1e-5j) == pytest.approx(
        -math.log10(1e-5 / abs(ring.values[1])), abs=0.3
    )


def test_random_graphs_are_connected_and_have_no_structure() -> None:
    graph = bench.random_integers(20)
    assert graph.components == 1
    assert {weight for _, _, weight in graph.links} == set(range(1, 10))
    assert graph == bench.random_integers(20)
    assert len(graph.spectrum.eigenvalues) == 20


def test_figure_has_a_line_for_each_method(rows: list[tuple]) -> None:
    times, panel = bench.draw(rows).axes
    assert [line.get_label() for line in times.lines] == [
        "synchain",
        "numpy eigvalsh",
        "python-flint factors",
        "sympy eigenvals",
    ]
    assert [line.get_label() for line in panel.lines] == ["synchain", "numpy eigvalsh"]

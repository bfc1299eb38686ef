"""Classes of equal entries of eigenvectors: against projections in floating point, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from catalogue import UNEVEN, floats

from synchain.graphs import cartesian, chain, complete, feed_forward, from_edges, from_matrix, petersen, star, topology
from synchain.models.graphs.topology import Topology
from synchain.models.symmetries.mode_classes import LARGEST, mode_classes, together

MISSING = {(1, 5), (2, 7), (3, 9), (5, 11), (8, 10), (10, 11)}
ELEVEN = from_edges([(i, j) for i in range(1, 12) for j in range(i + 1, 12) if (i, j) not in MISSING])
"""The network of Pecora et al., Nat. Commun. 5, 4079 (2014): eleven nodes, all links but six."""


def separated(graph: Topology, values: list[float]) -> np.ndarray:
    """Return for each pair of nodes (n, n) whether the modes of eigenvalues near `values` separate them."""
    eigenvalues, vectors = np.linalg.eig(floats(graph))
    near = np.min(np.abs(eigenvalues[:, None] - np.array(values)), axis=1) < 1e-6
    projection = vectors[:, near] @ np.linalg.inv(vectors)[near]
    return np.asarray(np.abs(projection[:, None] - projection[None]).max(axis=2) > 1e-8)


@pytest.mark.parametrize(
    "graph",
    [
        ELEVEN,
        UNEVEN,
        chain(9),
        petersen(10),
        star(6),
        cartesian(chain(3), chain(3)),
        topology("wheel", 7),
        topology("erdos_renyi", 12, p="1/3", seed=4),
        from_matrix([[-3, 1, 2], [1, -1, 0], [2, 1, -3]]),
    ],
    ids=lambda graph: f"{graph.name}{graph.n}",
)
def test_classes_are_those_of_projections_in_floating_point(graph: Topology) -> None:
    modes = mode_classes(graph)
    assert sum(root.multiplicity for mode in modes for root in mode.eigenvalues) == graph.n - 1
    for mode in modes:
        for root in mode.eigenvalues:  # each conjugate root separates the same nodes
            classes = np.array(mode.classes)
            np.testing.assert_array_equal(classes[:, None] != classes, separated(graph, [root.value]))


def test_entries_that_differ_by_less_than_rounding_are_told_apart() -> None:
    """Two nodes whose links differ by 1e-18; two eigenvectors in floating point have equal entries there."""
    tiny = f"{10**18 + 1}/{10**18}"
    graph = from_edges([("a", "b"), ("a", "c", tiny), ("a", "d", 3)])
    (mode,) = mode_classes(graph)
    assert sum(not separated(graph, [root.value])[1, 2] for root in mode.eigenvalues) == 2
    assert mode.classes == (0, 1, 2, 3)


def test_degenerate_modes_separate_all_nodes_that_any_vector_of_the_eigenspace_separates() -> None:
    (mode,) = mode_classes(complete(5))
    assert (mode.eigenvalues[0].multiplicity, mode.classes) == (4, (0, 1, 2, 3, 4))
    slow, fast = mode_classes(star(5))
    assert (slow.classes, fast.classes) == ((0, 1, 2, 3, 4), (0, 1, 1, 1, 1))


def test_defective_modes_use_the_generalised_eigenspace() -> None:
    """A feed-forward chain has one Jordan block, of -1: each node differs from all others in it."""
    (mode,) = mode_classes(feed_forward(5))
    assert mode.classes == (0, 1, 2, 3, 4)


def test_parts_without_links_differ_by_a_mode_of_eigenvalue_zero() -> None:
    zero, pairs = mode_classes(from_edges([(1, 2), (3, 4)]))
    assert (zero.eigenvalues[0].value, zero.classes) == (0, (0, 0, 1, 1))
    assert pairs.classes == (0, 1, 2, 3)


def test_together_is_the_common_refinement() -> None:
    modes = {mode.eigenvalues[0].value: mode for mode in mode_classes(ELEVEN)}
    slow, middle = (next(mode for value, mode in modes.items() if abs(value + x) < 1e-3) for x in (7.382, 8.382))
    assert together(11, []) == (0,) * 11
    assert together(11, [slow]) == slow.classes
    assert together(11, [slow, middle]) == (0, 1, 1, 1, 2, 1, 1, 3, 1, 4, 5)


def test_a_graph_of_too_many_nodes_is_refused() -> None:
    with pytest.raises(ValueError, match=f"expected at most {LARGEST} nodes"):
        mode_classes(chain(LARGEST + 1))

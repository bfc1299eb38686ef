"""Joint eigenvalues of layers: those that a common basis of eigenvectors gives, exactly and with their multiplicities."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from synchain.graphs import chain, circulant, complete, erdos_renyi, from_matrix, joint_spectrum, ring, star, topology
from synchain.models.graphs.topology import Topology


def by_vectors(*graphs: Topology) -> Counter[tuple[complex, ...]]:
    """Joint eigenvalues from eigenvectors of a combination of the matrices, rounded."""
    matrices = [np.array(graph.rows, dtype=float) for graph in graphs]
    vectors = np.linalg.eig(sum(w * m for w, m in zip((1.0, 0.7368, 0.3141), matrices, strict=False)))[1]
    inverse = np.linalg.inv(vectors)
    values = np.stack([np.diag(inverse @ m @ vectors) for m in matrices], axis=1)
    return Counter(tuple(complex(round(v.real, 6) + 0.0, round(v.imag, 6) + 0.0) for v in row) for row in values)


@pytest.mark.parametrize(
    "graphs",
    [
        (ring(6), circulant(6, offsets=(2,))),
        (ring(7), circulant(7, offsets=(2,)), circulant(7, offsets=(3,))),
        (chain(5), complete(5)),
        (erdos_renyi(12, p=0.4, seed=2), complete(12)),
        (ring(5), topology("one_way_ring", 5)),
        (ring(4),),
    ],
)
def test_pairs_are_those_of_common_eigenvectors(graphs: tuple[Topology, ...]) -> None:
    counts = Counter()
    for mode in joint_spectrum(graphs):
        counts[
            tuple(complex(round(complex(v).real, 6) + 0.0, round(complex(v).imag, 6) + 0.0) for v in mode.values)
        ] += mode.multiplicity
    assert counts == by_vectors(*graphs)
    assert sum(counts.values()) == graphs[0].n


def test_eigenvalues_are_exact_and_told_apart_where_one_combination_is_not() -> None:
    """With the weight 97 the first factor that is tried, 1/97, makes two sums equal: -1 - 3 and -4 - 0."""
    second = from_matrix([[Fraction(97) * x for x in row] for row in circulant(6, offsets=(2,)).rows])
    assert [(str(m), m.multiplicity) for m in joint_spectrum((ring(6), second))] == [
        ("(0, 0)", 1),
        ("(-4, 0)", 1),
        ("(-1, -291)", 2),
        ("(-3, -291)", 2),
    ]
    swapped = [str(m) for m in joint_spectrum((second, ring(6)))]
    assert sorted(swapped) == ["(-291, -1)", "(-291, -3)", "(0, -4)", "(0, 0)"]


def test_matrices_beside_those_of_graphs_have_joint_eigenvalues_too() -> None:
    pairs = joint_spectrum((ring(4).adjacency, complete(4).laplacian))
    assert {str(mode): mode.multiplicity for mode in pairs} == {"(2, 0)": 1, "(0, 4)": 2, "(-2, 4)": 1}


def test_matrices_that_do_not_commute_are_refused() -> None:
    with pytest.raises(ValueError, match=r"ring\(4\) and star\(4\): found matrices that do not commute"):
        joint_spectrum((ring(4), star(4)))
    with pytest.raises(ValueError, match="graphs of 4 and 5 nodes"):
        joint_spectrum((ring(4), star(5)))
    with pytest.raises(ValueError, match="found 2000 nodes; expected at most 1000"):
        joint_spectrum((ring(2000), complete(2000)))
    assert len(joint_spectrum((ring(2000),))) == 1001
    with pytest.raises(ValueError, match="graphs of no nodes"):
        joint_spectrum(())

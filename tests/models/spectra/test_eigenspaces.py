"""Exact eigenvectors: proved entry by entry, complete, as many as nodes; wrong ones are seen."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import accumulate, repeat
from operator import mul

import numpy as np
import pytest
import sympy as sp
from family_sizes import size
from flint import fmpq

from synchain.graphs import chain, complete, erdos_renyi, feed_forward, one_way_ring, ring, star, weighted
from synchain.models.algebra.minimal_polynomials import minimal_polynomial
from synchain.models.graphs.families import names, topology
from synchain.models.graphs.matrices import GraphMatrix, MatrixKind
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.spectra import eigenspaces as module
from synchain.models.spectra.eigenspaces import Eigenspace, Vector, check, eigenspaces, null_space
from synchain.models.spectra.eigenvalue import ProofError

DEFECTIVE = from_matrix([[-2, 1, 1, 0], [0, -2, 1, 1], [0, 0, -2, 2], [0, 0, 2, -2]])


def floats(matrix: Topology | GraphMatrix) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in matrix.rows])


def assert_right(matrix: Topology | GraphMatrix, spaces: tuple[Eigenspace, ...]) -> None:
    """All eigenvectors, independent: by floats, apart from the proof."""
    matrix_values, columns = floats(matrix), []
    for space in spaces:
        assert space.dimension == len(space.basis) == space.eigenvalue.geometric
        for vector in space.values:
            values = np.array(vector)
            assert np.max(np.abs(values)) == pytest.approx(1.0, rel=1e-15)
            assert matrix_values @ values == pytest.approx(
                space.eigenvalue.value * values, abs=1e-12 * max(1.0, np.abs(matrix_values).max())
            )
            columns.append(values)
    assert np.linalg.matrix_rank(np.array(columns, complex), tol=1e-8) == len(columns)
    if matrix.diagonalisable:
        assert len(columns) == matrix.n


@pytest.mark.parametrize("name", names())
@pytest.mark.parametrize("n", [5, 12])
def test_eigenvectors_of_all_families(name: str, n: int) -> None:
    graph = topology(name, size(name, n))
    assert_right(graph, graph.eigenspaces)


@pytest.mark.parametrize("kind", MatrixKind)
def test_eigenvectors_of_the_other_matrices(kind: MatrixKind) -> None:
    for graph in (chain(7), star(5), weighted(topology("wheel", 8), "2/3")):
        matrix = GraphMatrix(graph, kind)
        assert_right(matrix, matrix.eigenspaces)


@cache
def spaces_of_random() -> tuple[Eigenspace, ...]:
    """The eigenspaces of the random graph of two tests."""
    return erdos_renyi(30).eigenspaces


def test_a_random_graph_without_short_eigenvalues() -> None:
    spaces = spaces_of_random()
    assert {len(space.basis[0][0]) for space in spaces} == {1, 29}
    assert_right(erdos_renyi(30), spaces)


def test_vectors_by_hand() -> None:
    root = sp.sqrt(2)
    one, slow, middle, fast = chain(4).eigenspaces
    assert one.vectors == (sp.Matrix([1, 1, 1, 1]),)
    assert slow.vectors == (sp.Matrix([-1, 1 - root, root - 1, 1]),)
    assert middle.basis == (((1,), (-1,), (-1,), (1,)),)
    assert fast.vectors == (sp.Matrix([-1, 1 + root, -1 - root, 1]),)
    assert slow.basis == fast.basis  # conjugates
    leaves = star(5).eigenspaces[1]
    assert leaves.dimension == 3
    assert {vector[0] for vector in leaves.basis} == {(0,)}
    assert slow.values == ((1.0, float(root - 1), float(1 - root), -1.0),)


@pytest.mark.parametrize("graph", [chain(4), ring(5), one_way_ring(3), star(4), complete(4), ring(8)], ids=str)
def test_exact_vectors_multiplied_out_by_sympy(graph: Topology) -> None:
    for space in graph.eigenspaces:
        for vector in space.vectors:
            residual = graph.matrix * vector - space.eigenvalue.exact * vector
            assert residual.applyfunc(lambda x: sp.radsimp(sp.expand(x))) == sp.zeros(graph.n, 1)
        joined = sp.Matrix.hstack(*space.vectors)
        assert joined.rank(simplify=True) == space.dimension


@pytest.mark.parametrize(("graph", "total"), [(feed_forward(5), 2), (DEFECTIVE, 3)])
def test_a_defective_matrix_has_fewer(graph: Topology, total: int) -> None:
    spaces = graph.eigenspaces
    assert sum(space.dimension for space in spaces) == total < graph.n
    assert_right(graph, spaces)


def changed(basis: tuple[Vector, ...], by: int) -> tuple[Vector, ...]:
    """The basis with one coefficient of one entry of the last vector changed."""
    first, *others = basis[-1]
    return (*basis[:-1], ((*first[:-1], first[-1] + by), *others))


@pytest.mark.parametrize("graph", [chain(4), ring(7), star(6), erdos_renyi(12), weighted(ring(5), "1/3")], ids=str)
@pytest.mark.parametrize("by", [1, -1])
def test_a_changed_entry_is_seen(graph: Topology, by: int) -> None:
    for space in graph.eigenspaces:
        polynomial = minimal_polynomial(space.eigenvalue.number)
        check(graph, polynomial, space.basis)
        with pytest.raises(ProofError, match=r"entry \d+ of G v and of γ v differ"):
            check(graph, polynomial, changed(space.basis, by))


def test_dependent_vectors_are_seen() -> None:
    slow = ring(5).eigenspaces[1]
    polynomial = minimal_polynomial(slow.eigenvalue.number)
    times_gamma = tuple((-5 * b, a - 5 * b) for a, b in slow.basis[0])  # γ² = -5 - 5 γ
    check(ring(5), polynomial, [slow.basis[0]])
    check(ring(5), polynomial, [times_gamma])
    with pytest.raises(ProofError, match="are dependent"):
        check(ring(5), polynomial, [slow.basis[0], times_gamma])


def test_missing_vectors_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "null_space", lambda matrix: null_space(matrix)[:2])
    with pytest.raises(ProofError, match="eigenspaces of star: found 2 eigenvectors of -1; expected 3"):
        eigenspaces(star(5))
    monkeypatch.setattr(module, "null_space", lambda matrix: null_space(matrix)[:1])
    with pytest.raises(ProofError, match=r"eigenspaces of ring: found 1 eigenvectors of .*; expected 2"):
        eigenspaces(ring(5))


def test_more_nodes_than_can_be_done_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^eigenspaces of ring: found 101 nodes; expected at most 100$"):
        _ = ring(101).eigenspaces


def test_floats_of_long_numbers_are_the_nearest() -> None:
    """Fractions of coefficients of thousands of digits that nearly cancel."""
    space = spaces_of_random()[3]
    gamma = fmpq(*Fraction(str(space.eigenvalue.evaluate(1500))).as_integer_ratio())
    powers = list(accumulate(repeat(gamma, max(map(len, space.basis[0])) - 1), mul, initial=fmpq(1)))
    exact = [sum(fmpq(*c.as_integer_ratio()) * power for c, power in zip(entry, powers, strict=False))
             for entry in space.basis[0]]  # fmt: skip
    top = max(exact, key=abs)
    assert space.values[0] == tuple(float(Fraction(int(x.p), int(x.q))) for x in (e / top for e in exact))

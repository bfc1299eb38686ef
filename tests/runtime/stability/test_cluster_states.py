"""Exponents of cluster states against eigenvalues, the master stability function and simulated networks."""

from __future__ import annotations

import warnings

import mpmath
import numpy as np
import pytest
import sympy as sp

from synchain.models import Scene, Topology, clusters, from_matrix, orbital_partitions, topology
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import STRENGTH, clustered
from synchain.models.mechanics.components import Edge
from synchain.runtime import ClusterExponents, cluster_exponents, exponents, run

pytestmark = pytest.mark.long

PAIR, RING, STAR = topology("chain", 2), topology("ring", 4), topology("star", 4)


def friction(graph: Topology, sigma: float) -> Scene:
    return Scene(topology=graph, parameters={"omega": 1.15, "sigma": sigma})


def damped(graph: Topology, sigma: float) -> Scene:
    return Scene(oscillator="harmonic", coupling="damper", topology=graph, parameters={"sigma": sigma})


@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.3])
def test_a_pair_that_moves_as_one_has_the_exponent_of_its_mode(sigma: float) -> None:
    scene = friction(PAIR, sigma)
    result = cluster_exponents(scene, (0, 0), periods=200)
    expected = exponents(scene, [0.0, 2 * sigma], starts=1).exponent
    assert result.motion == pytest.approx(expected[0], abs=1e-5)
    assert result.exponent[0] == pytest.approx(expected[1], abs=1e-5)
    assert result.verdicts == ("stable" if expected[1] < 0 else "unstable",)


def test_linear_nodes_have_the_eigenvalues_of_each_block() -> None:
    """x'' = -x + sigma gamma x': -sigma |gamma| / 2 below critical damping; the slowest mode of each block counts."""
    for graph, classes, slowest in (
        (STAR, (0, 1, 1, 1), (1,)),
        (RING, (0, 0, 0, 0), (2,)),
        (topology("complete", 4), (0, 0, 1, 1), (4, 4)),
    ):
        result = cluster_exponents(damped(graph, 0.2), classes, transient=40, periods=200, precision=1e-9)
        np.testing.assert_allclose(result.exponent, [-0.2 * size / 2 for size in slowest], atol=3e-3)
        assert set(result.verdicts) == {"stable"}


@pytest.fixture(scope="module")
def ring() -> dict[float, ClusterExponents]:
    """Neighbours on a ring of four apart, opposite ones together."""
    return {sigma: cluster_exponents(friction(RING, sigma), (0, 1, 0, 1), periods=1000) for sigma in (0.12, 0.3)}


def after(sigma: float, periods: float) -> np.ndarray:
    """States (components, nodes) of the ring, started 1e-7 beside the cluster state."""
    scene = friction(RING, sigma).replace(
        initial={"x": [0.30, 0.28, 0.30 + 1e-7, 0.28 + 1e-7], "v": 0.0}, transient=0.0, window=periods, record=()
    )
    return np.asarray(run(scene, reduce=False).states("end").reshape(2, 4))


def test_a_stable_cluster_state_is_reached(ring: dict[float, ClusterExponents]) -> None:
    """sigma = 0.3: complete synchronisation is lost (4 sigma > 0.466), opposite oscillators stay together."""
    assert ring[0.3].verdicts == ("stable", "stable")
    assert ring[0.3].merged == ()
    x = after(0.3, 2000)[0]
    assert np.abs(x[:2] - x[2:]).max() < 1e-10
    assert abs(x[0] - x[1]) > 1e-3


def test_an_unstable_block_breaks_alone(ring: dict[float, ClusterExponents]) -> None:
    """sigma = 0.12: one pair of opposite oscillators parts, the other feels both of them alike and stays together.

    Which pair it is hangs on the start: the motion of the two clusters has a mirror image.
    """
    assert sorted(ring[0.12].verdicts) == ["stable", "unstable"]
    assert ring[0.12].intertwined == ((0,), (1,))
    assert ring[0.12].merged == ()
    gaps = [np.abs((state := after(0.12, periods))[:, :2] - state[:, 2:]).max(axis=0) for periods in (3000, 3250, 3500)]
    stays, breaks = sorted(np.max(gaps, axis=0))
    assert stays < 1e-10
    assert breaks > 1e-3


def test_clusters_that_merge_are_said() -> None:
    """sigma = 0.05: all of the ring synchronises (4 sigma < 0.466), the two clusters with it."""
    result = cluster_exponents(friction(RING, 0.05), (0, 1, 0, 1), transient=3000, periods=64)
    assert result.merged == ((0, 1),)
    assert result.exponent == pytest.approx(exponents(friction(PAIR, 0.0), [0.1], starts=1).exponent[[0, 0]], abs=1e-4)


# -- the variational equation --------------------------------------------------------------------------------


def numbers(entries: dict, values: dict, size: int) -> mpmath.matrix:
    matrix = mpmath.zeros(size)
    for key, e in entries.items():
        matrix[key] = mpmath.mpmathify(sp.N(e.subs(values), 40))
    return matrix


ONE_WAY = from_matrix(np.kron(np.eye(2, dtype=int), [[-1, 1, 0], [0, -2, 2], [3, 0, -3]]).tolist())
"""Two one-way rings of three, side by side: equal places form three clusters whose one block is not symmetric."""

GRAPHS = {
    **{graph: None for graph in (STAR, RING, topology("chain", 5))},
    from_matrix([[-3, 1, 2], [4, -5, 1], [4, 1, -5]]): (0, 1, 1),
    ONE_WAY: (0, 1, 2, 0, 1, 2),
}
"""With a partition, or None for all those that symmetries give."""


@pytest.mark.parametrize("graph", GRAPHS, ids=repr)
def test_quotient_and_blocks_are_together_the_jacobian_of_the_network(graph: Topology) -> None:
    """At any state in which clusters move as one: equal characteristic polynomials, 30 digits."""
    scene = Scene(oscillator="lorenz", coupling="x->x, 1/2 y->z", topology=graph)
    equations, random = scene.equations, np.random.default_rng(2)
    states = [clusters(graph, GRAPHS[graph])] if GRAPHS[graph] else orbital_partitions(graph)
    fixed = {sp.Symbol(name, real=True): sp.Rational(3 + i, 2) for i, name in enumerate(equations.parameters)}
    for state in states:
        network = clustered(equations, state)
        values = {**fixed, STRENGTH: fixed[sp.Symbol("sigma", real=True)]}
        together = dict(fixed)
        for k, members in enumerate(state.members):
            for s in network.orbit.symbols(k):
                values[s] = sp.Rational(int(random.integers(-9, 9)), 4)
            for i in members:
                together |= {a: values[b] for a, b in zip(equations.symbols(i), network.orbit.symbols(k), strict=True)}
        with mpmath.workdps(40):
            part = numbers(dict(network.matrix), values, network.size)
            full = numbers(equations.jacobian(), together, equations.dimension)
            assert network.size == equations.dimension
            for shift in (mpmath.mpf("0.3"), mpmath.mpf("-1.7"), mpmath.mpf("2.9")):
                a, b = (mpmath.det(matrix - shift * mpmath.eye(network.size)) for matrix in (part, full))
                assert abs(a - b) < mpmath.mpf("1e-30") * abs(b)


def test_a_coupling_with_a_state_in_its_derivative_is_refused() -> None:
    equations = damped(PAIR, 0.1).equations
    edge = equations.edge
    assert edge is not None
    gap = edge.there[1] - edge.here[1]
    push = edge.parameters[0] * edge.weight * (gap + gap**3)
    bent = Edge(edge.here, edge.there, edge.weight, (sp.S.Zero, push), edge.parameters)
    with pytest.raises(ValueError, match="has a derivative that depends on the states it joins"):
        clustered(Equations.of_equal_nodes(equations.node, bent, 2, equations.links), clusters(PAIR, (0, 0)))
    with pytest.raises(ValueError, match="these equations have no coupling"):
        clustered(Equations.of_equal_nodes(equations.node, None, 2), clusters(PAIR, (0, 0)))


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="partition is not balanced"):
        cluster_exponents(damped(STAR, 0.1), (0, 0, 1, 1))
    with pytest.raises(ValueError, match=r"belongs to another graph than ring\(4\)"):
        cluster_exponents(damped(RING, 0.1), clusters(topology("complete", 4), (0, 1, 0, 1)))
    with pytest.raises(ValueError, match="found 2 classes for 4 nodes"):
        cluster_exponents(damped(RING, 0.1), (0, 0))


def test_the_table_of_a_state_is_plain() -> None:
    answer = cluster_exponents(friction(PAIR, 0.1), [0, 0], transient=10, periods=64).as_dict()
    assert answer["classes"] == [0, 0]
    assert answer["merged"] == []
    (block,) = answer["blocks"]
    assert (block["clusters"], block["nodes"], block["verdict"]) == ([0], [0, 1], "stable")


def neurons(sigma: float) -> Scene:
    return Scene("fitzhugh_nagumo", "y->x", topology("ring", 6), parameters={"sigma": sigma})


def test_clusters_that_still_approach_each_other_are_said() -> None:
    """Coupling that repels for sigma > 0 brings all neurons together for sigma < 0, at 0.0044 per unit of time."""
    pairs = tuple((a, b) for a in range(4) for b in range(a + 1, 4))
    with pytest.warns(RuntimeWarning, match=r"clusters that approach each other, 1 and 2; .*; raise transient = 168$"):
        result = cluster_exponents(neurons(-0.05), (0, 1, 0, 2, 3, 2), transient=168, periods=56)
    assert 1e-6 < result.separation.max() < 1e-4
    assert (result.merged, result.approaching) == ((), pairs)
    assert "approaching  1 and 2; 1 and 3" in repr(result)
    assert result.as_dict()["approaching"] == [list(pair) for pair in pairs]


def test_clusters_that_have_merged_or_stay_apart_do_not_approach_each_other() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        merged = cluster_exponents(neurons(-0.05), (0, 1, 0, 2, 3, 2), transient=560, periods=56)
        apart = cluster_exponents(neurons(0.05), (0, 1, 0, 2, 3, 2), periods=1)
    assert (len(merged.merged), merged.approaching) == (6, ())
    assert (apart.merged, apart.approaching) == (((0, 3), (1, 2)), ())
    assert apart.separation.max() > 0.1


def test_the_first_half_of_the_transient_may_bring_clusters_nearer() -> None:
    """Two weak oscillators of van der Pol in antiphase, whose amplitude falls to 2 from 20, after 30 periods by 1 %."""
    scene = Scene(
        "van_der_pol", "spring", RING, parameters={"mu": 0.02, "sigma": 0.01}, initial={"x": [20, -20] * 2, "v": 0}
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = cluster_exponents(scene, (0, 1, 0, 1), transient=60, periods=30)
    assert result.separation.max() == pytest.approx(4.0, rel=0.02)
    with pytest.warns(RuntimeWarning, match="clusters that approach each other, 1 and 2; expected"):
        cluster_exponents(scene, (0, 1, 0, 1), transient=0, periods=30)

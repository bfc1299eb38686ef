"""Exponents of cluster states against eigenvalues, the master stability function and simulated networks."""

from __future__ import annotations

import warnings
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp

from synchain import Field, Rates, Scene, cluster_exponents, exponents, run
from synchain.graphs import Topology, clusters, from_matrix, star, topology, triangles
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import clustered
from synchain.results import ClusterExponents

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
    """x'' = -x + sigma gamma x': -sigma |gamma| / 2 below critical damping, for the eigenvalue of each block."""
    for graph, classes, sizes in (
        (STAR, (0, 1, 1, 1), (1,)),
        (RING, (0, 0, 0, 0), (4, 2)),
        (topology("complete", 4), (0, 0, 1, 1), (4, 4)),
    ):
        result = cluster_exponents(damped(graph, 0.2), classes, transient=40, periods=200, precision=1e-9)
        np.testing.assert_allclose(result.exponent, [-0.2 * size / 2 for size in sizes], atol=3e-3)
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

PANEL = from_matrix([[-6, 3, 1, 1, 1], [3, -6, 1, 1, 1], [2, 2, -6, 1, 1], [2, 2, 1, -6, 1], [2, 2, 1, 1, -6]])
"""A pair and a triple: nodes feel the weight 3 in the pair, and 2 in the triple."""

LORENZ = {"oscillator": "lorenz", "coupling": "x->x, 1/2 y->z"}
NODE, OTHER = (
    Field({"x": "y - x**3", "y": "a - x"}, parameters={"a": 0.1}),
    Field({"y": "-b*y**3"}, parameters={"b": 1}),
)
SYNAPSE = Rates({"x": "g*W*(2 - x_i)*tanh(x_j)"}, {"g": 0.3})
SPRING = Rates({"y": "k*W*((x_j - x_i) + (x_j - x_i)**3)"}, {"k": 0.2})
COMMON = Rates({"y": "k*W*y_i*y_j"}, {"k": 0.2})
THREE = Rates({"x": "q*W*(x_j*x_k*y_j - x_i**2*y_i)"}, {"q": 0.4})
PUSH = Rates({"x": "q*W*a_i*a_j*(x_j - x_i)"}, {"q": 0.4})

STATES = {
    "star": (LORENZ, STAR, (0, 1, 1, 1)),
    "ring": (LORENZ, RING, (0, 1, 0, 1)),
    "chain": (LORENZ, topology("chain", 5), (0, 1, 2, 1, 0)),
    "weights": (LORENZ, from_matrix([[-3, 1, 2], [4, -5, 1], [4, 1, -5]]), (0, 1, 1)),
    "one-way": (LORENZ, ONE_WAY, (0, 1, 2, 0, 1, 2)),
    "non-linear": ({"oscillator": NODE, "coupling": SPRING}, topology("ring", 6), (0, 1, 2, 0, 1, 2)),
    "synapses": ({"oscillator": NODE, "coupling": SYNAPSE}, topology("ring", 6), (0, 0, 1, 0, 0, 1)),
    "unequal sums inside": ({"oscillator": NODE, "coupling": SYNAPSE}, PANEL, (0, 0, 1, 1, 1)),
    "layers": ({"oscillator": NODE}, [(SPRING, topology("ring", 6)), (SYNAPSE, topology("complete", 6))], (0, 1) * 3),
    "no common modes": ({"oscillator": NODE}, [(SPRING, RING), (PUSH, STAR)], (0, 0, 0, 0)),
    "three ends": (
        {"oscillator": NODE}, [(SPRING, RING), (THREE, triangles([(1, 2, 3), (2, 3, 4, "1/2")]))], (0, 0, 0, 0),
    ),
    "kinds": (
        {"oscillator": NODE, "nodes": [{"oscillator": OTHER, "at": [1, 4]}], "coupling": COMMON},
        topology("ring", 6), (0, 1, 1, 0, 1, 1),
    ),
    "parameters": (
        {"oscillator": NODE, "coupling": PUSH, "parameters": {"a": [1, 2, 1, 2]}}, RING, (0, 1, 0, 1),
    ),
}  # fmt: skip
"""Arguments of a scene, its graph or layers, and a partition."""


def scene_of(name: str) -> tuple[Scene, tuple[int, ...]]:
    arguments, graph, classes = STATES[name]
    return Scene(**arguments, **({"links": graph} if isinstance(graph, list) else {"topology": graph})), classes


@pytest.mark.filterwarnings("ignore:topology|coupling")
@pytest.mark.parametrize("name", STATES)
def test_quotient_and_blocks_are_together_the_jacobian_of_the_network(name: str) -> None:
    """At any state in which clusters move as one: equal characteristic polynomials, 30 digits."""
    scene, classes = scene_of(name)
    equations, random = scene.equations, np.random.default_rng(2)
    state = clusters([graph for _, graph in scene.model.linked], classes)
    network = clustered(equations, state)
    # nodes of one class have equal parameters and states
    values: dict[sp.Symbol, sp.Expr] = {}
    for k, name_of in enumerate(equations.parameters):
        base, _, node = name_of.rpartition("_")
        k = state.members[classes[int(node) - 1]][0] if base in equations.varied else k
        values[sp.Symbol(name_of, real=True)] = sp.Rational(3 + k, 2)
    for k, members in enumerate(state.members):
        for s in network.variation.orbit.symbols(k):
            values[s] = number = sp.Rational(int(random.integers(-9, 9)), 4)
            for i in members:
                values[sp.Symbol(f"{s.name.rpartition('_')[0]}_{i + 1}#", real=True)] = number
    together = {
        s: values.get(sp.Symbol(f"{s.name}#", real=True), values.get(s))
        for s in map(real, (*equations.state, *equations.parameters))
    }
    with mpmath.workdps(40):
        full = numbers(equations.jacobian(), together, equations.dimension)
        parts = []
        times = [1, *(block.multiplicity for block in state.blocks)]
        for slots, row, count in zip(network.slots, network.strengths, times, strict=True):
            strengths = dict(zip(network.variation.parameters, (mpmath.mpf(precise(x)) for x in row), strict=True))
            whole = numbers(dict(network.variation.matrix), values | strengths, network.variation.size)
            rows = [r for slot in slots for r in network.rows[slot]]
            parts += [mpmath.matrix([[whole[r, c] for c in rows] for r in rows])] * count
        assert sum(part.rows for part in parts) == equations.dimension
        for shift in (mpmath.mpf("0.3"), mpmath.mpf("-1.7"), mpmath.mpf("2.9")):
            product = mpmath.mpf(1)
            for part in parts:
                product *= mpmath.det(part - shift * mpmath.eye(part.rows))
            expected = mpmath.det(full - shift * mpmath.eye(full.rows))
            assert abs(product - expected) < mpmath.mpf("1e-28") * abs(expected)


def precise(number: object) -> mpmath.mpf:
    """A number of a block to 40 digits."""
    if isinstance(number, Fraction):
        return mpmath.mpf(number.numerator) / number.denominator
    theta = mpmath.findroot(
        lambda x: mpmath.polyval(number.root.polynomial[::-1], x), float(number.root.enclosure(53).mid())
    )
    return sum(mpmath.mpf(c.numerator) / c.denominator * theta**k for k, c in enumerate(number.coefficients))


def real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


# -- runs beside the variational equation of the whole network, by NumPy ------------------------------------------


def exponents_of_network(rates, jacobian, state: np.ndarray, subspaces: list[np.ndarray], settle: float, time: float):
    """Largest exponent of the whole network in each subspace (columns), along an orbit of the clusters.

    Classical Runge-Kutta with fixed steps; deviations are projected onto their subspace.
    """
    h, logs = 0.02, np.zeros(len(subspaces))
    projectors = [space @ np.linalg.pinv(space) for space in subspaces]
    vectors = [space @ np.random.default_rng(1).normal(size=space.shape[1]) for space in subspaces]
    for n in range(round((settle + time) / h)):
        k1 = rates(state)
        k2 = rates(state + h / 2 * k1)
        k3 = rates(state + h / 2 * k2)
        k4 = rates(state + h * k3)
        a, b, c = jacobian(state), jacobian(state + h / 2 * k1), jacobian(state + h / 2 * k2)
        d = jacobian(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        for k, v in enumerate(vectors):
            m1 = a @ v
            m2 = b @ (v + h / 2 * m1)
            m3 = c @ (v + h / 2 * m2)
            m4 = d @ (v + h * m3)
            v = projectors[k] @ (v + h / 6 * (m1 + 2 * m2 + 2 * m3 + m4))
            size = np.linalg.norm(v)
            vectors[k] = v / size
            logs[k] += np.log(size) if n * h >= settle else 0.0
    return logs / time


def test_layers_without_common_modes_have_the_exponents_of_the_network() -> None:
    """Neurons of FitzHugh and Nagumo: gap junctions on a ring of six, synapses from a star of two-way links.

    The difference of mirrored nodes (0, 0, 1, -1, ...) is apart from the vectors that the mirror leaves alone.
    """
    node = Field(
        {"x": "x - x**3/3 - y + I", "y": "eps*(x + a - b*y)"}, parameters={"I": 0.5, "eps": 0.2, "a": 0.7, "b": 0.8}
    )
    gap = Rates({"x": "g*W*(x_j - x_i)"}, {"g": 0.1})
    slow = Rates({"y": "q*W*(x_j - x_i)"}, {"q": 0.15})
    ring, star = topology("ring", 6), topology("star", 6)
    scene = Scene(node, links=[(gap, ring), (slow, star)], initial={"x": 0.3, "y": 0.1})
    result = cluster_exponents(scene, [0] * 6, transient=20, periods=400, precision=1e-9)
    sizes = [len(block.cluster_of) for block in result.state.blocks]
    assert sorted(sizes) == [1, 1, 3]
    g, s = np.array(ring.rows, dtype=float), np.array(star.rows, dtype=float)

    def rates(state: np.ndarray) -> np.ndarray:
        x, y = state
        return np.array([x - x**3 / 3 - y + 0.5, 0.2 * (x + 0.7 - 0.8 * y)])

    def jacobian(state: np.ndarray) -> np.ndarray:
        one = np.eye(6)
        return np.block([[(1 - state[0] ** 2) * one + 0.1 * g, -one], [0.2 * one + 0.15 * s, -0.16 * one]])

    odd = np.array([[0, 1, 1, 0, -1, -1], [0, 1, -1, 0, 1, -1]], dtype=float).T
    even = np.array([[1, 0, 0, -1, 0, 0], [2, -1, 0, 0, 0, -1], [0, 1, -1, 0, -1, 1]], dtype=float).T
    spaces = [np.kron(np.eye(2), part) for part in (odd[:, :1], odd[:, 1:], even)]
    expected = exponents_of_network(rates, jacobian, np.array([0.3, 0.1]), spaces, 100.0, 848.0)
    assert sorted(result.exponent) == pytest.approx(sorted(expected), abs=2e-3)
    largest = result.exponent[sizes.index(3)]
    assert largest == pytest.approx(expected[2], abs=2e-3)


def test_linear_kinds_have_the_eigenvalues_of_the_network() -> None:
    """A ring of six: two heavy bodies opposite each other, pairs of light ones between them, and synapses to all."""
    light, heavy = Field({"x": "-x + y", "y": "-2*y"}), Field({"x": "-x/2"})
    push = Rates({"x": "k*W*(x_j + x_i/2)"}, {"k": 0.1})
    scene = Scene(
        light, push, topology("ring", 6), nodes=[{"oscillator": heavy, "at": [1, 4]}], initial={"x": 1.0, "y": 0.5}
    )
    result = cluster_exponents(scene, (0, 1, 1, 0, 1, 1), transient=20, periods=60, precision=1e-9)
    w = np.array([[float(abs(i - j) in (1, 5)) for j in range(6)] for i in range(6)])
    rates = np.diag([-0.5, -1, -1, -0.5, -1, -1]) + 0.1 * w + 0.1 * np.eye(6)  # each node has two links
    # differences: opposite heavy bodies with the light pairs on their sides, and light ones within a pair
    expected = []
    for vectors in ([[1, 0, 0, -1, 0, 0], [0, 1, -1, 0, -1, 1]], [[0, 1, 1, 0, -1, -1]], [[0, 1, -1, 0, 1, -1]]):
        basis = np.linalg.qr(np.array(vectors, dtype=float).T)[0]
        expected.append(np.linalg.eigvalsh(basis.T @ rates @ basis).max())
    assert sorted(result.exponent) == pytest.approx(sorted(expected), abs=1e-6)
    assert np.isinf(result.separation[0, 1])
    assert result.merged == result.approaching == ()


@pytest.mark.filterwarnings("ignore:coupling")
def test_ten_clusters_have_the_exponents_of_half_a_chain() -> None:
    """Differences of mirror images in a chain of linear nodes: eigenvalues of J + sigma G on odd vectors."""
    node, graph = Field({"x": "-x/5 + y", "y": "-x - y/10"}), topology("chain", 20)
    scene = Scene(node, Rates({"x": "k*W*(y_j - y_i)"}, {"k": 0.1}), graph, initial={"x": 1.0, "y": 0.5})
    result = cluster_exponents(scene, [min(i, 19 - i) for i in range(20)], transient=50, periods=500)
    modes = [value for k, value in enumerate(sorted(graph.spectrum.values, reverse=True)) if k % 2]
    expected = max(np.linalg.eigvals([[-0.2, 1.0 + 0.1 * value], [-1.0, -0.1]]).real.max() for value in modes)
    assert result.exponent[0] == pytest.approx(expected, abs=2e-3)


def test_links_without_a_sum_of_weights_are_refused() -> None:
    equations = damped(PAIR, 0.1).equations
    with pytest.raises(ValueError, match="these equations have no coupling"):
        clustered(Equations.of_equal_nodes(equations.node, None, 2), clusters(PAIR, (0, 0)))
    squared = Rates({"x": "g*W**2*(x_j - x_i)"}, {"g": 0.3})
    with pytest.raises(ValueError, match="is not proportional to its weight"):
        cluster_exponents(Scene("rossler", squared, PAIR), (0, 0))
    with pytest.raises(ValueError, match="nodes 1 and 2 of one class feel the weights 1 and 0 of their class"):
        cluster_exponents(Scene(NODE, SYNAPSE, from_matrix([[-2, 1, 1], [0, -1, 1], [1, 1, -2]])), (0, 0, 1))
    with pytest.raises(ValueError, match="nodes 1 and 2 of one class are of different kinds"):
        cluster_exponents(Scene(NODE, COMMON, PAIR, nodes=[{"oscillator": OTHER, "at": [1]}]), (0, 0))
    with pytest.raises(ValueError, match="nodes 1 and 2 of one cluster differ in a; expected equal nodes"):
        cluster_exponents(Scene(NODE, SPRING, PAIR, parameters={"a": [1, 2]}), (0, 0))


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


@pytest.mark.parametrize("s", [1e-12, 1e6])
def test_clusters_merge_in_any_unit_of_state(s: float) -> None:
    """A Rössler star: the hub and its leaves move apart at sigma = 0.01, and alike at 0.5."""
    node = Field({"x": "-y - z", "y": "x + 0.2*y", "z": "0.2*s + z*(x/s - 9)"}, parameters={"s": s})
    start = {"x": [s, 2 * s, 2 * s, 2 * s], "y": 0.5 * s, "z": 0.1 * s}
    scene = Scene(node, "x->x", star(4), initial=start, parameters={"s": s})
    apart, alike = (cluster_exponents(scene, [0, 1, 1, 1], sigma=sigma, periods=100) for sigma in (0.01, 0.5))
    assert (apart.merged, alike.merged) == ((), ((0, 1),))
    assert 10 * s < apart.separation[0, 1] < 100 * s

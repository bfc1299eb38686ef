"""Links of three ends: equations, runs, energy and stability, beside independent sums."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import (
    Field,
    Potential,
    Rates,
    Scene,
    cluster_exponents,
    ends,
    equilibrium,
    exponents,
    lyapunov_spectrum,
    run,
    thresholds,
    transition,
    universal_probe,
)
from synchain.codegen.export.python import to_python
from synchain.graphs import circulant, clusters, complete, from_edges, ring, triangles

NODE = Field(
    {"x": "-y - z", "y": "x + a*y", "z": "b + z*(x - c)"},
    parameters={"a": 0.2, "b": 0.2, "c": 7}, initial={"x": 1, "y": 1, "z": 1},
)  # fmt: skip
PAIR = Rates({"x": "p*W*(x_j - x_i)"}, {"p": 0.02})
THREE = Rates({"x": "q*W*(x_j**2*x_k - x_i**3)"}, {"q": 5e-4})
DIAMOND = from_edges([(1, 2), (1, 3), (2, 3), (2, 4), (3, 4)])


def scene(graph, hypergraph, **more) -> Scene:
    return Scene(
        NODE, links=[(PAIR, graph), (THREE, hypergraph)], transient=0, window=5, time_unit="time", rtol=1e-10, **more
    )


def rates(state: np.ndarray, graph, hypergraph) -> np.ndarray:
    """Gambuzza et al. 2021, equation 1: sums over all ordered pairs of the other two nodes of a triangle."""
    x, y, z = state.reshape(3, -1)
    dx = -y - z
    for i, j, w in graph.links:
        dx[i] += 0.02 * float(w) * (x[j] - x[i])
    for *nodes, w in hypergraph.triangles:
        for i, j, k in permutations(nodes):
            dx[i] += 5e-4 * float(w) * (x[j] ** 2 * x[k] - x[i] ** 3)
    return np.concatenate([dx, x + 0.2 * y, 0.2 + z * (x - 7)])


def test_ends_of_a_link_of_three() -> None:
    i, j, k, W = ends(NODE, 3)
    q = sp.Symbol("q")
    assert Rates({i.x: q * W * (j.x**2 * k.x - i.x**3)}, {q: 5e-4}) == THREE
    assert THREE.triadic
    assert not PAIR.triadic
    with pytest.raises(AttributeError, match="end k of a link: unknown 'a'"):
        k.a  # noqa: B018
    with pytest.raises(ValueError, match="unknown 'a' at the source of a link; known: x, y, z"):
        Scene(NODE, Rates({"x": "W*a_k*x_j"}), triangles([(1, 2, 3)]))


def test_equations_and_jacobian_are_those_of_the_sums() -> None:
    hypergraph = triangles([(1, 2, 3), (2, 3, 4, "1/2")])
    equations = scene(DIAMOND, hypergraph).equations
    state = np.random.default_rng(1).normal(size=12)
    values = dict(zip(map(sp.Symbol, equations.state), state, strict=True))
    values = {sp.Symbol(s.name, real=True): x for s, x in values.items()}
    values |= {sp.Symbol(n, real=True): x for n, x in {"a": 0.2, "b": 0.2, "c": 7, "p": 0.02, "q": 5e-4}.items()}
    found = np.array([float(e.xreplace(values)) for e in equations.rhs()])
    np.testing.assert_allclose(found, rates(state, DIAMOND, hypergraph), rtol=1e-13)
    jacobian = np.zeros((12, 12))
    for key, e in equations.jacobian().items():
        jacobian[key] = float(e.xreplace(values))
    h = 1e-6
    for column in range(12):
        step = h * np.eye(12)[column]
        slope = (rates(state + step, DIAMOND, hypergraph) - rates(state - step, DIAMOND, hypergraph)) / (2 * h)
        np.testing.assert_allclose(jacobian[:, column], slope, atol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize(
    ("integrator", "n"), [("dop853", 4), ("taylor", 4), ("rodas5p", 4), ("dop853", 12), ("taylor", 12), ("auto", 12)]
)
def test_runs_are_those_of_scipy(integrator: str, n: int) -> None:
    graph = DIAMOND if n == 4 else circulant(n, offsets=(1, 2))
    hypergraph = triangles(graph)
    x = 1 + 0.1 * np.sin(np.arange(n))
    found = run(scene(graph, hypergraph, integrator=integrator, initial={"x": x.tolist(), "y": 1, "z": 1}))
    start = np.concatenate([x, np.ones(2 * n)])
    expected = solve_ivp(
        lambda _, y: rates(y, graph, hypergraph), (0, 5), start, method="DOP853", rtol=1e-11, atol=1e-12
    ).y[:, -1]
    np.testing.assert_allclose(found.states("end").ravel(), expected, rtol=1e-7)


@pytest.mark.long
def test_a_potential_of_three_ends_keeps_its_energy() -> None:
    """H = sum of (v² + x²)/2 and of q w (x_i + x_j + x_k)⁴/4 over the triangles, each once."""
    potential = Potential("q*W*(x_i + x_j + x_k)**4/4", {"q": 0.3})
    body = Scene(
        "harmonic", potential, triangles([(1, 2, 3), (2, 3, 4, "1/2")]), initial={"x": [1, 0.5, -0.3, 0.2], "v": 0},
        transient=0, window=30, time_unit="time", rtol=1e-10,
    )  # fmt: skip

    def energy(x: np.ndarray, v: np.ndarray) -> float:
        return (x**2 + v**2).sum() / 2 + 0.3 * (x[:3].sum() ** 4 + x[1:].sum() ** 4 / 2) / 4

    end = run(body).states("end").reshape(2, 4)
    assert energy(*end) == pytest.approx(energy(np.array([1, 0.5, -0.3, 0.2]), np.zeros(4)), rel=1e-9)


@pytest.mark.long
def test_natural_coupling_has_one_strength() -> None:
    """h2(x_i, x_j, x_j) = h1(x_i, x_j) = x_j³ - x_i³: pairs and triangles act on modes as one (Gambuzza et al. 2021).

    On a complete graph of four both Laplacians commute: gamma = -4 and -8.
    """
    cubic = Rates({"x": "p*W*(x_j**3 - x_i**3)"}, {"p": 1e-3})
    both = Scene(NODE, links=[(cubic, complete(4)), (THREE, triangles(complete(4)))])
    alone = Scene(NODE, cubic, complete(4))
    p, q = 1e-3, 5e-4
    found = exponents(both, [[4 * p, 8 * q], [8 * p, 0.0]], starts=1, periods=200).exponent
    expected = exponents(alone, [8 * p], starts=1, periods=200).exponent[0]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    triad = Scene(NODE, THREE, triangles(complete(4)))
    np.testing.assert_allclose(exponents(triad, [8 * p], starts=1, periods=200).exponent, expected, atol=1e-6)
    assert [(e.number, e.multiplicity) for e in triad.spectrum] == [(0, 1), (-8, 3)]


@pytest.mark.long
def test_blocks_have_the_exponents_of_the_whole_network() -> None:
    """The largest transversal exponents beside the spectrum of the network with all its links, on one orbit."""
    network = scene(DIAMOND, triangles([(1, 2, 3), (2, 3, 4, "1/2")])).replace(initial={"x": 1, "y": 1, "z": 1})
    blocks = cluster_exponents(network, [0] * 4, periods=400)
    spectrum = lyapunov_spectrum(network, periods=400, count=4).exponent
    assert [len(block.cluster_of) for block in blocks.state.blocks] == [1, 2]
    largest = max(blocks.motion, *blocks.exponent)
    assert spectrum[0] == pytest.approx(largest, abs=0.02)


def test_what_is_refused() -> None:
    hypergraph = triangles([(1, 2, 3), (2, 3, 4)])
    network = Scene(NODE, THREE, hypergraph)
    assert clusters(hypergraph, [0, 1, 1, 0]).blocks  # of the generalised Laplacian alone
    for call, message in (
        (lambda: Scene(NODE, THREE, ring(4)), "links of three ends: found a graph of pairs"),
        (
            lambda: Scene(NODE, THREE, hypergraph, parameters={"q": [0.1, 0.2, 0.1, 0.1, 0.1]}),
            "found numbers of links, q",
        ),
        (lambda: cluster_exponents(network, [0, 1, 1, 0]), "cluster states of several clusters: found links of three"),
        (lambda: to_python(network.equations), "export to python: found links of three ends"),
        (lambda: equilibrium(network), "equilibria: found links of three ends"),
        (lambda: thresholds(network), "thresholds: found links of three ends"),
        (lambda: transition(network), "transition: found links of three ends"),
        (lambda: universal_probe(network, 0.1, 0.1), "probe: found links of three ends"),
        (lambda: Potential("W*(x_i + x_j - x_k)**2"), "changes if ends are exchanged"),
        (
            lambda: Scene("harmonic", Potential("W*x_i*x_j*x_k"), hypergraph, observe={"e": "mean(energy)"}),
            "energy: found links of three ends",
        ),
        (
            lambda: run(scene(complete(12), triangles(complete(12)), integrator="rodas5p")),
            "rodas5p: found links of three ends between 12 nodes",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            call()

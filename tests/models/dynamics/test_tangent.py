"""Tangent dynamics against differences in fifty digits, and modes against the Jacobian of the whole network."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import pytest
import sympy as sp
from differences import DIGITS, TABLE, close, evaluate, made, slopes, states
from parts import edge, node
from variational_reference import ALPHA, deviation_names, tangent_equations, transversal_equations

from synchain.graphs import Topology, from_matrix, topology
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import mode
from synchain.models.mechanics.components import Edge, Node

OSCILLATORS = [("friction", "exponential", "atan"), ("friction", "stribeck", "sign"), ("duffing", None, "atan")]
NEAR = pytest.mark.parametrize("near", [None, 1, -1], ids=["anywhere", "stick, w > 0", "stick, w < 0"])


@pytest.fixture(autouse=True)
def fifty_digits():
    with mpmath.workdps(DIGITS):
        yield


def extended(kind: str, oscillator: str, law: str | None, contact: str) -> Equations:
    if kind == "tangent":
        return tangent_equations(node(oscillator, law, contact))
    return transversal_equations(made(topology("chain", 2), oscillator, law, contact, kind))


def at_states(equations: Equations, seed: int, near: float | None) -> dict[sp.Symbol, mpmath.mpf]:
    """Values of states(…), without the index: velocities of the orbit near the belt's, deviations at random."""
    values = states(equations, seed, near)
    deviations = states(equations, seed + 1)
    return {s: deviations[s] if s.name.startswith("d_") else value for s, value in values.items()}


# -- the linearisation ---------------------------------------------------------------------------------------


@NEAR
@pytest.mark.parametrize("model", OSCILLATORS, ids=str)
def test_a_deviation_obeys_the_directional_derivative_of_the_node(model: tuple, near: float | None) -> None:
    single = node(*model)
    equations = tangent_equations(single)
    values = at_states(equations, 3, near)
    x, v, d_x, d_v = equations.symbols(0)
    parameter_values = evaluate(equations.rhs(), values)
    orbit = Equations.of_equal_nodes(single, None, 1).rhs()
    assert parameter_values[:2] == evaluate(orbit, values)
    assert close(parameter_values[2:], slopes(orbit, {x: values[d_x], v: values[d_v]}, values))


@NEAR
@pytest.mark.parametrize("coupling", ["spring", "damper"])
@pytest.mark.parametrize("model", OSCILLATORS, ids=str)
def test_a_mode_obeys_the_derivative_along_a_pair_moving_apart(model: tuple, coupling: str, near: float | None) -> None:
    """Two nodes at d and -d: the mode with gamma = -2 of chain(2), alpha = 2 sigma."""
    pair = made(topology("chain", 2), *model, coupling)
    mode = transversal_equations(pair)
    values = at_states(mode, 4, near)
    x, v, d_x, d_v = mode.symbols(0)
    (x_1, v_1), (x_2, v_2) = pair.symbols(0), pair.symbols(1)
    sigma = sp.Symbol("sigma", real=True)
    values |= {x_1: values[x], x_2: values[x], v_1: values[v], v_2: values[v], sigma: values[ALPHA] / 2}
    apart = {x_1: values[d_x], v_1: values[d_v], x_2: -values[d_x], v_2: -values[d_v]}
    rates = slopes(pair.rhs(), apart, values)
    assert close(evaluate(mode.rhs()[2:], values), [rates[0], rates[2]])
    assert close([-r for r in (rates[0], rates[2])], [rates[1], rates[3]])


@NEAR
@pytest.mark.parametrize("kind", ["tangent", "spring", "damper"])
@pytest.mark.parametrize("model", OSCILLATORS, ids=str)
def test_the_jacobian_of_the_extended_system_is_its_derivative(kind: str, model: tuple, near: float | None) -> None:
    """The one wrong factor kappa: second derivatives of the law are of the order kappa^2."""
    equations = extended(kind, *model)
    values = at_states(equations, 5, near)
    entries = equations.jacobian()
    parameter_values = dict(zip(entries, evaluate(list(entries.values()), values), strict=True))
    for column, state in enumerate(equations.symbols(0)):
        column_values = [parameter_values.get((row, column), mpmath.mpf(0)) for row in range(equations.dimension)]
        assert close(column_values, slopes(equations.rhs(), {state: mpmath.mpf(1)}, values), digits=20)


# -- modes of a network --------------------------------------------------------------------------------------


def spectrum_of(entries: dict, size: int, values: dict) -> list[mpmath.mpc]:
    """Eigenvalues of a matrix of expressions."""
    matrix = mpmath.zeros(size)
    for key, value in zip(entries, evaluate(list(entries.values()), values), strict=True):
        matrix[key] = value
    return list(mpmath.eig(matrix, left=False, right=False))


def matched(values: list, expected: list) -> bool:
    """True where both lists hold the same numbers, each as often, to 40 digits."""
    left = list(expected)
    for number in values:
        nearest = min(left, key=lambda other: abs(other - number))
        if abs(nearest - number) > mpmath.mpf(10) ** -40 * max(1, abs(number)):
            return False
        left.remove(nearest)
    return not left


@pytest.mark.parametrize("coupling", ["spring", "damper"])
@pytest.mark.parametrize(("family", "n"), [("chain", 3), ("star", 4), ("ring", 5)])
@pytest.mark.parametrize("near", [None, 1], ids=["slip", "stick"])
def test_modes_are_the_eigenvalues_of_the_whole_network(coupling: str, family: str, n: int, near: float | None) -> None:
    graph = topology(family, n)
    assert matched(*both_spectra(graph, coupling, near))


def both_spectra(graph: Topology, coupling: str, near: float | None) -> tuple[list, list]:
    """Eigenvalues of the network's Jacobian on the synchronous state, and of all its modes; 80 digits."""
    with mpmath.workdps(80):
        equations = made(graph, coupling=coupling)
        mode = transversal_equations(equations)
        values = at_states(mode, 6, near)
        x, v = mode.symbols(0)[:2]
        together = dict(values)
        for i in range(graph.n):
            together |= dict(zip(equations.symbols(i), (values[x], values[v]), strict=True))
        together[sp.Symbol("sigma", real=True)] = sigma = mpmath.mpf(TABLE["sigma"])
        block = {(r - 2, c - 2): e for (r, c), e in mode.jacobian().items() if r >= 2 and c >= 2}
        modes = []
        for eigenvalue in graph.spectrum.eigenvalues:
            values[ALPHA] = -sigma * mpmath.mpmathify(sp.N(eigenvalue.exact, 90))
            modes += spectrum_of(block, 2, values) * eigenvalue.multiplicity
        return spectrum_of(equations.jacobian(), equations.dimension, together), modes


@pytest.mark.parametrize("coupling", ["spring", "damper"])
def test_modes_of_a_one_way_chain_are_those_of_its_triangle(coupling: str) -> None:
    """Feed-forward with different weights: gamma = 0, -1, -3 are real although G is not symmetric."""
    graph = from_matrix([[0, 0, 0], [1, -1, 0], [1, 2, -3]])
    assert matched(*both_spectra(graph, coupling, None))


def test_without_strength_a_mode_is_the_tangent() -> None:
    single = node("friction", "exponential", "atan")
    mode = transversal_equations(made(topology("chain", 2)))
    assert tuple(e.xreplace({ALPHA: sp.S.Zero}) for e in mode.node.rhs) == tangent_equations(single).node.rhs
    assert mode.node.parameters == (*single.parameters, ALPHA)
    assert mode.state == ("x_1", "v_1", "d_x_1", "d_v_1")


def test_names_of_deviations() -> None:
    assert [s.name for s in deviation_names(node("duffing", None, "atan"))] == ["d_x", "d_v"]


# -- refusals ------------------------------------------------------------------------------------------------

PAIR = made(topology("chain", 2), "harmonic", None)


def with_link(change) -> Equations:  # type: ignore[no-untyped-def]
    """The harmonic pair with another force along its links."""
    spring = edge("spring", node("harmonic", None, "atan"), "harmonic")
    symbols = {s.name: s for s in (*spring.here, *spring.there, *spring.parameters, spring.weight)}
    return relinked(replace(spring, rhs=(sp.S.Zero, change(symbols))))


def relinked(edge: Edge) -> Equations:
    """The harmonic pair with another edge."""
    return Equations.of_equal_nodes(PAIR.node, edge, 2, PAIR.links)


def test_a_mode_needs_links() -> None:
    with pytest.raises(ValueError, match="these equations have no coupling; a transversal mode needs links"):
        transversal_equations(made(topology("chain", 1), coupling=None))


def test_a_mode_needs_a_synchronous_state() -> None:
    pushed = with_link(lambda s: s["sigma"] * s["weight"] * s["x_j"]).edge
    unequal = Equations.of_equal_nodes(PAIR.node, pushed, 3, topology("chain", 3).links)
    with pytest.raises(ValueError, match="sums of weights differ from node to node, so complete synchronisation is no"):
        mode(unequal)


def test_a_mode_needs_one_strength() -> None:
    with pytest.raises(ValueError, match="links are not proportional to sigma; a mode has no single strength alpha"):
        transversal_equations(with_link(lambda s: s["sigma"] ** 2 * s["weight"] * (s["x_j"] - s["x_i"])))
    other = sp.Symbol("strength", real=True)
    spring = with_link(lambda s: s["weight"] * (s["x_j"] - s["x_i"])).edge
    assert spring is not None
    renamed = Edge(spring.here, spring.there, spring.weight, (sp.S.Zero, other * spring.rhs[1]), (other,))
    assert mode(relinked(renamed)) == mode(PAIR)
    twice = Edge(spring.here, spring.there, spring.weight, (sp.S.Zero, other**2 * spring.rhs[1]), (other,))
    with pytest.raises(ValueError, match="strength of the links: found strength; expected sigma, or exactly one"):
        mode(relinked(twice))


@pytest.mark.parametrize("name", ["d_x", "d_v"])
def test_a_model_must_leave_the_names_of_deviations(name: str) -> None:
    x, v, taken = (sp.Symbol(s, real=True) for s in ("x", "v", name))
    with pytest.raises(ValueError, match=f"the symbol '{name}' is needed for the deviation; rename it in the model"):
        tangent_equations(Node((x, v), (v, -taken * x), (taken,)))


def test_a_model_must_leave_alpha() -> None:
    x, v = sp.symbols("x v", real=True)
    single = Node((x, v), (v, -ALPHA * x), (ALPHA,))
    with pytest.raises(ValueError, match="the symbol 'alpha' is needed for the deviation"):
        transversal_equations(Equations.of_equal_nodes(single, edge("spring", single), 2, PAIR.links))

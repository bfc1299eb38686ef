"""Complete synchronisation under links that act between equal states: its motion, and its modes against the whole network."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from synchain import Rates, Scene, ends
from synchain.graphs import Topology, chain, complete, from_matrix, ring
from synchain.models.definitions.loader import load_oscillator
from synchain.models.dynamics.synchrony import NoSynchrony, expect_vanishing, synchronous_node
from synchain.models.dynamics.variational import mode

G, LAM = sp.symbols("g lam")

ROSSLER = load_oscillator("rossler")

TARGET, SOURCE, W = ends(ROSSLER)

SYNAPSE = Rates(
    {TARGET.x: -G * W * (TARGET.x - 2) / (1 + sp.exp(-LAM * SOURCE.x)), TARGET.y: G * W * SOURCE.z * TARGET.y},
    {G: 0.3, LAM: 2},
)
"""A link between equal states, with a parameter beside its strength."""

ONE_WAY = from_matrix([[-3, 2, 1, 0], [0, -3, 1, 2], [3, 0, -3, 0], [1, 1, 1, -3]], "one way")
"""Four nodes with sums of weights 3, which feel one another one way."""


def scene(graph: Topology, coupling: Any = SYNAPSE) -> Scene:
    return Scene(oscillator="rossler", coupling=coupling, topology=graph)


def numeric(e: sp.Expr, values: dict[str, float]) -> complex:
    return complex(e.xreplace({s: sp.Float(values[s.name], 30) for s in e.free_symbols}))


@pytest.mark.parametrize("graph", [ring(4), complete(4), ONE_WAY])
def test_the_modes_are_those_of_the_whole_network(graph: Topology) -> None:
    network = scene(graph)
    equations, values = network.equations, dict(network.parameters)
    state = {"x": 0.7, "y": -0.4, "z": 1.3}
    everywhere = {f"{name}_{i + 1}": value for name, value in state.items() for i in range(graph.n)}
    matrix = np.zeros((12, 12), complex)
    for (r, c), e in equations.jacobian().items():
        matrix[r, c] = numeric(e, values | everywhere)
    plane = mode(equations, plane=True)
    collected = []
    for gamma in np.linalg.eigvals(np.array(graph.matrix, dtype=float)):
        alpha = {"mode_alpha": -values["g"] * gamma.real, "mode_beta": -values["g"] * gamma.imag}
        block = np.zeros((6, 6), complex)
        for (r, c), e in plane.matrix:
            block[r, c] = numeric(e, values | alpha | {f"{name}_1": value for name, value in state.items()})
        collected += list(np.linalg.eigvals(block[:3, :3] - 1j * block[:3, 3:]))
    expected = np.linalg.eigvals(matrix)
    gaps = np.abs(expected[:, None] - np.array(collected)[None])
    assert gaps.min(axis=0).max() < 1e-9
    assert gaps.min(axis=1).max() < 1e-9


def test_the_synchronous_motion_solves_the_network() -> None:
    equations = scene(ONE_WAY).equations
    node = synchronous_node(equations)
    equal = {s: sp.Symbol(s.name[:-2], real=True) for s in map(lambda n: sp.Symbol(n, real=True), equations.state)}
    for k, rate in enumerate(equations.rhs()):
        assert sp.simplify(rate.xreplace(equal) - node.rhs[k // 4]) == 0


def test_unequal_sums_of_weights_have_no_synchronous_motion() -> None:
    with pytest.raises(NoSynchrony, match="the sums of weights differ from node to node"):
        mode(scene(chain(3)).equations)
    assert any(
        "no solution of this network; expected a function of differences" in warning
        for warning in scene(chain(3)).warnings
    )
    assert not any("equal states" in warning for warning in scene(ring(3)).warnings)


def test_a_link_that_is_not_proportional_to_its_weight_has_no_modes() -> None:
    bent = Rates({TARGET.x: G * sp.tanh(W * (SOURCE.x - TARGET.x))}, {G: 0.3})
    assert mode(scene(ring(3), bent).equations)  # weights 1: the slope is proportional
    square = Rates({TARGET.x: G * W**2 * (SOURCE.x - TARGET.x)}, {G: 0.3})
    with pytest.raises(ValueError, match="links are not proportional to their weight"):
        mode(scene(ring(3), square).equations)
    with pytest.raises(ValueError, match="test: a link is not proportional to its weight"):
        expect_vanishing("test", scene(ring(3), square).equations)


def test_what_needs_one_synchronous_motion_for_all_strengths_is_refused() -> None:
    with pytest.raises(
        ValueError, match="test: a link acts between equal states, so that the synchronous motion changes"
    ):
        expect_vanishing("test", scene(ring(3)).equations)


def test_links_in_layers_move_the_synchronous_motion_together() -> None:
    other = Rates({TARGET.z: sp.Symbol("q") * W * SOURCE.x}, {"q": 0.1})
    layered = Scene(oscillator="rossler", links=[(SYNAPSE, ring(4)), (other, complete(4))])
    node = synchronous_node(layered.equations)
    alone = synchronous_node(scene(ring(4)).equations)
    assert sp.simplify(node.rhs[2] - alone.rhs[2] - 3 * sp.Symbol("q", real=True) * sp.Symbol("x", real=True)) == 0


def test_a_link_without_a_value_between_equal_states_has_no_synchronous_motion() -> None:
    gravity = Rates({TARGET.x: G * W / (SOURCE.x - TARGET.x)}, {G: 0.3})
    with pytest.raises(NoSynchrony, match="has no value between equal states"):
        mode(scene(complete(3), gravity).equations)
    assert any("has no value between equal states" in warning for warning in scene(complete(3), gravity).warnings)

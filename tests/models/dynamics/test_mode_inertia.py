"""Transversal modes of links with inertia: against the whole network, exactly, and against closed forms."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from parts import edge
from samples import real
from variational_reference import ALPHA, transversal_equations

from synchain import Scene, exponents
from synchain.graphs import chain, from_matrix, orbital_partitions
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.network import network
from synchain.models.dynamics.variational import MODE, clustered, mode
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.runtime.sweeps.certify import certify

GRAPH = from_matrix([[-3, 1, 2], [1, -2, 1], [2, 1, -3]])
"""Its eigenvalues are 0, -3 and -5."""


def stiff_and_heavy() -> Equations:
    """Links with a spring that is not linear and an inertia of 3 on the same coordinate, between cubic oscillators."""
    x, v, x_2, v_2, w, sigma, mu = real("x", "v", "x_2", "v_2", "weight", "sigma", "mu")
    node = Node((x, v), (v, -(x**3) - mu * v + sp.cos(TIME)), (mu,))
    mass = 3 * sigma * w
    blocks = tuple(((0, 0), (0, s * mass)) for s in (1, -1))
    inertia = tuple(tuple(tuple(map(sp.sympify, row)) for row in block) for block in blocks)
    push = 3 * sigma * w * sp.sin(x_2 - x) * (2 + x * x_2)
    return network(node, Edge((x, v), (x_2, v_2), w, (sp.S.Zero, push), (sigma,), inertia), GRAPH)


def scene(**keywords: object) -> Scene:
    return Scene(**{"oscillator": "duffing", "coupling": "inerter", "topology": chain(4), **keywords})


def of_two_coordinates() -> Equations:
    """Inerters on both of two coordinates whose oscillator has a mass of 2 for either."""
    x, y, u, v, k = real("x", "y", "u", "v", "k")
    node = Node((x, y, u, v), (u, v, -k * x * y - u / 3, -y + x**2), (k,))
    return network(node, edge("inerter", node), GRAPH)


NETWORKS = {
    "stiff and heavy": (stiff_and_heavy(), 3),
    "two coordinates": (of_two_coordinates(), 1),
    "inerters": (scene(topology=GRAPH).equations, 1),
}
"""With the inertia of a link over sigma."""


def linearised(equations: Equations) -> tuple[sp.Matrix, sp.Matrix]:
    """M and df/dy - d(M F)/dy of the whole network where all nodes move alike, F the rates of that motion."""
    n, rhs = equations.n, equations.node.rhs
    mass = sp.Matrix(sp.SparseMatrix(equations.dimension, equations.dimension, equations.mass()))
    state, force = sp.symbols(equations.state, real=True), sp.Matrix(equations.rhs())
    equal = {s: equations.node.state[k // n] for k, s in enumerate(state)}
    rates = {s: rhs[k // n] for k, s in enumerate(sp.symbols(f"F:{len(state)}"))}
    assert vanishes((mass * sp.Matrix(list(rates.values())) - force).xreplace(equal))
    slopes = (force - mass * sp.Matrix(list(rates))).jacobian(state)
    return mass.xreplace(equal), slopes.xreplace(rates).xreplace(equal)


def vanishes(matrix: sp.Matrix) -> bool:
    return all(sp.simplify(e) == 0 for e in matrix)


@pytest.mark.parametrize("case", NETWORKS)
def test_modes_are_those_of_the_whole_network(case: str) -> None:
    """M^-1 (df/dy - d(M F)/dy) acts on an eigenvector of G as the mode's matrix, exactly."""
    equations, share = NETWORKS[case]
    node, (sigma,) = equations.node, real("sigma")
    mass, slopes = linearised(equations)
    size = len(node.state)
    template = {real(f"{s}_1")[0]: s for s in node.state}
    of_mode = sp.Matrix(sp.SparseMatrix(size, size, dict(mode(equations).matrix))).xreplace(template)
    single = sp.Matrix(transversal_equations(equations).node.rhs[size:])
    by_alpha = single.jacobian(real(*(f"d_{s}" for s in node.state)))
    for gamma, _, (vector,) in sp.Matrix(GRAPH.rows).applyfunc(sp.Rational).eigenvects():
        alpha = -sigma * gamma
        rates = of_mode.xreplace({MODE[0]: alpha / (1 + share * alpha)})
        assert vanishes(rates - by_alpha.xreplace({ALPHA: alpha}))
        spread = sp.Matrix(sp.kronecker_product(sp.eye(size), vector))
        assert vanishes(mass * spread * rates - slopes * spread)


def test_exponents_of_heavy_links_follow_from_their_quadratic() -> None:
    """(1 + alpha) z^2 + delta z + 1 = 0 for a linear oscillator, whether it rests or is driven, alpha real or complex."""
    linear = {"beta": 0, "delta": 0.5, "omega": 1.3}
    alpha = np.array([0.0, 0.5, 3.0, 15.0, 40.0])
    exact = [max(np.roots([1 + a, 0.5, 1]).real) for a in alpha]
    for u in (0.0, 0.3):
        result = exponents(scene(parameters={**linear, "u": u}), alpha, starts=1, rtol=1e-9)
        np.testing.assert_allclose(result.exponent, exact, atol=2e-8)
        np.testing.assert_array_equal(result.alpha, alpha)
    with pytest.raises(ValueError, match=re.escape("alpha = -1.5: the mass of this mode is not positive")):
        exponents(scene(parameters=linear), [-1.5, 0.0])


def test_the_slowest_eigenvalue_of_a_linear_network_is_that_of_its_certificate() -> None:
    network = scene(
        parameters={"beta": 0, "delta": 0.5, "u": 0, "sigma": 0.7}, time_unit="time", record=("sync_error",)
    )
    laplacian = -np.array(network.topology.rows, float)
    heavy = np.eye(4) + 0.7 * laplacian
    free = scipy.linalg.block_diag(np.eye(4), heavy)
    push = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.eye(4), -0.5 * np.eye(4)]])
    values = scipy.linalg.eigvals(push, free)
    synchronous = np.roots([1, 0.5, 1])  # the synchronous motion
    others = [z for z in values if np.abs(z - synchronous).min() > 1e-9]
    assert len(others) == 6
    assert certify(network).exponent[0] == pytest.approx(max(z.real for z in others), abs=1e-8)


def test_what_has_no_modes() -> None:
    x, v, x_2, v_2, w, sigma, mu = real("x", "v", "x_2", "v_2", "weight", "sigma", "mu")
    node = Node((x, v), (v, -x - mu * v), (mu,))
    zero = sp.S.Zero

    def joined(here: sp.Expr, there: sp.Expr, push: tuple = (zero, zero), single: Node = node) -> Equations:
        blocks = tuple(((zero, zero), (zero, e)) for e in (here, there))
        return network(single, Edge((x, v), (x_2, v_2), w, push, (sigma,), blocks), GRAPH)

    for equations, message in (
        (joined(sigma * w, sigma * w), "inertia between nodes that move alike"),
        (joined(sigma**2 * w, -(sigma**2) * w), "the inertia of links is not proportional to sigma"),
        (joined(sigma * w * (1 + x**2), -sigma * w * (1 + x**2)), "masses that depend on the state"),
        (joined(sigma * w, -sigma * w, (sigma * w * (x_2 - x), zero)), "links push coordinates that their inertia"),
    ):
        with pytest.raises(ValueError, match=message):
            mode(equations)
    made = scene(topology=chain(4)).equations
    with pytest.raises(ValueError, match="cluster states: found links with inertia"):
        clustered(made, orbital_partitions(chain(4))[0])

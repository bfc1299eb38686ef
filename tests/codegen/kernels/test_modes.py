"""Kernels that carry deviations along an orbit, against matrix exponentials, the extended system and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import sympy as sp
from variational_reference import transversal_equations

from synchain.codegen.kernels.mode_kernel import emit_modes
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code.compile import load
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation, mode, network_variation
from synchain.models.graphs.families import topology
from synchain.models.mechanics.components import Node
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.engines.step_control import control_array
from synchain.runtime.stability.variational_integrator import VariationalIntegrator

OMEGA = 1.4


def scene(name: str, coupling: str, n: int = 2, **more: object) -> Scene:
    return Scene(oscillator=name, coupling=coupling, topology=topology("chain", n), **more)  # type: ignore[arg-type]


def integrator(
    s: Scene, variation: Variation, state: list[float], strengths: np.ndarray, rtol: float = 1e-10
) -> VariationalIntegrator:
    values = np.array([[s.parameters[name] for name in variation.orbit.parameters]])
    return VariationalIntegrator.make(
        s.replace(rtol=rtol, atol=rtol * 1e-2), variation, np.array([state]), values, strengths, 1
    )


def moved(c: VariationalIntegrator, length: float) -> np.ndarray:
    """Deviations (size, modes) after a length of time, as long as they are."""
    growth = c.advance(length)
    return (c.deviations * np.exp(growth)[:, None])[0]


ALPHA = np.array([3.0, 0.0, 0.4, 1.1, 25.0])


def test_modes_of_a_linear_node_follow_the_matrix_exponential() -> None:
    s = scene("harmonic", "damper")
    states = moved(integrator(s, mode(s.equations), [0.3, 0.1], ALPHA[None]), 2.0)
    for k, alpha in enumerate(ALPHA):
        exact = scipy.linalg.expm(2.0 * np.array([[0.0, 1.0], [-1.0, -alpha]])) @ (np.ones(2) / np.sqrt(2))
        np.testing.assert_allclose(states[:, k], exact, rtol=0, atol=2e-9 * np.abs(exact).max())


def test_complex_strengths_of_a_linear_node() -> None:
    s = scene("harmonic", "spring")
    strengths = np.array([[0.5, 0.5, -0.2], [0.7, -0.7, 2.0]])
    states = moved(integrator(s, mode(s.equations, plane=True), [0.3, 0.1], strengths), 2.0)
    for k, z in enumerate(strengths[0] + 1j * strengths[1]):
        exact = scipy.linalg.expm(2.0 * np.array([[0.0, 1.0], [-1.0 - z, 0.0]])) @ (np.full(2, 0.5 + 0.5j))
        np.testing.assert_allclose(states[:2, k] + 1j * states[2:, k], exact, rtol=0, atol=1e-9 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("name", "coupling", "state"),
    [
        ("friction", "spring", [0.3, 0.0]),
        pytest.param("duffing", "damper", [1.0, 0.2], marks=pytest.mark.long),
        pytest.param("rossler", "x->x", [1.0, -2.0, 0.1], marks=pytest.mark.long),
    ],
)
def test_modes_are_those_of_the_extended_system(name: str, coupling: str, state: list[float]) -> None:
    """Orbit and deviation as one state in an ordinary kernel, whose Jacobian SymPy derives anew."""
    s = scene(name, coupling)
    transversal = transversal_equations(s.equations)
    kernel = load(emit(transversal, "rodas5p", Recording(()), width=1))
    length = s.period or 6.0
    size = len(state)
    alphas = np.array([0.0, 0.3, 0.9])
    values = np.array([[{**s.parameters, "alpha": a}[p] for p in transversal.parameters] for a in alphas])
    start = np.tile([*state, *([1.0 / np.sqrt(size)] * size)], (3, 1))
    buffers = Buffers.empty(3, 2 * size, room=0, samples=0)
    limit = 0.5 * (s.period or np.inf)
    spans = np.tile([0.0, length, s.period or 0.0, 0.0, 1e-4, limit, np.inf], (3, 1))
    kernel.drive(0, 3, start, values, spans, control_array(1e-10, 1e-12, limit, 10**7), *buffers.arrays())
    c = integrator(s, mode(s.equations), state, alphas[None])
    states = moved(c, length)
    np.testing.assert_allclose(c.state[0], buffers.end[0, :size], rtol=0, atol=1e-7)
    np.testing.assert_allclose(states.T, buffers.end[:, size:], rtol=0, atol=2e-6 * np.abs(states).max())


@pytest.mark.long
def test_the_whole_network_follows_differences_of_its_trajectories() -> None:
    s = scene("duffing", "spring", 2, parameters={"sigma": 0.3})
    y0 = np.array([1.0, 0.7, 0.1, -0.2])
    variation = network_variation(s.equations)
    c = integrator(s, variation, list(y0), np.zeros((0, 4)))
    c.set_deviations(np.eye(4)[None])
    states = moved(c, s.period or 0.0)
    rhs = sp.lambdify([sp.Symbol(n, real=True) for n in ("t", *s.equations.state, *s.equations.parameters)],
                      list(s.equations.rhs()), "numpy")  # fmt: skip
    p = [s.parameters[name] for name in s.equations.parameters]

    def flow(y: np.ndarray) -> np.ndarray:
        out = scipy.integrate.solve_ivp(
            lambda t, y: rhs(t, *y, *p), (0.0, s.period), y, "DOP853", rtol=1e-12, atol=1e-13
        )
        return np.asarray(out.y[:, -1])

    for k in range(4):
        step = 1e-4 * np.eye(4)[k]
        np.testing.assert_allclose(states[:, k], (flow(y0 + step) - flow(y0 - step)) / 2e-4, atol=2e-6)


def test_growth_over_any_number_of_decades_is_counted() -> None:
    """A pair x' = x (alpha - 1 …): growth of e^4000 would overflow, decay of e^-4000 would vanish."""
    x = sp.Symbol("x", real=True)
    orbit = Equations.of_equal_nodes(Node((x,), (-x,), ()), None, 1)
    strength = sp.Symbol("mode_alpha", real=True)
    variation = Variation(orbit, 1, (((0, 0), strength),), (strength,))
    s = scene("harmonic", "spring")
    rates = np.array([[-40.0, 0.0, 40.0, 2.0]])
    c = VariationalIntegrator.make(s, variation, np.array([[1.0]]), np.zeros((1, 0)), rates, 1)
    np.testing.assert_allclose(c.advance(100.0)[0], 100.0 * rates[0], rtol=1e-7, atol=1e-6)
    np.testing.assert_allclose(c.deviations, 1.0)


def test_a_deviation_of_zero_stays_zero_and_has_no_exponent() -> None:
    s = scene("friction", "spring")
    c = integrator(s, mode(s.equations), [0.3, 0.0], np.array([[0.1, 0.2, 0.3]]))
    c.set_deviations(np.array([[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]]))
    growth = c.advance(s.period or 0.0)
    assert growth[0, 0] == -np.inf
    assert np.all(np.isfinite(growth[0, 1:]))
    assert np.all(c.deviations[0, :, 0] == 0.0)


def test_modes_do_not_depend_on_their_order_or_their_neighbours() -> None:
    s = scene("friction", "spring")
    one = integrator(s, mode(s.equations), [0.3, 0.0], ALPHA[None])
    other = integrator(s, mode(s.equations), [0.3, 0.0], ALPHA[None, ::-1])
    np.testing.assert_array_equal(moved(one, s.period or 0.0), moved(other, s.period or 0.0)[:, ::-1])


@pytest.mark.long
def test_names_of_the_model_cannot_collide_with_those_of_the_kernel() -> None:
    x, lag, value = (sp.Symbol(n, real=True) for n in ("x", "lag", "value_1_0"))
    orbit = Equations.of_equal_nodes(Node((x,), (-lag * x + value * sp.sin(x),), (lag, value)), None, 1)
    strength = sp.Symbol("mode_alpha", real=True)
    slope = -lag + value * sp.cos(orbit.symbols(0)[0])
    variation = Variation(orbit, 1, (((0, 0), slope - strength),), (strength,))
    c = VariationalIntegrator.make(
        scene("harmonic", "spring"), variation, np.zeros((1, 1)), np.array([[2.0, 0.5]]), np.zeros((1, 1)), 1
    )
    np.testing.assert_allclose(c.advance(3.0), -4.5, rtol=1e-7)


def test_what_a_variation_refuses() -> None:
    x = sp.Symbol("x", real=True)
    strength = sp.Symbol("mode_alpha", real=True)
    orbit = Equations.of_equal_nodes(Node((x,), (-x,), ()), None, 1)
    with pytest.raises(ValueError, match="outside the 1 x 1 matrix"):
        Variation(orbit, 1, (((0, 1), strength),), (strength,))
    with pytest.raises(ValueError, match="not linear in the strengths"):
        Variation(orbit, 1, (((0, 0), strength**2),), (strength,))
    with pytest.raises(ValueError, match="unknown symbol 'q'"):
        Variation(orbit, 1, (((0, 0), sp.Symbol("q", real=True)),), (strength,))
    taken = Equations.of_equal_nodes(Node((x,), (-strength * x,), (strength,)), None, 1)
    with pytest.raises(ValueError, match="'mode_alpha' is needed for the strength of a mode"):
        Variation(taken, 1, (((0, 0), strength),), (strength,))


def test_large_networks_are_refused_in_words() -> None:
    with pytest.raises(ValueError, match="tangent dynamics: found 33 oscillators or clusters; expected at most 32"):
        emit_modes(network_variation(Scene(topology=topology("chain", 33)).equations))

"""Taylor steps of deviations along an orbit: the extended system's in 60 digits, Floquet multipliers by mpmath, one step for all modes."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from test_series import DIGITS, FUNCTIONS, exact, series
from variational_reference import transversal_equations

from synchain.codegen.driver.columns import Control
from synchain.codegen.integrators import Integrator, integrator
from synchain.codegen.kernels.mode_kernel import emit_modes
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import write_tangent
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation, mode, network_variation
from synchain.models.graphs.families import topology
from synchain.models.mechanics.components import TIME, Node
from synchain.models.scenes.scene import Scene
from synchain.runtime.bifurcation.periodic import periodic_orbit
from synchain.runtime.stability.variational_integrator import VariationalIntegrator

TAYLOR, RODAS = integrator("taylor", 16), integrator("rodas5p")
X = sp.Symbol("x", real=True)
FAST, SLOW = sp.symbols("fast slow", real=True)


def scene(name: str, coupling: str, n: int = 2, **more: object) -> Scene:
    return Scene(oscillator=name, coupling=coupling, topology=topology("chain", n), **more)  # type: ignore[arg-type]


def in_digits(variation: Variation, order: int, start: list[Any], numbers: list[Any], d: list[Any], alpha: Any) -> list:
    """The deviation after one step as long as its scale, by the texts of the kernel in 60 digits."""
    source = write_tangent(variation, order)
    space: dict[str, Any] = {
        **FUNCTIONS, "mpf": mpmath.mpf, "pi": mpmath.pi, "math": math, "LANES": 1, "any_lane": bool,
        "load": lambda a, slot, width: a[slot],
    }  # fmt: skip
    for text in (source.orbit.text, *source.modes):
        exec(exact(text.replace("~(", "not (")), space)
    size = len(start)
    y, shared, new = [*start, *numbers], [None] * source.shared, [None] * len(d)
    huge = mpmath.mpf("1e40")
    shared[1], _ = space["step"](0, 1, mpmath.mpf(1), y, y, [None] * size, [None] * size * order, huge, huge, shared)
    assert shared[1] == 1
    assert space["carry"](shared, [alpha], d, new, 1, huge) == 1
    return new


@pytest.mark.parametrize(("name", "coupling"), [("rossler", "x->x"), ("duffing", "spring"), ("pendulum", "damper")])
@pytest.mark.parametrize("order", [8, 16])
def test_the_tangent_of_a_step_is_a_step_of_the_extended_system(name: str, coupling: str, order: int) -> None:
    """Orbit and deviation as one state, whose Jacobian SymPy derives anew: the same polynomial, summed at one scale."""
    s = scene(name, coupling)
    extended = transversal_equations(s.equations)
    variation = mode(s.equations)
    size = variation.size
    with mpmath.workdps(DIGITS):
        start = [mpmath.mpf(k + 2) / 7 for k in range(size)]
        d = [mpmath.mpf(3 - k) / 5 for k in range(size)]
        alpha = mpmath.mpf("0.9")
        values = {**s.parameters, "alpha": alpha}
        of_orbit, of_both = ([mpmath.mpf(values[p]) for p in e.parameters] for e in (variation.orbit, extended))
        rows = series(extended, [*start, *d], of_both, order=order)
        expected = [sum(row[size + c] for row in rows) for c in range(size)]
        found = in_digits(variation, order, start, of_orbit, d, alpha)
        assert all(abs(a - b) < mpmath.mpf(10) ** -(DIGITS - 20) * abs(b) for a, b in zip(found, expected, strict=True))


def carried(s: Scene, variation: Variation, state: list[float], strengths: np.ndarray, method: Integrator, rtol: float) -> VariationalIntegrator:  # fmt: skip
    values = np.array([[s.parameters[name] for name in variation.orbit.parameters]])
    tight = s.replace(rtol=rtol, atol=rtol)
    return VariationalIntegrator.make(tight, variation, np.array([state]), values, strengths, 1, method=method)


@pytest.mark.parametrize(
    ("name", "coupling", "length"),
    [("rossler", "y->y", 6.0), pytest.param("lorenz", "x->x", 2.0, marks=pytest.mark.long), pytest.param("duffing", "damper", 6.0, marks=pytest.mark.long),
     pytest.param("van_der_pol", "spring", 6.0, marks=pytest.mark.long)],
)  # fmt: skip
def test_both_methods_grow_deviations_alike(name: str, coupling: str, length: float) -> None:
    s = scene(name, coupling)
    variation = mode(s.equations)
    state = [values[0] for values in s.initial.values()]
    alpha = np.linspace(0.0, 2.0, 5)[None]
    by_series, by_stages = (carried(s, variation, state, alpha, method, 1e-12) for method in (TAYLOR, RODAS))
    growth = [c.advance(length)[0] for c in (by_series, by_stages)]
    np.testing.assert_allclose(growth[0], growth[1], rtol=0, atol=2e-10)
    np.testing.assert_allclose(by_series.deviations, by_stages.deviations, rtol=0, atol=2e-10)
    assert 15 * by_series.steps < by_stages.steps


def test_volumes_shrink_as_liouville_says() -> None:
    """Duffing pair: the determinant of the propagator of four deviations is exp(-2 delta t), whatever the motion."""
    s = scene("duffing", "spring", parameters={"sigma": 0.3, "delta": 0.2})
    c = carried(s, network_variation(s.equations), [1.0, 0.7, 0.1, -0.2], np.zeros((0, 4)), TAYLOR, 1e-12)
    c.set_deviations(np.eye(4)[None])
    growth = c.advance(s.period)[0]
    log_volume = np.linalg.slogdet(c.deviations[0])[1] + growth.sum()
    assert log_volume == pytest.approx(-2 * 0.2 * s.period, abs=1e-11)


def test_all_multipliers_of_a_linear_chain_have_the_size_of_its_damping() -> None:
    """d'' = -delta d' - (1 + sigma L) d: all four exponents are -delta/2."""
    s = scene("duffing", "spring", 2, parameters={"sigma": 0.4, "delta": 0.2, "beta": 0.0})
    c = carried(s, network_variation(s.equations), [1.0, 0.7, 0.1, -0.2], np.zeros((0, 4)), TAYLOR, 1e-12)
    c.set_deviations(np.eye(4)[None])
    propagator = (np.exp(c.advance(s.period))[:, None] * c.deviations)[0]
    np.testing.assert_allclose(np.log(np.abs(np.linalg.eigvals(propagator))) / s.period, -0.1, rtol=0, atol=1e-12)


def test_one_step_suits_the_modes_between_the_first_and_the_last() -> None:
    """d' = fast d, sorted by the size of (fast, slow): the fast ones stand in the middle, where nobody looks first."""
    orbit = Equations.of_equal_nodes(Node((X,), (-X,), ()), None, 1)
    variation = Variation(orbit, 1, (((0, 0), FAST + 0 * SLOW),), (FAST, SLOW))
    count = 64
    slow = np.linspace(0.0, 1e3, count)
    fast = np.where((slow > 400.0) & (slow < 600.0), -50.0, -0.1)
    c = carried(scene("harmonic", "spring"), variation, [1.0], np.stack([fast, slow]), TAYLOR, 1e-10)
    np.testing.assert_allclose(c.advance(3.0)[0], 3.0 * fast, rtol=1e-8)


@pytest.mark.filterwarnings("ignore:stiff modes")
def test_a_coefficient_beyond_all_numbers_asks_for_a_smaller_scale() -> None:
    """(1e3 * 1e20)^14 overflows, and the orbit, which rests, says nothing against that scale; inf - inf is no number."""
    orbit = Equations.of_equal_nodes(Node((X,), (sp.S.Zero,), ()), None, 1)
    matrix = (((0, 0), FAST), ((0, 1), FAST), ((1, 0), FAST), ((1, 1), -FAST))
    highest = integrator("taylor", 24)
    for entries, size, rate in ((matrix, 2, math.sqrt(2.0)), (matrix[:1], 1, 1.0)):
        variation = Variation(orbit, size, entries, (FAST,))
        c = carried(scene("harmonic", "spring"), variation, [1.0], np.array([[1e3, 0.0]]), highest, 1e-8)
        c.set_deviations(np.array([[[1.0], [math.sqrt(2.0) - 1.0]][:size]]) * np.ones((1, size, 2)))
        c.control[Control.FIRST_STEP] = 1e20
        length = math.log(math.hypot(1.0, math.sqrt(2.0) - 1.0)) if size == 2 else 0.0
        np.testing.assert_allclose(c.advance(1.0)[0], [1e3 * rate + length, length], rtol=1e-7, atol=1e-12)


def test_coefficients_that_move_with_time_alone() -> None:
    """d' = cos(t) d: the logarithm of the growth is sin(t), also with the clock at another phase."""
    orbit = Equations.of_equal_nodes(Node((X,), (-X,), ()), None, 1)
    variation = Variation(orbit, 1, (((0, 0), FAST * sp.cos(TIME) + TIME * SLOW),), (FAST, SLOW))
    strengths = np.array([[1.0, -2.0, 0.0], [0.0, 0.3, 1.0]])
    c = carried(scene("harmonic", "spring"), variation, [1.0], strengths, TAYLOR, 1e-12)
    expected = strengths[0] * np.sin(2.5) + strengths[1] * 2.5**2 / 2
    np.testing.assert_allclose(c.advance(2.5)[0], expected, rtol=0, atol=1e-11)


def duffing_monodromy(state: np.ndarray, values: dict[str, float], alpha: float, period: float) -> Any:
    """The propagator of a deviation over a period in 30 digits, by the recurrences of this oscillator alone."""
    order, pieces = 36, 64
    delta, beta, u, omega = (mpmath.mpf(values[k]) for k in ("delta", "beta", "u", "omega"))
    h = mpmath.mpf(period) / pieces
    x0, v0 = map(mpmath.mpf, state)
    columns = [[mpmath.mpf(1), mpmath.mpf(0)], [mpmath.mpf(0), mpmath.mpf(1)]]
    for piece in range(pieces):
        x, v, square, now = [x0], [v0], [], piece * h
        paths = [([d[0]], [d[1]]) for d in columns]
        for k in range(order):
            square.append(sum(x[j] * x[k - j] for j in range(k + 1)))
            cube = sum(square[j] * x[k - j] for j in range(k + 1))
            drive = u * omega**k * mpmath.cos(omega * now + k * mpmath.pi / 2) / mpmath.factorial(k)
            x.append(v[k] / (k + 1))
            v.append((-delta * v[k] - x[k] - beta * cube + drive) / (k + 1))
            for a, b in paths:
                bent = sum(square[j] * a[k - j] for j in range(k + 1))
                a.append(b[k] / (k + 1))
                b.append((-delta * b[k] - (1 + alpha) * a[k] - 3 * beta * bent) / (k + 1))
        x0, v0 = mpmath.polyval(x[::-1], h), mpmath.polyval(v[::-1], h)
        columns = [[mpmath.polyval(a[::-1], h), mpmath.polyval(b[::-1], h)] for a, b in paths]
    return x0, v0, mpmath.matrix(columns).T


@pytest.mark.parametrize("alpha", [pytest.param(0.0, marks=pytest.mark.long), 0.7])
def test_floquet_multipliers_are_those_of_mpmath(alpha: float) -> None:
    s = scene("duffing", "spring", parameters={"omega": 1.3, "u": 0.6}, transient=60.0)
    orbit = periodic_orbit(s.replace(initial={"x": 0.3, "v": 0.0}))
    with mpmath.workdps(30):
        period = 2 * mpmath.pi / mpmath.mpf(1.3)
        start = orbit.state.reshape(2, 2)[:, 0]  # of the first node; the orbit is synchronous
        x, v, matrix = duffing_monodromy(start, orbit.scene.parameters, alpha, period)
        assert max(abs(x - start[0]), abs(v - start[1])) < 1e-12
        expected = sorted((complex(z) for z in mpmath.eig(matrix)[0]), key=lambda z: z.imag)
    ordered = sorted(orbit.transversal_multipliers(alpha), key=lambda z: z.imag)
    np.testing.assert_allclose(ordered, expected, rtol=0, atol=1e-11)


def test_methods_without_modes_are_refused() -> None:
    variation = mode(tidy(scene("duffing", "spring").equations))
    for name in ("dop853", "cash_karp"):
        with pytest.raises(ValueError, match=rf"found integrator {name}; expected a Rosenbrock or a Taylor method"):
            emit_modes(variation, name)

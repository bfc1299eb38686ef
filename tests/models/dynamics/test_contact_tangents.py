"""Deviations through stick and slip: laws with a jump at rest, whole networks and cluster states."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from event_reference import Reference
from mpmath import mp, mpf

from synchain import Scene, cluster_exponents, lyapunov_spectrum, periodic_orbit
from synchain.graphs import Topology, clusters, topology
from synchain.models.dynamics.variational import MODE, Variation, clustered, mode, network_variation
from synchain.runtime.stability.orbits import OrbitProblem

ONE, PAIR = topology("chain", 1), topology("chain", 2)
JUMP = {"theta_b": 0.1, "epsilon": 1.0, "u": 0.1, "omega": 1.15, "mu_s": 0.3, "mu_k": 0.2}


def jumping(graph: Topology = PAIR, **more: float) -> Scene:
    return Scene(
        topology=graph, friction="coulomb_static", contact="set-valued", parameters={**JUMP, **more},
        initial={"x": 0.1, "v": 0.1},
    )  # fmt: skip


def symbols(text: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(name, real=True) for name in text.split())


def velocity_gained(variation: Variation, i: int, side: int) -> dict[int, sp.Expr]:
    """Derivatives of the first velocity that the start of slip of contact i changes, by the components of a deviation."""
    events, orbit = variation.events, variation.orbit
    assert events is not None
    mode = orbit.symbols(i)[2]
    same = {then: sp.Symbol(name, real=True) for then, name in zip(events.after, orbit.state, strict=True)}
    modes = {mode: sp.S.Zero} | {then: sp.Integer(side) for then, s in same.items() if s == mode}
    changed = [e for d, e in zip(events.deviations, events.jumps[i], strict=True) if e != d]
    after = changed[0].xreplace(modes).xreplace(same)
    slopes = {c: after.diff(d) for c, d in enumerate(events.deviations)}
    return {c: e for c, e in slopes.items() if e != 0}


def test_the_exit_factor_is_that_of_the_theory() -> None:
    """xi'+ = Delta a (1 + alpha) xi / (theta_b + u omega sin omega t), at the load where slip with w > 0 begins."""
    variation = mode(jumping().equations)
    epsilon, mu_s, mu_k, u, omega, theta_b, t, x = symbols("epsilon mu_s mu_k u omega theta_b t x_1")
    for sign in (1, -1):
        gained = velocity_gained(variation, 0, sign)
        load = sp.solve(-x + u * sp.cos(omega * t) + sign * epsilon * mu_s, x)[0]
        jump = -sign * epsilon * (mu_s - mu_k)
        expected = jump * (1 + MODE[0]) / (theta_b + u * omega * sp.sin(omega * t))
        assert list(gained) == [0]
        assert sp.simplify(gained[0].xreplace({x: load}) - expected) == 0


def test_exits_of_clusters_are_those_of_the_network() -> None:
    """Two of three oscillators move as one: the exits of the quotient and of the difference, put together from the whole."""
    chain = topology("chain", 3)
    equations = jumping(chain).equations
    network = clustered(equations, clusters(chain, (0, 1, 0)))
    assert (network.slots, network.rows) == (((0, 1), (0,)), ((0, 1), (2, 3)))
    x1, x2, x3, v1, v2, v3, a, b, c, d = symbols("x_1 x_2 x_3 v_1 v_2 v_3 a b c d")
    on = {x1: a, x2: b, x3: a, v1: c, v2: d, v3: c}
    first = {column: e.xreplace(on) for column, e in velocity_gained(network_variation(equations), 0, 1).items()}
    parameters = network.variation.parameters
    motion, difference = (dict(zip(parameters, map(sp.Rational, row), strict=True)) for row in network.strengths)
    for strengths, expected in ((motion, first[1]), (difference, 0)):  # x_3 - x_1 does not feel the middle
        values = {x1: a, x2: b, v1: c, v2: d, **strengths}
        gained = {column: e.xreplace(values) for column, e in velocity_gained(network.variation, 0, 1).items()}
        assert sp.simplify(gained[0] - first[0]) == 0
        assert sp.simplify(gained[2] - expected) == 0


def test_dampers_and_a_jump_have_no_tangent() -> None:
    scene = Scene(topology=PAIR, friction="coulomb_static", contact="set-valued", coupling="damper")
    for refused in (mode, network_variation):
        with pytest.raises(ValueError, match="links act on velocities, so the order of simultaneous releases matters"):
            refused(scene.equations)


def far(x: float, v: float, length: float) -> tuple[mpf, mpf]:
    """One block by the Taylor series, in the digits that are set."""
    values = {**JUMP, "hold": JUMP["mu_s"], "mu_s": JUMP["mu_k"], "a": 1.0, "sigma": 0.0}
    reference = Reference(values, [], [x], [v])  # type: ignore[list-item]
    reference.advance(mpf(length))
    assert {new for _, _, new in reference.events} == {0, 1}
    return reference.x[0], reference.v[0]


def propagator(scene: Scene, alpha: float) -> np.ndarray:
    """Propagator of a mode over two periods of the drive."""
    start = np.array([[0.1, 0.1, 0.0]])
    problem = OrbitProblem.of_modes(scene, np.array([alpha]), start, 1)
    integrator = problem.integrator(problem.with_slip_states(start))
    return problem.propagators(integrator, 2.0)[0][0, 0]


@pytest.mark.long
def test_the_propagator_of_a_law_with_a_jump_against_fifty_digits() -> None:
    """A release, slip, a landing and another release: differences of the flow, 1e-15 apart, right to 15 digits."""
    scene = jumping().replace(rtol=1e-12)
    matrix = propagator(scene, 0.0)
    length = 4.0 * np.pi / JUMP["omega"]
    with mp.workdps(50):
        step = mpf(10) ** -15
        there, back = (far(mpf("0.1") + s * step, JUMP["theta_b"], length) for s in (1, -1))  # type: ignore[arg-type]
        by_x = [float((p - q) / (2 * step)) for p, q in zip(there, back, strict=True)]
    np.testing.assert_allclose(matrix[:, 0], by_x, rtol=1e-8)
    assert np.all(matrix[:, 1] == 0.0)  # a deviation of the velocity is lost in stick


@pytest.mark.long
def test_a_pair_out_of_phase_follows_its_mode() -> None:
    """Two coupled oscillators a hair apart, let go one after the other: their difference is the mode alpha = 2 sigma."""
    from synchain.runtime.sweeps.run import run

    scene = jumping(sigma=0.15).replace(transient=0.0, window=2.0, record=(), rtol=1e-12)
    column = propagator(scene, 0.3)[:, 0]
    d = 1e-6
    end = run(scene, reduce=False, show_progress=False, x_1=0.1 + d, x_2=0.1 - d).states("end")
    np.testing.assert_allclose(column, (end[[0, 2]] - end[[1, 3]]) / (2 * d), rtol=1e-4)


def exponents_of(scene: Scene, periods: int, *alpha: float) -> np.ndarray:
    orbit = periodic_orbit(scene, periods)
    length = periods * 2 * np.pi / scene.parameters["omega"]
    return np.array([np.log(abs(orbit.transversal_multipliers(a)[0])) / length for a in alpha])


def test_the_spectrum_of_a_synchronous_pair_is_that_of_its_periodic_orbit() -> None:
    """omega = 1.15, period two: multipliers of the modes 0 and 2 sigma, and -inf for each velocity, which dies in stick."""
    scene = Scene(
        topology=PAIR, contact="set-valued", parameters={"omega": 1.15, "sigma": 0.2}, initial={"x": [0.3] * 2}
    )
    expected = exponents_of(scene, 2, 0.0, 0.4)
    result = lyapunov_spectrum(scene, transient=400, periods=64)
    np.testing.assert_allclose(result.exponent[:2], np.sort(expected)[::-1], rtol=0, atol=1e-6)
    assert result.exponent[2:].tolist() == [-np.inf, -np.inf]
    assert result.resolved.tolist() == [True, True, False, False]
    assert result.divergence == -np.inf
    assert result.components == 4


@pytest.mark.long
def test_a_cluster_of_two_has_the_exponent_of_its_mode() -> None:
    scene = Scene(
        topology=PAIR, contact="set-valued", parameters={"omega": 1.15, "sigma": 0.2}, initial={"x": [0.3] * 2}
    )
    result = cluster_exponents(scene, (0, 0), transient=400, periods=64)
    expected = exponents_of(scene, 2, 0.0, 0.4)
    np.testing.assert_allclose([result.motion, result.exponent[0]], expected, rtol=0, atol=1e-6)

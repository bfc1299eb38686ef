"""Derivatives and deviations of networks, against difference quotients of the equations and against other code."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from pendula import pendulum

import synchain as sc
from synchain.codegen.driver.columns import SpanColumn
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.machine_code.compile import load
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.lift import derivative, lifted
from synchain.runtime.bifurcation.linearised import Linearised
from synchain.runtime.cells.plan import CellRows
from synchain.runtime.engines.job import JobSpec, RowsSpec
from synchain.runtime.engines.step_control import control_array

VAN_DER_POL = sc.Field({"x": "v", "v": "mu*(1 - x**2)*v - x"}, parameters={"mu": 1.0})
SLOW = sc.Field({"x": "v", "v": "nu*(1 - x**2)*v - x - q", "q": "(x - q)/tau"}, parameters={"nu": 0.3, "tau": 2.0})
PHASE = sc.Field({"theta": "w"}, parameters={"w": 0.5})
i, j, W = sc.ends(VAN_DER_POL)
k, g, mu = sp.symbols("k g mu")
PULL = sc.Rates({i.v: k * W * (j.x - i.x) ** 3}, {k: 0.3})
GAP = sc.Rates({i.x: g * W * sp.tanh((i.x + j.x) * (j.v - i.v))}, {g: 0.2})
BY_SOURCE = sc.Rates({i.v: k * W * j.mu**2 * j.x}, {k: 0.3})
SCENES = {
    "one node": (sc.Scene(VAN_DER_POL), "mu"),
    "link": (sc.Scene(VAN_DER_POL, PULL, sc.graphs.star(4)), "k"),
    "layers": (sc.Scene(VAN_DER_POL, links=[(PULL, sc.graphs.ring(5)), (GAP, sc.graphs.star(5))]), "g"),
    "kinds": (
        sc.Scene(VAN_DER_POL, "x->v", sc.graphs.chain(4), nodes=[{"oscillator": SLOW, "at": [2, 3]}]),
        "sigma",
    ),
    "one node's parameter": (sc.Scene(VAN_DER_POL, PULL, sc.graphs.ring(3), parameters={"mu": [0.5, 1.0, 2.0]}), "mu_2"),
    "parameter of the source": (
        sc.Scene(VAN_DER_POL, BY_SOURCE, sc.graphs.ring(3), parameters={"mu": [0.5, 1.0, 2.0]}),
        "mu_3",
    ),
    "one link's parameter": (
        sc.Scene(VAN_DER_POL, links=[(PULL, sc.graphs.ring(3)), (GAP, sc.graphs.chain(3))], parameters={"k": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}),
        "k_1_3",
    ),
    "mean field": (
        sc.Scene(PHASE, sc.Rates({"theta": "k*W*sin(theta_j - theta_i - lag)"}, {"k": 0.5, "lag": 0.3}), sc.graphs.complete(9)),
        "lag",
    ),
    "masses": (sc.Scene(pendulum(4), "spring on q1", sc.graphs.chain(2), record=()), "gravity"),
    "inertial links": (sc.Scene("harmonic", "inerter", sc.graphs.chain(3), record=()), "sigma"),
}  # fmt: skip


def rates(equations: Equations, values: dict[str, float], state: np.ndarray) -> np.ndarray:
    """dx/dt, by a dense solve where the network has a mass matrix."""
    numbers = Linearised.of(equations, values)
    mass = numbers.mass(state)
    return numbers.rates(state) if mass is None else np.linalg.solve(mass.toarray(), numbers.rates(state))


@pytest.mark.parametrize("name", SCENES)
def test_a_lift_moves_deviations_as_neighbouring_motions_differ(name: str) -> None:
    scene, parameter = SCENES[name]
    equations, values = scene.equations, dict(scene.parameters)
    lift = lifted(equations, [parameter])
    x, d = np.random.default_rng(1).normal(size=(2, equations.dimension))
    both = np.zeros(2 * len(x))
    both[list(lift.states)], both[list(lift.deviations)] = x, d
    known = {**values, **dict.fromkeys(lift.equations.parameters, 0.0), **values, lift.seeds[parameter]: 0.7}
    moved = rates(lift.equations, known, both)
    np.testing.assert_allclose(moved[list(lift.states)], rates(equations, values, x), atol=1e-13)
    h = 1e-5
    ahead, behind = (rates(equations, values | {parameter: values[parameter] + 0.7 * e}, x + e * d) for e in (h, -h))
    np.testing.assert_allclose(moved[list(lift.deviations)], (ahead - behind) / (2 * h), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", SCENES)
def test_a_derivative_by_a_parameter_is_that_of_rates_and_masses(name: str) -> None:
    scene, parameter = SCENES[name]
    equations, values = scene.equations, dict(scene.parameters)
    network, seeds = derivative(equations, parameter)
    slope = Linearised.of(network, values | seeds)
    assert network.state == equations.state
    x, h = np.random.default_rng(2).normal(size=equations.dimension), 1e-5
    ahead, behind = (Linearised.of(equations, values | {parameter: values[parameter] + e}) for e in (h, -h))
    np.testing.assert_allclose(slope.rates(x), (ahead.rates(x) - behind.rates(x)) / (2 * h), atol=1e-8)
    if equations.inertial:
        difference = (ahead.mass(x) - behind.mass(x)).toarray() / (2 * h)
        np.testing.assert_allclose(slope.mass(x).toarray(), difference, atol=1e-8)
    else:
        assert slope.mass(x) is None


def test_a_network_can_be_lifted_twice() -> None:
    """d d2 = r_xx d d2 for the motion of the second deviation of x^3: 6 x d d2."""
    once = lifted(sc.Scene(sc.Field({"x": "a*x**3"}, parameters={"a": 1.0})).equations, ["a"])
    twice = lifted(once.equations, ["a", "seed_a"])
    assert twice.equations.state == ("x_1", "d_x_1", "d2_x_1", "d2_d_x_1")
    assert dict(twice.seeds) == {"a": "seed2_a", "seed_a": "seed2_seed_a"}
    values = {"a": 1.0, "seed_a": 0.0, "seed2_a": 0.0, "seed2_seed_a": 0.0}
    assert rates(twice.equations, values, np.array([2.0, 3.0, 5.0, 0.0]))[3] == pytest.approx(6 * 2 * 3 * 5)


def multipliers(scene: sc.Scene, period: float, method: str, unroll: int) -> np.ndarray:
    """Characteristic multipliers of a cycle through the start of a scene: each column of d(T) is a lane."""
    lift, size = lifted(scene.equations), len(scene.y0)
    spec = RowsSpec(
        lift.equations, method, control_array(1e-12, 1e-14, np.inf, 1e7, jumps=False), Recording(()), unroll
    )
    source = spec.source()
    assert source.looped == (unroll < scene.equations.n)
    start = np.zeros((size, 2 * size))
    start[:, lift.states], start[np.arange(size), lift.deviations] = scene.y0, 1.0
    spans = np.zeros((size, len(SpanColumn)))
    spans[:, [SpanColumn.END, SpanColumn.FIRST_STEP, SpanColumn.LOOK, SpanColumn.LONGEST]] = (
        period,
        1e-4,
        np.inf,
        np.inf,
    )
    numbers = np.tile([scene.parameters[name] for name in lift.equations.parameters], (size, 1))
    end = spec.job(JobSpec.of(spec, source), load(source)).run(CellRows(start, numbers, spans)).end
    np.testing.assert_allclose(end[0, list(lift.states)], scene.y0, atol=1e-11)
    return np.linalg.eigvals(end[:, list(lift.deviations)].T)


@pytest.mark.parametrize(("method", "unroll"), [("taylor", 8), ("dop853", 4)])
def test_kernels_of_a_lift_give_the_multipliers_of_a_travelling_wave(method: str, unroll: int) -> None:
    """Stuart-Landau ring z' = (1 + i)z - (1 + i/2)|z|^2 z + kap(1 + ib)(z_+ + z_- - 2z): closed form by 2 x 2 blocks."""
    n, kap, b = 5, 0.3, -1.0
    node = sc.Field({"x": "x - y - (x**2 + y**2)*(x - y/2)", "y": "y + x - (x**2 + y**2)*(y + x/2)"})
    link = sc.Rates(
        {"x": "kap*W*(x_j - x_i - b*(y_j - y_i))", "y": "kap*W*(y_j - y_i + b*(x_j - x_i))"}, {"kap": kap, "b": b}
    )
    angles, q = 2 * np.pi * np.arange(n) / n, 2 * np.pi / n
    radius2 = 1 - kap * (2 - 2 * np.cos(q))
    start = {"x": list(np.sqrt(radius2) * np.cos(angles)), "y": list(np.sqrt(radius2) * np.sin(angles))}
    period = 2 * np.pi / (1 - radius2 / 2 - kap * b * (2 - 2 * np.cos(q)))
    # A deviation of amplitude a_p and conj(a_-p) in the turning frame: waves q + p and q - p are coupled by r^2.
    exponents = []
    for p in q * np.arange(n):
        shifts = [kap * (1 + 1j * b) * (2 * np.cos(q + s) - 2 * np.cos(q)) for s in (p, -p)]
        own = -(1 + 0.5j) * radius2
        block = np.array([[own + shifts[0], own], [np.conj(own), np.conj(own + shifts[1])]])
        exponents += list(np.linalg.eigvals(block))
    expected = np.exp(np.array(exponents) * period)
    found = multipliers(sc.Scene(node, link, sc.graphs.ring(n), initial=start), period, method, unroll)
    gaps = np.abs(found[:, None] - expected[None])
    assert gaps.min(axis=0).max() < 1e-10
    assert gaps.min(axis=1).max() < 1e-10


def test_rates_that_jump_are_refused() -> None:
    belt = sc.Scene(contact="set-valued")
    for call in (lambda: lifted(belt.equations), lambda: derivative(belt.equations, belt.equations.parameters[0])):
        with pytest.raises(ValueError, match=r"found set-valued friction; expected smooth rates; use contact 'atan'"):
            call()
    clock = sc.Field({"x": "1 - sign(x)"}, contact="set-valued", events=[sc.Reset("x - 1", {"x": "0"})])
    with pytest.raises(ValueError, match=r"found set-valued signs and resets; expected smooth rates; use steep"):
        lifted(sc.Scene(clock, None).equations)
    jumping = sc.Scene(sc.Field({"x": "-sign(x)"})).equations
    with pytest.raises(ValueError, match="by which rates jump"):
        lifted(jumping)


def test_a_parameter_that_does_not_enter_is_refused() -> None:
    with pytest.raises(ValueError, match="found 'nu'; expected one of mu"):
        derivative(sc.Scene(VAN_DER_POL).equations, "nu")

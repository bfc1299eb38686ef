"""Energy and power of every conservative and damped network along its exact equations, and of trajectories."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
import sympy as sp
from catalogue import FORCES, LAGRANGIAN
from mechanics_proof import vanishes
from parts import oscillator_of

from synchain import Parameter, Potential, Rates, Scene, ends
from synchain.graphs import chain, complete, ring
from synchain.models.graphs.topology import from_matrix
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.lagrangian import total_derivative
from synchain.models.mechanics.oscillator import Coordinate, LagrangianModel
from synchain.models.scenes.energy import energy_terms
from synchain.models.scenes.file import load_scene
from synchain.plugins import Oscillator
from synchain.runtime.results.energy_of_states import energy_function


def scene_of(oscillator: str, coupling: str, n: int = 2, **more: object) -> Scene:
    friction = "viscous" if oscillator_of(oscillator).takes_friction else None
    return Scene(oscillator=oscillator, friction=friction, coupling=coupling, topology=chain(n), **more)


def balance(scene: Scene) -> sp.Expr:
    """dE/dt along the equations of the whole network less the power, in state symbols."""
    equations = scene.equations
    total, power = energy_terms(scene).whole()
    state, half = sp.symbols(equations.state, real=True), equations.dimension // 2
    rates = equations.rhs()
    return total_derivative(total, state[:half], state[half:], rates[half:]) - power


@pytest.mark.parametrize("coupling", FORCES)
@pytest.mark.parametrize("oscillator", ["duffing", "pendulum", "friction"])
def test_the_power_is_the_rate_of_the_energy(oscillator: str, coupling: str) -> None:
    assert vanishes(balance(scene_of(oscillator, coupling, 3)))


@pytest.mark.parametrize("oscillator", [name for name in LAGRANGIAN if "belt" not in name])
def test_the_power_of_every_oscillator_with_a_spring(oscillator: str) -> None:
    assert vanishes(balance(scene_of(oscillator, "spring")))


@pytest.mark.long
def test_the_power_of_a_cart_with_pendulums_that_is_joined_to_another() -> None:
    """In numbers: the symbolic proof of one of them alone is in test_lagrangian.py, and two would take minutes."""
    scene = scene_of("belt_double_pendulum", "spring on x", parameters={"sigma": 0.4, "damping": 0.2})
    total, power = energy_terms(scene).whole()
    state, half = sp.symbols(scene.equations.state, real=True), scene.equations.dimension // 2
    at = dict(zip(state, np.random.default_rng(3).uniform(-1, 1, 2 * half), strict=True))
    at |= {sp.Symbol(name, real=True): value for name, value in scene.parameters.items()}
    rates = sp.lambdify(list(at), scene.equations.rhs(), cse=True)(*at.values())
    slopes = sp.lambdify(list(at), [total.diff(s) for s in state])(*at.values())
    gained = float(power.xreplace(at))
    assert float(np.dot(slopes, rates)) == pytest.approx(gained, rel=1e-12)
    assert abs(gained) > 1e-3


def unequal() -> dict[str, Scene]:
    """Networks with inertia, with nodes of several kinds, and with both; some with parameters of their own."""
    weights = from_matrix([["-1/2", "1/2", 0], ["1/2", "-5/2", 2], [0, 2, -2]])
    kinds = [{"oscillator": "pendulum", "at": [2]}, {"oscillator": "friction", "at": [3]}]
    values = {"delta": [0.1, 0.2, 0.3]}
    return {
        "inertial": Scene(oscillator="duffing", coupling="inerter", topology=weights, parameters=values),
        "two coordinates": scene_of("double_pendulum", "inerter"),
        "three kinds": Scene(oscillator="duffing", nodes=kinds, coupling="damper", topology=weights),
        "oriented": scene_of("mass", "fput", 3),
        "clocks": load_scene("huygens"),
    }


@pytest.mark.parametrize("name", unequal())
def test_the_power_of_unequal_nodes_and_of_links_with_inertia(name: str) -> None:
    """In 40 digits at random states: M is solved by numbers, as the equations are."""
    scene = unequal()[name]
    eq, (total, power) = scene.equations, energy_terms(scene).whole()
    state, random = sp.symbols(eq.state, real=True), np.random.default_rng(3)
    symbols = [TIME, *state, *sp.symbols(eq.parameters, real=True)]
    mass = sp.Matrix(sp.SparseMatrix(eq.dimension, eq.dimension, eq.mass())) if eq.inertial else sp.eye(eq.dimension)
    terms = [total.diff(TIME), [total.diff(s) for s in state], eq.rhs(), mass, power]
    of = [sp.lambdify(symbols, e, "mpmath") for e in terms]
    with mpmath.workdps(40):
        for _ in range(3):
            at = [mpmath.mpf(value) for value in random.uniform(0.2, 1.3, len(symbols))]
            explicit, slopes, rhs, masses, gained = (f(*at) for f in of)
            rates = mpmath.lu_solve(masses, mpmath.matrix(rhs))
            assert abs(explicit + mpmath.fdot(slopes, rates) - gained) < 1e-36
            assert abs(gained) > 1e-3 or name == "oriented"


@pytest.mark.parametrize("coupling", FORCES)
def test_what_conserves_energy(coupling: str) -> None:
    assert energy_terms(scene_of("harmonic", coupling)).conservative == ("damper" not in coupling)
    assert not energy_terms(scene_of("duffing", coupling)).conservative


def test_what_has_no_energy() -> None:
    one_way = from_matrix([[0, 0], [1, -1]])
    uneven = from_matrix([[-1, 1, 0], [1, -3, 2], [0, 3, -3]])
    for keywords, message in (
        ({"oscillator": "lorenz", "coupling": "x->x", "topology": chain(2)}, "'lorenz' is a vector field"),
        ({"oscillator": "harmonic", "coupling": "x->v", "topology": chain(2)}, "the coupling 'x->v' has none"),
        ({"oscillator": "harmonic", "topology": one_way}, "found one-way links, first from 1 to 2 in"),
        ({"oscillator": "harmonic", "topology": uneven}, "found the weights 3 from 2 to 3 and 2 back in"),
        ({"contact": "set-valued"}, "set-valued friction does work that is no function of the state"),
    ):
        with pytest.raises(ValueError, match=message):
            energy_terms(Scene(**keywords))


def pendulums() -> Scene:
    """Weighted, with two coordinates."""
    graph = from_matrix([["-5/2", 2, "1/2"], [2, -2, 0], ["1/2", 0, "-1/2"]])
    return Scene(oscillator="double_pendulum", coupling="torsion", topology=graph,
                 parameters={"sigma": 0.7, "delta": 0.3, "mass_ratio": 1.5})  # fmt: skip


@pytest.mark.parametrize("scene", [pendulums(), *unequal().values()], ids=["pendulums", *unequal()])
def test_arrays_have_the_energy_of_the_exact_expression(scene: Scene) -> None:
    """For a stack of states: the same numbers as the expression of the whole network."""
    function = energy_function(scene)
    scene = function.scene
    states = np.random.default_rng(1).normal(size=(2, 5, scene.equations.dimension))
    symbols = [TIME, *(real for names in (scene.equations.state, scene.equations.parameters)
                       for real in sp.symbols(names, real=True))]  # fmt: skip
    values = [scene.parameters[name] for name in scene.equations.parameters]
    found_both = function(states, 0.7), function.power(states, 0.7)
    for value, exact in zip(found_both, function.exact.whole(), strict=True):
        written = sp.lambdify(symbols, exact)(0.7, *np.moveaxis(states, -1, 0), *values)
        assert value.shape == (2, 5)
        assert np.allclose(value, written, rtol=1e-13, atol=1e-13)
    name = scene.equations.edges[0].parameters[0].name
    other = function(states, parameters={name: scene.parameters[name] + 0.4})
    assert (np.abs(other - function(states)).max() > 0.1) == (str(scene.coupling) != "damper")


def test_the_imbalance_of_an_exact_solution_is_that_of_the_rule() -> None:
    """x = sin t under v' = -x: E is constant; with x = e^-t sin t and the damping left out the loss is all imbalance."""
    scene = Scene(oscillator="harmonic")
    t = np.linspace(0, 6, 601)
    function = energy_function(scene)
    assert np.abs(function.imbalance(t, np.stack([np.sin(t), np.cos(t)], axis=1))).max() < 1e-15
    damped = np.exp(-t) * np.stack([np.sin(t), np.cos(t) - np.sin(t)])
    assert function.imbalance(t, damped.T)[-1] == pytest.approx(-0.5, abs=1e-4)
    duffing = Scene(oscillator="duffing", parameters={"delta": 2.0, "beta": 0.0, "u": 0.0})
    critical = np.stack([np.exp(-t) * (1 + t), -t * np.exp(-t)], axis=1)  # x'' = -2 x' - x from rest at 1
    fine, coarse = (energy_function(duffing).imbalance(t[::k], critical[::k])[::2] for k in (1, 2))
    assert np.abs(fine).max() < 2e-9
    assert np.abs(coarse).max() / np.abs(fine).max() == pytest.approx(16, rel=0.02), (
        "order four over pairs of intervals"
    )
    with pytest.raises(ValueError, match="found 2 samples; expected at least three"):
        function.imbalance(t[:2], damped.T[:2])


def test_a_ring_of_fput_springs_keeps_what_its_report_keeps() -> None:
    """E = sum v^2/2 + r^2/2 + alpha r^3/3 over the springs of the ring, each with its extension."""
    scene = Scene(oscillator="mass", coupling="fput", topology=ring(6))
    y = np.random.default_rng(2).normal(size=12)
    r = np.roll(y[:6], -1) - y[:6]
    written = (y[6:] ** 2 / 2).sum() + (r**2 / 2 + r**3 / 12).sum()
    assert energy_function(scene)(y) == pytest.approx(written, rel=1e-14)


def test_bodies_of_different_masses_have_an_energy_and_rates_have_none() -> None:
    """The masses cancel in the forces, not in the energy: its exact derivative along the motion vanishes."""
    m, u, v, g = sp.symbols("m u v g", real=True)
    model = LagrangianModel(
        (Coordinate("x", "u"), Coordinate("y", "v")), m * (u**2 + v**2) / 2, sp.S.Zero, (sp.S.Zero,) * 2
    )
    body = Oscillator("body", FrozenDict({"m": Parameter(1.0, "1", "mass", positive=True)}), model)
    i, j, w = ends(body)
    gravity = Potential(-g * w * i.m * j.m / sp.sqrt((i.x - j.x) ** 2 + (i.y - j.y) ** 2), {g: 1})
    for masses in ([1.0, 2.0, 3.0], 1.0):
        scene = Scene(oscillator=body, coupling=gravity, topology=complete(3), parameters={"m": masses})
        total, power = energy_terms(scene).whole()
        states = [sp.Symbol(name, real=True) for name in scene.equations.state]
        drift = sum(total.diff(s) * rate for s, rate in zip(states, scene.equations.rhs(), strict=True))
        values = {s: sp.Rational(3 * k + 1, 7) for k, s in enumerate(sorted(drift.free_symbols, key=str))}
        assert power == 0
        assert abs(sp.N(drift.xreplace(values), 30)) < 1e-25
    with pytest.raises(ValueError, match="energy: the coupling 'rates of u' has none"):
        energy_terms(scene.replace(coupling=Rates({i.u: w * j.x}), parameters=None))

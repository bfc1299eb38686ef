"""Networks of any links against SciPy's DOP853, with right-hand sides that were written by hand."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import sympy as sp
from catalogue import BODY, ROTOR
from scipy.integrate import solve_ivp

from synchain import Field, Parameter, Potential, Rates, Scene, ends, run
from synchain.graphs import Topology, complete, ring, star
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.mechanics.oscillator import FieldModel
from synchain.plugins import Oscillator

K, LAG, OMEGA, G, VS, LAM, TH, GE = sp.symbols("K lag Omega g V_s lam Theta g_el")
P, X, Y, Z = sp.symbols("p x y z", real=True)

Rhs = Callable[[float, np.ndarray], np.ndarray]


def number(default: float) -> Parameter:
    return Parameter(default, "1", "a number")


NEURON = Oscillator(
    "hindmarsh_rose",
    FrozenDict({}),
    FieldModel(
        ("x", "y", "z"),
        (
            Y - X**3 + 3 * X**2 - Z + sp.Rational(16, 5),
            1 - 5 * X**2 - Y,
            (4 * (X + sp.Rational(8, 5)) - Z) * sp.Rational(6, 1000),
        ),
    ),
)


def weights(graph: Topology) -> np.ndarray:
    matrix = np.zeros((graph.n, graph.n))
    for target, source, weight in graph.links:
        matrix[target, source] = float(weight)
    return matrix


def kuramoto(n: int) -> tuple[Scene, Rhs]:
    """Phases with a lag, whose coupling is pumped: rates of first order, not reciprocal, of time."""
    i, j, w = ends(ROTOR)
    pumped = (1 + 0.5 * sp.cos(OMEGA * sp.Symbol("t"))) * K * w * sp.sin(j.theta - i.theta - LAG)
    coupling = Rates({i.theta: pumped}, {K: 1.3, LAG: 0.2, OMEGA: 2})
    frequencies, felt = np.linspace(-0.5, 0.5, n), weights(ring(n))

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        return frequencies + 1.3 * (1 + 0.5 * np.cos(2 * t)) * (felt * np.sin(y[None] - y[:, None] - 0.2)).sum(1)

    return Scene(oscillator=ROTOR, coupling=coupling, topology=ring(n), parameters={"p": list(frequencies)}), rhs


def neurons(n: int) -> tuple[Scene, Rhs]:
    """Hindmarsh-Rose neurons with electrical links on a ring and chemical synapses on a star."""
    i, j, w = ends(NEURON)
    electrical = Rates({i.x: GE * w * (j.x - i.x)}, {GE: 0.1})
    chemical = Rates({i.x: -G * w * (i.x - VS) / (1 + sp.exp(-LAM * (j.x - TH)))}, {G: 0.2, VS: 2, LAM: 10, TH: -0.25})
    first, second = weights(ring(n)), weights(star(n))
    start = {"x": np.linspace(-1, 1, n), "y": np.linspace(-0.5, 0.2, n), "z": np.linspace(2.8, 3.2, n)}

    def rhs(t: float, state: np.ndarray) -> np.ndarray:
        x, y, z = state.reshape(3, -1)
        firing = 1 / (1 + np.exp(-10 * (x + 0.25)))
        push = 0.1 * (first @ x - first.sum(1) * x) - 0.2 * (x - 2) * (second @ firing)
        return np.concatenate([y - x**3 + 3 * x**2 - z + 3.2 + push, 1 - 5 * x**2 - y, 0.006 * (4 * (x + 1.6) - z)])

    layers = [(electrical, ring(n)), (chemical, star(n))]
    return Scene(oscillator=NEURON, links=layers, initial={name: list(values) for name, values in start.items()}), rhs


def bodies(n: int) -> tuple[Scene, Rhs]:
    """Bodies of different masses in the plane under their gravity: forces of several coordinates and of parameters."""
    i, j, w = ends(BODY)
    gravity = Potential(-G * w * i.m * j.m / sp.sqrt((i.x - j.x) ** 2 + (i.y - j.y) ** 2), {G: 1})
    mass, angle = np.linspace(1.0, 2.0, n), 2 * np.pi * np.arange(n) / n
    start = {"x": 5 * np.cos(angle), "y": 5 * np.sin(angle), "u": -0.5 * np.sin(angle), "v": 0.5 * np.cos(angle)}

    def rhs(t: float, state: np.ndarray) -> np.ndarray:
        x, y, u, v = state.reshape(4, -1)
        dx, dy = x[None] - x[:, None], y[None] - y[:, None]
        cube = (dx**2 + dy**2) ** 1.5
        np.fill_diagonal(cube, 1.0)
        return np.concatenate([u, v, (mass * dx / cube).sum(1), (mass * dy / cube).sum(1)])

    initial = {name: list(values) for name, values in start.items()}
    settings = {"oscillator": BODY, "coupling": gravity, "topology": complete(n), "initial": initial}
    return Scene(**settings, parameters={"m": list(mass)}), rhs


@cache
def case(make: Callable[[int], tuple[Scene, Rhs]], n: int) -> tuple[Scene, np.ndarray]:
    scene, rhs = make(n)
    end = solve_ivp(rhs, (0.0, 4.0), scene.y0, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return scene.replace(transient=0.0, window=4.0, time_unit="time", record=(), rtol=1e-12, atol=1e-13), end


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("make", "n", "integrator"),
    [
        (kuramoto, 3, "rodas5p"),
        (kuramoto, 9, "taylor"),
        (neurons, 9, "taylor"),
        (bodies, 2, "taylor"),
        pytest.param(neurons, 9, "rodas5p", marks=LONG),
        pytest.param(kuramoto, 3, "taylor", marks=LONG),
        pytest.param(kuramoto, 9, "rodas5p", marks=LONG),
        pytest.param(neurons, 3, "rodas5p", marks=LONG),
        pytest.param(neurons, 3, "taylor", marks=LONG),
        pytest.param(bodies, 3, "taylor", marks=LONG),
        pytest.param(bodies, 3, "rodas5p", marks=LONG),
        pytest.param(bodies, 9, "taylor", marks=LONG),
        pytest.param(bodies, 9, "rodas5p", marks=LONG),
        pytest.param(bodies, 9, "dop853", marks=LONG),
    ],
)
def test_links_against_dop853(make: Callable[[int], tuple[Scene, Rhs]], n: int, integrator: str) -> None:
    scene, end = case(make, n)
    states = run(scene.replace(integrator=integrator)).states()
    assert np.abs(states - end).max() < 2e-11 * np.abs(end).max()


@pytest.mark.parametrize("n", [3, pytest.param(9, marks=LONG)])
def test_time_in_links_costs_a_rosenbrock_method_no_steps(n: int) -> None:
    """With the exact derivative by time its steps are those of the same motion with time as a state."""
    scene, _ = case(kuramoto, n)
    clock = Oscillator("clocked", ROTOR.parameters, FieldModel(("theta", "s"), (P, sp.S.One)))
    i, j, w = ends(clock)
    pumped = (1 + 0.5 * sp.cos(OMEGA * i.s)) * K * w * sp.sin(j.theta - i.theta - LAG)
    settings = {"oscillator": clock, "coupling": Rates({i.theta: pumped}, {K: 1.3, LAG: 0.2, OMEGA: 2})}
    start = {"theta": scene.initial["theta"], "s": 0.0}
    changed = scene.replace(**settings, initial=start, parameters={"p": list(np.linspace(-0.5, 0.5, n))})
    steps = [int(run(each.replace(integrator="rodas5p", rtol=1e-9)).data.steps) for each in (scene, changed)]
    assert abs(steps[0] - steps[1]) <= 1


def test_functions_of_the_weight_alone_run_in_loops() -> None:
    """Weights of a loop are numbers, what functions take are registers; a power of it and a sine, on unequal weights."""
    i, j, weight = ends(ROTOR)
    link = Rates({i.theta: K * (sp.sin(weight) + weight**LAG) * sp.sin(j.theta - i.theta)}, {K: 0.3, LAG: 0.5})
    n = 10
    weights = np.diag(np.arange(1.0, n), 1) / n + np.diag(np.arange(1.0, n), -1) / 7
    start = np.linspace(0.0, 3.0, n)
    scene = Scene(
        ROTOR, link, weights - np.diag(weights.sum(axis=1)), record=(),
        transient=0.0, window=2.0, time_unit="time", rtol=1e-10, initial={"theta": start},
    )  # fmt: skip

    def rates(_: float, theta: np.ndarray) -> np.ndarray:
        factors = 0.3 * np.where(weights > 0.0, np.sin(weights) + np.sqrt(weights), 0.0)
        return 0.3 + (factors * np.sin(theta[None, :] - theta[:, None])).sum(axis=1)

    expected = solve_ivp(rates, (0.0, 2.0), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(run(scene, show_progress=False).end.values.ravel(), expected, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("n", [3, 10])
def test_choices_by_the_weight_run(n: int) -> None:
    """Links of weight 2 act on one phase's sine, those of weight 1 on its cosine; written out and in loops."""
    i, j, weight = ends(ROTOR)
    gap = j.theta - i.theta
    link = Rates({i.theta: K * sp.Piecewise((sp.sin(gap), weight > 1), (sp.cos(gap) - 1, True))}, {K: 0.3})
    weights = np.diag(1.0 + np.arange(n - 1) % 2, 1) + np.diag(1.0 + np.arange(1, n) % 2, -1)
    start = np.linspace(0.0, 2.0, n)
    scene = Scene(
        ROTOR, link, weights - np.diag(weights.sum(axis=1)), record=(), transient=0.0, window=2.0, time_unit="time",
        rtol=1e-10, integrator="taylor", initial={"theta": start},
    )  # fmt: skip

    def rates(_: float, theta: np.ndarray) -> np.ndarray:
        gaps = theta[None, :] - theta[:, None]
        return 0.3 + 0.3 * np.where(weights > 1.0, np.sin(gaps), np.where(weights > 0, np.cos(gaps) - 1, 0)).sum(axis=1)

    expected = solve_ivp(rates, (0.0, 2.0), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(run(scene, show_progress=False).end.values.ravel(), expected, rtol=0.0, atol=1e-8)


def test_functions_of_summed_inputs_by_sums_of_links() -> None:
    """x' = -x + tanh(W x + I) of docs/links.md: in its inputs exactly, and with a fast state for the sum."""
    felt, start = weights(ring(4)), np.array([0.5, 0.1, -0.3, 0.2])
    exact = solve_ivp(lambda _, x: -x + np.tanh(felt @ x + 0.2), (0, 5), start, rtol=1e-10, atol=1e-12).y[:, -1]
    settings = {"transient": 0.0, "window": 5.0, "time_unit": "time", "rtol": 1e-9, "record": ()}

    unit = Field({"u": "I - u"}, parameters={"I": 0.2})
    inputs = Scene(unit, Rates({"u": "W*tanh(u_j)"}), ring(4), initial={"u": list(felt @ start + 0.2)}, **settings)
    np.testing.assert_allclose(run(inputs).end.squeeze(), felt @ exact + 0.2, rtol=0.0, atol=1e-7)

    unit = Field({"x": "-x + tanh(s + I)", "s": "-s/tau"}, parameters={"I": 0.2, "tau": 1e-3})
    i, j, w = ends(unit)
    begin = {"x": list(start), "s": list(felt @ start)}
    fast = run(Scene(unit, Rates({i.s: w * j.x / i.tau}), ring(4), initial=begin, **settings))
    error = abs(fast.end.sel(component="x").squeeze() - exact).max()
    assert 1e-5 < error < 1e-3

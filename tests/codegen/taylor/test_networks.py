"""Networks of every shape, written out and looped, against SciPy and against each other."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from march import compiled
from plain import Text, march
from samples import TABLE, harmonic_chain, looped, parametric, tanh_pair, two_kinds, varied, waving
from scipy.integrate import solve_ivp
from test_step import friction_pair, pendula

from synchain import Scene
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import write_looped
from synchain.graphs import chain, ring
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

CASES = {
    "chain": harmonic_chain(5), "one-way": looped(), "parametric": parametric(), "functions": tanh_pair(),
    "driven pendulum": waving(), "own parameters": varied(), "two kinds": two_kinds(), "set-valued": friction_pair(),
    "pendula": pendula(2), "lorenz ring": Scene(oscillator="lorenz", topology=ring(4), coupling="x->x").equations,
}  # fmt: skip
END = 0.75


def values(eq: Equations) -> tuple[list[float], list[float]]:
    rng = np.random.default_rng(7)
    start = [
        1.0 if name.startswith("slip") else 0.2 * x
        for name, x in zip(eq.state, rng.normal(size=eq.dimension), strict=True)
    ]
    return start, [
        TABLE.get(name, 0.3 + 0.5 * x) for name, x in zip(eq.parameters, rng.random(len(eq.parameters)), strict=True)
    ]


def reference(eq: Equations) -> np.ndarray:
    start, parameters = values(eq)
    symbols = [sp.Symbol(name, real=True) for name in (*eq.state, *eq.parameters)]
    f = sp.lambdify([TIME, symbols], eq.rhs())
    solution = solve_ivp(lambda t, y: f(t, [*y, *parameters]), (0, END), start, method="DOP853", rtol=1e-13, atol=1e-14)
    return solution.y[:, -1]


def follows(eq: Equations, end: np.ndarray, steps: int) -> None:
    assert np.abs(end - reference(eq)).max() < 3e-12 * (1 + np.abs(end).max())
    assert steps < 60


@pytest.mark.parametrize("looped", [False, True], ids=["written out", "looped"])
@pytest.mark.parametrize("name", CASES)
def test_text_of_networks_follows_their_equations(name, looped):
    eq = CASES[name]
    start, parameters = values(eq)
    follows(eq, *march(eq, 14, start, END, 1e-12, numbers=parameters, looped=looped))


SHORT = (("driven pendulum", False), ("lorenz ring", True))
"""What compiles in a second; others take several."""


@pytest.mark.parametrize(
    ("name", "looped"),
    [
        pytest.param(name, looped, id=f"{name}-{'looped' if looped else 'written out'}",
                     marks=[pytest.mark.long] * ((name, looped) not in SHORT))
        for name in CASES for looped in (False, True)
    ],
)  # fmt: skip
def test_networks_follow_their_equations(name, looped):
    eq = CASES[name]
    end, steps = compiled(eq, 14, looped=looped).run(*values(eq), END, 1e-12)
    follows(eq, end[0], steps)


@pytest.mark.parametrize("name", ["own parameters", "two kinds", "set-valued"])
def test_dense_output_of_loops_is_that_of_lines(name):
    eq = CASES[name]
    texts = [Text(eq, 8, looped, dense=True) for looped in (False, True)]
    for text in texts:
        text.step(np.hstack(values(eq)), 0.0, 0.125, 0.25, 1.0, 1e-11)
    rows = [text.rows for text in texts]
    assert np.abs(rows[0] - rows[1]).max() < 1e-15 * 8
    assert np.abs(rows[0][0]).max() > 0.0


def test_the_length_of_a_looped_step_is_that_of_the_largest_node_at_every_width():
    """Scalar loops that take a maximum over nodes are what LLVM vectorises; a lost node lets the step be too long."""
    scene = Scene("duffing", "spring", ring(9), parameters={"sigma": 0.3})
    values = [scene.parameters[name] for name in scene.equations.parameters]
    single, many = (compiled(scene.equations, 8, width, looped=True) for width in (1, 8))
    dice = np.random.default_rng(3)
    for trial in range(25):
        starts, more = dice.normal(size=(8, 18)), {"t": float(trial), "scale": 2.0 ** (trial % 5 - 4)}
        together, _, _ = many.step(starts, values, **more)
        assert [single.step([start], values, **more)[0][0] for start in starts] == together.tolist()


def test_a_looped_step_without_numbers_has_no_length():
    eq = CASES["lorenz ring"]
    start, parameters = values(eq)
    assert np.isnan(compiled(eq, 14, looped=True).step([np.nan, *start[1:]], parameters)[0][0])


def test_the_text_of_loops_does_not_grow():
    few, many = (write_looped(tidy(Scene(oscillator="pendulum", topology=chain(n)).equations), 16) for n in (9, 900))
    assert len(many.text) - len(few.text) < 200
    assert many.workspace > 90 * few.workspace


def test_equal_oscillators_of_a_ring_have_equal_bits_in_loops():
    eq = CASES["lorenz ring"]
    end, _ = compiled(eq, 14, looped=True).run([1.0] * 4 + [2.0] * 4 + [20.0] * 4, values(eq)[1], 2.0, 1e-9)
    assert (np.ptp(end.reshape(3, 4), axis=1) == 0.0).all()

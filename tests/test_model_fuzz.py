"""Random models, said in SymPy, against SciPy: one or two nodes, smooth, kinked and driven, fields and Lagrangians.

A model is the number that draws it: `check(1234)` repeats a finding.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
import sympy as sp
from catalogue import FUZZ_SECONDS
from scipy.integrate import solve_ivp

from synchain import Field, Lagrangian, Scene, run
from synchain.graphs import chain
from synchain.models.mechanics.components import TIME
from synchain.results import Status

MODELS = 12
"""Models where no time is given."""

LONGEST_STEP = 0.02
"""Of the reference: kinks cost a method of order 8 some digits, pulses must not be missed."""

Pick = np.random.Generator
INTEGRATORS = ("taylor", "dop853", "rodas5p")


@dataclass(frozen=True)
class Case:
    """A drawn scene, its length, and its rates as a function of (t, y)."""

    scene: Scene
    rates: Callable[[float, np.ndarray], np.ndarray]
    start: np.ndarray


def number(pick: Pick, low: float = 0.1, high: float = 2.0) -> sp.Rational:
    """A decimal with one digit behind the point, more often large than small."""
    return sp.Rational(int(pick.integers(round(10 * low), round(10 * high) + 1)), 10)


def signed(pick: Pick) -> sp.Rational:
    return number(pick) * int(pick.choice([-1, 1]))


def smooth(pick: Pick, a: sp.Expr) -> sp.Expr:
    """A bounded or slowly growing function of one argument."""
    return [
        lambda: sp.sin(number(pick) * a),
        lambda: sp.cos(number(pick) * a),
        lambda: sp.tanh(number(pick, 0.2, 5.0) * a),
        lambda: sp.atan(number(pick, 0.2, 5.0) * a),
        lambda: sp.exp(-number(pick, 0.2, 5.0) * a**2),
        lambda: 1 / (1 + number(pick, 0.2, 5.0) * a**2),
        lambda: sp.log(1 + number(pick) * a**2),
        lambda: sp.sqrt(number(pick) + a**2),
        lambda: (1 + a**2) ** sp.Rational(int(pick.integers(-5, 3)), 3),
        lambda: sp.asin(sp.sin(a) / 2),
        lambda: sp.acos(sp.tanh(a) / 2),
        lambda: sp.tan(sp.atan(a) / 2),
        lambda: sp.sinh(a / 2) / sp.cosh(a),
        lambda: 1 / (1 + sp.exp(-number(pick, 1.0, 10.0) * (a - signed(pick)))),
        lambda: sp.cos(a) ** int(pick.integers(2, 9)),
        lambda: sp.exp(number(pick, 1.0, 30.0) * (sp.cos(a) - 1)),
    ][int(pick.integers(16))]()


def kinked(pick: Pick, a: sp.Expr) -> sp.Expr:
    """A function with a kink."""
    c = signed(pick)
    return [
        lambda: sp.Abs(a - c),
        lambda: sp.Max(a, c),
        lambda: sp.Min(a, c),
        lambda: sp.Max(-1, sp.Min(1, number(pick) * a)),
        lambda: sp.Piecewise((2 * (a - c), a > c), (0, True)),
        lambda: sp.Max(0, sp.sin(a) - number(pick, 0.0, 0.9)),
        lambda: sp.Abs(sp.exp(-(a**2)) - sp.Rational(1, 2)),
        lambda: a * sp.Abs(a) / (1 + a**2),
    ][int(pick.integers(8))]()


def drive(pick: Pick) -> sp.Expr:
    """A function of time."""
    w, at = number(pick, 0.2, 4.0), number(pick, 1.0, 8.0)
    return [
        lambda: sp.cos(w * TIME),
        lambda: sp.exp(-w * (TIME - at) ** 2),
        lambda: sp.tanh(w * (TIME - at)),
        lambda: sp.exp(-TIME / 2) * sp.sin(w * TIME + 1),
        lambda: sp.Max(0, sp.sin(w * TIME) - number(pick, 0.0, 0.9)),
        lambda: sp.exp(number(pick, 1.0, 40.0) * (sp.cos(w * TIME) - 1)),
        lambda: TIME / 5,
        lambda: (1 - sp.cos(w * TIME)) ** int(pick.integers(1, 9)) / 16,
    ][int(pick.integers(8))]()


def argument(pick: Pick, states: Sequence[sp.Symbol]) -> sp.Expr:
    """A state, a difference or a product of two, or a state beside time."""
    a, b = (states[int(pick.integers(len(states)))] for _ in range(2))
    return [a, a - signed(pick) * b, a * b, a + number(pick) * sp.sin(TIME), a + signed(pick)][int(pick.integers(5))]


def force(pick: Pick, states: Sequence[sp.Symbol]) -> sp.Expr:
    """One to three terms, each a function of the states, or a product of two; often a drive."""
    terms = []
    for _ in range(int(pick.integers(1, 4))):
        make = kinked if pick.random() < 0.3 else smooth
        term = make(pick, argument(pick, states))
        if pick.random() < 0.3:
            term *= smooth(pick, argument(pick, states))
        terms.append(signed(pick) * term)
    if pick.random() < 0.6:
        terms.append(signed(pick) * drive(pick))
    return sp.Add(*terms)


def power(pick: Pick) -> int:
    return int(pick.choice([1, 3, 5, 7]))


def field(pick: Pick) -> tuple[Field, dict[sp.Symbol, sp.Expr]]:
    """A vector field of one to three states, each pulled back by a power of its own."""
    states = sp.symbols(f"x:{int(pick.integers(1, 4))}", real=True)
    rates = {s: force(pick, states) - number(pick) * s ** power(pick) for s in states}
    return Field(rates), rates


def lagrangian(pick: Pick) -> tuple[Lagrangian, dict[sp.Symbol, sp.Expr]]:
    """One coordinate with a mass that may depend on it, a potential of even degree, damping and a drive."""
    x, v = sp.symbols("x v", real=True)
    mass = 1 + int(pick.integers(2)) * smooth(pick, x) ** 2
    potential = number(pick) * x ** (power(pick) + 1) + signed(pick) * smooth(pick, x) / 2
    push = force(pick, (x, v)) - number(pick, 0.0, 1.0) * v
    node = Lagrangian(mass * v**2 / 2, potential, {x: push}, coordinates={x: v})
    return node, {x: v, v: (push - potential.diff(x) - mass.diff(x) * v**2 / 2) / mass}


def drawn(seed: int) -> Case:
    """The scene that a number draws."""
    pick = np.random.default_rng(seed)
    node, rates = (field if pick.random() < 0.6 else lagrangian)(pick)
    start = np.round(pick.normal(size=len(rates)), 1)
    start[pick.random(len(rates)) < 0.3] = 0.0  # kinks, and zeros of high order
    scene = Scene(
        node, None, chain(1), record=(), transient=0.0, time_unit="time", window=float(pick.choice([1.0, 5.0, 12.0])),
        initial={s.name: float(a) for s, a in zip(rates, start, strict=True)}, max_steps=200_000,
        rtol=float(pick.choice([1e-2, 1e-3, 1e-5, 1e-8, 1e-11, 1e-13])),
    )  # fmt: skip
    function = sp.lambdify((TIME, list(rates)), list(rates.values()), "math")
    return Case(scene, lambda t, y: np.array(function(t, y), dtype=float), start)


def reference(case: Case, start: np.ndarray, rtol: float, step: float) -> np.ndarray | None:
    """The end state by SciPy; None where it gives up."""
    try:
        done = solve_ivp(
            case.rates, (0.0, case.scene.window), start, method="DOP853", rtol=rtol, atol=rtol / 10, max_step=step
        )
    except (ArithmeticError, ValueError):
        return None
    return np.array(done.y[:, -1]) if done.success and np.abs(done.y).max() < 1e6 else None


def tolerated(case: Case, right: np.ndarray, rough: np.ndarray) -> float:
    """A hundred tolerances, as often as a small change at the start grows, and ten times what the reference may be off."""
    rtol, growth = case.scene.rtol, 1.0
    for which in range(len(right)):
        moved = np.array(case.start)
        moved[which] += 1e-6
        end = reference(case, moved, 1e-10, math.inf)
        growth = max(growth, 1e6 * float(np.abs(end - right).max()) if end is not None else math.inf)
    size = max(1.0, float(np.abs(right).max()))
    return 100.0 * rtol * size * growth + 10.0 * float(np.abs(right - rough).max()) + 1e-12 * size * growth


def check(seed: int, integrators: Sequence[str] = INTEGRATORS) -> list[str]:
    """What went wrong with a model, by method: a line each; a refusal in one line is none."""
    case = drawn(seed)
    right = reference(case, case.start, 1e-12, LONGEST_STEP)
    rough = reference(case, case.start, 1e-10, 2 * LONGEST_STEP)
    if right is None or rough is None:
        return []
    allowed = tolerated(case, right, rough)
    if not allowed < 0.1 * max(1.0, float(np.abs(right).max())) * max(1.0, 100.0 * case.scene.rtol / 0.1):
        return []  # chaos or a singularity: nothing to compare
    wrong = []
    for name in integrators:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = run(case.scene.replace(integrator=name), show_progress=False)
        except (ValueError, TypeError) as refused:
            if "\n" in str(refused):
                wrong.append(f"model {seed}, {name}: {refused}")
            continue
        error = float(np.abs(result.states("end") - right).max())
        if int(result.status) != Status.FINISHED or not error <= allowed:
            wrong.append(
                f"model {seed}, {name}, rtol = {case.scene.rtol:g}: {Status(int(result.status)).name}, "
                f"{int(result.steps)} steps, error {error:.3g} of {allowed:.3g} allowed: {case.scene.equations.rhs()}"
            )
    return wrong


@pytest.mark.long
def test_random_models_end_where_scipy_says() -> None:
    end, seed = time.monotonic() + FUZZ_SECONDS, 0
    while seed < MODELS or time.monotonic() < end:
        assert not (wrong := check(seed)), "\n".join(wrong)
        seed += 1

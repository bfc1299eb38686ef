"""Central differences in many digits, against which the tests hold exact derivatives."""

from __future__ import annotations

import functools
import random
from collections.abc import Callable, Mapping, Sequence

import mpmath
import sympy as sp
from parts import edge, node

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.network import network
from synchain.models.graphs.topology import Topology
from synchain.models.mechanics.components import TIME

DIGITS = 50
TABLE = {
    "theta_b": 0.1, "epsilon": 2, "u": 0.1, "omega": 1.15, "mu_s": 0.3, "mu_k": 0.15, "mu": 0.3, "a": 2.5, "v_s": 0.4,
    "c": 0.07, "kappa": 1e5, "sigma": 0.2, "alpha": 0.3, "delta": 0.1, "beta": 1.1,
}  # fmt: skip
"""A value for every parameter of the shipped models: table 1 of the paper where it has one."""

Values = dict[sp.Symbol, mpmath.mpf]


def made(graph: Topology, oscillator: str = "friction", friction: str | None = "exponential", contact: str = "atan",
         coupling: str | None = "spring") -> Equations:  # fmt: skip
    """The equations of a network by the names of its parts."""
    single = node(oscillator, friction, contact)
    return network(single, edge(coupling, single, oscillator) if coupling else None, graph)


def states(equations: Equations, seed: int, near: float | None = None) -> Values:
    """Time and states at random, parameters of TABLE; with `near`, sliding velocities 0.2 … 0.9 times near/kappa."""
    dice = random.Random(seed)
    values = {sp.Symbol(name, real=True): mpmath.mpf(TABLE[name]) for name in equations.parameters}
    for name in equations.state:
        value = mpmath.mpf(dice.uniform(-0.5, 0.5))
        if near is not None and name.startswith("v"):
            sliding = near * mpmath.mpf(dice.uniform(0.2, 0.9)) / mpmath.mpf(TABLE["kappa"])
            value = mpmath.mpf(TABLE["theta_b"]) - sliding
        values[sp.Symbol(name, real=True)] = value
    return {**values, TIME: mpmath.mpf(dice.uniform(0, 9))}


def evaluate(expressions: Sequence[sp.Expr], values: Mapping[sp.Symbol, mpmath.mpf]) -> list[mpmath.mpf]:
    """Expressions as mpmath numbers, in the precision that is set."""
    return [mpmath.mpmathify(x) for x in _compiled(tuple(values), tuple(expressions))(*values.values())]


@functools.cache
def _compiled(symbols: tuple[sp.Symbol, ...], expressions: tuple[sp.Expr, ...]) -> Callable[..., list]:
    return sp.lambdify(list(symbols), list(expressions), "mpmath")


def slopes(expressions: Sequence[sp.Expr], along: Mapping[sp.Symbol, mpmath.mpf], values: Values) -> list[mpmath.mpf]:
    """Central differences of expressions along a direction, right to about 1e-35 relative to their curvature."""
    step = mpmath.mpf(10) ** (-DIGITS // 2)
    with mpmath.workdps(2 * DIGITS):
        there = evaluate(expressions, {s: x + step * along.get(s, 0) for s, x in values.items()})
        back = evaluate(expressions, {s: x - step * along.get(s, 0) for s, x in values.items()})
        return [(a - b) / (2 * step) for a, b in zip(there, back, strict=True)]


def close(values: Sequence[mpmath.mpf], expected: Sequence[mpmath.mpf], digits: int = 25) -> bool:
    """True where all numbers agree to `digits` digits, relative to the larger of 1 and the number."""
    pairs = zip(values, expected, strict=True)
    return all(abs(a - b) <= mpmath.mpf(10) ** -digits * max(1, abs(b)) for a, b in pairs)

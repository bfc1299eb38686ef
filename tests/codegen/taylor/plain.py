"""The text of Taylor steps on plain double precision: no compiler, so that hundreds of models can be tried in a minute.

What a driver does around a step is written once more, in a few lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import special

from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.steps.sparse_plan import sparse_plan
from synchain.codegen.taylor import write_looped, write_rolled, write_step
from synchain.models.dynamics.equations import Equations

BUDGET = 20_000


def _kept(bits: int) -> Callable[[float], np.float64]:
    """Cut a number to the bits of a mask."""
    return lambda a: (np.float64(a).view(np.int64) & np.int64(bits)).view(np.float64)


def _store(array: np.ndarray, slot: int, value: float) -> None:
    array[slot] = value


WORDS: dict[str, Any] = {
    "load": lambda array, slot, width: array[slot], "store": _store, "broadcast": lambda a, width: np.float64(a),
    "select": lambda mask, yes, no: yes if mask else no, "any_lane": bool, "njit": lambda **options: lambda f: f,
    "absolute": np.abs, "maximum": np.fmax, "minimum": np.fmin, "fma": lambda a, b, c: a * b + c, "truncated": _kept(-(1 << 44)),
    "power": np.power, "floor": np.floor, "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "atan": np.arctan, "asin": np.arcsin, "acos": np.arccos,
    "asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh, "erf": special.erf, "math": math, "WIDTH": 1, "DENSE": False,
}  # fmt: skip


class Text:
    """A step whose text is run; the states and the rows of dense output, (order, dimension), are those of the last one."""

    def __init__(
        self, equations: Equations, order: int, looped: bool = False, dense: bool = False, rolled: bool = False
    ) -> None:
        equations = tidy(equations)
        write = write_rolled if rolled else write_looped if looped else write_step
        plan, written = sparse_plan(equations), write(equations, order)
        self.size = equations.dimension
        space = {
            **WORDS, "DIMENSION": self.size, "NODES": equations.n, "DENSE_ROWS": order, "DENSE": dense,
        }  # fmt: skip
        exec(written.text, space)
        self.function, self.graph = space["step"], (plan.arrays, plan.weights) if looped else ()
        if rolled:
            self.graph = ((*plan.arrays[:-1], np.array(written.table)), plan.weights)
        self.state, self.work = np.zeros(self.size), np.zeros(order * self.size + written.workspace)
        self.rows = self.work[: order * self.size].reshape(order, self.size)

    def step(
        self, y: np.ndarray, t: float, limit: float, scale: float, rtol: float, atol: float
    ) -> tuple[float, float]:
        """The length of a step from a state and parameters, and how far its series reach."""
        with np.errstate(all="ignore"):
            length, reach = self.function(t, limit, scale, y, y, self.state, self.work, rtol, atol, *self.graph)
        return length, reach


def march(
    equations: Equations,
    order: int,
    start: Sequence[float],
    end: float,
    rtol: float,
    longest: float = math.inf,
    numbers: Sequence[float] = (),
    looped: bool = False,
) -> tuple[np.ndarray, int]:
    """The state at the end, NaN where steps vanish or are too many, and the number of steps; atol is a tenth of rtol.

    `numbers` are the values of the parameters.
    """
    text, size = Text(equations, order, looped), equations.dimension
    y = np.array([*start, *numbers], dtype=float)
    t, scale, power_of_two = np.float64(0.0), np.float64(1e-4), _kept(0x7FF << 52)
    for steps in range(BUDGET):
        if t >= end:
            return y[:size], steps
        limit = np.float64(min(end - t, longest))
        h, reach = text.step(y, t, limit, scale, rtol, rtol / 10)
        if not reach > 0.0:
            scale = 0.0625 * scale
        else:
            t = np.float64(end) if h >= end - t else t + h
            y[:size] = text.state
            scale = power_of_two(reach) if reach < limit else np.maximum(scale, power_of_two(reach))
        if not (scale > 4e-16 * max(1.0, t) and np.abs(y[:size]).max() < 2.0**53):
            break
    return np.full(size, math.nan), steps

"""A minimal driver for Taylor steps: runs lanes of equal equations until all have reached their end."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit as numba_njit

from synchain.codegen import simd
from synchain.codegen.front_end.syntax_trees import execute
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.steps.sparse_plan import sparse_plan
from synchain.codegen.taylor import TaylorStep, write_looped, write_step
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Node


def plain(**options: Any) -> Callable[..., Any]:
    """The decorator of kernels for text that stands in no file."""
    return simd.njit(**{**options, "cache": False})


SPACE = {name: getattr(simd, name) for name in simd.__all__} | {"njit": plain, "math": math}


def alone(state: Sequence[Any], rhs: Sequence[Any], parameters: Sequence[Any] = ()) -> Equations:
    """One node without links."""
    return Equations.of_equal_nodes(Node(tuple(state), tuple(rhs), tuple(parameters)), None, 1)


def step_of(equations: Equations, order: int) -> TaylorStep:
    return write_step(tidy(equations), order)


@dataclass(frozen=True, slots=True)
class Lanes:
    """A compiled step and loop."""

    march: Callable[..., int]
    once: Callable[..., np.ndarray]
    equations: Equations
    width: int
    order: int
    groups: int

    def run(self, start: Any, numbers: Any, end: Any, rtol: float, atol: float | None = None, **more: Any) -> Any:
        """The end states (width, dimension) and the number of steps; rows of `start` and `numbers` are lanes or shared."""
        y = self.bank(start, numbers)
        t = np.full(self.width, float(more.get("t", 0.0)))
        ends = np.broadcast_to(np.asarray(end, float), self.width).copy()
        atol = rtol / 10 if atol is None else atol
        steps = self.march(t, y, ends, rtol, atol, float(more.get("scale", 2.0**-6)))
        return y[: self.equations.dimension * self.width].reshape(-1, self.width).T.copy(), steps

    def bank(self, start: Any, numbers: Any) -> np.ndarray:
        rows = np.hstack(
            [np.broadcast_to(np.asarray(part, float), (self.width, np.shape(part)[-1])) for part in (start, numbers)]
        )
        return np.ascontiguousarray(rows.T).reshape(-1)

    def step(
        self, start: Any, numbers: Any, h: float = math.inf, **more: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One step: lengths, new states (width, dimension), rows of dense output (order, dimension, width)."""
        y, size = self.bank(start, numbers), self.equations.dimension
        y_new, dense, length = (
            np.zeros(size * self.width),
            np.zeros(self.groups * self.width),
            np.zeros(self.width),
        )
        rtol, atol = more.get("rtol", 1e-10), more.get("atol", 1e-11)
        t, scale = float(more.get("t", 0.0)), float(more.get("scale", 1.0))
        length = self.once(t, float(h), scale, y, y_new, dense, rtol, atol)
        return length, y_new.reshape(size, -1).T, dense[: self.order * size * self.width].reshape(self.order, size, -1)


@functools.lru_cache(maxsize=64)
def compiled(equations: Equations, order: int, width: int = 1, dense: bool = False, looped: bool = False) -> Lanes:
    """The step of some order, compiled for a width; tests that ask for the same one share it."""
    plan = sparse_plan(tidy(equations))
    written = write_looped(tidy(equations), order) if looped else step_of(equations, order)
    space = {**SPACE, "WIDTH": width, "DIMENSION": equations.dimension, "NODES": equations.n, "DENSE": dense}
    space["DENSE_ROWS"] = order
    execute(written.text, "<step>", space)
    if looped:
        graph, weights, inner = plan.arrays, plan.weights, space["step"]
        space["step"] = numba_njit(error_model="numpy")(
            lambda t, h, scale, y, p, y_new, dense, rtol, atol: inner(
                t, h, scale, y, p, y_new, dense, rtol, atol, graph, weights
            )
        )
    step, load, store, select, broadcast = (space[n] for n in ("step", "load", "store", "select", "broadcast"))
    size, lane_bits, power_of_two = equations.dimension, simd.lane_bits, simd.power_of_two
    groups = order * size + written.workspace

    @numba_njit(error_model="numpy")
    def march(t, y, ends, rtol, atol, first):
        y_new, work, scales = np.zeros(size * width), np.zeros(groups * width), np.full(width, first)
        steps = 0
        while True:
            now, end = load(t, 0, width), load(ends, 0, width)
            h, reach = step(now, end - now, load(scales, 0, width), y, y, y_new, work, rtol, atol)
            running = reach > 0.0
            if lane_bits(running) == 0:
                return steps
            steps += 1
            for c in range(size):
                store(y, c, select(running, load(y_new, c, width), load(y, c, width)))
            landed = h >= end - now
            store(t, 0, select(landed, end, now + h))
            store(scales, 0, select(reach >= end - now, load(scales, 0, width), power_of_two(reach)))

    @numba_njit(error_model="numpy")
    def once(t, h, scale, y, y_new, work, rtol, atol):
        length = np.zeros(width)
        h, reach = step(
            broadcast(t, width), broadcast(h, width), broadcast(scale, width), y, y, y_new, work, rtol, atol
        )
        store(length, 0, select(reach > 0.0, h, reach))
        return length

    return Lanes(march, once, equations, width, order, groups)

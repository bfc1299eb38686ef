"""Work and precision of the friction oscillators: time per drive period and core against the error of the state.

The cases are the reference solutions in `data/` (quadruple precision, at least 15 certain decimals); the error is the
largest over all components of the state at 40 times.  Every method runs through the same generated kernel and driver, so
that only the method differs; width 1 is the scalar kernel.  The first row of each case is the source paper's method and
tolerances, Cash-Karp with 1e-15 and 1e-12.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from synchain.models.scene import Scene
from synchain.models.topology import topology

from ..plan import control_array
from ..sweep import Buffers, kernel

__all__ = ["CASES", "COLUMNS", "METHODS", "Case", "Method", "measure", "read_case", "solve"]

COLUMNS = ("n", "method", "lanes", "rtol", "error", "microseconds per period", "steps per period", "times faster")
CASES = (1, 2)


@dataclass(frozen=True, slots=True)
class Method:
    """A row of the benchmark."""

    integrator: str
    width: int
    rtol: float
    atol: float
    periods: int


METHODS = (
    Method("cash_karp", 1, 1e-12, 1e-15, 10),
    *(Method("rodas5p", 1, rtol, 0.1 * rtol, 100) for rtol in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)),
    *(Method("rodas5p", 8, rtol, 0.1 * rtol, 100) for rtol in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)),
)


@dataclass(frozen=True, slots=True)
class Case:
    """A reference solution: scene, times (m,) in non-dimensional time and states (m, dimension)."""

    scene: Scene
    times: np.ndarray
    states: np.ndarray


def read_case(n: int) -> Case:
    """Return the reference solution of n oscillators (1 or 2)."""
    data = json.loads(files(__package__).joinpath("data", f"trajectory_n{n}.json").read_text(encoding="utf-8"))
    names = {"vb": "theta_b", "eps": "epsilon"}
    parameters = {names.get(name, name): value for name, value in data["parameters"].items()}
    if n > 1:
        parameters["sigma"] = data["sigma"]
    scene = Scene(
        topology=topology("chain", n), parameters=parameters, initial=data["initial"], record=(), time_unit="time"
    )
    times = np.array([float.fromhex(t) for t in data["t"]])
    return Case(scene, times, np.array(data["state"], dtype=float))


def solve(case: Case, method: Method, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Integrate to each of the end times; returns states, counts and CPU seconds."""
    compiled = kernel(case.scene.replace(integrator=method.integrator), method.width)
    cells, dimension = len(ends), case.states.shape[1]
    start = np.tile(np.array(case.scene.y0), (cells, 1))
    numbers = np.tile([case.scene.parameters[name] for name in case.scene.equations.parameters], (cells, 1))
    spans = np.stack([np.zeros(cells), ends], axis=1).copy()
    control = control_array(method.rtol, method.atol, np.inf, 1e12)
    buffers = Buffers.empty(cells, dimension, room=0, samples=0)
    begin = time.process_time()
    compiled.drive(0, cells, start, numbers, spans, control, *buffers.arrays())
    return buffers.end, buffers.counts, time.process_time() - begin


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    rows: list[tuple[object, ...]] = []
    for n in CASES:
        case = read_case(n)
        slowest = 0.0
        for method in METHODS:
            row, cost = _row(case, method, quick, slowest)
            slowest = slowest or cost
            rows.append((n, *row))
    return rows


def _row(case: Case, method: Method, quick: bool, slowest: float) -> tuple[tuple[object, ...], float]:
    period = 2.0 * np.pi / case.scene.parameters["omega"]
    chosen = slice(0, 8) if quick or method.integrator == "cash_karp" else slice(None)
    states, _, _ = solve(case, method, case.times[chosen])
    error = float(np.abs(states - case.states[chosen]).max())
    length = np.full(method.width, method.periods * period)
    best, counts = np.inf, np.zeros((1, 4))
    for _ in range(1 if quick else 5):
        _, counts, seconds = solve(case, method, length)
        best = min(best, seconds)
    cost = best / (method.periods * method.width) * 1e6
    steps = float(counts[0, 1] + counts[0, 2]) / method.periods
    ratio = slowest / cost if slowest else 1.0
    return (method.integrator, method.width, method.rtol, error, cost, steps, ratio), cost

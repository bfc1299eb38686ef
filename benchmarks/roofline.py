"""How much of the processor's arithmetic a step of rodas5p uses: operations over time against a
measured peak.

How operations are counted stands in `_operations.py`; a division counts as one although the
processor needs many times longer for it. The peak is that of independent chains of fused
multiply-adds on the same lanes; both are timed in turn, so that they see the same clock, and the
share is the median over the rounds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from synchain.codegen.simd import lanes
from synchain.codegen.simd.addresses import address
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.plan import plan
from synchain.runtime.engines.scene_kernels import kernel

from .kit.operations import operations

COLUMNS = ("n", "lanes", "flops per step and lane", "nanoseconds per step", "Gflop/s", "peak Gflop/s", "share of peak")
CHAINS = 12
"""Independent multiply-adds in flight: at least latency times units, at most the vector registers.
"""

PEAK = """
@njit(error_model="numpy")
def work(start, count):
    a, b = load(start, 0, WIDTH), load(start, 1, WIDTH)
    {first}
    for _ in range(count):
{body}
    store(start, 2, {total})
"""

STEPS = """
@njit(error_model="numpy")
def work(step, bank, new, rows, clock, count):
    y, y_new, dense = address(bank, 0), address(new, 0), address(rows, 0)
    worst = broadcast(0.0, WIDTH)
    for _ in range(count):
        error = step(load(clock, 0, WIDTH), load(clock, 1, WIDTH), y, y, y_new, dense, 1e-8, 1e-9)
        worst = maximum(worst, error)
    store(clock, 2, worst)
"""


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    sizes = (1,) if quick else (1, 2, 4, 8)
    return [_row(n, lanes.native_width(), quick) for n in sizes]


def _row(n: int, width: int, quick: bool) -> tuple[object, ...]:
    scene = Scene(topology=topology("chain", n), record=(), integrator="rodas5p")
    compiled = kernel(scene, width, reduce=False)
    flops = operations(compiled.origin)
    step = compiled.compiled.functions["step"]
    cells = plan(scene)
    bank = np.repeat(np.concatenate([cells.start[0], cells.numbers[0]]), width)
    clock = np.repeat([0.3, 0.01, 0.0], width)
    new, rows = np.zeros(bank.size), np.zeros(compiled.origin.dimensions.dense_rows * bank.size)
    steps = _function(STEPS, width)
    seconds, rounds = (1e-3, 3) if quick else (0.1, 15)
    pairs = _in_turn(lambda count: steps(step, bank, new, rows, clock, count), _peak(width), seconds, rounds)
    if not (clock[2 * width :] > 0.0).all() or not (clock[2 * width :] <= 1.0).all():
        raise RuntimeError(f"the timed step has the error {clock[-1]}; expected one that would be accepted")
    done = [(flops * width / a * 1e-9, 2 * CHAINS * width / b * 1e-9) for a, b in pairs]
    share = median(x / y for x, y in done)
    spent = median(a for a, _ in pairs) * 1e9
    return (n, width, flops, spent, median(x for x, _ in done), median(y for _, y in done), share)


def _peak(width: int) -> Callable[[int], object]:
    """A function of a count that runs so many rounds of CHAINS independent multiply-adds."""
    names = [f"x{i}" for i in range(CHAINS)]
    text = PEAK.format(
        first="\n    ".join(f"{name} = a*{i + 1}.0" for i, name in enumerate(names)),
        body="\n".join(f"        {name} = multiply_add({name}, b, a)" for name in names),
        total=" + ".join(names),
    )
    function = _function(text, width)
    start = np.repeat([1e-3, 0.999, 0.0], width)
    return lambda count: function(start, count)


def _function(text: str, width: int) -> Callable[..., object]:
    """Compile the function `work` of a text."""
    from numba import njit

    given = {name: getattr(lanes, name) for name in ("load", "store", "multiply_add", "broadcast", "maximum")}
    space: dict[str, Any] = {**given, "address": address, "njit": njit, "WIDTH": width}
    exec(compile(text, "<roofline benchmark>", "exec"), space)
    work: Callable[..., object] = space["work"]
    return work


def _in_turn(
    first: Callable[[int], object], second: Callable[[int], object], seconds: float, rounds: int
) -> list[tuple[float, float]]:
    """Seconds for one count of either function, timed in turn."""
    counts = []
    for function in (first, second):
        function(1)
        count, spent = 1, 0.0
        while spent < seconds:
            count *= 2
            spent = _timed(function, count)
        counts.append(count)
    return [(_timed(first, counts[0]) / counts[0], _timed(second, counts[1]) / counts[1]) for _ in range(rounds)]


def _timed(function: Callable[[int], object], count: int) -> float:
    begin = time.perf_counter()
    function(count)
    return max(time.perf_counter() - begin, math.ulp(1.0))

"""Transversal Lyapunov exponents of the synchronous state as a function of alpha = sigma |gamma|.

One oscillator and one mode are integrated together (models/tangent.py).  The deviation is scaled back to length 1 after
every block of drive periods; the exponent is the mean growth rate over the blocks.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from synchain.codegen.emit import emit
from synchain.codegen.load import Kernel, load
from synchain.models.scene import Scene
from synchain.models.tangent import transversal

from .intervals import Interval
from .plan import control_array, tolerances
from .status import Status
from .sweep import Buffers, worker_count

__all__ = ["Exponents", "exponents"]


@dataclass(frozen=True, slots=True)
class Exponents:
    """Exponent (m,) per unit of non-dimensional time at each alpha (m,), with its standard error (m,).

    The error comes from the scatter of ten batch means over time and over the starts; `time` is the length averaged over
    for each start.
    """

    alpha: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    time: float
    starts: int

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Where the exponent is negative; ends between grid points by linear interpolation."""
        x, y = self.alpha, self.exponent
        ends = [float(x[0])] if y[0] < 0 else []
        for i in np.flatnonzero((y[1:] < 0) != (y[:-1] < 0)):
            ends.append(float(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])))
        if y[-1] < 0:
            ends.append(float(x[-1]))
        return tuple(zip(ends[::2], ends[1::2], strict=True))


def exponents(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray,
    *,
    periods: float = 2000,
    transient: float = 300,
    starts: int = 4,
    block: float = 10,
    workers: int | None = None,
    seed: int = 0,
    **parameters: float,
) -> Exponents:
    """Return the largest transversal exponent of a scene's oscillator and coupling for each alpha.

    `periods` (of the drive, or of 2 pi where there is none) are averaged over after `transient`, from `starts` initial
    states; the first is that of the scene's first oscillator, the others are moved at random by up to 0.4 in the position.

    Raises ValueError for a network without coupling or a coupling without synchronous state; FloatingPointError where an
    integration fails.
    """
    scene = scene.replace(axes=(), record=(), **parameters)
    alpha = np.asarray(alpha, dtype=float)
    unit = scene.period or 2.0 * math.pi
    work = _Blocks.prepare(scene, alpha, starts, block * unit, worker_count(workers), seed)
    for _ in range(round(transient / block)):
        work.advance()
    growth = np.array([work.advance() for _ in range(round(periods / block))])
    return _summary(alpha, growth / (block * unit), starts, periods * unit)


@dataclass(slots=True)
class _Blocks:
    """Cells (alpha, start) in step with each other, one block of time after the other."""

    kernel: Kernel
    state: np.ndarray
    numbers: np.ndarray
    spans: np.ndarray
    control: np.ndarray
    workers: int

    @classmethod
    def prepare(cls, scene: Scene, alpha: np.ndarray, starts: int, length: float, workers: int, seed: int) -> _Blocks:
        kernel = load(emit(transversal(scene.equations), scene.integrator, ()))
        cells = len(alpha) * starts
        names = kernel.equations.parameters
        values = {**scene.parameters, "alpha": 0.0}
        numbers = np.tile([values[name] for name in names], (cells, 1))
        numbers[:, names.index("alpha")] = np.repeat(alpha, starts)
        limits = tolerances(scene, np.empty((0, 0)))
        control = control_array(*limits, 0.5 * (scene.period or math.inf), scene.max_steps)
        return cls(
            kernel, _start(scene, cells, starts, seed), numbers, np.tile([0.0, length], (cells, 1)), control, workers
        )

    def advance(self) -> np.ndarray:
        """Integrate over one block, scale the deviations back to 1 and return the logarithm of their growth (cells,)."""
        self.state = _integrate(self)
        half = self.state.shape[1] // 2
        length = np.maximum(np.linalg.norm(self.state[:, half:], axis=1), 1e-300)
        self.state[:, half:] /= length[:, None]
        return np.log(length)


def _start(scene: Scene, cells: int, starts: int, seed: int) -> np.ndarray:
    """Rows of orbit and deviation: the first oscillator's state, moved; the deviation along (1, 1, …)."""
    own = np.array([values[0] for values in scene.initial.values()])
    moves = np.concatenate([[0.0], np.random.default_rng(seed).uniform(-0.4, 0.4, starts - 1)])
    state = np.ones((cells, 2 * len(own)))
    state[:, : len(own)] = own
    state[:, 0] += np.tile(moves, cells // starts)
    state[:, len(own) :] /= math.sqrt(len(own))
    return state


def _integrate(work: _Blocks) -> np.ndarray:
    """The states of all cells at the end of a block, on threads; FloatingPointError where one fails."""
    cells, dimension = work.state.shape
    buffers = Buffers.empty(cells, dimension, room=0, samples=0)
    cuts = np.linspace(0, cells, work.workers + 1).astype(int)
    fixed = (work.state, work.numbers, work.spans, work.control, *buffers.arrays())
    with ThreadPoolExecutor(work.workers) as pool:
        jobs = [pool.submit(work.kernel.drive, a, b, *fixed) for a, b in itertools.pairwise(cuts) if b > a]
        for job in jobs:
            job.result()
    bad = np.flatnonzero(buffers.counts[:, 0] != Status.FINISHED)
    if len(bad):
        raise FloatingPointError(f"a tangent integration failed: {Status(int(buffers.counts[bad[0], 0])).message}")
    return buffers.end


def _summary(alpha: np.ndarray, rates: np.ndarray, starts: int, length: float) -> Exponents:
    """Mean and standard error from ten batches in time for each start."""
    table = rates.reshape(len(rates), len(alpha), starts)
    batches = np.array([part.mean(axis=0) for part in np.array_split(table, min(10, len(table)))])
    flat = batches.transpose(1, 0, 2).reshape(len(alpha), -1)
    error = flat.std(axis=1, ddof=1) / math.sqrt(flat.shape[1]) if flat.shape[1] > 1 else np.full(len(alpha), np.nan)
    return Exponents(alpha, table.mean(axis=(0, 2)), error, length, starts)

"""Transversal Lyapunov exponents of the synchronous state as a function of alpha = sigma |gamma|.

One oscillator and one mode are integrated together (models/tangent.py).  The deviation is scaled back to length 1 after
every block of drive periods; the exponent is the mean growth rate over the blocks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from synchain.codegen.emit import emit
from synchain.codegen.load import load
from synchain.models.scene import Scene
from synchain.models.tangent import transversal

from .intervals import Interval
from .status import Status
from .sweep import worker_count

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
    kernel = load(emit(transversal(scene.equations), scene.integrator, ()))
    alpha = np.asarray(alpha, dtype=float)
    cells = len(alpha) * starts
    names = kernel.equations.parameters
    values = {**scene.parameters, "alpha": 0.0}
    numbers = np.tile([values[name] for name in names], (cells, 1))
    numbers[:, names.index("alpha")] = np.repeat(alpha, starts)
    unit = scene.period or 2.0 * math.pi
    state = _start(scene, cells, starts, seed)
    size = len(scene.components)
    spans = np.tile([0.0, block * unit], (cells, 1))
    control = np.array([scene.rtol, scene.atol, 1e-4, 0.5 * unit, scene.max_steps, 0.0, 0.0])
    total, skip = round((periods + transient) / block), round(transient / block)
    growth = np.zeros((total - skip, cells))
    for k in range(total):
        state = _advance(kernel, state, numbers, spans, control, worker_count(workers))
        length = np.linalg.norm(state[:, size:], axis=1)
        if k >= skip:
            growth[k - skip] = np.log(np.maximum(length, 1e-300))
        state[:, size:] /= np.maximum(length, 1e-300)[:, None]
    return _summary(alpha, growth / (block * unit), starts, periods * unit)


def _start(scene: Scene, cells: int, starts: int, seed: int) -> np.ndarray:
    """Rows of orbit and deviation: the first oscillator's state, moved; the deviation along (1, 1, …)."""
    own = np.array([values[0] for values in scene.initial.values()])
    moves = np.concatenate([[0.0], np.random.default_rng(seed).uniform(-0.4, 0.4, starts - 1)])
    state = np.ones((cells, 2 * len(own)))
    state[:, : len(own)] = own
    state[:, 0] += np.tile(moves, cells // starts)
    state[:, len(own) :] /= math.sqrt(len(own))
    return state


def _advance(kernel, state, numbers, spans, control, workers):  # type: ignore[no-untyped-def]
    """Integrate all cells over one block on threads."""
    cells, dimension = state.shape
    end, sums, counts = np.empty_like(state), np.zeros((cells, 4)), np.zeros((cells, 4), np.int64)
    points, samples = np.zeros((cells, 0, dimension + 1)), np.zeros((cells, 0, dimension))
    cuts = np.linspace(0, cells, workers + 1).astype(int)
    with ThreadPoolExecutor(workers) as pool:
        jobs = [
            pool.submit(kernel.drive, a, b, state, numbers, spans, control, end, sums, counts, points, samples)
            for a, b in zip(cuts[:-1], cuts[1:], strict=True)
            if b > a
        ]
        for job in jobs:
            job.result()
    bad = np.flatnonzero(counts[:, 0] != Status.FINISHED)
    if len(bad):
        raise FloatingPointError(f"a tangent integration failed: {Status(int(counts[bad[0], 0])).message}")
    return end


def _summary(alpha: np.ndarray, rates: np.ndarray, starts: int, length: float) -> Exponents:
    """Mean and standard error from ten batches in time for each start."""
    table = rates.reshape(len(rates), len(alpha), starts)
    batches = np.array([part.mean(axis=0) for part in np.array_split(table, min(10, len(table)))])
    flat = batches.transpose(1, 0, 2).reshape(len(alpha), -1)
    error = flat.std(axis=1, ddof=1) / math.sqrt(flat.shape[1]) if flat.shape[1] > 1 else np.full(len(alpha), np.nan)
    return Exponents(alpha, table.mean(axis=(0, 2)), error, length, starts)

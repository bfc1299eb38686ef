"""Orbits that carry deviations: arrays around the kernels of `synchain.codegen.kernels.modes`, stretch after stretch of time."""

from __future__ import annotations

import itertools
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from synchain.codegen.driver.columns import Control
from synchain.codegen.kernels.compile import Kernel, load
from synchain.codegen.kernels.modes import emit_modes
from synchain.models.dynamics.variational import Variation
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import local_clock
from ..cells.plan import control_array, half_swing, periods, tolerances
from ..support.status import Status
from ..support.threads import worker_count

__all__ = ["Carrier"]


@dataclass(slots=True)
class Carrier:
    """Orbits (cells) with deviations, `modes` of them each, which differ in their strengths.

    state (cells, dimension), numbers (cells, parameters), period (cells,): after which the clock starts anew, 0 for none;
    strengths (number of strengths, padded modes) sorted by size, order (modes,): where each mode of the caller stands;
    vectors (cells, size, padded modes).
    """

    kernel: Kernel
    state: np.ndarray
    numbers: np.ndarray
    period: np.ndarray
    control: np.ndarray
    strengths: np.ndarray
    order: np.ndarray
    vectors: np.ndarray
    workers: int
    steps: int = 0

    @classmethod
    def make(
        cls,
        scene: Scene,
        variation: Variation,
        state: np.ndarray,
        numbers: np.ndarray,
        strengths: np.ndarray,
        workers: int | None = None,
        looseness: float = 1.0,
    ) -> Carrier:
        """Prepare the kernel and the arrays; tolerances and step budget are the scene's.

        strengths: (number of strengths, modes), any order.  Deviations start along (1, 1, …).  `looseness`: how many
        times the tolerance of the orbit the deviations are allowed.
        """
        kernel = _kernel(variation)
        width, count = kernel.origin.width, strengths.shape[1]
        order = np.argsort(np.hypot.reduce(strengths, axis=0) if len(strengths) else np.zeros(count), kind="stable")
        padded = -(-count // width) * width
        chosen = np.concatenate([order, np.full(padded - count, order[-1])])
        where = np.empty(count, dtype=np.int64)
        where[order] = np.arange(count)
        rtol, atol = tolerances(scene, numbers)
        repeat = periods(kernel.equations, numbers)
        longest = half_swing(kernel.equations, dict(zip(kernel.equations.parameters, numbers.T, strict=True)))
        control = np.append(control_array(rtol, atol, longest, scene.max_steps, jumps=False), looseness)
        vectors = np.full((len(state), variation.size, padded), 1.0 / math.sqrt(variation.size))
        kept = np.ascontiguousarray(strengths[:, chosen], dtype=float)
        kept = kept if len(kept) else np.zeros((1, padded))
        rows = np.ascontiguousarray(state, dtype=float).copy()
        clock = local_clock(kernel.equations, repeat)
        return cls(kernel, rows, np.ascontiguousarray(numbers, dtype=float), clock, control, kept, where, vectors,
                   worker_count(workers))  # fmt: skip

    @property
    def deviations(self) -> np.ndarray:
        """The deviations (cells, size, modes) in the caller's order, at unit length."""
        return self.vectors[:, :, self.order]

    def point(self, vectors: np.ndarray) -> None:
        """Set the deviations (cells, size, modes), in the caller's order; lengths other than 1 are kept."""
        self.vectors[:, :, self.order] = vectors
        spare = self.vectors.shape[2] - len(self.order)
        if spare:
            self.vectors[:, :, -spare:] = self.vectors[:, :, -spare - 1 : -spare]

    def advance(self, length: float | np.ndarray) -> np.ndarray:
        """Integrate over a length of time (one for all cells, or one each); returns log growth (cells, modes).

        Where the equations are periodic in time the length must be a whole number of periods: the next stretch begins at
        the phase 0 again.  Deviations come out at unit length; the growth of one that has become zero is -inf.
        Raises FloatingPointError where an orbit cannot be integrated, KeyboardInterrupt on Ctrl-C.
        """
        cells, dimension = self.state.shape
        spans = np.zeros((cells, 4))
        spans[:, 1], spans[:, 2] = length, self.period
        growth = np.empty((cells, self.strengths.shape[1]))
        end, sums, counts = np.empty((cells, dimension)), np.empty((cells, 4)), np.zeros((cells, 6), dtype=np.int64)
        rest = (self.state, self.numbers, spans, self.control, self.strengths, self.vectors, growth, end, sums, counts,
                np.empty((cells, 0, dimension)))  # fmt: skip
        cuts = np.linspace(0, cells, min(cells, self.workers) + 1).astype(int)
        if len(cuts) == 2:
            self.kernel.entry(0, cells, *rest)
        else:
            self._share(cuts, rest)
        bad = np.flatnonzero(counts[:, 0] != Status.FINISHED)
        if len(bad):
            status = Status(int(counts[bad[0], 0]))
            raise FloatingPointError(f"the orbit with its deviations cannot be integrated: {status.message}")
        self.state = end
        self.steps += int(counts[:, 1:3].sum())
        return growth[:, self.order]

    def _share(self, cuts: np.ndarray, rest: tuple[np.ndarray, ...]) -> None:
        """Run the parts of the cells on threads; on Ctrl-C they stop at once."""
        with ThreadPoolExecutor(self.workers) as pool:
            jobs = [pool.submit(self.kernel.entry, a, b, *rest) for a, b in itertools.pairwise(cuts)]
            try:
                for job in jobs:
                    job.result()
            except KeyboardInterrupt:
                self.control[Control.CANCEL] = 1.0
                raise


@lru_cache(maxsize=64)
def _kernel(variation: Variation) -> Kernel:
    return load(emit_modes(variation))

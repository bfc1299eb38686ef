"""Integrate orbits together with deviations, one stretch of time after the other.

This module lays out the arrays that the kernels of `synchain.codegen.kernels.mode_kernel` read and fill.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from synchain.codegen.driver.columns import Control, SpanColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.mode_kernel import emit_modes
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.simd.lane_types import native_width
from synchain.models.dynamics.variational import Variation
from synchain.models.scenes.scene import Scene

from ..cells.drive_times import by_place, half_swing, periods
from ..cells.initial_modes import local_clock
from ..cells.stiffness_rates import mode_rates
from ..engines.choice import chosen_for_modes, warn_of_stiff_modes
from ..engines.step_control import control_array, first_step, tolerances
from ..support.status import Status
from ..support.threads import worker_count
from .averages import TOLERANCE_RATIO, TRIED, error_of_steps
from .interpolation import Registers, on_a_cache_line

NO_PANELS = (
    np.ones(1, dtype=np.int64),  # one block
    np.zeros((0, 1)),  # places of the deviations of each node
    np.zeros((0, 7)),  # panels
    np.zeros(0),  # weights
    np.zeros((0, 0)),  # deviations of all strengths
    np.zeros((0, 0, 0)),  # log_growth
    np.zeros(0),  # interpolation_errors
    np.zeros((0, 7)),  # panels of stick intervals
    np.zeros(0),  # weights of stick intervals
    np.zeros(0),  # places of their nodes
    np.zeros((0, 0, 0)),  # batch_starts
)
"""The last arguments of a kernel that integrates deviations over one block, without interpolation."""

NO_FRAME = (np.zeros(0, dtype=np.int64), np.zeros((0, 0)))
"""Arguments for deviations that stay as they are at the ends of blocks."""

NO_STICK_INTERVALS, NO_BATCH_STARTS = NO_PANELS[-4:-1], NO_PANELS[-1]
"""Arguments for propagators that are integrated over whole blocks, and for starts of batches that are not recorded."""

STEEP, LONG, HIGH, FEWEST_STEPS = 1.1, 3, 256.0, 16
"""An orbit grows without bound if its number of steps per time grows by the factor STEEP in each of LONG successive
stretches, and if both this number and the size of the state grow by HIGH in all. Stretches of fewer than FEWEST_STEPS
steps
do not count. The kernel makes the same test within a stretch."""


@dataclass(slots=True)
class Deviations:
    """Deviations of all strengths, which propagators multiply."""

    registers: Registers  # interpolation from the propagators of the nodes to those of all strengths
    columns: int  # components of a deviation, real or complex
    vectors: np.ndarray  # (cells, any): the deviations at unit length, in registers
    # for bodies that stick: interpolation from the propagators between landings to those of the nodes
    stick_intervals: Registers | None = None
    error: float = 0.0  # largest interpolation error so far, relative to the size of a propagator

    @classmethod
    def make(
        cls, registers: Registers, cells: int, columns: int, parts: int, stick_intervals: Registers | None = None
    ) -> Deviations:
        """Return deviations along (1, 1, …); `parts`: number of real numbers of a deviation."""
        lanes = registers.lanes
        start = np.zeros((cells, registers.room // lanes, parts, lanes))
        start[:, :, :columns] = 1.0 / math.sqrt(columns)
        return cls(registers, columns, on_a_cache_line(start.reshape(-1)).reshape(cells, -1), stick_intervals)

    @property
    def interval_arrays(self) -> tuple[np.ndarray, ...]:
        """Return the arguments of a kernel for stick intervals."""
        own = self.stick_intervals
        return NO_STICK_INTERVALS if own is None else (own.panels, own.weights, own.where.astype(float))


@dataclass(slots=True)
class GrowthWatch:
    """Find orbits that grow without bound over several stretches of time; a kernel does the same within one stretch."""

    steps: np.ndarray = field(default_factory=lambda: np.zeros(1))  # (cells,): number of steps so far
    # (cells,): successive stretches with rising steps per time
    rises: np.ndarray = field(default_factory=lambda: np.zeros(1))
    # (2, cells): steps per time and largest size of the state, before the first of these stretches and in the last one
    origins: np.ndarray = field(default_factory=lambda: np.zeros((2, 1)))
    last: np.ndarray = field(default_factory=lambda: np.array([[np.inf], [0.0]]))

    def status(self, codes: np.ndarray, steps: np.ndarray, times: np.ndarray, sizes: np.ndarray, most: float) -> Status:
        """Return FINISHED, or the status of the first orbit that fails; `codes` are the kernel's. Shapes: (cells,)."""
        bad = codes != Status.FINISHED
        if bad.any():
            return Status(int(codes[bad.argmax()]))
        now = np.array([steps / np.where(times > 0.0, times, np.inf), np.fmax(sizes, self.last[1])])
        rising = (now[0] > STEEP * self.last[0]) & (steps >= FEWEST_STEPS)
        self.rises = np.where(rising, self.rises + 1, 0)
        self.origins, self.last = np.where(self.rises <= 1, self.last, self.origins), now
        self.steps = self.steps + steps
        if np.any((self.rises >= LONG) & np.all(now > HIGH * self.origins, axis=0)):
            return Status.DIVERGED
        return Status.STEP_BUDGET if np.any(self.steps >= most) else Status.FINISHED


@dataclass(slots=True)
class VariationalIntegrator:
    """Orbits with several deviations along each orbit, which differ in their strengths."""

    variation: Variation  # orbit with its variational equation
    kernel: Kernel  # compiled kernel of `variation`
    state: np.ndarray  # (cells, dimension): states of the orbits
    parameter_values: np.ndarray  # (cells, parameters)
    period: np.ndarray  # (cells,): time after which the clock restarts; 0 if the clock never restarts
    control: np.ndarray  # tolerances, limits and cancel flag of the kernel
    # (number of strengths, padded modes): strengths sorted by size, padded to a multiple of the lanes
    strengths: np.ndarray
    order: np.ndarray  # (modes,): position of each mode of the caller in `strengths`
    vectors: np.ndarray  # (cells, size, padded modes): deviations
    workers: int  # number of threads
    steps: int = 0  # steps taken so far
    warned: bool = False  # True after a warning of short steps because of stiff modes
    # True if stretches of time are short: a stretch begins with the last step size, and short steps cause no warning
    observes: bool = False
    slow: float = 1.0  # rate of the motion, which limits the steps whether modes are stiff or not
    # finds orbits that grow without bound, or take more than `max_steps` steps in all
    watch: GrowthWatch = field(default_factory=GrowthWatch)

    @classmethod
    def make(
        cls,
        scene: Scene,
        variation: Variation,
        state: np.ndarray,
        parameter_values: np.ndarray,
        strengths: np.ndarray,
        workers: int | None = None,
        tolerance_ratio: float = 1.0,
        method: Integrator | None = None,
    ) -> VariationalIntegrator:
        """Prepare the kernel and the arrays, with the tolerances and the step budget of the scene.

        `tolerance_ratio`: tolerance of the deviations relative to that of the orbits.
        Shapes: state (cells, dimension), parameter_values (cells, parameters), strengths (number of strengths, modes).
        """
        method = chosen_for_modes(scene, variation, state, parameter_values, strengths) if method is None else method
        kernel = _kernel(variation, method, native_width())
        width, count = kernel.origin.width, strengths.shape[1]
        # sort strengths by size, so that strengths in one register are similar; repeat the last one to fill a register
        order = np.argsort(np.hypot.reduce(strengths, axis=0) if len(strengths) else np.zeros(count), kind="stable")
        padded = -(-count // width) * width
        columns = np.concatenate([order, np.full(padded - count, order[-1])])
        where = np.empty(count, dtype=np.int64)
        where[order] = np.arange(count)
        rtol, atol = (float(values.min()) for values in tolerances(scene, variation.orbit, parameter_values))
        repeat = periods(kernel.equations, parameter_values)
        longest = half_swing(kernel.equations, by_place(kernel.equations, parameter_values))
        control = np.append(control_array(rtol, atol, longest, scene.max_steps, jumps=False), tolerance_ratio)
        if method.implicit:
            growth = (
                at.growth
                for at in mode_rates(variation, state, parameter_values, strengths)
                if math.isfinite(at.growth)
            )
            control[Control.FIRST_STEP] = first_step(max(growth, default=0.0))
        vectors = np.full((len(state), variation.size, padded), 1.0 / math.sqrt(variation.size))
        sorted_strengths = np.ascontiguousarray(strengths[:, columns], dtype=float)
        return cls(
            variation=variation,
            kernel=kernel,
            state=np.ascontiguousarray(state, dtype=float).copy(),
            parameter_values=np.ascontiguousarray(parameter_values, dtype=float),
            period=local_clock(kernel.equations, repeat),
            control=control,
            strengths=sorted_strengths if len(strengths) else np.zeros((1, padded)),
            order=where,
            vectors=vectors,
            workers=worker_count(workers),
        )

    @property
    def deviations(self) -> np.ndarray:
        """The normalised deviations (cells, size, modes), in the caller's order."""
        return self.vectors[:, :, self.order]

    def set_deviations(self, vectors: np.ndarray) -> None:
        """Set the deviations. Shapes: vectors (cells, size, modes)."""
        self.vectors[:, :, self.order] = vectors
        spare = self.vectors.shape[2] - len(self.order)
        if spare:
            self.vectors[:, :, -spare:] = self.vectors[:, :, -spare - 1 : -spare]

    def set_directions(self, basis: np.ndarray) -> None:
        """Set the deviations (size, count) of one orbit, and those in spare lanes to zero."""
        self.vectors[:] = 0.0
        self.vectors[0, :, : basis.shape[1]] = basis

    def advance(self, length: float | np.ndarray) -> np.ndarray:
        """Integrate over lengths of time (cells,); return the log growth of each deviation (cells, modes)."""
        growth = np.empty((len(self.state), self.strengths.shape[1]))
        self._run(length, NO_PANELS, self.vectors, growth)
        return growth[:, self.order]

    def follow(
        self, length: float, batches: np.ndarray, deviations: Deviations, batch_starts: np.ndarray = NO_BATCH_STARTS
    ) -> np.ndarray:
        """Integrate over successive blocks of time, and multiply deviations by the propagators of the blocks.

        Every block begins with the integrator's own deviations, p for each node, which do not change.
        Shapes: batches (b,), batch_starts (cells, b, any); returns the logarithm of the growth (b, cells, strengths).
        """
        cells, registers = len(self.state), deviations.registers
        places = self.order.reshape(-1, deviations.columns).astype(float)
        log_growth, interpolation_errors = np.empty((cells, len(batches), registers.room)), np.zeros(cells)
        moved = (registers.panels, registers.weights, deviations.vectors, log_growth, interpolation_errors)
        panels = (batches, places, *moved, *deviations.interval_arrays, batch_starts)
        self._run(length, panels, self.vectors, np.empty((cells, self.strengths.shape[1])))
        deviations.error = float(np.maximum(deviations.error, interpolation_errors.max()))  # a NaN remains
        return registers.of_strengths(log_growth.transpose(1, 0, 2))

    def orthogonal(self, length: float, batches: np.ndarray, plan: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Integrate one orbit over successive blocks of time, and make its deviations orthogonal after each block.

        Shapes: batches (b,), plan (4,) and frame (4, count) as in `codegen.driver.frames`; returns the growth
        (b, count + 1) of the directions and of the volume over each batch.
        """
        growths = np.zeros((1, len(batches), frame.shape[1] + 1))
        panels = (batches, *NO_PANELS[1:5], growths, *NO_PANELS[6:])
        self._run(length, panels, self.vectors, np.empty((1, self.strengths.shape[1])), (plan, frame))
        return np.asarray(growths[0])

    def loosen(self, ratio: float) -> None:
        """Multiply the tolerances by a ratio."""
        self.control[[Control.RTOL, Control.ATOL]] *= ratio

    def beside(self, state: np.ndarray, ratio: float) -> VariationalIntegrator:
        """Return an integrator along other orbits, from `state` (cells, dimension), with looser tolerances."""
        times = len(state) // len(self.state)
        other = replace(
            self,
            state=state,
            parameter_values=np.concatenate([self.parameter_values] * times),
            period=np.concatenate([self.period] * times),
            vectors=np.concatenate([self.vectors] * times),
            control=self.control.copy(),
            watch=GrowthWatch(),
        )
        other.loosen(ratio)
        return other

    @contextmanager
    def loosened(self, ratio: float) -> Iterator[None]:
        """Multiply the tolerances inside the context; restore states, deviations and tolerances after it."""
        state, vectors, control = self.state, self.vectors.copy(), self.control.copy()
        self.loosen(ratio)
        yield
        self.state, self.vectors[:], self.control[:] = state, vectors, control

    def error_of_steps(self, length: float) -> np.ndarray:
        """Advance by TRIED blocks; return the error of growth rates (cells, modes) from `averages.error_of_steps`."""
        usual, looser = [], []
        for _ in range(TRIED):
            with self.loosened(TOLERANCE_RATIO):
                looser.append(self.advance(length))
            usual.append(self.advance(length))
        return error_of_steps(usual, looser, length)

    def _run(
        self,
        length: float | np.ndarray,
        panels: tuple[np.ndarray, ...],
        vectors: np.ndarray,
        growth: np.ndarray,
        framing: tuple[np.ndarray, np.ndarray] = NO_FRAME,
    ) -> None:
        """Run the kernel for all cells, and store the states at the end."""
        cells, dimension = self.state.shape
        cell_times = np.zeros((cells, 4))
        cell_times[:, SpanColumn.END], cell_times[:, SpanColumn.PERIOD] = length, self.period
        end, sums, counts = np.empty((cells, dimension)), np.empty((cells, 4)), np.zeros((cells, 6), dtype=np.int64)
        before = (self.state, self.parameter_values, cell_times, self.control, self.strengths)
        arguments = (*before, vectors, growth, end, sums, counts, *panels, *framing)
        if min(cells, self.workers) == 1:
            self.kernel.drive(0, cells, *arguments)
        else:
            self._share(np.linspace(0, cells, min(cells, self.workers) + 1).astype(int), arguments)
        # raise an error for an orbit that grows without bound or takes too many steps, in the kernel or over all
        # stretches
        times = panels[0].sum() * cell_times[:, SpanColumn.END]
        status = self.watch.status(
            counts[:, 0], counts[:, 1:3].sum(axis=1), times, np.abs(end).max(axis=1), self.control[Control.MAX_STEPS]
        )
        if status is not Status.FINISHED:
            largest = np.hypot.reduce(self.strengths).max()
            modes = f" of strengths up to {largest:g}" if largest else ""
            # rates of deviations have slopes of slopes: those of sqrt(|x|) have none at 0, where runs pass
            remedy = (
                "; deviations need finite slopes: write sqrt(abs(x)) as (x**2 + 1e-12)**(1/4), and abs(x)**p with p > 1"
            )
            raise FloatingPointError(
                f"the orbit with its deviations{modes} cannot be integrated: {status.message}"
                f"{remedy if status is Status.STEP_UNDERFLOW else ''}"
            )
        # begin the next stretch of a power series with the mean step of this one; warn if the mean step was short
        taken = int(counts[:, 1:3].sum())
        series = self.kernel.origin.method.series
        if taken and (series or self.observes):
            step = float(panels[0].sum()) * float(cell_times[:, SpanColumn.END].sum()) / taken
            # only a hint: step control corrects the step size within a few steps
            self.control[Control.FIRST_STEP] = step
            self.warned = self.warned or (
                series
                and not self.observes
                and warn_of_stiff_modes(self.variation, end, self.parameter_values, self.strengths, step, self.slow)
            )
        self.state = end
        self.steps += taken

    def _share(self, cuts: np.ndarray, arguments: tuple[np.ndarray, ...]) -> None:
        """Run parts of the cells on threads; Ctrl-C stops all threads at once."""
        with ThreadPoolExecutor(self.workers) as pool:
            jobs = [pool.submit(self.kernel.drive, a, b, *arguments) for a, b in itertools.pairwise(cuts)]
            try:
                for job in jobs:
                    job.result()
            except KeyboardInterrupt:
                self.control[Control.CANCEL] = 1.0
                raise


@lru_cache(maxsize=64)
def _kernel(variation: Variation, method: Integrator, width: int) -> Kernel:
    """Return the compiled kernel of a variational equation."""
    return load(emit_modes(variation, method, width))

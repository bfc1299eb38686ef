"""Integrate the orbit of a network of any size with orthogonal deviations, by the kernel of the lifted network.

A lane of the kernel holds the orbit and one deviation (`synchain.models.dynamics.lift`). Lanes take steps of their own, so
that their orbits separate by errors of the integration; after each block of time all take the orbit of the first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from synchain.codegen.driver.columns import Control, Count, SpanColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.driver import KernelKind
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import LARGEST_UNROLLED_LIFT, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.simd.lane_types import native_width
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.lift import Lift, lifted
from synchain.models.dynamics.variational import PHASE
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.drive_times import longest_steps, periods
from ..cells.paces import Templates
from ..cells.plan import FIRST_STEP, CellRows
from ..engines.choice import chosen_for_rows, first_steps
from ..engines.step_control import control_array, tolerances
from ..support.status import Status
from .variational_integrator import GrowthWatch

NO_SHIFT = np.array([1, 0, -1, 0])
"""Plan of blocks whose clock is not shifted."""

ENDLESS = 1e9
"""Length of a run for which the integrator is chosen; any that is long compared with the motion."""


@dataclass(slots=True)
class LiftedIntegrator:
    """An orbit with orthogonal directions; a cell of the kernel holds the orbit and one direction."""

    lift: Lift
    kernel: Kernel
    start: np.ndarray  # (count, dimension): the orbit, and the directions of the last block
    values: np.ndarray  # (count, parameters)
    spans: np.ndarray  # (count, len(SpanColumn))
    control: np.ndarray  # tolerances, limits and cancel flag of the kernel
    units: np.ndarray  # (size,): unit of each component of a direction
    basis: np.ndarray  # (size, count): orthonormal directions
    steps: int = 0  # steps of the orbit so far
    observes: bool = False  # as in `VariationalIntegrator`; without effect
    # finds orbits that grow without bound, or take more than `max_steps` steps in all
    watch: GrowthWatch = field(default_factory=GrowthWatch)

    @classmethod
    def make(cls, scene: Scene, equations: Equations, state: np.ndarray, basis: np.ndarray) -> LiftedIntegrator:
        """Compile the kernel, with the tolerances and the step budget of the scene.

        Shapes: state (size,), basis (size, count).
        """
        lift, count = lifted(equations), basis.shape[1]
        known = {**scene.parameters, PHASE.name: 0.0}
        values = np.tile([float(known[name]) for name in lift.equations.parameters], (count, 1))
        start = np.zeros((count, lift.equations.dimension))
        start[:, lift.states], start[:, lift.deviations] = state, basis.T
        spans = np.zeros((count, len(SpanColumn)))
        spans[:, SpanColumn.FIRST_STEP], spans[:, SpanColumn.LOOK] = FIRST_STEP, math.inf
        spans[:, SpanColumn.PERIOD] = periods(lift.equations, values)
        spans[:, SpanColumn.END] = ENDLESS  # the integrator is chosen for a long run
        spans[:, SpanColumn.LONGEST] = longest_steps(lift.equations, values, np.full(count, 1e3))
        row = CellRows(start[:1].copy(), values[:1].copy(), spans[:1].copy())
        method = chosen_for_rows(scene, lift.equations, row)
        if method.implicit:
            spans[:, SpanColumn.FIRST_STEP] = first_steps(Templates(lift.equations), row)
        width = min(native_width(), 1 << (count - 1).bit_length())
        rtol, atol = (float(column.min()) for column in tolerances(scene, lift.equations, values))
        return cls(
            lift,
            _kernel(lift.equations, method, width),
            start,
            values,
            spans,
            control_array(rtol, atol, math.inf, scene.max_steps, jumps=False),
            np.ones(len(state)),
            np.ascontiguousarray(basis),
        )

    @property
    def state(self) -> np.ndarray:
        """State (1, size) of the orbit."""
        return self.start[:1, self.lift.states]

    @state.setter
    def state(self, state: np.ndarray) -> None:
        self.start[:, self.lift.states] = state

    def alone(self) -> LiftedIntegrator:
        """Return an integrator of the same orbit with one direction."""
        arrays = {name: getattr(self, name)[:1].copy() for name in ("start", "values", "spans")}
        return replace(self, **arrays, basis=self.basis[:, :1].copy(), control=self.control.copy(), watch=GrowthWatch())

    def advance(self, length: float) -> None:
        """Integrate over a length of time."""
        self.orthogonal(length, np.ones(1, dtype=np.int64), NO_SHIFT.copy(), np.zeros((4, self.basis.shape[1])))

    def orthogonal(self, length: float, batches: np.ndarray, plan: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Integrate blocks of time as `VariationalIntegrator.orthogonal`; the growth of the volume is zero."""
        count, dimension = self.start.shape
        growths, taken = np.zeros((len(batches), count + 1)), np.zeros(1, dtype=np.int64)
        buffers = Buffers.empty(count, dimension, room=0, samples=0)
        self.spans[:, SpanColumn.END] = length
        places = np.array([self.lift.states, self.lift.deviations])
        framing = (batches, plan, frame, places, self.units, self.basis, growths, taken)
        inputs = (self.start, self.values, self.spans, self.control)
        self.kernel.drive(0, count, *inputs, *buffers.arrays(), *framing)
        failed = buffers.status != Status.FINISHED
        code = np.array([buffers.counts[failed.argmax(), Count.STATUS]])
        steps, times = np.array([taken[0] / count]), np.array([batches.sum() * length])
        largest = np.array([np.abs(self.state).max()])
        status = self.watch.status(code, steps, times, largest, self.control[Control.MAX_STEPS])
        if status is not Status.FINISHED:
            raise FloatingPointError(f"the orbit with its deviations cannot be integrated: {status.message}")
        self.steps += int(steps[0])
        return growths

    def set_directions(self, basis: np.ndarray) -> None:
        """Set the directions (size, count)."""
        self.basis[:] = basis

    @contextmanager
    def loosened(self, ratio: float) -> Iterator[None]:
        """Multiply the tolerances inside the context; restore state, directions and tolerances after it."""
        arrays = (self.start, self.basis, self.control, self.spans)
        copies = [array.copy() for array in arrays]
        self.control[[Control.RTOL, Control.ATOL]] *= ratio
        yield
        for array, copy in zip(arrays, copies, strict=True):
            array[:] = copy


@lru_cache(maxsize=16)
def _kernel(equations: Equations, method: Integrator, width: int) -> Kernel:
    """Return the compiled kernel of a lifted network."""
    source = emit(equations, method, Recording(()), width, unroll=LARGEST_UNROLLED_LIFT)
    return load(replace(source, driver=replace(source.driver, kind=KernelKind.FRAME)))

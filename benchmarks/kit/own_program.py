"""How long this program's own kernels take and how far off they are; the peers' counterpart is
`_clock.curve`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code.compile import Kernel
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.drive_times import longest_steps
from synchain.runtime.cells.initial_modes import with_modes
from synchain.runtime.cells.plan import FIRST_STEP
from synchain.runtime.cells.reduce import as_reduction
from synchain.runtime.engines.scene_kernels import chosen_integrator, kernel
from synchain.runtime.engines.step_control import control_array

from .cases import Case
from .clock import Point, best_time, timed_periods

Ends = tuple[np.ndarray, np.ndarray]
"""States at the ends (m, dimension) and counts (m, …) of the kernel."""
Integrate = Callable[[float, float, np.ndarray], Ends]

REFILLS = 8
"""Cells that each lane works through in the rows with full lanes: the last ones cost what they do
in a sweep.
"""


def full_width(case: Case, integrator: str, rtol: float, atol: float) -> int:
    """Return the lanes in which a sweep of the case runs on this processor."""
    reduction = as_reduction(case.scene.replace(integrator=integrator, rtol=rtol, atol=atol), False)
    return emit(reduction.equations, chosen_integrator(reduction)).driver.width


def prepare(case: Case, integrator: str, width: int | None, readings: int = 0) -> Integrate:
    """Compile or load the kernel of a case; returns solve(rtol, atol, ends) -> (states, counts).

    A width of None is that of a sweep.

    `solve` integrates one cell to each of the end times and raises RuntimeError where a cell did
    not reach its end; its states are those at the ends (m, dimension), or at evenly spaced times
    from the start to the ends (m, readings, dimension) if there are readings.
    """
    record = ("trajectory",) if readings else ()
    chosen = case.scene.replace(integrator=integrator, record=record, samples=readings)
    made: dict[tuple[float, float], Kernel] = {}
    one = np.array([case.scene.parameters[name] for name in case.scene.equations.parameters])
    longest = float(longest_steps(case.scene.equations, one[None], np.full(1, case.periods * case.period))[0])
    (y0,) = with_modes(case.scene.equations, np.array([case.scene.y0]), one[None])

    def solve(rtol: float, atol: float, ends: np.ndarray) -> Ends:
        cells = len(ends)
        spans = np.ascontiguousarray(
            np.stack(
                [
                    np.zeros(cells),
                    ends,
                    *(np.full(cells, e) for e in (case.period, 0.0, FIRST_STEP, longest, np.inf, 1.0)),
                ],
                axis=1,
            )
        )
        if (rtol, atol) not in made:  # the order of a Taylor step follows the tolerance
            lanes = full_width(case, integrator, rtol, atol) if width is None else width
            made[rtol, atol] = kernel(chosen.replace(rtol=rtol, atol=atol), lanes, reduce=False)
        compiled = made[rtol, atol]
        control = control_array(rtol, atol, np.inf, 1e12, jumps=False)
        buffers = Buffers.empty(cells, len(y0), room=0, samples=readings)
        compiled.drive(0, cells, np.tile(y0, (cells, 1)), np.tile(one, (cells, 1)), spans, control, *buffers.arrays())
        if not np.isfinite(buffers.end).all():
            raise RuntimeError(f"{integrator}: a cell did not finish at rtol = {rtol:g}")
        return buffers.samples if readings else buffers.end, buffers.counts

    return solve


@dataclass(frozen=True, slots=True)
class Own:
    """An integrator with its kernel for a case: `cells` in `lanes` run over `periods` of the drive
    when they are timed; lanes of None are those of a sweep.
    """

    case: Case
    integrator: str
    lanes: int | None
    cells: int
    periods: int
    compile: float
    solve: Integrate

    @classmethod
    def compiled(cls, case: Case, integrator: str, lanes: int | None, cells: int, periods: int) -> Own:
        """Compile or load the kernel and note the seconds that takes."""
        begin = time.perf_counter()
        solve = prepare(case, integrator, lanes)
        return cls(case, integrator, lanes, cells, periods, time.perf_counter() - begin, solve)

    def point(self, rtol: float, atol: float, quick: bool) -> Point:
        """Error, seconds and steps per period at one tolerance."""
        case, periods = self.case, self.periods
        part = case.within(periods)
        states, _ = self.solve(rtol, atol, part.times)
        begin = time.process_time()
        self.solve(rtol, atol, np.full(self.cells, periods * case.period))
        length = timed_periods((time.process_time() - begin) / periods, periods, quick=False)
        ends = np.full(self.cells, length * case.period)
        _, counts = self.solve(rtol, atol, ends)
        seconds = best_time(lambda: self.solve(rtol, atol, ends), quick) / (length * self.cells)
        error, steps = float(np.abs(states - part.states).max()), float(counts[0, 1] + counts[0, 2]) / length
        remark = "" if periods == case.periods else f"{periods} of {case.periods} periods"
        lanes = full_width(case, self.integrator, rtol, atol) if self.lanes is None else self.lanes
        return Point(self.integrator, lanes, rtol, atol, error, seconds, periods, self.compile, steps, remark)

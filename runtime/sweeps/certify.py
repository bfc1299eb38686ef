"""Certify cells: determine the stability of each cell's synchronous state by exponents along its final motion.

Two oscillators can become equal bit for bit by rounding, and then stay together although the synchronous state is
unstable (Pikovsky, Phys. Rev. Lett. 73, 2931 (1994)). A cell that starts outside the basin, or has too short a
transient, is not synchronous although the state is stable. Exponents distinguish these cases. A cell that is
certain to stay synchronous ends early.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from synchain.models.dynamics.variational import mode
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.checked_axes import rest_in_sweep

from ..cells.buffers import Buffers
from ..cells.layout import Layout
from ..cells.plan import Planner
from ..cells.reduce import ReducedScene
from ..cells.run_keywords import Given, with_numbers
from ..engines.job import Start
from ..results.certificate import ERRORS, Certificate
from ..results.labels import States
from ..stability.attractor import Motion
from ..stability.averages import PRECISION, Averaging, errors_for
from ..stability.exponents import along, coupled_cell
from ..stability.motion import Spread
from ..stability.orbits import OrbitProblem, unit_of_time, within
from ..stability.transversal_modes import shared_orbits, transversal_modes
from ..support.execution import Execution
from .errors import sweep_errors
from .memory import Memory
from .pool import Task
from .prepare import PreparedRun
from .scheduler import BlockScheduler, Sink

# Largest number of cells of a certified sweep: a choice; exponents and verdicts of all cells are in memory.
MOST = 10**7
# Transient before the average along an orbit, in units of time, and relative tolerance: choices for speed.
TRANSIENT, RTOL = 300, 1e-6
# LOOKED: number of samples by which motions are distinguished. STARTS: number of cells of one motion along which
# exponents are averaged. Choices.
LOOKED, STARTS = 64, 4
# Two motions count as one if their means differ by less than CLOSE times the extent of all motions of a group: a choice.
CLOSE = 1e-3


@dataclass
class _Ends(Sink):
    """Store the final states of the cells of a sweep: of the reduced network (`left`) and of the unreduced one."""

    layout: Layout
    reduction: ReducedScene
    left: np.ndarray
    whole: np.ndarray
    finished: np.ndarray

    def ends(self, block: int) -> Start:
        """Return the final states of a block, and whether each of its cells finished."""
        rows = self.layout.rows(block)
        return self.left[rows], self.finished[rows]

    def put(self, task: Task, buffers: Buffers) -> None:
        """Store the final states of a block."""
        self.left[task.cells], self.finished[task.cells] = buffers.end, buffers.finished
        self.whole[task.cells] = self.reduction.expand(buffers).end


def certified(prepared: PreparedRun) -> PreparedRun:
    """Return a run with the exponents of every cell; run all cells once first, to find their final motions."""
    scene, layout = prepared.scene, prepared.layout()
    check_certifiable(scene)
    shape = (scene.cells, prepared.reduction.dimension), (scene.cells, len(scene.y0))
    finished = np.zeros(scene.cells, dtype=bool)
    ends = _Ends(layout, prepared.reduction, np.empty(shape[0]), np.empty(shape[1]), finished)
    quiet = replace(prepared.execution, show_progress=False, progress=None)
    reporter = quiet.reporter(scene.cells)
    workers = quiet.workers if quiet.executor is None else None
    with sweep_errors(scene.cells, lambda: (0, Memory.of(prepared, None).result())):
        BlockScheduler(np.zeros(layout.blocks, dtype=bool), ends, prepared, reporter).run()
        states = np.where(finished[:, None], ends.whole, Planner(scene).rows(np.arange(scene.cells)).start)
        return replace(prepared, certificate=certify(scene, states, workers=workers))


def certify(
    scene: Scene,
    states: np.ndarray | None = None,
    *,
    precision: float | None = None,
    periods: float = 2000,
    workers: int | None = None,
) -> Certificate:
    """Return the exponents along the synchronous motion of every cell; a motion starts from `states` (cells, states).

    Exponents are computed once for cells that share a motion. Such cells differ only in their starts, and in the
    strength of links that vanish between equal states.
    """
    check_certifiable(scene)
    error, execution = 2.0 * PRECISION if precision is None else precision, Execution(workers, None, False)
    averaging = Averaging(error, periods, TRANSIENT, 0, execution, of_motion=precision is None)
    planner, cells = Planner(scene), np.arange(scene.cells)
    starts = planner.rows(cells).start
    layout = States.of(scene)
    begun = layout.table(starts if states is None else states)[:, :, 0]  # (cells, p): the first node
    table = {name: np.empty(scene.cells) for name in ("exponent", "stderr", "diffusion", "margin", "size")}
    for group in shared_orbits(scene, planner.columns(cells)):
        # Integrate one orbit for each cell of a group, at the parameters common to the group.
        single = with_numbers(scene, group.parameters, axes=(), zipped=False, continuation="none", stop=None)
        cell = coupled_cell(Given(certify), single, RTOL)
        problem = OrbitProblem.of_modes(cell, group.strengths, begun[group.cells[:1]], averaging.execution.size)
        first = problem.with_slip_states(begun[group.cells])
        spread = layout.table(starts[group.cells]).transpose(0, 2, 1).reshape(-1, begun.shape[1])
        for members, extent, whole in _motions(problem, first, spread):
            chosen = members[np.linspace(0, len(members) - 1, min(STARTS, len(members))).astype(int)].tolist()
            with averaging.reporter() as reporter:
                average = along(
                    problem, first[chosen], group.strengths, averaging.in_units(cell, problem.unit), reporter
                )
            # Of several similar attractors take the least stable, and of its modes the largest exponent.
            means = [average.by_start[list(rows)].mean(axis=0) for rows in average.groups]
            strength_of = group.place[members]
            values = np.nanmax(means, axis=0)[strength_of]
            rows, mode_of = np.arange(len(members)), values.argmax(axis=1)
            at = group.cells[members]
            stderr = average.stderr[strength_of][rows, mode_of]
            table["exponent"][at], table["stderr"][at] = values[rows, mode_of], stderr
            table["diffusion"][at] = stderr**2 * average.time * average.averaged
            table["margin"][at] = errors_for(ERRORS, average.time / problem.unit) * stderr
            rests = average.attractors[0].motion in (Motion.FIXED_POINT, Motion.LINEAR)
            table["size"][at] = np.linalg.norm(whole if rests else extent)
    return Certificate(**table)


def _motions(
    problem: OrbitProblem, states: np.ndarray, starts: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield groups of orbits on one motion: rows, extent (p,) of the motion, extent (p,) of all motions and `starts`.

    Motions with equal means and extents over some units of time count as one. Shapes: starts (any, p).
    """
    integrator = problem.integrator(states, problem.strengths[:1])
    step = problem.unit if problem.forced else problem.unit / 8
    path = [integrator.state]
    for _ in range(LOOKED):
        integrator.advance(step)
        path.append(integrator.state)
    spread = Spread.of(np.array(path))
    whole = np.ptp(np.concatenate([*path, starts]), axis=0)
    # Group the remaining rows with the first of them.
    remaining = np.arange(len(states))
    while len(remaining):
        first = remaining[0]
        one, others = (Spread(*(values[rows] for values in spread)) for rows in (first, remaining))
        alike = others.like(one, CLOSE * whole) | problem.linear
        rows = remaining[alike]
        # The samples of a forced motion are at one phase of the drive: add samples within a period.
        samples = within(problem, states[rows]) if problem.forced else np.array(path)[:, rows]
        yield rows, np.ptp(samples.reshape(-1, len(whole)), axis=0), whole
        remaining = remaining[~alike]


def check_certifiable(scene: Scene) -> None:
    """Raise ValueError if the synchronous state of a scene has no transversal exponents."""
    if not scene.equations.link_count:
        raise ValueError("a certificate needs coupled oscillators; found a scene without links")
    if scene.cells > MOST:
        raise ValueError(f"a certificate needs memory for every cell; found {scene.cells}, expected at most {MOST}")
    if scene.realisations:
        raise ValueError(f"a certificate is for a sweep; found {scene.realisations} realisations, expected axes alone")
    mode(scene.equations)
    transversal_modes(scene)
    unit_of_time(scene)
    frequency = scene.drive.frequency
    rest = None if frequency is None else rest_in_sweep(frequency, scene.parameters, scene.axes, scene.zipped)
    if rest is not None:
        raise ValueError(f"a certificate needs a drive with a period; found {rest[0]} = {rest[1]:g} in the sweep")

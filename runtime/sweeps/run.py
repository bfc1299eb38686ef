"""Runs a scene: one kernel, blocks of cells on workers, and a result that knows how it came about."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from synchain.models.inputs.checks import instance, number
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.buffers import COUNTS, SUMS, Buffers
from ..cells.kernels import kernel, kernel_source
from ..cells.keywords import check_keywords
from ..cells.layout import Layout
from ..cells.plan import plan
from ..cells.reduce import Reduction
from ..results.result import IN_MEMORY, Result, gather
from ..support.status import CODES, Status, tally
from ..support.threads import worker_count
from .job import Start
from .pool import Task, worker_lost
from .progress import Hook, Reporter
from .scheduler import BlockScheduler, PreparedRun, SweepFailed, SweepInterrupted, prepare

__all__ = ["Buffers", "SweepFailed", "SweepInterrupted", "kernel", "kernel_source", "run", "with_axes", "worker_count"]


def run(
    scene: Scene,
    *,
    workers: int | None = None,
    resume: Result | None = None,
    show_progress: bool | None = None,
    width: int | None = None,
    reduce: bool | Reduction = True,
    certified: bool = False,
    executor: Executor | None = None,
    progress: Hook | None = None,
    **axes: Any,
) -> Result:
    """Run every cell of a scene and return the labelled result.

    `axes` set parameters or initial states: a number fixes one, a sequence makes it an axis of the sweep (after those of
    the scene, replacing one of the same name).  `workers` is the number of threads (default: all cores), `width` the
    number of lanes (default: what the CPU has), `executor` any `concurrent.futures.Executor` to run on in place of
    threads (docs/scale.md); none of them changes a result.  `resume` is an earlier, unfinished result of the same scene,
    whose finished cells are kept.  `show_progress` None shows a bar on terminals, elsewhere a line a minute; `progress` is
    called with a Progress after each block.  `reduce` leaves out what the scene does not need, exactly (docs/skips.md);
    False integrates it as it stands, a Reduction of this scene is taken as is.  `certified` adds the transversal exponent of
    every cell and a verdict on its synchronisation to the result, and lets cells end that are certain to stay
    synchronous (see `synchain.runtime.sweeps.certify`).

    Raises ValueError for an unknown axis, a result or a Reduction of another scene, SweepInterrupted on Ctrl-C, and SweepFailed
    where the workers are lost.
    """
    scene = with_axes(scene, axes)
    if resume is not None:
        instance("resume", resume, Result, "an earlier Result, e.g. from open_result")
    reporter = Reporter(scene.cells, show_progress, progress)
    prepared = prepare(scene, reduce, width, workers, executor, certified)
    memory = _memory(prepared, resume)
    _work(memory, prepared, executor, reporter)
    return memory.result(prepared)


def _work(memory: Memory, prepared: PreparedRun, executor: Executor | None, reporter: Reporter) -> None:
    """Run what is missing; whoever stops it gets the cells that have finished."""
    sitting = BlockScheduler(memory.layout, memory.done(), memory, reporter, prepared.certificate)
    try:
        reporter.start(tally(memory.buffers.counts[:, 0]) * (np.arange(CODES) == Status.FINISHED))
        sitting.run(prepared.shop, executor, prepared.workers)
    except (Exception, KeyboardInterrupt) as problem:
        if not (isinstance(problem, KeyboardInterrupt) or worker_lost(problem)):
            raise
        found = memory.result(prepared)
        finished, cells = int((found.status == Status.FINISHED).sum()), found.scene.cells
        if isinstance(problem, KeyboardInterrupt):
            raise SweepInterrupted(finished, cells, found) from None
        raise SweepFailed(f"the workers are lost ({problem})", finished, cells, found) from problem
    finally:
        reporter.close()


@dataclass(slots=True)
class Memory:
    """Keeps the blocks of a sweep in arrays of all its cells."""

    layout: Layout
    buffers: Buffers

    def done(self) -> np.ndarray:
        """True for each block (blocks,) that has finished, with those that it needed; in a continued sweep clears others."""
        finished = self.buffers.counts[:, 0] == Status.FINISHED
        done = np.zeros(self.layout.blocks, dtype=bool)
        for block in range(self.layout.blocks):
            rows, needed = self.layout.rows(block), self.layout.before(block)
            done[block] = finished[rows].all() and (needed is None or done[needed])
            if self.layout.columns and not done[block]:  # its cells started from others
                self.buffers.counts[rows] = 0
                for array in self.buffers.arrays():
                    if array is not self.buffers.counts:
                        array[rows] = np.nan
        return done

    def missing(self, block: int) -> np.ndarray:
        """Numbers of the cells of a block that have not finished."""
        rows = self.layout.rows(block)
        return rows[self.buffers.counts[rows, 0] != Status.FINISHED]

    def ends(self, block: int) -> Start:
        """The final states of a block, and which of its cells finished."""
        rows = self.layout.rows(block)
        return self.buffers.end[rows], self.buffers.counts[rows, 0] == Status.FINISHED

    def put(self, task: Task, made: Buffers) -> None:
        """Copy a block into the whole arrays, which are widened where it has more section points than they have room for."""
        whole, most = self.buffers, made.points.shape[1]
        if most > whole.points.shape[1]:
            wide = np.full((len(whole.end), most, made.points.shape[2]), np.nan)
            wide[:, : whole.points.shape[1]] = whole.points
            whole.points = wide
        for target, source in ((whole.end, made.end), (whole.sums, made.sums), (whole.counts, made.counts),
                               (whole.samples, made.samples)):  # fmt: skip
            target[task.cells] = source
        whole.points[task.cells, :most] = made.points

    def result(self, prepared: PreparedRun) -> Result:
        """The cells so far as a result."""
        chosen = prepared.shop.recipe.chosen
        spans = plan(chosen.scene).spans
        return gather(chosen.scene, prepared.attributes, spans, chosen.expand(self.buffers), prepared.certificate)


def _memory(prepared: PreparedRun, earlier: Result | None) -> Memory:
    """Arrays for all cells, with those of an earlier result that finished."""
    chosen = prepared.shop.recipe.chosen
    scene = chosen.scene
    _fits(scene, len(chosen.places) + prepared.shop.samples * len(chosen.places))
    layout = Layout.of(scene, prepared.size())
    if earlier is None:
        return Memory(layout, prepared.shop.blank(scene.cells, 0))
    finished = Buffers.empty(scene.cells, len(chosen.places), 0, prepared.shop.samples)
    earlier.restore(scene, finished, chosen.equations)
    return Memory(layout, chosen.contract(finished))


def _fits(scene: Scene, numbers: int) -> None:
    """Raise ValueError where the cells do not fit into memory; `numbers` are the states that are kept of each."""
    row = numbers + SUMS + COUNTS
    if scene.cells * row > IN_MEMORY:
        size = scene.cells * row * 8 / 1e9
        raise ValueError(
            f"sweep: found {scene.cells} cells, {size:.0f} GB in memory; expected at most {IN_MEMORY * 8 / 1e9:.0f} GB; "
            "write it to a file with stream, whose memory does not grow with the sweep, or take fewer cells"
        )


def with_axes(scene: Scene, axes: dict[str, Any], function: Callable[..., Any] = run) -> Scene:
    """The scene with parameters fixed by numbers and axes set by sequences, as the `function` takes them."""
    fixed: dict[str, Any] = {}
    swept: dict[str, Any] = {axis.name: axis.values for axis in a_scene(scene).axes}
    start = {name: list(values) for name, values in scene.initial.items()}
    for name, value in axes.items():
        if isinstance(value, Iterable) and not isinstance(value, str | bytes) and getattr(value, "ndim", 1) > 0:
            swept[name] = value
        elif name in scene.equations.state:
            component, place = name.rsplit("_", 1)
            start[component][scene.equations.holders(component).index(int(place) - 1)] = number(name, value)
            swept.pop(name, None)
        else:
            fixed[name] = value
            swept.pop(name, None)
    check_keywords(function, scene, fixed, scene.equations.state)
    if axes:
        scene = scene.replace(axes=swept, initial=start, **fixed)
    return scene

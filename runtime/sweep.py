"""Runs a scene: one kernel, chunks of cells on threads, and a result that knows how it came about."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import sympy as sp
from tqdm import tqdm

from synchain.codegen.emit import AUTO, KernelSource, emit
from synchain.codegen.load import Kernel, load
from synchain.models.scene import Scene

from .certificate import Certificate, certify
from .plan import CANCEL, Plan, control_array, plan, tolerances
from .result import Buffers, Result, gather
from .skip import Skip, decide
from .status import Status
from .threads import worker_count

__all__ = ["Buffers", "SweepInterrupted", "kernel", "kernel_source", "run"]

DIRECTIONS = {"falling": -1.0, "rising": 1.0, "both": 0.0}


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; `result` holds the cells that had finished."""

    def __init__(self, result: Result) -> None:
        super().__init__(f"interrupted with {int((result.status == Status.FINISHED).sum())} cells finished")
        self.result = result


def kernel(scene: Scene, width: int | None = None, skip: bool | Skip = False) -> Kernel:
    """Return the compiled kernel of a scene; scenes that differ only in numbers share it.

    With `skip` it is the one that `run` uses, which leaves out what the scene does not need (see
    `synchain.runtime.skip`).
    """
    return load(kernel_source(scene, width, skip))


def kernel_source(scene: Scene, width: int | None = None, skip: bool | Skip = False) -> KernelSource:
    """Return the text of a scene's kernel without compiling it."""
    chosen = _chosen(scene, skip)
    section = None
    if "section" in scene.record:
        section = sp.Symbol(chosen.section_variable(), real=True) - sp.Rational(repr(scene.section.level))
    sticking = scene.equations.node.contact is not None
    best = "dop853" if sticking else best_integrator(scene.n, scene.rtol)
    method = best if scene.integrator == "auto" else scene.integrator
    return emit(chosen.equations, method, chosen.records, section, width, chosen.multiplicity)


def best_integrator(n: int, rtol: float) -> str:
    """What "auto" stands for: the fastest at equal error (docs/performance.md).

    Two oscillators at a tight tolerance gain from DOP853 while none of them sticks; of more, some nearly always stick.
    """
    return "switching" if n == 2 and rtol <= 1e-9 else AUTO


def _chosen(scene: Scene, skip: bool | Skip) -> Skip:
    chosen = skip if isinstance(skip, Skip) else decide(scene, skip)
    if chosen.scene != scene:
        raise ValueError("skip: found the reductions of another scene; make them with decide(scene)")
    return chosen


def run(
    scene: Scene,
    *,
    workers: int | None = None,
    resume: Result | None = None,
    show_progress: bool | None = None,
    width: int | None = None,
    skip: bool | Skip = True,
    certified: bool = False,
    **axes: Any,
) -> Result:
    """Run every cell of a scene and return the labelled result.

    `axes` set parameters or initial states: a number fixes one, a sequence makes it an axis of the sweep (after those of
    the scene, replacing one of the same name).  `workers` is the number of threads (default: all cores), `width` the
    number of lanes (default: what the CPU has); neither changes a result.  `resume` is an earlier, unfinished result of
    the same scene, whose finished cells are kept.  `show_progress` None shows a bar on terminals only.  `skip` leaves out
    what the scene does not need, exactly (docs/skips.md); False integrates it as it stands, a Skip of this scene is taken
    as is. `certified` adds the transversal exponent of every cell and a verdict on its synchronisation to the result, and
    lets cells end that are certain to stay synchronous (see `synchain.runtime.certificate`).

    Raises ValueError for an unknown axis, a result or a Skip of another scene, SweepInterrupted on Ctrl-C.
    """
    scene = with_axes(scene, axes)
    chosen = _chosen(scene, skip)
    width = 1 if width is None and scene.cells == 1 else width
    workers = worker_count(workers)
    bar = tqdm(total=scene.cells, unit="cell", disable=None if show_progress is None else not show_progress)
    with bar:
        bar.set_description_str("compiling")
        certificate = certify(scene, workers=workers) if certified else None
        job = _job(chosen, kernel(scene, width, chosen), workers, resume, certificate)
        bar.set_description_str("")
        bar.unpause()
        job.advance = bar.update
        try:
            _run_cells(scene, job)
        except KeyboardInterrupt:
            raise SweepInterrupted(_report(chosen, job, certificate)) from None
    return _report(chosen, job, certificate)


def _run_cells(scene: Scene, job: Job) -> None:
    """Run what has not finished, side by side or one cell after the other."""
    if scene.continuation == "none":
        _run_all(job)
    else:
        _run_along(scene, job)
    _complete_points(job)


@dataclass(slots=True)
class Job:
    """A kernel, the cells it works on, what it fills, and how many threads share the work."""

    kernel: Kernel
    cells: Plan
    control: np.ndarray
    buffers: Buffers
    workers: int
    advance: Callable[[int], Any]

    def drive(self, first: int, last: int) -> int:
        """Run some of the cells in this thread; returns how many."""
        rows = self.cells
        self.kernel.drive(first, last, rows.start, rows.numbers, rows.spans, self.control, *self.buffers.arrays())
        return last - first

    def part(self, rows: np.ndarray) -> Job:
        """The same job for some rows, in copies of its arrays."""
        cells = Plan(self.cells.start[rows], self.cells.numbers[rows], self.cells.spans[rows])
        buffers = Buffers(*(array[rows] for array in self.buffers.arrays()))
        return Job(self.kernel, cells, self.control, buffers, self.workers, self.advance)

    def take(self, rows: np.ndarray, part: Job) -> None:
        """Write the outcome of a part back."""
        for whole, piece in zip(self.buffers.arrays(), part.buffers.arrays(), strict=True):
            whole[rows] = piece


def _job(chosen: Skip, compiled: Kernel, workers: int, earlier: Result | None, certificate: Certificate | None) -> Job:
    scene, whole = chosen.scene, plan(chosen.scene, None if certificate is None else certificate.near)
    limits, direction = tolerances(scene, whole.numbers), DIRECTIONS[scene.section.direction]
    control = control_array(*limits, _max_step(scene), scene.max_steps, direction, chosen.jumps)
    samples = scene.samples if "trajectory" in scene.record else 0
    buffers = Buffers.empty(scene.cells, len(chosen.states), _room(scene), samples)
    if earlier is not None:
        finished = Buffers.empty(scene.cells, len(chosen.places), _room(scene), samples)
        earlier.restore(scene, finished, chosen.equations)
        buffers = chosen.contract(finished)
    return Job(compiled, chosen.cells(whole), control, buffers, workers, lambda done: None)


def _report(chosen: Skip, job: Job, certificate: Certificate | None) -> Result:
    limits = (float(job.control[0]), float(job.control[1]))
    buffers = chosen.expand(job.buffers)
    return gather(chosen.scene, job.kernel, job.cells, buffers, limits, chosen.skipped, certificate)


def with_axes(scene: Scene, axes: dict[str, Any]) -> Scene:
    """The scene with parameters fixed by numbers and axes set by sequences."""
    fixed: dict[str, Any] = {}
    swept = {axis.name: axis.values for axis in scene.axes}
    start = {name: list(values) for name, values in scene.initial.items()}
    for name, value in axes.items():
        if np.ndim(value) > 0:
            swept[name] = tuple(float(v) for v in value)
        elif name in scene.equations.state:
            component, number = name.rsplit("_", 1)
            start[component][int(number) - 1] = float(value)
            swept.pop(name, None)
        else:
            fixed[name] = value
            swept.pop(name, None)
    settings = {setting.name for setting in fields(Scene)}
    unknown = [name for name in fixed if name not in scene.parameters and name not in settings]
    if unknown:
        known = ", ".join((*scene.parameters, *scene.equations.state))
        raise ValueError(f"unknown parameter or initial state {unknown[0]!r}; known: {known}")
    if axes:
        scene = scene.replace(axes=swept, initial=start, **fixed)
    return scene


def _max_step(scene: Scene) -> float:
    """Half a drive period at most, so that no step can miss a whole swing of the drive."""
    if not scene.forced:
        return math.inf
    fastest = max((abs(v) for axis in scene.axes if axis.name == "omega" for v in axis.values), default=0.0)
    fastest = max(fastest, abs(scene.omega or 0.0))
    return math.pi / fastest if fastest > 0.0 else math.inf


def _room(scene: Scene) -> int:
    """Section points to make room for at first: two a period; cells with more are run again with what they need."""
    if "section" not in scene.record:
        return 0
    periods = scene.window if scene.time_unit == "period" else scene.window / math.pi
    return int(min(2.0 * periods, 1e6)) + 8


def _run_all(job: Job) -> None:
    """Run the cells that have not finished, in chunks on threads; on Ctrl-C stop the threads and pass it on."""
    count = len(job.buffers.counts)
    todo = np.flatnonzero(job.buffers.counts[:, 0] != Status.FINISHED)
    job.advance(count - len(todo))
    if len(todo) == 0:
        return
    part = job if len(todo) == count else job.part(todo)
    part.buffers.counts[:] = 0
    size = _chunk(len(todo), job.kernel.origin.width, job.workers)
    chunks = ((i, min(i + size, len(todo))) for i in range(0, len(todo), size))
    try:
        with ThreadPoolExecutor(job.workers) as pool:
            _feed(pool, chunks, part)
    finally:
        if part is not job:
            job.take(todo, part)


def _chunk(cells: int, width: int, workers: int) -> int:
    """Cells a chunk: a few refills of every lane, and enough chunks to keep all threads busy to the end."""
    return max(width, min(16 * width, math.ceil(cells / (8 * workers) / width) * width))


def _feed(pool: ThreadPoolExecutor, chunks: Iterator[tuple[int, int]], job: Job) -> None:
    """Keep two chunks a thread in flight; an interrupt raises the kernels' cancel flag."""
    running: set[Future[int]] = set()
    try:
        for first, last in chunks:
            running.add(pool.submit(job.drive, first, last))
            while len(running) >= 2 * job.workers:
                running = _collect(running, job.advance)
        while running:
            running = _collect(running, job.advance)
    except BaseException:
        job.control[CANCEL] = 1.0
        raise


def _collect(running: set[Future[int]], advance: Callable[[int], Any]) -> set[Future[int]]:
    done, left = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
    for future in done:
        advance(future.result())
    return set(left)


def _run_along(scene: Scene, job: Job) -> None:
    """Run the last axis cell by cell, each from the end of the one before; the other axes run side by side.

    The plan of the job is replaced by one with the states that the cells really started from.
    """
    columns = scene.shape[-1]
    order = range(columns) if scene.continuation == "up" else range(columns - 1, -1, -1)
    table = np.arange(scene.cells).reshape(-1, columns)
    stated, started = job.cells.start, job.cells.start.copy()
    start = stated[table[:, order[0]]]
    try:
        for column in order:
            rows = table[:, column]
            started[rows] = start
            part = job.part(rows)
            part.cells = Plan(start, part.cells.numbers, part.cells.spans)
            _run_all(part)
            job.take(rows, part)
            good = part.buffers.counts[:, 0] == Status.FINISHED
            start = np.where(good[:, None], part.buffers.end, stated[rows])
    finally:
        job.cells = Plan(started, job.cells.numbers, job.cells.spans)


def _complete_points(job: Job) -> None:
    """Run cells with more section points than there was room for again, with the room they need."""
    buffers = job.buffers
    room = buffers.points.shape[1]
    short = np.flatnonzero(buffers.counts[:, 3] > room)
    if len(short) == 0:
        return
    wide = np.full((len(buffers.counts), int(buffers.counts[:, 3].max()), buffers.points.shape[2]), np.nan)
    wide[:, :room] = buffers.points
    buffers.points = wide
    job.advance = lambda done: None
    again = job.part(short)
    again.buffers.counts[:, 0] = Status.NOT_RUN
    _run_all(again)
    job.take(short, again)

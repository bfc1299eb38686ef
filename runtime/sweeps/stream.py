"""Run a scene to a file: each block is written as soon as it ends, so that a crash loses only the running blocks.

The stages are those of `run.py`. Before them, `claim` decides whether to begin or to continue a file, or to return.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from synchain.codegen.machine_code.installation import InstallationError
from synchain.codegen.machine_code.processor import told_apart
from synchain.models.inputs.checks import check_flag, check_integer, check_path, short_repr
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.layout import Layout
from ..cells.reduce import ReducedScene, as_reduction
from ..cells.run_keywords import Given
from ..engines.job import Start
from ..results.block_log import BlockLog
from ..results.labelled import Labelled
from ..results.labels import alike, changed, scene_of
from ..results.partial import (
    certificate_of,
    describe_sweep,
    layout_of,
    part_of,
    partial_path,
    read_partial,
    verdicts_in,
    write_result,
)
from ..results.result import Result, read_result
from ..results.store import NO_ROOM, attributes_of, form_of, opened
from ..support.error_text import counted
from ..support.execution import Execution
from ..support.files import drop_leftovers, understood
from ..support.progress import Hook, Progress, Reporter
from ..support.status import Status, tally
from .certify import certified as with_certificate
from .errors import SweepFailed, reason_of, sweep_errors, worker_lost
from .pool import Task
from .prepare import PreparedRun, prepare
from .scheduler import BlockScheduler, Sink

# Expected number of threads of a job in a job array (a choice); a part is divided into blocks for this number.
JOB_THREADS = 8


@dataclass(frozen=True, slots=True, repr=False)
class Streamed(Labelled):
    """A finished run: file, number of cells with each status and, for certified runs, with each verdict.

    See Also
    --------
    synchain.stream
    """

    path: Path
    scene: Scene
    progress: Progress
    verdicts: Mapping[str, int]
    part: tuple[int, int] | None = None  # k and N if the file holds part k of N alone

    @property
    def result(self) -> Result:
        """The result in memory, read from its file; cells of other parts have the status NOT_RUN."""
        return read_result(self.path) if self.part is None else read_partial(self.path)

    @property
    def data(self) -> xr.Dataset:
        """The dataset in memory, read from its file."""
        return self.result.data

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, file, time, statuses of cells, verdicts."""
        done, scene = self.progress, self.scene
        times = f" in {done.running:.1f} s, after {done.compiling:.1f} s for the kernel"
        if done.total and done.kept == done.total:  # an existing result, or merged parts
            times = ", run earlier"
        elif done.kept:
            times += f", {done.kept} of them in an earlier run"
        if self.part is not None:
            times = "; part {} of {}: {:.0f} cells{}".format(*self.part, done.total, times)
        verdicts, certain = self.verdicts.items(), ", certain to stay synchronous"
        return (
            ("scene", scene.title or repr(scene)),
            ("cells", f"{counted(scene.cells, 'cell')} of {counted(scene.n, 'oscillator')}{times}"),
            *(("ended", f"{counted(count, 'cell')}: {status.message}") for status, count in done.statuses.items()),
            *(("verdict", f"{counted(n, 'cell')} {name}{certain * (name == 'ended early')}") for name, n in verdicts),
            ("file", str(self.path)),
        )

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the result to another file (see `Result.save`); all of it is read into memory."""
        self.result.save(path, overwrite=overwrite)

    @property
    def success(self) -> bool:
        """True if every cell reached the end of its window."""
        return self.progress.statuses.get(Status.FINISHED, 0) == self.progress.total


def stream(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    resume: bool = False,
    overwrite: bool = False,
    width: int | None = None,
    reduce: bool | ReducedScene = True,
    certified: bool = False,
    part: tuple[int, int] | None = None,
    t_eval: Iterable[float] | None = None,
    realisations: int | None = None,
    draws: Mapping[str, object] | None = None,
    rng: int | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, object] | None = None,
    **axes: object,
) -> Streamed:
    """Run every cell of a scene and write its result to a file, block by block.

    Memory does not grow with the sweep.  Until all cells have ended, their blocks are kept beside
    `path` in a file ".partial", whatever the form of the result; `open_result` opens it too.

    Parameters
    ----------
    scene : Scene
    path : str or path
        File of the result, whose ending chooses its form: .nc, .nc4 or .zarr (see `Result.save`).
    resume : bool
        Go on with a run that was not finished; its result is, bit for bit, that of a run without
        interruption. Nothing is run if it was finished.
    overwrite : bool
        Replace what is there already.
    part : tuple of int, optional
        Run part k of N alone, (k, N) with k from 1 to N, into the file ".kofN.partial" beside `path`, as
        one job of a job array. `merge` makes the result of all parts. With `resume` a part that is not
        there is begun.
    width, reduce, certified, t_eval, realisations, draws, rng, parameters, **axes
        As for `run`.
    workers, executor, show_progress, progress
        As for `run`.

    Returns
    -------
    Streamed
        The file, how its cells ended, and their verdicts.

    Raises
    ------
    ValueError
        If a keyword is refused as by `run`, for another ending, or if a file at `path` belongs to another run.
    FileExistsError
        If the result or an unfinished run is there and neither `resume` nor `overwrite` is given.
    FileNotFoundError
        If there is nothing to resume.
    BlockingIOError
        If another process writes there.
    ModuleNotFoundError
        If the package of the form is not installed.
    SweepInterrupted
        On Ctrl-C.
    SweepFailed
        If the workers are lost or the disk is full.

    See Also
    --------
    synchain.run
    synchain.merge
    synchain.open_result

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import sympy as sp
    >>> import synchain as sc
    >>> x = sp.Symbol("x")
    >>> scene = sc.Scene("duffing", record=(), observe={"far": sc.observe.maximum(x)})
    >>> streamed = sc.stream(scene, Path(mkdtemp()) / "far.nc", omega=[1.0, 2.0], show_progress=False)
    >>> sc.open_result(streamed.path)["far"].sizes["omega"]
    2
    """
    scene = Given(stream, parameters, axes).sweep(scene, t_eval=t_eval, realisations=realisations, draws=draws, rng=rng)
    reduction = as_reduction(scene, reduce)
    execution = Execution(workers, executor, show_progress, progress)
    reporter = execution.reporter(scene.cells)
    state = claim(reduction, path, resume=resume, overwrite=overwrite, certified=certified, part=part)
    if state == "complete":
        if not resume:
            raise FileExistsError(
                f"{os.fspath(path)} holds the result of this scene already; give resume (--resume) to take it, or "
                "overwrite (--overwrite) to run it again"
            )
        return _finished(Path(path), scene, reporter)
    partial = partial_path(path, part)
    if state == "continue":
        certificate = certificate_of(BlockLog.describe(partial))
        prepared = prepare(reduction, execution, certificate, width=width)
    else:
        prepared = prepare(reduction, execution, width=width)
        prepared = with_certificate(prepared) if certified else prepared
        # All parts must use the same blocks, for any number of threads of a job.
        layout = prepared.layout(None if part is None else JOB_THREADS * part[1])
        about = describe_sweep(reduction, layout, prepared.attributes, prepared.certificate, part)
        try:
            BlockLog.create(partial, about)
        except OSError as problem:
            if problem.errno not in NO_ROOM:
                raise
            raise SweepFailed(f"cannot write {partial}: {problem.strerror}", 0, scene.cells) from problem
    log = BlockLog.open(partial, writing=True)
    try:
        verdicts = _run_blocks(prepared, log, reporter, path)
    finally:
        log.close()
        reporter.close()
    if part is not None:
        return Streamed(partial, scene, reporter.now, verdicts, part)
    partial.unlink()
    return Streamed(Path(path), scene, reporter.now, verdicts)


def claim(
    reduction: ReducedScene,
    path: str | os.PathLike[str],
    *,
    resume: bool = False,
    overwrite: bool = False,
    certified: bool = False,
    part: tuple[int, int] | None = None,
) -> str:
    """Return the next action for a result at `path`: "begin", "continue", or "complete" if the result is finished."""
    check_part(part)
    for name, value in (("resume", resume), ("overwrite", overwrite), ("certified", certified)):
        check_flag(name, value)
    target = check_path("path", path)
    partial = partial_path(target, part)
    form = form_of(target)
    if resume and overwrite:
        raise ValueError("found both resume and overwrite; expected one of them")
    form.check(target)
    if partial.exists():
        BlockLog.expect_idle(partial)
    if overwrite:
        return "begin"
    if partial.exists() and (resume or not target.exists()):
        with understood(partial):
            about = BlockLog.describe(partial)
            if part_of(about) != part:
                raise ValueError(f"it does not hold what its name says; found part {part_of(about)}, expected {part}")
            _check_same(reduction, certified, partial, about["attributes"], about["certificate"] is not None)
        if not resume:
            state = "a run of this scene that was not finished" if part is None else "this part, finished or not"
            raise FileExistsError(
                f"{partial} keeps {state}; "
                "continue it with resume (--resume), or start again with overwrite (--overwrite)"
            )
        return "continue"
    if target.exists():
        with understood(target):
            with opened(target) as file:
                attributes, exponents = dict(file.attrs), "transversal_exponent" in file
            _check_same(reduction, certified, target, attributes_of(attributes, target), exponents)
        return "complete"
    if resume and part is None:
        raise FileNotFoundError(f"nothing to resume: {target} does not exist; run without resume (--resume)")
    return "begin"


def check_part(part: object) -> None:
    """Raise TypeError or ValueError unless a part is None or (k, N) with k from 1 to N."""
    if part is None:
        return
    if not (isinstance(part, tuple) and len(part) == 2):
        raise TypeError(f"part: found {short_repr(part)}; expected a tuple (k, N), e.g. (3, 8)")
    k, parts = (check_integer("part", number, 1) for number in part)
    if k > parts:
        raise ValueError(f"part: found part {k} of {parts}; expected one from 1 to {parts}")


def _check_same(
    reduction: ReducedScene, certified: bool, path: Path, attributes: Mapping[str, object], exponents: bool
) -> None:
    """Raise ValueError if a file with these attributes, with or without exponents, belongs to another run."""
    again = "repeat the options of that run, choose another path (--out), or replace it with overwrite (--overwrite)"
    if not alike(scene_of(attributes), reduction.scene):
        raise ValueError(f"{path} belongs to another scene ({short_repr(attributes['title'])}); {again}")
    if changed(attributes, reduction.scene):
        raise ValueError(
            f"{path} comes of another model: the code of its scene has changed since; "
            f"{again.replace('repeat the options of that run', 'restore the code')}"
        )
    if attributes["equations"] != reduction.equations.digest:
        raise ValueError(
            f"{path} left out other parts of its scene: {attributes.get('skipped', 'nothing')}; "
            f"{again.replace('the options of that run', 'its reduction (--no-skip, or the absence of it)')}"
        )
    if exponents != certified:
        certificate = "with" if exponents else "without"
        raise ValueError(f"{path} was run {certificate} a certificate (certified, --certify); {again}")


def _finished(path: Path, scene: Scene, reporter: Reporter) -> Streamed:
    """Return the run of a complete result."""
    with understood(path), opened(path) as file:
        reporter.start(tally(file["status"].values.ravel()))
        verdicts = verdicts_in(file)
    reporter.close()
    return Streamed(path, scene, reporter.now, verdicts)


@dataclass
class _Disk(Sink):
    """Store the blocks of a sweep in a block log."""

    layout: Layout
    log: BlockLog

    def ends(self, block: int) -> Start:
        buffers = self.log.read(block)
        return buffers.end, buffers.finished

    def put(self, task: Task, buffers: Buffers) -> None:
        if buffers.ended:
            self.log.append(task.block, buffers)


def _run_blocks(
    prepared: PreparedRun, log: BlockLog, reporter: Reporter, path: str | os.PathLike[str]
) -> dict[str, int]:
    """Run the blocks that the log lacks, write the result, and return the verdicts."""
    scene = prepared.scene
    _check_kernel(prepared, log)
    layout = layout_of(log.about, scene)
    part = part_of(log.about)
    wanted = layout.part(part)
    reporter.total = int(layout.lengths[wanted].sum())
    scheduler = BlockScheduler(log.done | ~wanted, _Disk(layout, log), prepared, reporter)

    def reason(problem: Exception) -> str | None:
        """Return why workers, their installations or the disk failed; None for any other error."""
        if isinstance(problem, InstallationError):
            return str(problem)
        if worker_lost(problem) or not isinstance(problem, OSError):
            return reason_of(problem)
        return f"cannot write {problem.filename or log.path}: {problem.strerror}" if problem.strerror else str(problem)

    with sweep_errors(int(reporter.total), lambda: (int(log.counts.sum()), None), reason):
        for target in (path, log.path):
            drop_leftovers(target)
        reporter.start(log.counts, prepared.compiling)
        scheduler.run()
        return write_result((log,), path, scene, log.most) if part is None else {}


def _check_kernel(prepared: PreparedRun, log: BlockLog) -> None:
    """Raise ValueError if a log's cells were run by another kernel, version or kind of processor."""
    spec, attributes = prepared.job.spec, log.about["attributes"]
    if (begun := str(attributes.get("processor"))) != spec.processor:
        there, here = told_apart(begun, spec.processor)
        raise ValueError(
            f"{log.path} was begun on the processor {there}; found {here}, which may round otherwise: the two parts of "
            "the sweep might differ; go on there, or replace it with overwrite (--overwrite)"
        )
    if attributes["lanes"] == spec.width and attributes["kernel"] != spec.digest:
        raise ValueError(f"{log.path} was begun with another kernel; replace it with overwrite (--overwrite)")
    if attributes["versions"] != spec.versions:
        raise ValueError(
            f"{log.path} was begun with {attributes['versions']}; found {spec.versions}: the two parts of the sweep might "
            "differ; install those versions, or replace it with overwrite (--overwrite)"
        )

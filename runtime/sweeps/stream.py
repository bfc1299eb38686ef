"""Runs a scene to a file: blocks go to disk as they end, so that nothing that happens costs more than those in flight."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from synchain.codegen.kernels.installation import InstallationError
from synchain.codegen.kernels.processor import told_apart
from synchain.models.inputs.checks import a_path, flag, shown
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.kernels import as_reduction
from ..cells.layout import Layout
from ..cells.reduce import Reduction
from ..results.block_log import Store
from ..results.labels import alike, changed, scene_of
from ..results.partial import about, certificate_of, finish_file, layout_of, partial_path
from ..results.result import told_by
from ..support.files import check_replaceable, drop_leftovers, netcdf_data, understood
from ..support.status import Status
from .job import Start, whole
from .pool import Task, pool_size, worker_lost
from .progress import Hook, Progress, Reporter
from .run import with_axes
from .scheduler import BlockScheduler, PreparedRun, SweepFailed, SweepInterrupted, prepare

__all__ = ["Streamed", "claim", "stream"]


@dataclass(frozen=True, slots=True)
class Streamed:
    """A finished run: its file, how its cells ended, and how many have which verdict (only certified runs have some)."""

    path: Path
    progress: Progress
    verdicts: Mapping[str, int]

    @property
    def success(self) -> bool:
        """True where every cell reached the end of its window."""
        return self.progress.statuses.get(Status.FINISHED, 0) == self.progress.cells


def stream(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    resume: bool = False,
    overwrite: bool = False,
    workers: int | None = None,
    show_progress: bool | None = None,
    width: int | None = None,
    reduce: bool | Reduction = True,
    certified: bool = False,
    executor: Executor | None = None,
    progress: Hook | None = None,
    **axes: Any,
) -> Streamed:
    """Run every cell of a scene and write its result to a netCDF file, block by block; memory does not grow with the sweep.

    Until all cells have ended, their blocks are kept beside `path` in a file ".partial", which `open_result` opens too.
    With `resume` such a run goes on; its result is, byte for byte, that of a run without interruption.  What is there
    already is replaced only with `overwrite`.  The other keywords are those of `run`.

    Raises the errors of `claim` where the files do not allow it, SweepInterrupted on Ctrl-C, SweepFailed where the workers
    are lost or the disk is full.
    """
    chosen = as_reduction(scene := with_axes(scene, axes, stream), reduce)
    reporter = Reporter(scene.cells, show_progress, progress)
    pool_size(executor, workers)  # refuses what is no executor before there is a file
    if (state := claim(chosen, path, resume=resume, overwrite=overwrite, certified=certified)) == "complete":
        raise FileExistsError(
            f"{os.fspath(path)} holds the result of this scene already; give overwrite (--overwrite) to run it again"
        )
    prepared = _prepared(chosen, partial_path(path), state, certified, width=width, workers=workers, executor=executor)
    store = Store.open(partial_path(path), writing=True)
    try:
        verdicts = _fill(prepared, store, executor, reporter, path)
    finally:
        store.close()
        reporter.close()
    partial_path(path).unlink()
    return Streamed(Path(path), reporter.now, verdicts)


def _prepared(chosen: Reduction, partial: Path, state: str, certified: bool, **given: Any) -> PreparedRun:
    """The kernel, the certificate (made or kept) and, of a new run, the store."""
    if state == "continue":
        return prepare(chosen.scene, chosen, **given, certificate=certificate_of(Store.describe(partial)) or False)
    prepared = prepare(chosen.scene, chosen, **given, certificate=certified)
    layout = Layout.of(chosen.scene, prepared.size())
    Store.create(partial, about(chosen, layout, prepared.shop.samples, prepared.attributes, prepared.certificate))
    return prepared


def claim(
    chosen: Reduction,
    path: str | os.PathLike[str],
    *,
    resume: bool = False,
    overwrite: bool = False,
    certified: bool = False,
) -> str:
    """What can be done about a result at `path`: "begin", "continue", or nothing because it is "complete".

    Raises ValueError where a file there belongs to another run, FileExistsError where a run there was not finished and
    `resume` is not given, FileNotFoundError where it is given and there is none.
    """
    for name, value in (("resume", resume), ("overwrite", overwrite), ("certified", certified)):
        flag(name, value)
    target = a_path("path", path)
    partial = partial_path(target)
    if target.suffix.lower() == partial.suffix:
        raise ValueError(
            f"path: found {str(target)!r}, the name of an unfinished run; expected that of a result; end it in .nc"
        )
    if resume and overwrite:
        raise ValueError("found both resume and overwrite; expected one of them")
    check_replaceable(target)
    if overwrite:
        return "begin"
    if partial.exists() and (resume or not target.exists()):
        with understood(partial):
            _check_same(chosen, certified, partial, Store.describe(partial))
        if not resume:
            raise FileExistsError(
                f"{partial} keeps a run of this scene that was not finished; "
                "continue it with resume (--resume), or start again with overwrite (--overwrite)"
            )
        return "continue"
    if target.exists():
        with understood(target):
            _check_same(chosen, certified, target, _described(target))
        return "complete"
    if resume:
        raise FileNotFoundError(f"nothing to resume: {target} does not exist; run without resume (--resume)")
    return "begin"


def _described(target: Path) -> dict[str, Any]:
    """Of a finished result what a store says of an unfinished one."""
    with netcdf_data(target) as file:
        attributes, certified = dict(file.attrs), "transversal_exponent" in file
    return {"attributes": told_by(attributes, target), "certificate": certified or None}


def _check_same(chosen: Reduction, certified: bool, path: Path, told: Mapping[str, Any]) -> None:
    """Raise ValueError where a file is not that of this run."""
    kept = told["attributes"]
    again = "repeat the options of that run, choose another path (--out), or replace it with overwrite (--overwrite)"
    if not alike(scene_of(kept), chosen.scene):
        raise ValueError(f"{path} belongs to another scene ({shown(kept['title'])}); {again}")
    if changed(kept, chosen.scene):
        raise ValueError(
            f"{path} comes of another model: the code of its scene has changed since; "
            f"{again.replace('repeat the options of that run', 'restore the code')}"
        )
    if kept["equations"] != chosen.equations.digest:
        raise ValueError(
            f"{path} left out other parts of its scene: {kept.get('skipped', 'nothing')}; "
            f"{again.replace('the options of that run', 'its reduction (--no-skip, or the absence of it)')}"
        )
    if (told["certificate"] is not None) != certified:
        found = "with" if told["certificate"] is not None else "without"
        raise ValueError(f"{path} was run {found} a certificate (certified, --certify); {again}")


@dataclass(slots=True)
class _Disk:
    """Keeps the blocks of a sweep in a store."""

    layout: Layout
    store: Store

    def missing(self, block: int) -> np.ndarray:
        return self.layout.rows(block)

    def ends(self, block: int) -> Start:
        made = self.store.read(block)
        return made.end, made.counts[:, 0] == Status.FINISHED

    def put(self, task: Task, made: Buffers) -> None:
        if whole(made):
            self.store.append(task.block, made)


def _fill(
    prepared: PreparedRun, store: Store, executor: Executor | None, reporter: Reporter, path: str | os.PathLike[str]
) -> dict[str, int]:
    """Run what the store lacks, then write the result; returns the verdicts."""
    scene = prepared.shop.recipe.chosen.scene
    _check_kernel(prepared, store)
    layout = layout_of(store.about, scene)
    sitting = BlockScheduler(layout, store.done, _Disk(layout, store), reporter, prepared.certificate)
    try:
        drop_leftovers(path)
        reporter.start(store.counts)
        sitting.run(prepared.shop, executor, prepared.workers)
        return finish_file(store, path, scene)
    except KeyboardInterrupt:
        raise SweepInterrupted(int(store.counts.sum()), scene.cells) from None
    except Exception as problem:
        if not (worker_lost(problem) or isinstance(problem, OSError | InstallationError)):
            raise
        reason = str(problem) if isinstance(problem, InstallationError) else f"the workers are lost ({problem})"
        if isinstance(problem, OSError) and not worker_lost(problem):
            where = problem.filename or store.path
            reason = f"cannot write {where}: {problem.strerror}" if problem.strerror else str(problem)
        raise SweepFailed(reason, int(store.counts.sum()), scene.cells) from problem


def _check_kernel(prepared: PreparedRun, store: Store) -> None:
    """Raise ValueError if a store's cells were run by another kernel, version or kind of processor."""
    recipe, kept = prepared.shop.recipe, store.about["attributes"]
    if (begun := str(kept.get("processor"))) != recipe.processor:
        there, here = told_apart(begun, recipe.processor)
        raise ValueError(
            f"{store.path} was begun on the processor {there}; found {here}, which may round otherwise: the two parts of "
            "the sweep might differ; go on there, or replace it with overwrite (--overwrite)"
        )
    if kept["lanes"] == recipe.width and kept["kernel"] != recipe.digest:
        raise ValueError(f"{store.path} was begun with another kernel; replace it with overwrite (--overwrite)")
    if kept["versions"] != recipe.versions:
        raise ValueError(
            f"{store.path} was begun with {kept['versions']}; found {recipe.versions}: the two parts of the sweep might "
            "differ; install those versions, or replace it with overwrite (--overwrite)"
        )

"""What a worker does: from a recipe it makes the kernel, then it runs the blocks that it is given.

A worker is a thread, another process or another machine.  Where it does not share our memory it gets the recipe of a sweep
once, packed, and makes the kernel itself, from its own installation and through its own cache; of a block it gets the
numbers of the cells.
"""

from __future__ import annotations

import importlib.metadata
import io
import math
import pickle
import threading
from collections import OrderedDict
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from synchain.codegen.kernels.compile import Kernel, load
from synchain.codegen.kernels.installation import InstallationError
from synchain.codegen.kernels.processor import processor, told_apart
from synchain.codegen.kernels.sweep import KernelSource, emit
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.plugins import allow_code, allowed_code
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.kernels import kernel, kernel_source
from ..cells.plan import CANCEL, Plan, Planner, control_array, longest_step, tolerances
from ..support.status import Status

__all__ = ["JobSpec", "RowsJob", "RowsSpec", "Start", "SweepJob", "forget", "run_block", "versions"]

DIRECTIONS = {"falling": -1.0, "rising": 1.0, "both": 0.0}
KEPT = 8
"""Sweeps that a worker process remembers; an older one is sent to it again."""

LARGEST = 2**25
"""Numbers that the room for section points of a block has at first, 268 MB."""

Start = tuple[np.ndarray, np.ndarray]
"""States (cells, dimension) to start from in place of the scene's, and for which cells (cells,) they are good."""

_shops: OrderedDict[str, SweepJob | RowsJob] = OrderedDict()
_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class JobSpec:
    """What all blocks of a sweep have in common; `digest` is that of the kernel's text, `code` are files allowed to run.

    `processor` is the kind that machine code is made for (see `synchain.codegen.kernels.processor`).

    `chosen` is what is left of a scene to integrate (a Reduction), or cells of a kernel that no scene has (RowsSpec).
    """

    chosen: Any
    width: int
    digest: str
    versions: str
    processor: str
    code: tuple[str, ...]

    @classmethod
    def of(cls, chosen: Any, source_width: int, digest: str) -> JobSpec:
        """The recipe of a sweep in this process."""
        return cls(chosen, source_width, digest, versions(), processor(), allowed_code())

    def packed(self) -> bytes:
        """As bytes, for a worker elsewhere."""
        target = io.BytesIO()
        head = {name: getattr(self, name) for name in ("versions", "processor", "code", "width", "digest")}
        pickle.dump(head, target)
        pickle.dump(self.chosen, target)
        return target.getvalue()

    @classmethod
    def unpacked(cls, data: bytes) -> JobSpec:
        """From bytes; InstallationError if this worker has other versions or another processor than the main program."""
        source = io.BytesIO(data)
        head = pickle.load(source)
        if head["versions"] != versions():
            raise InstallationError(
                f"this worker has {versions()}; expected the versions of the main program, {head['versions']}: "
                "a sweep needs the same installation everywhere"
            )
        if head["processor"] != processor():
            kept, here = told_apart(head["processor"], processor())
            raise InstallationError(
                f"this worker has the processor {here}; expected that of the main program, {kept}, because another kind may "
                "round otherwise; run on one kind, or set NUMBA_CPU_NAME and NUMBA_CPU_FEATURES to one that all can run"
            )
        allow_code(*head["code"])
        return cls(pickle.load(source), **head)

    def check(self, source: KernelSource) -> None:
        """Raise InstallationError where this worker has written another kernel than who made the recipe."""
        if source.digest != self.digest:
            raise InstallationError(
                f"this worker makes the kernel {source.digest[:12]}; expected that of the main program, "
                f"{self.digest[:12]}: a sweep needs the same installation everywhere"
            )

    def opened(self) -> SweepJob | RowsJob:
        """The kernel with all that it needs to run."""
        return RowsJob(self) if isinstance(self.chosen, RowsSpec) else SweepJob(self)


@dataclass(frozen=True, slots=True, eq=False)
class RowsSpec:
    """Cells of equations that no scene has: their rows, integrator and control array; only the error is recorded."""

    equations: Equations
    integrator: str
    plan: Plan
    control: np.ndarray


@dataclass(slots=True)
class RowsJob:
    """A kernel, ready to run any of the given rows."""

    recipe: JobSpec
    kernel: Kernel = field(init=False)
    control: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        rows: RowsSpec = self.recipe.chosen
        source = emit(rows.equations, rows.integrator, ("sync_error",), width=self.recipe.width)
        self.recipe.check(source)
        self.kernel, self.control = load(source), rows.control.copy()

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.control[CANCEL] = 1.0

    def run(self, cells: np.ndarray, start: Start | None = None, near: np.ndarray | None = None) -> Buffers:
        """Run these cells; they start as their rows say."""
        plan: Plan = self.recipe.chosen.plan
        rows = plan.start[cells], plan.numbers[cells], plan.spans[cells]
        made = Buffers.empty(len(cells), plan.start.shape[1], room=0, samples=0)
        self.kernel.drive(0, len(cells), *rows, self.control, *made.arrays())
        return made


@dataclass(slots=True)
class SweepJob:
    """A kernel, ready to run any cells of its sweep."""

    recipe: JobSpec
    kernel: Kernel = field(init=False)
    planner: Planner = field(init=False)
    control: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        chosen, scene = self.recipe.chosen, self.recipe.chosen.scene
        source = kernel_source(scene, self.recipe.width, chosen)
        self.recipe.check(source)
        self.kernel = kernel(scene, self.recipe.width, chosen)
        self.planner = Planner(scene)
        limits = tolerances(scene, self.planner.extremes().numbers)
        direction = DIRECTIONS[scene.section.direction]
        self.control = control_array(*limits, longest_step(scene), scene.max_steps, direction, chosen.jumps)

    @property
    def samples(self) -> int:
        """Points of a trajectory, 0 where none is recorded."""
        scene = self.recipe.chosen.scene
        return scene.samples if "trajectory" in scene.record else 0

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.control[CANCEL] = 1.0

    def blank(self, cells: int, room: int | None = None) -> Buffers:
        """Buffers for so many cells, with the room for section points that they have at first."""
        chosen = self.recipe.chosen
        dimension = len(chosen.states)
        room = _room(chosen.scene, cells * (dimension + 1)) if room is None else room
        return Buffers.empty(cells, dimension, room, self.samples)

    def run(self, cells: np.ndarray, start: Start | None = None, near: np.ndarray | None = None) -> Buffers:
        """Run these cells; `near` (cells,) is the last column of their spans."""
        rows = self.recipe.chosen.cells(self.planner.rows(cells, near))
        if start is not None:
            rows = replace(rows, start=np.where(start[1][:, None], start[0], rows.start))
        made = self.blank(len(cells))
        self._drive(rows, made)
        room = made.points.shape[1]
        short = np.flatnonzero(made.counts[:, 3] > room)
        if len(short):
            self._again(rows, made, short)
        most = int(made.counts[:, 3].max(initial=0))
        made.points = np.ascontiguousarray(made.points[:, :most])
        return made

    def _drive(self, rows: Plan, made: Buffers) -> None:
        cells = len(rows.start)
        self.kernel.drive(0, cells, rows.start, rows.numbers, rows.spans, self.control, *made.arrays())

    def _again(self, rows: Plan, made: Buffers, short: np.ndarray) -> None:
        """Run cells with more section points than there was room for again, with the room they need."""
        most = int(made.counts[:, 3].max())
        wide = np.full((len(made.counts), most, made.points.shape[2]), np.nan)
        wide[:, : made.points.shape[1]] = made.points
        made.points = wide
        part = self.blank(len(short), most)
        self._drive(Plan(rows.start[short], rows.numbers[short], rows.spans[short]), part)
        for whole, piece in zip(made.arrays(), part.arrays(), strict=True):
            whole[short] = piece


def run_block(key: str, recipe: bytes | None, *block: Any) -> Buffers | None:
    """Run a block in a worker that does not share our memory; None where it does not know the sweep and needs the recipe."""
    with _lock:
        shop = _shops.get(key)
        if shop is None and recipe is not None:
            shop = _shops[key] = JobSpec.unpacked(recipe).opened()
            while len(_shops) > KEPT:
                _shops.popitem(last=False)
    return None if shop is None else shop.run(*block)


def forget(key: str) -> None:
    """Drop a sweep that ran in this process; its cells that still run end."""
    with _lock:
        shop = _shops.pop(key, None)
    if shop is not None:
        shop.cancel()


def whole(made: Buffers) -> bool:
    """True where every cell has come to its end, good or bad."""
    return not bool(np.isin(made.counts[:, 0], (Status.NOT_RUN, Status.INTERRUPTED)).any())


def versions() -> str:
    """The versions that a result depends on."""
    names = ("synchain", "numba", "numpy", "sympy")
    return ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)


def _room(scene: Scene, row: int) -> int:
    """Section points to make room for at first: two a period, as far as LARGEST allows where one more needs `row` numbers.

    Cells with more are run again with what they need.
    """
    if "section" not in scene.record:
        return 0
    periods = scene.window if scene.time_unit == "period" else scene.window / math.pi
    return int(min(2.0 * periods, 1e6, LARGEST // row)) + 8

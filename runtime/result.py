"""The labelled outcome of a run: numbers, what they mean, and how they came about."""

from __future__ import annotations

import importlib.metadata
import json
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.models.scene import Scene

from .certificate import VERDICTS, Certificate
from .files import whole_file
from .status import Status

if TYPE_CHECKING:
    from synchain.codegen.load import Kernel
    from synchain.models.equations import Equations

    from .plan import Plan

__all__ = ["Buffers", "Result", "gather", "open_result"]

MEANINGS = {
    "sync_error": "average synchronisation error",
    "sync_error_max": "largest synchronisation error seen in the window",
    "sync_error_end": "synchronisation error at the end of the window",
    "status": "how the cell ended: " + "; ".join(f"{s.value} {s.name.lower()}" for s in Status),
    "steps": "accepted steps",
    "rejected": "rejected steps",
    "periods_skipped": "periods of the drive jumped over in a cell that repeats itself",
    "end": "state at the end of the window",
    "end_time": "non-dimensional time at which the cell stopped",
    "section_count": "number of section points in the window",
    "section_time": "times of the section points",
    "section": "states at the section points, NaN where there are fewer",
    "trajectory": "states at equally spaced times of the window",
    "trajectory_time": "times of the trajectory",
    "transversal_exponent": "largest transversal exponent of the synchronous state",
    "transversal_stderr": "standard error of the transversal exponent",
    "ended_early": "1 where the cell ended before its window did, certain to stay synchronous",
    "verdict": "; ".join(f"{k} {words}" for k, words in enumerate(VERDICTS)),
}


@dataclass(slots=True)
class Buffers:
    """What the kernel fills, one row for each cell; see the docstring of `drive` in any kernel."""

    end: np.ndarray
    sums: np.ndarray
    counts: np.ndarray
    points: np.ndarray
    samples: np.ndarray

    @classmethod
    def empty(cls, cells: int, dimension: int, room: int, samples: int) -> Buffers:
        """Buffers in which nothing has run: numbers NaN, counts zero."""
        return cls(
            end=np.full((cells, dimension), np.nan),
            sums=np.full((cells, 4), np.nan),
            counts=np.zeros((cells, 6), np.int64),
            points=np.full((cells, room, dimension + 1), np.nan),
            samples=np.full((cells, samples, dimension), np.nan),
        )

    def arrays(self) -> tuple[np.ndarray, ...]:
        """In the order of the kernel's arguments."""
        return self.end, self.sums, self.counts, self.points, self.samples


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """Labelled arrays of a run (`data`, an xarray.Dataset) and the scene that they belong to.

    Dimensions are the names of the axes (or "cell" where the axes are zipped), then "state", "point" or "sample".
    """

    data: xr.Dataset
    scene: Scene

    def __getattr__(self, name: str) -> xr.DataArray:
        if name.startswith("_") or name not in self.data:
            known = ", ".join(sorted(map(str, self.data.data_vars)))
            raise AttributeError(f"this result has no {name!r}; it has: {known}")
        return self.data[name]

    @property
    def success(self) -> bool:
        """True where every cell reached the end of its window."""
        return bool((self.data.status == Status.FINISHED).all())

    @property
    def message(self) -> str:
        """How many cells ended how, in words."""
        codes, counts = np.unique(self.data.status.values, return_counts=True)
        parts = [
            f"{n} cell{'s' * (n > 1)}: {Status(int(c)).message}" for c, n in zip(codes, counts.tolist(), strict=True)
        ]
        return "; ".join(parts)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a netCDF file that opens in xarray and in `open_result`; it appears whole or not at all."""
        with whole_file(path) as temporary:
            self.data.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")

    def belongs_to(self, scene: Scene) -> bool:
        """True where the scene is this result's but for its title."""
        return self.scene.replace(title="") == scene.replace(title="")

    def stepped(self, equations: Equations) -> bool:
        """True where these are the equations that were integrated: the scene's, or what was left of them to step."""
        return bool(self.data.attrs["equations"] == equations.digest)

    def restore(self, scene: Scene, buffers: Buffers, equations: Equations) -> None:
        """Put the finished cells of this result into the buffers of a new run of the same scene that steps these equations.

        Raises ValueError where the scenes differ in more than their titles, or this result comes of other equations.
        """
        if not self.belongs_to(scene):
            raise ValueError("the result to resume belongs to another scene; run without resume")
        if not self.stepped(equations):
            raise ValueError("the result to resume left out other parts of its scene; resume with the skip of that run")
        if scene.continuation != "none":
            return  # every cell needs the one before: a continued sweep starts again
        cells, data = scene.cells, self.data
        for source, target in (("end", buffers.end), ("trajectory", buffers.samples)):
            if source in data:
                target[:] = data[source].values.reshape(target.shape)
        counts = ("status", "steps", "rejected", "section_count", "periods_skipped")
        sums = ("sync_error", "sync_error_max", "sync_error_end", "end_time")
        for table, names in ((buffers.counts, counts), (buffers.sums, sums)):
            for column, name in enumerate(names):
                if name in data:
                    table[:, column] = data[name].values.reshape(cells)
        if "section" in data:
            kept = np.concatenate([data.section_time.values[..., None], data.section.values], axis=-1)
            kept = kept.reshape(cells, -1, kept.shape[-1])
            buffers.points = np.full((cells, max(kept.shape[1], buffers.points.shape[1]), kept.shape[2]), np.nan)
            buffers.points[:, : kept.shape[1]] = kept
        again = buffers.counts[:, 0] != Status.FINISHED
        buffers.counts[again] = 0
        for array in (buffers.end, buffers.sums, buffers.points, buffers.samples):
            array[again] = np.nan


def open_result(path: str | os.PathLike[str]) -> Result:
    """Read a file written by `Result.save`; OSError or ValueError where it is none."""
    try:
        with xr.open_dataset(path, engine="scipy") as file:
            data = file.load()
    except (OSError, ValueError, TypeError, KeyError) as problem:
        raise OSError(f"cannot read {os.fspath(path)} as a netCDF result: {problem}") from problem
    if "scene" not in data.attrs:
        raise ValueError(f"{os.fspath(path)} is no synchain result: it has no attribute 'scene'")
    return Result(data, Scene.from_dict(json.loads(data.attrs["scene"])))


def gather(
    scene: Scene,
    kernel: Kernel,
    cells: Plan,
    buffers: Buffers,
    tolerances: tuple[float, float],
    skipped: tuple[str, ...] = (),
    certificate: Certificate | None = None,
) -> Result:
    """Label what the kernel wrote; `skipped` says what was left out of the equations (see `synchain.runtime.skip`)."""
    dims = ("cell",) if scene.zipped else tuple(axis.name for axis in scene.axes)
    shape = scene.shape
    data: dict[str, Any] = {}

    def add(name: str, values: np.ndarray, *more: str) -> None:
        data[name] = ((*dims, *more), values.reshape((*shape, *values.shape[1:])), {"long_name": MEANINGS[name]})

    for name, column in (("status", 0), ("steps", 1), ("rejected", 2), ("periods_skipped", 4)):
        add(name, buffers.counts[:, column].astype(np.int32))
    add("end", buffers.end, "state")
    add("end_time", buffers.sums[:, 3])
    if "sync_error" in scene.record:
        for column, name in enumerate(("sync_error", "sync_error_max", "sync_error_end")):
            add(name, buffers.sums[:, column])
    if certificate is not None:
        for name, values in _certified(scene, cells, buffers, certificate).items():
            add(name, values)
    if "section" in scene.record:
        most = max(int(buffers.counts[:, 3].max(initial=0)), 1)
        add("section_count", buffers.counts[:, 3].astype(np.int32))
        add("section_time", buffers.points[:, :most, 0], "point")
        add("section", buffers.points[:, :most, 1:], "point", "state")
    if "trajectory" in scene.record:
        parts = np.linspace(0.0, 1.0, scene.samples) if scene.samples > 1 else np.zeros(1)
        times = cells.spans[:, :1] + (cells.spans[:, 1:2] - cells.spans[:, :1]) * parts
        add("trajectory_time", times, "sample")
        add("trajectory", buffers.samples, "sample", "state")
    provenance = {**_provenance(scene, kernel, tolerances), "skipped": "; ".join(skipped) or "nothing"}
    return Result(xr.Dataset(data, _coordinates(scene), provenance), scene)


def _certified(scene: Scene, cells: Plan, buffers: Buffers, certificate: Certificate) -> dict[str, np.ndarray]:
    """What a certificate says of each cell."""
    made = {"transversal_exponent": certificate.exponent, "transversal_stderr": certificate.stderr}
    last = cells.spans[:, 1]
    made["ended_early"] = ((buffers.counts[:, 0] == Status.FINISHED) & (buffers.sums[:, 3] < last)).astype(np.int32)
    if "sync_error" in scene.record:
        finished = buffers.counts[:, 0] == Status.FINISHED
        made["verdict"] = certificate.verdicts(finished, buffers.sums[:, 0]).astype(np.int32)
    return made


def _coordinates(scene: Scene) -> dict[str, Any]:
    coordinates: dict[str, Any] = {"state": list(scene.equations.state)}
    for axis in scene.axes:
        coordinates[axis.name] = ("cell" if scene.zipped else axis.name, np.array(axis.values))
    return coordinates


def _provenance(scene: Scene, kernel: Kernel, tolerances: tuple[float, float]) -> dict[str, Any]:
    packages = ("synchain", "numba", "numpy", "sympy")
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in packages)
    return {
        "title": scene.title or repr(scene),
        "scene": json.dumps(scene.as_dict()),
        "equations": kernel.equations.digest,
        "kernel": kernel.digest,
        "lanes": kernel.origin.width,
        "rtol_used": tolerances[0],
        "atol_used": tolerances[1],
        "seed": scene.seed,
        "versions": versions,
    }

"""The labelled result of a run: numbers, their meaning, and how they came about."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from synchain.codegen.kernels.processor import processor, told_apart
from synchain.models.inputs.checks import check_instance
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.buffers import Buffers
from ..support.files import netcdf_data, understood, whole_file
from ..support.netcdf import DIGEST, seal, unsealed
from ..support.status import Status
from .certificate import Certificate
from .labels import COUNTS, MEANINGS, SUMS, alike, changed, coordinates, dimensions, scene_of, variables

if TYPE_CHECKING:
    from synchain.models.dynamics.equations import Equations

__all__ = ["Result", "attributes_of", "gather", "read_result"]


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """Labelled arrays of a run; a variable `name` of the data is also an attribute:
    `result.sync_error`.

    Attributes
    ----------
    data : xarray.Dataset
        Its dimensions are the names of the axes (or "cell" if the axes are zipped), then "state",
        "point" or "sample".  Its attributes say how the result came about.
    scene : Scene
        The scene, with its axes.

    Notes
    -----
    Every cell has a `status`; `synchain.runtime.Status` names the codes.  Times are
    non-dimensional.
    """

    data: xr.Dataset
    scene: Scene

    def __post_init__(self) -> None:
        check_instance("data", self.data, xr.Dataset, "an xarray.Dataset; open_result reads one from a file")
        a_scene(self.scene)

    def __getattr__(self, name: str) -> xr.DataArray:
        if name.startswith("_") or name not in self.data:
            known = ", ".join(sorted(map(str, self.data.data_vars)))
            raise AttributeError(f"this result has no {name!r}; it has: {known}")
        return self.data[name]

    @property
    def success(self) -> bool:
        """True if every cell reached the end of its window."""
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
        """Write a netCDF file that opens in xarray and in `open_result`; it appears whole or not at
        all.

        Its attribute `digest` is the SHA-256 of the file, by which `open_result` and `stream` see
        whether it was damaged.
        """
        with whole_file(path) as temporary:
            unsealed(self.data).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
            with open(temporary, "r+b") as file:
                seal(file)

    def belongs_to(self, scene: Scene) -> bool:
        """True if the scene is this result's but for its title."""
        return alike(self.scene, scene)

    def stepped(self, equations: Equations) -> bool:
        """True if these are the equations that were integrated: the scene's, or what was left of
        them to step.
        """
        return bool(self.data.attrs["equations"] == equations.digest)

    def restore(self, scene: Scene, buffers: Buffers, equations: Equations) -> None:
        """Copy the finished cells of this result into the buffers of a new run of the same scene.

        Parameters
        ----------
        scene : Scene
            Scene of the new run.
        buffers : Buffers
            Buffers of all its cells.
        equations : Equations
            The equations that the new run steps.

        Raises
        ------
        ValueError
            If the scenes differ in more than their titles, or if this result comes of other
            equations or of another kind of processor.
        """
        if not self.belongs_to(scene):
            raise ValueError("the result to resume belongs to another scene; run without resume")
        if changed(self.data.attrs, scene):
            raise ValueError(
                "the result to resume comes of another model: its code has changed since; "
                "restore the code, or run without resume"
            )
        if not self.stepped(equations):
            raise ValueError(
                "the result to resume left out other parts of its scene; resume with the reduction of that run"
            )
        if (begun := str(self.data.attrs.get("processor"))) != processor():
            there, here = told_apart(begun, processor())
            raise ValueError(
                f"the result to resume was begun on the processor {there}; found {here}, which may round otherwise; "
                "resume on the first kind, or run without resume"
            )
        self._fill(buffers)
        buffers.clear(~buffers.finished)

    def _fill(self, buffers: Buffers) -> None:
        """Copy all cells into the buffers; the way back of `gather`."""
        cells, data = self.scene.cells, self.data
        for source, target in (("end", buffers.end), ("trajectory", buffers.samples)):
            if source in data:
                target[:] = data[source].values.reshape(target.shape)
        for table, columns in ((buffers.counts, COUNTS), (buffers.sums, SUMS)):
            for name, column in columns.items():
                if name in data:
                    table[:, column] = data[name].values.reshape(cells)
        if "section" in data:
            points = np.concatenate([data.section_time.values[..., None], data.section.values], axis=-1)
            points = points.reshape(cells, -1, points.shape[-1])
            buffers.widen(points.shape[1])
            buffers.points[:, : points.shape[1]] = points


def read_result(path: Path) -> Result:
    """Return the result that a netCDF file holds.

    Raises
    ------
    OSError, ValueError
        If the file is damaged or holds no result.
    """
    with netcdf_data(path) as file:
        data = file.load()
    data.attrs = attributes_of(data.attrs, path)
    with understood(path):
        scene = scene_of(data.attrs)
        status = data.get("status")
        if status is None or status.dims != dimensions(scene) or status.shape != scene.shape:
            raise ValueError("its variables are not those of its scene")
        list(map(Status, np.unique(status.values).tolist()))
    return Result(data, scene)


def attributes_of(attributes: Mapping[object, object], path: Path) -> dict[str, object]:
    """The attributes of a result's file without its digest; a RuntimeWarning says if there is none."""
    if "scene" in attributes and DIGEST not in attributes:
        warnings.warn(
            f"{path} has no digest, so damage of its numbers cannot be seen; open it and save it with Result.save",
            RuntimeWarning,
            stacklevel=3,
        )
    return {str(name): value for name, value in attributes.items() if name != DIGEST}


def gather(
    scene: Scene,
    attributes: Mapping[str, object],
    spans: np.ndarray,
    buffers: Buffers,
    certificate: Certificate | None = None,
) -> Result:
    """Return the labelled result of all cells.

    Parameters
    ----------
    scene : Scene
    attributes : mapping
        How the result came about (`synchain.runtime.results.labels.provenance`).
    spans : ndarray, shape (cells, len(Span))
    buffers : Buffers
        Results of all cells, of the whole network.
    certificate : Certificate, optional
    """
    dims, shape = dimensions(scene), scene.shape
    data = {
        name: ((*dims, *more), values.reshape((*shape, *values.shape[1:])), {"long_name": MEANINGS[name]})
        for name, more, values in variables(scene, spans, buffers, certificate, buffers.most_points)
    }
    return Result(xr.Dataset(data, coordinates(scene), dict(attributes)), scene)

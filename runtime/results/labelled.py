"""The base class of results: labelled data, a plot, a file, a few lines of text."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.models.inputs.display import HasPlot

from .codec import encode
from .store import write_data

if TYPE_CHECKING:
    from synchain.models.scenes.scene import Scene

KIND, VALUE = "kind", "value"  # attributes of a file: the class of the value, and its fields as JSON


class Labelled(HasPlot):
    """A frozen value with `data`, `summary`, `as_dict`, `plot` and `save`.

    A subclass is a frozen dataclass that defines `data` and `summary`.  `synchain.runtime.results.codec` writes and
    reads the fields by their types, so a subclass needs no reader or writer.  `open_result` finds a subclass by its
    name in `synchain.results`.
    """

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def data(self) -> xr.Dataset:
            """The numbers with named dimensions and coordinates."""

        @property
        def summary(self) -> tuple[tuple[str, str], ...]:
            """Names and texts of the main facts, which `print` and the command line show."""

    def as_dict(self) -> dict[str, object]:
        """Return the value for JSON.

        Returns
        -------
        dict
            By default the variables and coordinates of `data`.  Numbers that are not finite are None, complex ones
            [real part, imaginary part].
        """
        return as_json({str(name): variable.values for name, variable in self.data.variables.items()})

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a file for `open_result` and xarray; the file is written completely or not at all.

        Parameters
        ----------
        path : str or path
            Its ending chooses the form: .nc is netCDF-3, .nc4 netCDF-4 (needs h5netcdf), .zarr a Zarr
            folder (needs zarr).
        overwrite : bool
            Replace an existing file.

        Raises
        ------
        ValueError
            For another ending.
        FileExistsError
            If the file exists and `overwrite` is False.
        ModuleNotFoundError
            If the package of the form is not installed.
        OSError
            If the file cannot be written.
        """
        data = self.data.copy(deep=False)
        tree, arrays = encode(self, data)
        data = data.assign(arrays)
        data.attrs = {**data.attrs, KIND: type(self).__name__, VALUE: json.dumps(tree)}
        write_data(data, path, overwrite)

    def __repr__(self) -> str:
        rows = self.summary
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join([type(self).__name__, *(f"  {name:<{width}}  {text}" for name, text in rows)])


def dataset(
    variables: Mapping[str, tuple[Sequence[str], Any, str]], coordinates: Mapping[str, Any], scene: Scene | None = None
) -> xr.Dataset:
    """Return labelled data from (dimensions, values, meaning) of each variable."""
    arrays = {
        name: (tuple(dims), np.asarray(values), {"long_name": meaning})
        for name, (dims, values, meaning) in variables.items()
    }
    attributes = {} if scene is None else {"title": scene.title or repr(scene), "scene": json.dumps(scene.as_dict())}
    return xr.Dataset(arrays, coordinates, attributes)


def as_json(table: Mapping[str, object]) -> dict[str, object]:
    """Return a table in JSON types: None for numbers that are not finite, [real part, imaginary part] for complex ones."""
    return {name: _json(value) for name, value in table.items()}


def _json(value: object) -> object:
    if isinstance(value, np.ndarray | np.generic):
        return _json(value.tolist())
    if isinstance(value, Mapping):
        return as_json(value)
    if isinstance(value, list | tuple):
        return [_json(item) for item in value]
    if isinstance(value, complex):
        return [_json(value.real), _json(value.imag)]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def scene_text(scene: Scene, axes: Collection[str] = ()) -> str:
    """Return a scene and the frequency of its drive for a summary, unless one of `axes` changes the frequency."""
    drive = drive_text(scene, axes)
    return f"{scene!r}, {drive}" if drive else repr(scene)


def drive_text(scene: Scene, axes: Collection[str] = ()) -> str:
    """Return the frequency of a drive, such as "omega = 1.4"; empty without one, or if one of `axes` changes it."""
    frequency, value = scene.drive.frequency, scene.angular_frequency
    if frequency is None or value is None or {s.name for s in frequency.free_symbols} & set(axes):
        return ""
    return f"{frequency} = {value:g}" if frequency.free_symbols else f"drive frequency {value:g}"

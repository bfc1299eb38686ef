"""What a function of this package returns: labelled data, a plot, a file, a few lines of text."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.models.inputs.shown import Shown

from .codec import encode
from .store import write_data

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from synchain.models.scenes.scene import Scene

__all__ = ["KIND", "VALUE", "Labelled", "dataset", "ends_of", "words_of"]

KIND, VALUE = "kind", "value"
"""Attributes of a file: the class of the value, and its fields as JSON."""


class Labelled(Shown):
    """A frozen value with `data`, `plot`, `save` and a summary.

    A subclass is a frozen dataclass that defines `data` and `summary`.  Its fields are written and
    read by `synchain.runtime.results.codec`, so a subclass has no reader or writer of its own.
    """

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def data(self) -> xr.Dataset:
            """The numbers with named dimensions and coordinates."""

        @property
        def summary(self) -> tuple[tuple[str, str], ...]:
            """Names and words of what a reader wants to know first."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the value.

        Parameters
        ----------
        ax : Axes, optional
            Matplotlib axes; by default those of a new figure.

        Returns
        -------
        Axes
            Nothing is shown on a screen.  ``ax.figure.savefig("figure.png")`` writes the figure, which
            belongs to no window.
        """
        return self._drawn(ax)

    def _drawn(self, ax: Axes | None, **options: Any) -> Axes:
        from synchain.runtime.seeing.draw import drawn

        return drawn(self, ax, **options)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a file that opens in xarray and in `open_result`; it appears whole or not at all.

        Parameters
        ----------
        path : str or path
            Its ending chooses the form: .nc is netCDF-3, .nc4 netCDF-4 (needs h5netcdf), .zarr a Zarr
            folder (needs zarr).
        overwrite : bool
            Replace what is there already.

        Raises
        ------
        ValueError
            For another ending.
        FileExistsError
            If a file is there and `overwrite` is not given.
        ModuleNotFoundError
            If the package of the form is not installed.
        OSError
            If the file cannot be written.
        """
        data = self.data.copy(deep=False)
        tree, further = encode(self, data)
        data = data.assign(further)
        data.attrs = {**data.attrs, KIND: type(self).__name__, VALUE: json.dumps(tree)}
        write_data(data, path, overwrite)

    def __repr__(self) -> str:
        rows = self.summary
        wide = max((len(name) for name, _ in rows), default=0)
        return "\n".join([type(self).__name__, *(f"  {name:<{wide}}  {words}" for name, words in rows)])


def dataset(
    variables: Mapping[str, tuple[Sequence[str], Any, str]], coordinates: Mapping[str, Any], scene: Scene | None = None
) -> xr.Dataset:
    """Return labelled data.

    Parameters
    ----------
    variables : mapping
        Dimensions, values and meaning of each variable.
    coordinates : mapping
        Coordinates as for `xarray.Dataset`.
    scene : Scene, optional
        What the numbers belong to; it becomes an attribute.
    """
    made = {
        name: (tuple(dims), np.asarray(values), {"long_name": words})
        for name, (dims, values, words) in variables.items()
    }
    about = {} if scene is None else {"title": scene.title or repr(scene), "scene": json.dumps(scene.as_dict())}
    return xr.Dataset(made, coordinates, about)


def ends_of(values: np.ndarray) -> str:
    """Return the smallest and the largest number in words."""
    low, high = (f"{x:.6g}" for x in (values.min(), values.max()))
    return f"from {low} to {high}"


def words_of(
    intervals: Sequence[tuple[float, float]],
    errors: Sequence[tuple[float, float]] | None = None,
    most: int = 8,
    beyond: Collection[float] = (),
) -> str:
    """Return intervals in words, with the errors of their ends if they are known; dots at ends `beyond` which they may go on."""

    def end(x: float, error: float) -> str:
        known = error > np.finfo(float).eps * abs(x)  # no error of rounding
        return f"{x:z.4f}" + ("..." if x in beyond else f" ± {error:.1g}" if known else "")

    found = []
    for k, ends in enumerate(intervals[:most]):
        spread = errors[k] if errors else (0.0, 0.0)
        found.append(" … ".join(map(end, ends, spread)))
    more = [f"{len(intervals) - most} more"] if len(intervals) > most else []
    return "; ".join([*found, *more]) or "none"

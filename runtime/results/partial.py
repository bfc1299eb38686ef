"""From the blocks of a sweep on disk to a result: of all cells so far in memory, or of all cells in a netCDF file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import whole
from synchain.models.scenes.scene import Scene

from ..cells.buffers import COUNTS, SUMS, Buffers
from ..cells.layout import Layout
from ..cells.plan import Planner
from ..cells.reduce import NodeMerge, Reduction
from ..support.files import understood, whole_file
from ..support.netcdf import Sheet, seal, unsealed
from .block_log import Store
from .certificate import VERDICTS, Certificate
from .labels import MEANINGS, Variable, coordinates, dimensions, scene_of, variables
from .result import IN_MEMORY, Result, gather

__all__ = ["about", "certificate_of", "finish_file", "layout_of", "open_unfinished", "partial_path"]


def about(
    chosen: Reduction, layout: Layout, samples: int, attributes: Mapping[str, Any], certificate: Certificate | None
) -> dict[str, Any]:
    """What a store has to say of its sweep, in JSON types, so that it can be read without the kernel."""
    merged = chosen.merged
    few = len(merged.states) < len(merged.places)
    return {
        "attributes": dict(attributes),
        "blocks": layout.blocks,
        "size": layout.size,
        "dimension": len(merged.states),
        "samples": samples,
        "merged": [merged.states.tolist(), merged.places.tolist()] if few else None,
        "together": merged.together,
        "certificate": None if certificate is None else [
            part.tolist() for part in (certificate.exponent, certificate.stderr, certificate.diffusion)
        ],
    }  # fmt: skip


def layout_of(told: Mapping[str, Any], scene: Scene) -> Layout:
    """The blocks of a store; ValueError if it does not have as many as its scene needs."""
    layout = Layout.of(scene, whole("size", told["size"], 1))
    if layout.blocks != told["blocks"]:
        raise ValueError(f"found {told['blocks']} blocks; expected {layout.blocks} for the cells of its scene")
    return layout


def certificate_of(told: Mapping[str, Any]) -> Certificate | None:
    """The certificate of a store's cells, None where they are not certified."""
    found = told["certificate"]
    return None if found is None else Certificate(*(np.array(part, dtype=float) for part in found))


class _Reader:
    """Reads blocks of a store as those of the whole network."""

    def __init__(self, store: Store, scene: Scene) -> None:
        told = store.about
        self.store, self.scene = store, scene
        self.layout, self.certificate = layout_of(told, self.scene), certificate_of(told)
        self.planner = Planner(self.scene)
        same = np.arange(int(told["dimension"]))
        states, places = (same, same) if told["merged"] is None else map(np.array, told["merged"])
        self.merged = NodeMerge(states, places, bool(told["together"]))

    def buffers(self, block: int) -> Buffers:
        return self.merged.expand(self.store.read(block))

    def variables(self, rows: np.ndarray, buffers: Buffers) -> Iterator[Variable]:
        own = None if self.certificate is None else self.certificate.take(rows)
        return variables(self.scene, self.planner.rows(rows).spans, buffers, own, self.store.most)


def open_unfinished(path: str | os.PathLike[str]) -> Result:
    """The cells so far of a sweep on disk; the others have the status NOT_RUN."""
    with understood(Path(path)):
        told = Store.describe(path)
        scene = scene_of(told["attributes"])
        layout_of(told, scene)
        with closing(Store.open(path)) as store:
            return _so_far(store, scene)


def _so_far(store: Store, scene: Scene) -> Result:
    reader = _Reader(store, scene)
    dimension, samples = len(reader.merged.places), int(store.about["samples"])
    numbers = scene.cells * (dimension * (1 + samples) + (dimension + 1) * store.most + SUMS + COUNTS)
    if numbers > IN_MEMORY:
        raise ValueError(
            f"found a sweep of {numbers * 8 / 1e9:.0f} GB; expected at most {IN_MEMORY * 8 / 1e9:.0f} GB in memory; finish "
            "it with resume (--resume), and open parts of the result with xarray"
        )
    made = Buffers.empty(scene.cells, dimension, store.most, samples)
    for block in np.flatnonzero(store.done).tolist():
        rows, found = reader.layout.rows(block), reader.buffers(block)
        for target, source in zip(made.arrays(), found.arrays(), strict=True):
            target[(rows, slice(source.shape[1]))] = source
    spans = reader.planner.rows(np.arange(scene.cells)).spans
    return gather(scene, store.about["attributes"], spans, made, reader.certificate)


def finish_file(store: Store, path: str | os.PathLike[str], scene: Scene) -> dict[str, int]:
    """Write the netCDF file of a scene's store whose blocks are all there, one block in memory at a time.

    Returns how many cells have which verdict, and how many "ended early"; empty where the cells are not certified.
    """
    reader = _Reader(store, scene)
    told: dict[str, int] = {}
    axes = {axis.name: len(axis) for axis in scene.axes}
    lengths = {"cell": scene.cells} if scene.zipped else axes
    with whole_file(path) as temporary, open(temporary, "w+b") as file:
        sheet = Sheet(file, _template(reader), lengths)
        for axis in scene.axes:
            sheet.put(axis.name, np.arange(len(axis)), np.array(axis.values))
        for block in range(reader.layout.blocks):
            rows = reader.layout.rows(block)
            for name, _, values in reader.variables(rows, reader.buffers(block)):
                sheet.put(name, rows, values)
                for word, count in _words(name, values):
                    told[word] = told.get(word, 0) + count
        seal(file)
        file.flush()
        os.fsync(file.fileno())
    return told


def _template(reader: _Reader) -> xr.Dataset:
    """The result of the first cell alone."""
    scene = reader.scene
    one = np.arange(1)
    first = Buffers(*(array[:1] for array in reader.buffers(0).arrays()))
    dims, ones = dimensions(scene), (1,) * len(scene.shape)
    data = {
        name: ((*dims, *more), values[:1].reshape((*ones, *values.shape[1:])), {"long_name": MEANINGS[name]})
        for name, more, values in reader.variables(one, first)
    }
    made = coordinates(scene)
    for axis in scene.axes:
        dim, values = made[axis.name]
        made[axis.name] = (dim, values[:1])
    return unsealed(xr.Dataset(data, made, reader.store.about["attributes"]))


def _words(name: str, values: np.ndarray) -> list[tuple[str, int]]:
    """What a block adds to the count of verdicts."""
    if name == "ended_early":
        return [("ended early", int(np.count_nonzero(values)))]
    if name == "verdict":
        codes, counts = np.unique(values, return_counts=True)
        return [(VERDICTS[code], int(count)) for code, count in zip(codes, counts, strict=True)]
    return []


def partial_path(path: str | os.PathLike[str]) -> Path:
    """Where the blocks of a run are kept until its result is written: beside the result."""
    return Path(path).with_suffix(".partial")

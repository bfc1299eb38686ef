"""Build results from the blocks of a sweep on disk: the finished cells in memory, or all cells in a file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import fields
from itertools import chain
from pathlib import Path

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.buffers import IN_MEMORY, Buffers, numbers_of_a_cell
from ..cells.layout import Layout
from ..cells.observable_arrays import Sections
from ..cells.plan import Planner
from ..cells.reduce import NodeMerge, ReducedScene
from ..support.files import understood
from .block_log import BlockLog, Description
from .certificate import VERDICTS, Certificate
from .labels import Variable, dimensions, labelled, scene_of, swept, variables
from .result import Result, gather
from .store import filled


def describe_sweep(
    reduction: ReducedScene,
    layout: Layout,
    attributes: Mapping[str, object],
    certificate: Certificate | None,
    part: tuple[int, int] | None = None,
) -> Description:
    merge = reduction.merge
    exponents = None if certificate is None else [getattr(certificate, part.name) for part in fields(certificate)]
    return {
        "attributes": dict(attributes),
        "blocks": layout.blocks,
        "size": layout.size,
        "dimension": reduction.dimension,
        "samples": reduction.samples,
        "observed": reduction.observed.numbers,
        "kept": reduction.point_size,
        "merged": [merge.states.tolist(), merge.places.tolist()] if merge.merges else None,
        "together": merge.together,
        "part": None if part is None else list(part),
        "certificate": None if exponents is None else [part.tolist() for part in exponents],
    }


def layout_of(about: Description, scene: Scene) -> Layout:
    """Return the division of the cells of a log into blocks."""
    layout = Layout.of(scene, check_integer("size", about["size"], 1))
    if layout.blocks != about["blocks"]:
        raise ValueError(f"found {about['blocks']} blocks; expected {layout.blocks} for the cells of its scene")
    return layout


def part_of(about: Description) -> tuple[int, int] | None:
    """Return the part (k, N) of a sweep that a log holds, or None if it is the log of a whole sweep."""
    part = about.get("part")
    if part is None:
        return None
    k, parts = part
    return check_integer("part", k, 1), check_integer("part", parts, k)


def certificate_of(about: Description) -> Certificate | None:
    """Return the certificate of a log's cells, or None if they are not certified."""
    exponents = about["certificate"]
    return None if exponents is None else Certificate(*(np.array(part, dtype=float) for part in exponents))


class _BlockReader:
    """Read the blocks of a log, and expand each from the reduced to the whole network."""

    def __init__(self, log: BlockLog, scene: Scene, most: int | None = None) -> None:
        about = log.about
        self.log, self.scene, self.most = log, scene, log.most if most is None else most
        self.layout, self.certificate = layout_of(about, scene), certificate_of(about)
        self.planner = Planner(scene)
        if check_integer("dimension", about["dimension"], 1) > len(scene.y0):
            raise ValueError(f"found {about['dimension']} states; expected at most the {len(scene.y0)} of its scene")
        identity = np.arange(about["dimension"])
        states, indices = (identity, identity) if about["merged"] is None else map(np.array, about["merged"])
        self.merge = NodeMerge(states, indices, bool(about["together"]))

    def buffers(self, block: int) -> Buffers:
        return self.merge.expand(self.log.read(block))

    def variables(self, cells: np.ndarray, buffers: Buffers) -> Iterator[Variable]:
        """Yield the variables of cells from their buffers. Shapes: cells (k,)."""
        certificate = None if self.certificate is None else self.certificate.take(cells)
        return variables(self.scene, self.planner.spans(cells), buffers, certificate, self.most)


def read_partial(path: str | os.PathLike[str]) -> Result:
    """Return the finished cells of a sweep on disk; all other cells have the status NOT_RUN."""
    with understood(Path(path)):
        about = BlockLog.describe(path)
        scene = scene_of(about["attributes"])
        layout_of(about, scene)  # raises ValueError for a wrong description, before all records are read
        with closing(BlockLog.open(path)) as log:
            reader = _BlockReader(log, scene)
            dimension, samples = len(reader.merge.places), int(about["samples"])
            observed, point_size = int(about["observed"]), Sections(scene).width(dimension)
            numbers = scene.cells * numbers_of_a_cell(dimension, log.most, samples, observed, point_size)
            if numbers > IN_MEMORY:
                raise ValueError(
                    f"found a sweep of {numbers * 8 / 1e9:.0f} GB; expected at most {IN_MEMORY * 8 / 1e9:.0f} GB in "
                    "memory; finish it with resume (--resume), and open parts of the result with xarray"
                )
            buffers = Buffers.empty(scene.cells, dimension, log.most, samples, observed, point_size)
            for block in np.flatnonzero(log.done).tolist():
                buffers.put(reader.layout.rows(block), reader.buffers(block))
            spans = reader.planner.spans(np.arange(scene.cells))
            return gather(scene, lambda: about["attributes"], spans, buffers, reader.certificate)


def write_result(logs: Iterable[BlockLog], path: str | os.PathLike[str], scene: Scene, most: int) -> dict[str, int]:
    """Write the result of logs that together contain each block once; return the number of cells by verdict."""
    # One block is in memory at a time. The first log contains block 0; a cell has at most `most` section points. The
    # ending of `path` chooses the format of the file.
    following = iter(logs)
    first_log = next(following)
    reader = _BlockReader(first_log, scene, most)
    verdicts: dict[str, int] = {}
    # The dataset of the first cell has all variables: it is the template of the file, except the lengths of the axes.
    first = Buffers(*(array[:1] for array in reader.buffers(0).arrays()))
    arrays = reader.variables(np.arange(1), first)
    template = labelled(scene, arrays, (1,) * len(scene.shape), first_log.about["attributes"])
    lengths = dict(zip(dimensions(scene), scene.shape, strict=True))
    with filled(path, template, lengths) as file:
        for name, _, values in swept(scene):
            file.put(name, np.arange(len(values)), values)
        for log in chain((first_log,), following):
            reader = _BlockReader(log, scene, most)
            for block in np.flatnonzero(log.done).tolist():
                rows = reader.layout.rows(block)
                for name, _, values in reader.variables(rows, reader.buffers(block)):
                    file.put(name, rows, values)
                    for verdict, count in _verdicts(name, values):
                        verdicts[verdict] = verdicts.get(verdict, 0) + count
    return verdicts


def verdicts_in(data: xr.Dataset) -> dict[str, int]:
    """Return the number of cells of a result with each verdict, as `write_result` does."""
    return {verdict: count for name, values in data.items() for verdict, count in _verdicts(str(name), values)}


def _verdicts(name: str, values: np.ndarray | xr.DataArray) -> list[tuple[str, int]]:
    """Return the verdicts in a variable of some cells, with their counts."""
    if name == "ended_early":
        return [("ended early", int(np.count_nonzero(values)))]
    if name == "verdict":
        codes, counts = np.unique(values, return_counts=True)
        return [(VERDICTS[code], int(count)) for code, count in zip(codes, counts, strict=True)]
    return []


def partial_path(path: str | os.PathLike[str], part: tuple[int, int] | None = None) -> Path:
    """Return the path of the block log of a run, beside its result: a.partial, or a.3of8.partial of part (3, 8)."""
    path = Path(path).with_suffix(".partial")
    return path if part is None else path.with_name(f"{path.stem}.{part[0]}of{part[1]}.partial")

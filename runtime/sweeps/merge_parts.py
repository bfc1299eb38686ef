"""Merge the parts of a sweep, which separate jobs have run, into the result of the whole sweep."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from synchain.models.inputs.checks import check_flag, check_path
from synchain.models.scenes.scene import Scene

from ..results.block_log import BlockLog, Description
from ..results.labels import scene_of
from ..results.partial import layout_of, part_of, write_result
from ..results.store import form_of
from ..support.execution import Execution
from ..support.files import understood
from ..support.status import CODES
from .stream import Streamed


def merge(
    parts: Iterable[str | os.PathLike[str]], path: str | os.PathLike[str], *, overwrite: bool = False
) -> Streamed:
    """Write the result of a sweep whose parts were run one by one.

    The file is, byte for byte, that of one run of the whole sweep. One block is in memory at a time, one part is open
    at a time, and the parts are kept.

    Parameters
    ----------
    parts : iterable of str or path
        The files ".kofN.partial" of all N parts, in any order (see `stream`).
    path : str or path
        File of the result, whose ending chooses its form: .nc, .nc4 or .zarr.
    overwrite : bool
        Replace what is there already.

    Returns
    -------
    Streamed
        The file, how its cells ended, and their verdicts.

    Raises
    ------
    ValueError
        If a part is missing, occurs twice, is not finished, or belongs to another sweep, another version or
        another kind of processor.
    FileExistsError
        If the result is there and `overwrite` is not given.
    OSError
        If a file cannot be read or written, or another process writes to a part.

    See Also
    --------
    stream : Runs one part with `part=(k, N)`.

    Examples
    --------
    >>> import tempfile
    >>> from synchain import Scene, merge, stream
    >>> from synchain.graphs import chain
    >>> scene = Scene(topology=chain(2), transient=1, window=1, axes={"sigma": [0.0, 0.1, 0.2]})
    >>> folder = tempfile.mkdtemp()
    >>> done = [stream(scene, f"{folder}/map.nc", part=(k, 2), show_progress=False) for k in (1, 2)]
    >>> [part.path.name for part in done]
    ['map.1of2.partial', 'map.2of2.partial']
    >>> merge([part.path for part in done], f"{folder}/map.nc").success
    True
    """
    check_flag("overwrite", overwrite)
    target = check_path("path", path)
    form_of(target).check(target)
    if target.exists() and not overwrite:
        raise FileExistsError(f"{target} is there already; give overwrite (--overwrite) to replace it")
    found = _PartFiles.read([check_path("parts", part) for part in parts])
    reporter = Execution().reporter(found.scene.cells)
    reporter.start(found.counts)
    verdicts = write_result(found.logs(), target, found.scene, found.most)
    return Streamed(target, found.scene, reporter.now, verdicts)


@dataclass(frozen=True, slots=True)
class _PartFiles:
    """The paths of all parts of a sweep in order, and the sums over their logs."""

    paths: tuple[Path, ...]
    scene: Scene
    counts: np.ndarray  # (CODES,): number of cells with each status
    most: int  # largest number of section points of a cell

    @classmethod
    def read(cls, paths: list[Path]) -> _PartFiles:
        """Check that the files are the finished parts of one sweep, each of them once."""
        if not paths:
            raise ValueError("parts: found none; expected the files .kofN.partial of all parts")
        first, ordered = paths[0], dict[int, Path]()
        reference, total, counts, most = "", 0, np.zeros(CODES, dtype=np.int64), 0
        for path in paths:
            BlockLog.expect_idle(path)
            with understood(path):
                about = BlockLog.describe(path)
                part = part_of(about)
                if part is None:
                    raise ValueError(
                        "it holds a whole sweep, not a part of one; finish it with run and resume (--resume)"
                    )
                reference = reference or _text(about)
                if _text(about) != reference:
                    raise ValueError(
                        f"it is no part of the sweep of {first}: {_difference(about, BlockLog.describe(first))}"
                    )
                scene = scene_of(about["attributes"])
                with closing(_finished(path, scene)) as log:
                    counts, most = counts + log.counts, max(most, log.most)
            k, total = part
            if k in ordered:
                raise ValueError(f"found part {k} of {total} twice: {ordered[k]} and {path}; expected it once")
            ordered[k] = path
        missing = [str(k) for k in range(1, total + 1) if k not in ordered]
        if missing:
            names = ", ".join(missing[:10]) + (" …" if len(missing) > 10 else "")
            raise ValueError(
                f"found {len(ordered)} of {total} parts; expected all; run those that are missing: {names}"
            )
        return cls(tuple(ordered[k] for k in sorted(ordered)), scene, counts, most)

    def logs(self) -> Iterator[BlockLog]:
        """Yield the logs in order, beginning with that of block 0; a log is open until the next one is opened."""
        for path in self.paths:
            with closing(_finished(path, self.scene)) as log:
                yield log


def _finished(path: Path, scene: Scene) -> BlockLog:
    """Open the log of a part; raise ValueError if it lacks blocks."""
    log = BlockLog.open(path)
    part = part_of(log.about)
    wanted = layout_of(log.about, scene).part(part)
    done = int(log.done.sum())
    if part is None or not np.array_equal(log.done, wanted):
        log.close()
        raise ValueError(
            f"part {part and part[0]} has {done} of its {int(wanted.sum())} blocks; continue it with run and resume (--resume)"
        )
    return log


def _text(about: Description) -> str:
    """Return the description of a sweep as text for comparison, without the number of the part."""
    part = part_of(about)
    return json.dumps({**about, "part": part and part[1]}, sort_keys=True)


def _difference(about: Description, first: Description) -> str:
    """Return the first difference of two descriptions: found, expected."""
    part, of_first = part_of(about), part_of(first)
    if part is not None and of_first is not None and part[1] != of_first[1]:
        return f"found a sweep in {part[1]} parts; expected {of_first[1]}"
    attributes = first["attributes"]
    for name in ("versions", "processor", "scene", "model", "skipped", "lanes", "kernel"):
        if (value := about["attributes"].get(name)) != attributes.get(name):
            differs = name in ("scene", "model", "kernel")
            return f"its {name} is another" if differs else f"found {name} {value}; expected {attributes.get(name)}"
    return "it has another certificate or other blocks"

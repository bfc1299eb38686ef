"""Open files of results of every kind, from finished and unfinished runs."""

from __future__ import annotations

import json
import os
from importlib import import_module
from pathlib import Path

from synchain.models.inputs.checks import check_path
from synchain.models.inputs.keywords import warn

from ..support.files import understood
from .block_log import is_block_log
from .codec import decode
from .labelled import KIND, VALUE, Labelled
from .labels import changed
from .partial import read_partial
from .result import Result, result_of
from .store import read_data


def open_result(path: str | os.PathLike[str]) -> Labelled:
    """Read the file of a result of any kind, or the finished cells of an unfinished run.

    Parameters
    ----------
    path : str or path
        A file written by `save` of any result or by `stream`, or the file with the ending ".partial" of an unfinished
        run.

    Returns
    -------
    Result, MSF, Thresholds …
        The saved value.  For an unfinished run a `Result` of all cells, in which cells that have not ended have the
        status NOT_RUN.

    Raises
    ------
    OSError, ValueError
        If the file is of another kind or damaged.
    ModuleNotFoundError
        If the file needs a package that is not installed.

    Warns
    -----
    RuntimeWarning
        If the file has no digest, because another program or an earlier version wrote it; damage cannot be detected.
    UserWarning
        If the code of the model has changed since the run: the numbers belong to the former model, the scene to the
        present model.

    See Also
    --------
    synchain.run : Computes a `Result`.
    synchain.stream : Writes a `Result` to a file while it is computed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> import synchain as sc
    >>> file = Path(mkdtemp()) / "result.nc"
    >>> sc.run(sc.Scene("duffing", record=()), show_progress=False).save(file)
    >>> sc.open_result(file).success
    True
    """
    path = check_path("result", path)
    if is_block_log(path):
        return _warned(read_partial(path), path)
    data = read_data(path)
    if KIND not in data.attrs:  # the file of a sweep: the dataset itself is the result
        return _warned(result_of(data, path), path)
    with understood(path):
        tree, kind = json.loads(data.attrs[VALUE]), data.attrs[KIND]
        found = getattr(import_module("synchain.results"), kind, None)
        if not isinstance(found, type) or not issubclass(found, Labelled):
            raise ValueError(f"it holds a {kind}; expected a result")
        return decode(tree, data, found)


def _warned(result: Result, path: Path) -> Result:
    """Return the result, after a warning if the code of its model has changed."""
    if changed(result.data.attrs, result.scene):
        warn(
            f"{path}: the code of its model has changed since it was written: its numbers are those of the former "
            "model, its scene has the equations of the present one; restore the code, or run it again",
            UserWarning,
        )
    return result

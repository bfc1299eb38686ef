"""Opening the files of results of every kind, finished or not."""

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
    """Read the file of a result of any kind, or the cells so far of a run that is not finished.

    Parameters
    ----------
    path : str or path
        A file written by the `save` of any result or by `stream`, or the file ".partial" beside it
        while a run is not finished.

    Returns
    -------
    Result, MSF, Thresholds …
        The value that was saved.  Of an unfinished run all cells; those that have not ended have
        the status NOT_RUN.

    Raises
    ------
    OSError, ValueError
        If the file is none of these or if it is damaged.
    ModuleNotFoundError
        If the file needs a package that is not installed.

    Warns
    -----
    RuntimeWarning
        If the file has no digest because another program or an earlier version wrote it: damage
        cannot be seen.
    UserWarning
        If the code of the model has changed since: the numbers are those of the former model, the
        scene names the present one.

    See Also
    --------
    synchain.run : Computes a `Result`.
    synchain.stream : Writes a `Result` to a file while it is computed.
    """
    path = check_path("result", path)
    if is_block_log(path):
        return _warned(read_partial(path), path)
    data = read_data(path)
    if KIND not in data.attrs:  # the data of a sweep are a result as they are
        return _warned(result_of(data, path), path)
    with understood(path):
        tree, kind = json.loads(data.attrs[VALUE]), data.attrs[KIND]
        return decode(tree, data, _class_of(kind))


def _class_of(kind: str) -> type[Labelled]:
    """Return the result class of a public name of the runtime, which imports its module on first use."""
    found = getattr(import_module("synchain.runtime"), kind, None)
    if not isinstance(found, type) or not issubclass(found, Labelled):
        raise ValueError(f"it holds a {kind}; expected a result")
    return found


def _warned(result: Result, path: Path) -> Result:
    """Return the result, after a warning if the code of its model has changed."""
    if changed(result.data.attrs, result.scene):
        warn(
            f"{path}: the code of its model has changed since it was written: its numbers are those of the former "
            "model, its scene has the equations of the present one; restore the code, or run it again",
            UserWarning,
        )
    return result

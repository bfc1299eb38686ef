"""Opening the files of finished and unfinished results."""

from __future__ import annotations

import os
import warnings

from synchain.models.inputs.checks import check_path

from .block_log import is_block_log
from .labels import changed
from .partial import read_partial
from .result import Result, read_result

__all__ = ["open_result"]


def open_result(path: str | os.PathLike[str]) -> Result:
    """Read the file of a result, or the cells so far of a run that is not finished.

    Parameters
    ----------
    path : str or path
        A file written by `Result.save` or `stream`, or the file ".partial" beside it while a run is
        not finished.

    Returns
    -------
    Result
        All cells; those of an unfinished run that have not ended have the status NOT_RUN.

    Raises
    ------
    OSError, ValueError
        If the file is none of these or if it is damaged.

    Warns
    -----
    RuntimeWarning
        If the file has no digest because another program or an earlier version wrote it: damage
        cannot be seen.
    UserWarning
        If the code of the model has changed since: the numbers are those of the former model, the
        scene names the present one.
    """
    path = check_path("result", path)
    result = read_partial(path) if is_block_log(path) else read_result(path)
    if changed(result.data.attrs, result.scene):
        warnings.warn(
            f"{path}: the code of its model has changed since it was written: its numbers are those of the former model, "
            "its scene has the equations of the present one; restore the code, or run it again",
            UserWarning,
            stacklevel=2,
        )
    return result

"""Opening the files of finished and unfinished results."""

from __future__ import annotations

import os
import warnings

from synchain.models.inputs.checks import a_path

from .labels import changed
from .result import Result, _opened

__all__ = ["open_result"]


def open_result(path: str | os.PathLike[str]) -> Result:
    """Read a file written by `Result.save` or `stream`, or the cells so far of a run that is not finished.

    Raises OSError or ValueError if it is none of these or if it is damaged.  A result without a digest, which another
    program wrote, or an earlier version, is read with a RuntimeWarning: damage of its numbers cannot be seen.  A UserWarning
    says if the code of its model has changed since it was written: the numbers are those of the former model, the scene
    names the present one.
    """
    result = _opened(a_path("result", path))
    if changed(result.data.attrs, result.scene):
        warnings.warn(
            f"{path}: the code of its model has changed since it was written: its numbers are those of the former model, "
            "its scene has the equations of the present one; restore the code, or run it again",
            UserWarning,
            stacklevel=2,
        )
    return result

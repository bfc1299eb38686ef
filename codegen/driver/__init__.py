"""The part of a kernel that is the same for all equations: control of the step size, recording, lanes.

The files are Python that can be read and checked; their text becomes part of every driver.
"""

from __future__ import annotations

import functools
import re
from importlib.resources import files

__all__ = ["MARK", "text", "without_annotations"]

MARK = "# --- kernel text below ---\n"


@functools.cache
def text(name: str, annotated: bool = False) -> str:
    """Return the part of a file that a generated module contains, with its annotations or without."""
    room, _, file = name.partition(".")
    whole = files(__name__.rpartition(".")[0]).joinpath(room, f"{file}.py").read_text(encoding="utf-8")
    part = whole.split(MARK, 1)[1].strip("\n")
    return part if annotated else without_annotations(part)


def without_annotations(part: str) -> str:
    """Return a text without the annotations in the heads of its functions."""
    return re.sub(r"^def .*", lambda head: re.sub(r": \w+(?=[,)])|(?<=\)) -> \w+", "", head[0]), part, flags=re.M)

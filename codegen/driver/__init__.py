"""The part of a kernel that is the same for all equations: control of the step size, recording, lanes.

The files are Python that can be read and checked; their text becomes part of every driver.
"""

from __future__ import annotations

import functools
from importlib.resources import files

__all__ = ["MARK", "text"]

MARK = "# --- kernel text below ---\n"


@functools.cache
def text(name: str) -> str:
    """Return the part of a file that a generated module contains."""
    room, _, file = name.partition(".")
    whole = files(__name__.rpartition(".")[0]).joinpath(room, f"{file}.py").read_text(encoding="utf-8")
    return whole.split(MARK, 1)[1].strip("\n")

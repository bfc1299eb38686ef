"""How much a call does, counted in calls of functions: nearly the same number on every machine, however busy it is."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

__all__ = ["effort"]


def effort(function: Callable[[], Any]) -> tuple[Any, int]:
    """What `function` returns, and how many calls of Python and of C functions it took (imports included)."""
    count = 0

    def note(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before, collecting = sys.getprofile(), gc.isenabled()
    gc.disable()  # what other tests have left is not to be counted
    sys.setprofile(note)
    try:
        result = function()
    finally:
        sys.setprofile(before)
        if collecting:
            gc.enable()
    return result, count

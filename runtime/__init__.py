"""Running scenes: sweeps, thresholds, figures, benchmarks and the command line."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .result import Result, open_result
    from .status import Status
    from .sweep import SweepInterrupted, kernel, run
    from .threshold import Thresholds, thresholds

__all__ = ["Result", "Status", "SweepInterrupted", "Thresholds", "kernel", "open_result", "run", "thresholds"]

_HOME = {
    "Result": "result", "open_result": "result", "SweepInterrupted": "sweep", "kernel": "sweep", "run": "sweep",
    "Status": "status", "Thresholds": "threshold", "thresholds": "threshold",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)

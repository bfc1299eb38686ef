"""Number of threads."""

from __future__ import annotations

import os

from synchain.models.inputs.checks import check_integer


def worker_count(workers: int | None) -> int:
    """Return the number of threads (default: all cores); raise ValueError or TypeError unless it is an integer > 0."""
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return check_integer("workers", workers, 1)

"""How many threads to use."""

from __future__ import annotations

import os

__all__ = ["worker_count"]


def worker_count(workers: int | None) -> int:
    """Number of threads to use; ValueError for less than one."""
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if workers < 1:
        raise ValueError(f"workers = {workers}; expected at least 1")
    return workers

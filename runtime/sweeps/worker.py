"""The worker of a pool that does not share the memory of the main program: it rebuilds jobs and
runs their blocks.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Any

from ..cells.buffers import Buffers
from .job import Job, JobSpec

__all__ = ["forget", "run_block"]

KEPT = 8
"""Jobs that a worker process remembers; an older one is sent to it again."""

_jobs: OrderedDict[str, Job] = OrderedDict()
_lock = threading.Lock()


def run_block(key: str, spec: bytes | None, *block: Any) -> Buffers | None:
    """Run a block of a job.

    Parameters
    ----------
    key : str
        Names the job.
    spec : bytes, optional
        The packed specification, if the worker may not know the job.
    *block
        Arguments of `Job.run`.

    Returns
    -------
    Buffers or None
        None if the worker does not know the job and needs its specification.
    """
    with _lock:
        job = _jobs.get(key)
        if job is None and spec is not None:
            job = _jobs[key] = JobSpec.unpacked(spec).rebuilt()
            while len(_jobs) > KEPT:
                _jobs.popitem(last=False)
    return None if job is None else job.run(*block)


def forget(key: str) -> None:
    """Drop a job of this process; its cells that still run end."""
    with _lock:
        job = _jobs.pop(key, None)
    if job is not None:
        job.cancel()

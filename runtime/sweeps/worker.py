"""Rebuild jobs and run their blocks in a worker that does not share the memory of the main program."""

from __future__ import annotations

import threading
from collections import OrderedDict

from ..cells.buffers import Buffers
from ..engines.job import Job, JobSpec


class JobCache:
    """The last `size` jobs of a process; an older one is sent to it again."""

    def __init__(self, size: int = 8) -> None:
        self.size = size
        self.jobs: OrderedDict[str, Job] = OrderedDict()
        self.lock = threading.Lock()

    def run(self, key: str, spec: bytes | None, *block: object) -> Buffers | None:
        """Run a block of a job; return None if there is neither the job nor its specification."""
        with self.lock:
            job = self.jobs.get(key)
            if job is None and spec is not None:
                job = self.jobs[key] = JobSpec.unpacked(spec).rebuilt()
                while len(self.jobs) > self.size:
                    self.jobs.popitem(last=False)
        return None if job is None else job.run(*block)

    def forget(self, key: str) -> None:
        """Drop a job, and cancel its cells that still run."""
        with self.lock:
            job = self.jobs.pop(key, None)
        if job is not None:
            job.cancel()


_CACHE = JobCache()


def run_block(key: str, spec: bytes | None, *block: object) -> Buffers | None:
    """Run a block of a job in this process; parameters and result as for `JobCache.run`."""
    return _CACHE.run(key, spec, *block)


def forget(key: str) -> None:
    """Drop a job of this process, and cancel its cells that still run."""
    _CACHE.forget(key)

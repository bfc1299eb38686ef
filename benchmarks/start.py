"""What a first use costs: import, derivation, text of the kernel, compilation, and loading from the
cache.

Every row is the time of one stage inside a fresh process; the cache of kernels is a temporary
folder, empty at the first process and filled at the second. The very first scene compiles the
driver, too, which later scenes share. Importing Numba alone is listed for
comparison: it is part of `import`.  The rows of peers that compile are the seconds from the same
equations to the end of a first period, with their modules imported.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from statistics import median

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.orbits import unit_of_time

from . import peers
from .peers.problem import Problem

COLUMNS = ("stage", "oscillators", "seconds")
SIZES = (2, 4)
REPEATS = 5
COMPILING = ("heyoka_batch", "jitcode_lsoda", "numbalsoda_lsoda", "diffrax_kvaerno5")
"""Peers that compile what they integrate."""
STAGES = ("import the models", "derive", "import the runtime", "emit", "load the driver", "load")

CHILD = """
import json, sys, time
marks = [time.perf_counter()]
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
marks.append(time.perf_counter())
scene = Scene(topology=topology("chain", int(sys.argv[1])), axes={"omega": [1.0, 1.2]})
scene.equations
marks.append(time.perf_counter())
from synchain.runtime.engines.scene_kernels import kernel_source
from synchain.codegen.machine_code.compile import load, load_shared
marks.append(time.perf_counter())
source = kernel_source(scene, reduce=False)
marks.append(time.perf_counter())
shared = [load_shared(part) for part in source.shared]
marks.append(time.perf_counter())
compiled = load(source)
marks.append(time.perf_counter())
cached = {made.from_cache for made in (*shared, compiled)}
print(json.dumps([[b - a for a, b in zip(marks, marks[1:])], cached.pop() if len(cached) == 1 else None]))
"""

NUMBA = """
import json, time
begin = time.perf_counter()
import numba
print(json.dumps([[time.perf_counter() - begin], False]))
"""


def notes() -> list[str]:
    """A line for each peer that cannot run here, with the reason and the remedy."""
    return peers.skipped(COMPILING)


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS: medians of five processes, of one
    where `quick`.
    """
    repeats = 1 if quick else REPEATS
    rows: list[tuple[object, ...]] = []
    with tempfile.TemporaryDirectory() as folder:
        alone = [_child(NUMBA, folder)[0][0] for _ in range(repeats)]
        rows.append(("import Numba alone", 0, median(alone)))
    for n in SIZES[:1] if quick else SIZES:
        with tempfile.TemporaryDirectory() as folder:
            cold = stages(n, folder, cached=False)
            warm = [stages(n, folder, cached=True) for _ in range(repeats)]
        rows += [(name, n, median(times[k] for times in warm)) for k, name in enumerate(STAGES[:-2])]
        rows.append(("compile, nothing in the cache", n, cold[-2] + cold[-1]))
        rows.append(("compile, the driver in the cache", n, cold[-1]))
        rows.append(("load from the cache", n, median(times[-2] + times[-1] for times in warm)))
        rows += [(f"compile, {peer}", n, seconds) for peer, seconds in peer_times(n)]
    return rows


def peer_times(n: int) -> list[tuple[str, float]]:
    """Return name and seconds to the end of a first period of each peer that can run."""
    scene = Scene(topology=topology("chain", n))
    end = np.array([unit_of_time(scene)])
    found = []
    for peer in peers.present(COMPILING):
        begin = time.perf_counter()
        peer.prepare(Problem(scene))(*peer.tolerances[0], end)
        found.append((peer.name, time.perf_counter() - begin))
    return found


def stages(n: int, folder: str, cached: bool) -> list[float]:
    """Seconds of each of STAGES in one fresh process; RuntimeError where the kernel was cached
    against expectation.
    """
    times, from_cache = _child(CHILD, folder, str(n))
    if from_cache is not cached:
        found = "in part" if from_cache is None else from_cache
        raise RuntimeError(f"the kernel of {n} oscillators came from the cache: {found}; expected {cached}")
    return times


def _child(code: str, folder: str, *arguments: str) -> tuple[list[float], bool | None]:
    environment = {**os.environ, "SYNCHAIN_CACHE": folder}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"a process that was to be timed failed: {done.stderr.strip()[-500:]}")
    times, from_cache = json.loads(done.stdout.splitlines()[-1])
    return times, from_cache

"""What a first use costs: import, derivation, text of the kernel, compilation, and loading from the
cache.

Every column is the time of one stage inside a fresh process; the cache of kernels is a temporary
folder, empty at the first process and filled at the second. Importing Numba alone is listed for
comparison: it is part of `import`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from statistics import median

__all__ = ["COLUMNS", "SIZES", "measure", "stages"]

COLUMNS = ("stage", "oscillators", "seconds")
SIZES = (2, 4)
REPEATS = 5
STAGES = ("import the models", "derive", "import the runtime", "emit", "load")

CHILD = """
import json, sys, time
marks = [time.perf_counter()]
from synchain.models.scene import Scene
from synchain.models.topology import topology
marks.append(time.perf_counter())
scene = Scene(topology=topology("chain", int(sys.argv[1])), axes={"omega": [1.0, 1.2]})
scene.equations
marks.append(time.perf_counter())
from synchain.runtime.sweep import kernel_source
from synchain.codegen.load import load
marks.append(time.perf_counter())
source = kernel_source(scene, reduce=False)
marks.append(time.perf_counter())
compiled = load(source)
marks.append(time.perf_counter())
print(json.dumps([[b - a for a, b in zip(marks, marks[1:])], compiled.from_cache]))
"""

NUMBA = """
import json, time
begin = time.perf_counter()
import numba
print(json.dumps([[time.perf_counter() - begin], False]))
"""


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
            cold = stages(n, folder, cached=False)
            warm = [stages(n, folder, cached=True) for _ in range(repeats)]
            rows += [(name, n, median(times[k] for times in warm)) for k, name in enumerate(STAGES[:-1])]
            rows.append(("compile, nothing in the cache", n, cold[-1]))
            rows.append(("load from the cache", n, median(times[-1] for times in warm)))
    return rows


def stages(n: int, folder: str, cached: bool) -> list[float]:
    """Seconds of each of STAGES in one fresh process; RuntimeError where the kernel was cached
    against expectation.
    """
    times, from_cache = _child(CHILD, folder, str(n))
    if from_cache is not cached:
        raise RuntimeError(f"the kernel of {n} oscillators came from the cache: {from_cache}; expected {cached}")
    return times


def _child(code: str, folder: str, *arguments: str) -> tuple[list[float], bool]:
    environment = {**os.environ, "SYNCHAIN_CACHE": folder}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"a process that was to be timed failed: {done.stderr.strip()[-500:]}")
    times, from_cache = json.loads(done.stdout.splitlines()[-1])
    return times, from_cache

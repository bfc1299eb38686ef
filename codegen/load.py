"""From the text of a kernel to machine code, through a cache on disk that is named by content.

A module file is named by the hash of its text, of the lane library, of the versions of Python, Numba, llvmlite and
this package, and of the CPU: whatever could change the machine code changes the name.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib.metadata
import logging
import platform
import shutil
import sys
import tempfile
import threading
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types

from synchain.models.equations import Equations

from . import elementary, inner, lane_types, lanes
from .cache import cache_folder, discard, has_code, is_sound, open_folder, seal, write_whole
from .emit import LARGEST_UNROLLED, KernelSource
from .installation import InstallationError
from .sparse import EMPTY, NAMES, program

__all__ = ["Kernel", "load"]

_matrix, _counts = types.float64[:, ::1], types.int64[:, ::1]
_given = types.Array(types.float64, 2, "C", readonly=True)
"""What a kernel only reads may be read-only or not."""
_cube = types.float64[:, :, ::1]


def _signature(arrays: int) -> Any:
    """The types of a sweep kernel's arguments, with so many arrays in its graph."""
    return types.void(
        types.int64, types.int64, _given, _given, _given, types.float64[::1], _matrix, _matrix, _counts, _cube, _cube,
        types.UniTuple(types.int64[::1], arrays), types.float64[::1],
    )  # fmt: skip


SIGNATURE = _signature(len(NAMES))
"""first, last, start, numbers, spans, control, end, sums, counts, points, samples, graph, weights."""
MODES = types.void(
    types.int64, types.int64, _given, _given, _given, types.float64[::1], _given, _cube, _matrix, _matrix, _matrix,
    _counts, _cube,
)  # fmt: skip
"""first, last, start, numbers, spans, control, strengths, vectors, growth, end, sums, counts, samples."""

LOG = logging.getLogger(__name__)
"""Says at the level INFO when something is compiled, which takes seconds."""

_lock = threading.Lock()


@dataclass(frozen=True, slots=True)
class Kernel:
    """A compiled kernel that keeps its text: `print(kernel.source)` shows what runs.

    `entry` is the compiled entry point of the kernel module, `drive` of a sweep and `march` of a kernel that carries modes;
    their arrays are described there.
    """

    origin: KernelSource
    entry: Any = field(repr=False)
    graph: tuple[np.ndarray, ...] = field(repr=False)
    weights: np.ndarray = field(repr=False)
    path: str
    from_cache: bool

    def drive(self, first: int, last: int, *arrays: np.ndarray) -> None:
        """Run the cells first … last-1 on the arrays start, numbers, spans, control, end, sums, counts, points, samples."""
        self.entry(first, last, *arrays, self.graph, self.weights)

    @property
    def source(self) -> str:
        """The whole text of the kernel module."""
        return self.origin.text

    @property
    def digest(self) -> str:
        """SHA-256 of the text."""
        return self.origin.digest

    @property
    def equations(self) -> Equations:
        """What the kernel integrates."""
        return self.origin.equations


def load(source: KernelSource) -> Kernel:
    """Compile a kernel, or load its machine code from the cache.

    Damaged cache files are deleted and the kernel is compiled anew.  Where the cache folder cannot be used, the kernel is
    compiled for this process alone and a RuntimeWarning says why.  Raises InstallationError where Numba does not compile.
    """
    if numba.config.DISABLE_JIT:
        raise InstallationError(
            "Numba: found compilation switched off (NUMBA_DISABLE_JIT); expected it on; unset NUMBA_DISABLE_JIT"
        )
    with _lock:
        return _load(source)


@functools.lru_cache(maxsize=256)
def _load(source: KernelSource) -> Kernel:
    name = f"kernel_{_fingerprint(source)[:32]}"
    try:
        folder = open_folder(cache_folder())
        if not is_sound(folder, name):
            discard(folder, name)
        if not has_code(folder, name):
            _tell(source, "kept for later runs")
        return _kept(source, name, folder)
    except (OSError, RuntimeError) as problem:  # RuntimeError: no home folder
        warnings.warn(f"kernels are not kept on disk: {problem}", RuntimeWarning, stacklevel=3)
    _tell(source, "for this process alone")
    folder = Path(tempfile.mkdtemp(prefix="synchain-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return _compile(source, name, folder)


def _tell(source: KernelSource, how: str) -> None:
    n = source.equations.n
    LOG.info("compiling a kernel for %d oscillator%s (%s), %s", n, "s" * (n != 1), source.integrator, how)


def _kept(source: KernelSource, name: str, folder: Path) -> Kernel:
    """The kernel from the folder, or compiled into it; what cannot be loaded is deleted and compiled anew."""
    try:
        found = _compile(source, name, folder)
    except Exception:
        sys.modules.pop(name, None)
        if not discard(folder, name):
            raise
        found = _compile(source, name, folder)
    if not found.from_cache:
        seal(folder, name)
    return found


def _compile(source: KernelSource, name: str, folder: Path) -> Kernel:
    path = folder / f"{name}.py"
    module = _module(source.text, name, path)
    graph, weights = EMPTY, np.zeros(0)
    if source.kind == "sweep" and source.equations.n > LARGEST_UNROLLED:
        made = program(source.equations)
        graph, weights = made.arrays, made.weights
    entry = module.march if source.kind == "modes" else module.drive
    entry.compile(MODES if source.kind == "modes" else _signature(len(graph)))
    entry.disable_compile()  # arrays of another type are a mistake of ours, not a reason to compile anew
    hits = sum(entry.stats.cache_hits.values())
    return Kernel(source, entry, graph, weights, str(path), hits > 0)


def _module(text: str, name: str, path: Path) -> ModuleType:
    """Write the module file where it is missing, and run its text.

    The text comes from memory, not from the file and not from what Python would keep of it in `__pycache__`; the file is
    there for Numba, which puts machine code beside it, and for readers.
    """
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        write_whole(path, text)
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # before execution: Numba looks its functions up there
    elsewhere, numba.config.CACHE_DIR = numba.config.CACHE_DIR, ""  # code comes from the folder that was checked
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    finally:
        numba.config.CACHE_DIR = elsewhere
    return module


@functools.cache
def _surroundings() -> str:
    """Everything besides the text that the machine code depends on."""
    here = [Path(m.__file__).read_text(encoding="utf-8") for m in (inner, lane_types, lanes, elementary) if m.__file__]
    features = ",".join(f"{k}{int(v)}" for k, v in sorted(llvm.get_host_cpu_features().items()))
    versions = [sys.version, numba.__version__, importlib.metadata.version("llvmlite"), platform.machine()]
    return "\n".join([*here, *versions, llvm.get_host_cpu_name(), features])


def _fingerprint(source: KernelSource) -> str:
    return hashlib.sha256(f"{_surroundings()}\n{source.text}".encode()).hexdigest()

"""From the text of a kernel to machine code, through a cache on disk that is named by content.

A module file is named by the hash of everything that could change the machine code: its text, the
sources of the lanes, the versions of Python, Numba and llvmlite, and the processor.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import importlib.metadata
import logging
import pickle
import platform
import shutil
import sys
import tempfile
import threading
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import numba
import numpy as np
from numba import types
from numba.core.serialize import dumps

from synchain.models.dynamics.equations import Equations

from ..simd import decorator, elementary, lane_types, lanes
from ..steps.names import NAMES
from ..steps.program import EMPTY
from .cache import Folder, cache_folder, open_folder
from .installation import InstallationError
from .processor import processor
from .sweep import KernelKind, KernelSource

__all__ = ["Kernel", "load"]

_matrix, _counts = types.float64[:, ::1], types.int64[:, ::1]
_input = types.Array(types.float64, 2, "C", readonly=True)
"""An array that a kernel only reads; it may be read-only or not."""
_cube = types.float64[:, :, ::1]


def _signature(arrays: int) -> Any:
    """The types of a sweep kernel's arguments, with so many arrays in its graph."""
    inputs = (_input, _input, _input, types.float64[::1])
    outputs = (_matrix, _matrix, _counts, _cube, _cube)
    graph = (types.UniTuple(types.int64[::1], arrays), types.float64[::1])
    return types.void(types.int64, types.int64, *inputs, *outputs, *graph)


SIGNATURE = _signature(len(NAMES))
"""first, last, start, numbers, spans, control, end, sums, counts, points, samples, graph, weights."""
MODES = types.void(
    types.int64,
    types.int64,
    *(_input, _input, _input, types.float64[::1], _input),
    *(_cube, _matrix, _matrix, _matrix, _counts, _cube),
)
"""first, last, start, numbers, spans, control, strengths, vectors, growth, end, sums, counts, samples."""

LOG = logging.getLogger(__name__)
"""Reports at the level INFO each compilation, which takes seconds."""

_lock = threading.Lock()


class EntryPoint(Protocol):
    """The compiled entry point of a kernel module: `drive` of a sweep, `march` of a kernel of modes.

    It runs the cells first … last-1 on arrays that are described in the text of the module.
    """

    def __call__(self, first: int, last: int, /, *arrays: np.ndarray | tuple[np.ndarray, ...]) -> None: ...


@dataclass(frozen=True, slots=True)
class Kernel:
    """A compiled kernel that keeps its text: `print(kernel.source)` shows what runs.

    `graph` and `weights` are the links and the elimination program of a network whose steps are loops.
    """

    origin: KernelSource
    entry: EntryPoint = field(repr=False)
    graph: tuple[np.ndarray, ...] = field(repr=False)
    weights: np.ndarray = field(repr=False)
    path: str
    from_cache: bool

    def drive(self, first: int, last: int, *arrays: np.ndarray) -> None:
        """Run the cells first … last-1 of a sweep.

        Parameters
        ----------
        first, last
            Rows of the arrays to run.
        *arrays
            start, numbers, spans, control, end, sums, counts, points, samples, as the docstring of
            `drive` in the text of the module describes them.
        """
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

    Parameters
    ----------
    source
        The text of the kernel, and what its arrays mean.

    Returns
    -------
    Kernel
        The same object for the same source within a process.

    Raises
    ------
    InstallationError
        If Numba is told not to compile.

    Warns
    -----
    RuntimeWarning
        If the cache folder cannot be used; the kernel is then compiled for this process alone.

    Notes
    -----
    A kernel whose cache file is damaged is compiled anew.
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
        with open_folder(cache_folder()) as folder:
            return _from_folder(source, name, folder)
    except (OSError, RuntimeError) as problem:  # RuntimeError: no home folder
        warnings.warn(f"kernels are not kept on disk: {problem}", RuntimeWarning, stacklevel=3)
    _report(source, "for this process alone")
    path = Path(tempfile.mkdtemp(prefix="synchain-"), f"{name}.py")
    atexit.register(shutil.rmtree, path.parent, ignore_errors=True)
    path.write_text(source.text, encoding="utf-8")
    return _compile(source, path, _MachineCode())


def _report(source: KernelSource, how: str) -> None:
    n = source.equations.n
    LOG.info("compiling a kernel for %d oscillator%s (%s), %s", n, "s" * (n != 1), source.integrator, how)


def _from_folder(source: KernelSource, name: str, folder: Folder) -> Kernel:
    """The kernel from the folder, or compiled into it; what cannot be loaded is compiled anew."""
    path, text = folder.path / f"{name}.py", source.text.encode()
    if folder.read(path.name) != text:
        folder.write(path.name, text)
    if (kernel := _stored(source, name, folder, path)) is not None:
        return kernel
    with folder.turn(name):
        if (kernel := _stored(source, name, folder, path)) is not None:
            return kernel
        _report(source, "kept for later runs")
        code = _MachineCode()
        kernel = _compile(source, path, code)
        folder.keep(name, code.data)
    return kernel


def _stored(source: KernelSource, name: str, folder: Folder, path: Path) -> Kernel | None:
    """The kernel by the machine code in the folder, None if there is none that can be loaded."""
    code = folder.machine_code(name)
    if code is None:
        return None
    try:
        return _compile(source, path, _MachineCode(code))
    except Exception:
        sys.modules.pop(name, None)
        return None


class _MachineCode:
    """Machine code as checked bytes, in place of the files that Numba reads and writes by their paths."""

    def __init__(self, data: bytes = b"") -> None:
        self.data = data

    def load(self, key: Any) -> Any:
        """What was compiled for these types and this processor; None if there is no such code."""
        return pickle.loads(self.data).get(key) if self.data else None

    def save(self, key: Any, compiled: Any) -> None:
        self.data = dumps({key: compiled})


def _compile(source: KernelSource, path: Path, code: _MachineCode) -> Kernel:
    module = _module(source.text, path)
    loops = source.elimination
    graph, weights = (EMPTY, np.zeros(0)) if loops is None else (loops.arrays, loops.weights)
    modes = source.kind is KernelKind.MODES
    entry = module.march if modes else module.drive
    entry._cache._cache_file = code
    entry.compile(MODES if modes else _signature(len(graph)))
    entry.disable_compile()  # arrays of another type are a mistake of ours, not a reason to compile anew
    hits = sum(entry.stats.cache_hits.values())
    return Kernel(source, entry, graph, weights, str(path), hits > 0)


def _module(text: str, path: Path) -> ModuleType:
    """Run the text of a module.

    The text comes from memory, not from the file at `path` and not from `__pycache__`.  The file is
    there for readers, and for Numba, which caches no function without a file.
    """
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    sys.modules[path.stem] = module  # before execution: Numba looks its functions up there
    elsewhere, numba.config.CACHE_DIR = numba.config.CACHE_DIR, ""  # nothing is made in a folder of Numba's own
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    finally:
        numba.config.CACHE_DIR = elsewhere
    return module


@functools.cache
def _surroundings() -> str:
    """Everything besides the text that the machine code depends on."""
    here = [
        Path(m.__file__).read_text(encoding="utf-8") for m in (decorator, lane_types, lanes, elementary) if m.__file__
    ]
    versions = [sys.version, numba.__version__, importlib.metadata.version("llvmlite"), platform.machine()]
    return "\n".join([*here, *versions, processor()])


def _fingerprint(source: KernelSource) -> str:
    return hashlib.sha256(f"{_surroundings()}\n{source.text}".encode()).hexdigest()

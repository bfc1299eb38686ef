"""From the text of a kernel to machine code, through a cache on disk that is named by content.

A module file is named by the hash of its text, of the lane library, of the versions of Python, Numba, llvmlite and
this package, and of the CPU: whatever could change the machine code changes the name.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
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

from . import elementary, lane_types, lanes
from .cache import cache_folder, open_folder
from .emit import LARGEST_UNROLLED, KernelSource
from .sparse import EMPTY, NAMES, program

__all__ = ["Kernel", "load"]

_matrix, _counts = types.float64[:, ::1], types.int64[:, ::1]
_given = types.Array(types.float64, 2, "C", readonly=True)
"""What a kernel only reads may be read-only or not."""
_cube = types.float64[:, :, ::1]
SIGNATURE = types.void(
    types.int64, types.int64, _given, _given, _given, types.float64[::1], _matrix, _matrix, _counts, _cube, _cube,
    types.UniTuple(types.int64[::1], len(NAMES)), types.float64[::1],
)  # fmt: skip
"""first, last, start, numbers, spans, control, end, sums, counts, points, samples, graph, weights."""
MODES = types.void(
    types.int64, types.int64, _given, _given, _given, types.float64[::1], _given, _cube, _matrix, _matrix, _matrix,
    _counts, _cube,
)  # fmt: skip
"""first, last, start, numbers, spans, control, strengths, vectors, growth, end, sums, counts, samples."""

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
    compiled for this process alone and a RuntimeWarning says why.
    """
    with _lock:
        return _load(source)


@functools.lru_cache(maxsize=256)
def _load(source: KernelSource) -> Kernel:
    try:
        folder = open_folder(cache_folder())
    except (OSError, RuntimeError) as problem:  # RuntimeError: no home folder
        warnings.warn(f"kernels are not kept on disk: {problem}", RuntimeWarning, stacklevel=3)
        folder = Path(tempfile.mkdtemp(prefix="synchain-"))
    name = f"kernel_{_fingerprint(source)[:32]}"
    path = folder / f"{name}.py"
    try:
        return _compile(source, name, path)
    except Exception:
        leftovers = [path, *(folder / "__pycache__").glob(f"{name}*")]
        if not any(p.exists() for p in leftovers):
            raise
        for p in leftovers:
            p.unlink(missing_ok=True)
        sys.modules.pop(name, None)
        return _compile(source, name, path)


def _compile(source: KernelSource, name: str, path: Path) -> Kernel:
    module = _module(source.text, name, path)
    entry, signature = (module.march, MODES) if source.kind == "modes" else (module.drive, SIGNATURE)
    entry.compile(signature)
    entry.disable_compile()  # arrays of another type are a mistake of ours, not a reason to compile anew
    hits = sum(entry.stats.cache_hits.values())
    if source.kind == "sweep" and source.equations.n > LARGEST_UNROLLED:
        made = program(source.equations)
        return Kernel(source, entry, made.arrays, made.weights, str(path), hits > 0)
    return Kernel(source, entry, EMPTY, np.zeros(0), str(path), hits > 0)


def _module(text: str, name: str, path: Path) -> ModuleType:
    """Write the module file where it is missing and import it."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=name, suffix=".tmp")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(temporary, path)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot import the kernel module {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # before execution: Numba looks its functions up there
    spec.loader.exec_module(module)
    return module


@functools.cache
def _surroundings() -> str:
    """Everything besides the text that the machine code depends on."""
    here = [Path(m.__file__).read_text(encoding="utf-8") for m in (lane_types, lanes, elementary) if m.__file__]
    features = ",".join(f"{k}{int(v)}" for k, v in sorted(llvm.get_host_cpu_features().items()))
    versions = [sys.version, numba.__version__, importlib.metadata.version("llvmlite"), platform.machine()]
    return "\n".join([*here, *versions, llvm.get_host_cpu_name(), features])


def _fingerprint(source: KernelSource) -> str:
    return hashlib.sha256(f"{_surroundings()}\n{source.text}".encode()).hexdigest()

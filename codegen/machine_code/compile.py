"""Compile the text of a kernel to machine code, with a cache on disk whose files are named by content.

The functions of a scene form one module.  The driver and the recorders are further modules, which scenes share.  Scenes
whose functions have the same text also share the first module: looped steps have one text for all graphs of a size.
A module passes these stages once per process (compilation once per cache folder):

1. `_fingerprint` hashes everything that machine code depends on (text, sources of lanes and front end, versions, flags of Numba,
   processor) to the name of the module.
2. `_module` opens the cache folder (`code_cache.py`); if it cannot be used, the module is compiled for this process alone.
3. `_from_folder` loads the machine code, or waits for another process that compiles it, or compiles and stores it.
4. `_compile` executes the text and compiles its functions for the types of `signatures.py`, or rebuilds them from stored code.
5. `_kernel` puts the addresses of the functions of a scene into the table that its driver takes (`function_table.py`).
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import logging
import os
import pickle
import platform
import sys
import threading
from collections import ChainMap
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol
from weakref import WeakValueDictionary

import numba
import numpy as np
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn

from ..driver import dimensions, records
from ..front_end import decorator, syntax_trees
from ..kernels.driver import Driver, Recorder
from ..kernels.kernel_text import KernelSource
from ..simd import lane_types
from ..simd.lane_types import has_fma
from . import function_table
from .code_cache import Folder, cache_folder, open_folder
from .function_table import Functions
from .installation import InstallationError
from .processor import processor
from .signatures import recorder_signatures, signatures

LOG = logging.getLogger(__name__)  # reports at the level INFO each compilation, which takes seconds
# Held while a kernel is loaded or compiled. A fork waits for the lock: no child starts during a compilation.
_lock = threading.RLock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release)


class EntryPoint(Protocol):
    """The compiled entry point of a driver: `drive` of a sweep, `march` of a kernel of modes."""

    # Its text describes its arguments: the functions of a scene, sizes, cells and arrays.

    def __call__(self, /, *arguments: Any) -> None: ...


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Compiled:
    functions: dict[str, Any]  # by name
    path: str  # file with the text; a name in the folder `<memory>` if the text is not on disk
    from_cache: bool  # True if the machine code was loaded from the cache, False if it was compiled
    problem: str = ""  # reason why the machine code is not stored on disk; empty if it is stored


@dataclass(frozen=True, eq=False)
class Kernel:
    """The compiled functions of a scene, and the driver that runs them; `print(kernel.source)` shows the functions."""

    origin: KernelSource
    compiled: Compiled = field(repr=False)
    driver: Compiled = field(repr=False)
    scene_arguments: tuple[Any, ...] = field(repr=False)  # of the driver: functions, sizes, links

    def __repr__(self) -> str:
        return f"Kernel({self.origin.equations.n} nodes, {self.origin.method.name}, {self.origin.driver})"

    @functools.cached_property
    def entry(self) -> EntryPoint:
        """The function of the driver that runs cells."""
        function: EntryPoint = self.driver.functions[self.origin.driver.entry]
        return function

    @property
    def path(self) -> str:
        """The file that holds the code of the functions of the scene."""
        return self.compiled.path

    @property
    def from_cache(self) -> bool:
        """True if the functions of the scene were loaded from the cache; see `driver.from_cache` for the driver."""
        return self.compiled.from_cache

    def drive(self, first: int, last: int, *arrays: np.ndarray) -> None:
        """Run the cells first … last-1."""
        # Numba finds the types of few tuples faster than those of many arrays
        self.entry(*self.scene_arguments, first, last, *self.origin.driver.grouped(arrays))

    @property
    def source(self) -> str:
        """The text of the functions of the scene; `kernel.origin.driver.text` is the text of the driver."""
        return self.origin.text

    @property
    def digest(self) -> str:
        return self.origin.digest

    @property
    def equations(self) -> Equations:
        return self.origin.equations


# -- kernels of this process -------------------------------------------------------------------------------------

# The kernels of this process that are in use.
_kernels: WeakValueDictionary[KernelSource, Kernel] = WeakValueDictionary()
# The functions of scenes that are in use, by their code.
_modules: WeakValueDictionary[str, Compiled] = WeakValueDictionary()


def load(source: KernelSource) -> Kernel:
    """Compile a kernel, or load its machine code from the cache."""
    # A kernel whose cache file is damaged is compiled anew.
    _check_numba()
    return _load(source)


def load_shared(part: Driver | Recorder) -> Compiled:
    """Compile a driver or a recorder, or load its machine code from the cache."""
    _check_numba()
    with _lock:
        return _shared(part)


def forget() -> None:
    """Forget the kernels and drivers of this process; the next `load` reads the cache folder."""
    # Kernels and drivers that are not in use are freed.
    with _lock:
        _load.cache_clear()
        _shared.cache_clear()
        _kernels.clear()
        _modules.clear()


def _check_numba() -> None:
    if numba.config.DISABLE_JIT:
        raise InstallationError(
            "Numba: found compilation switched off (NUMBA_DISABLE_JIT); expected it on; unset NUMBA_DISABLE_JIT"
        )


@functools.lru_cache(maxsize=16)  # the last kernels stay loaded, for functions that run one scene again and again
def _load(source: KernelSource) -> Kernel:
    with _lock:  # inside the cached function, so that a call for a loaded kernel never waits
        kernel = _kernels.get(source)
        if kernel is None:
            kernel = _kernels[source] = _kernel(source)
            if problem := kernel.compiled.problem or kernel.driver.problem:
                warn(f"kernels are not kept on disk: {problem}")
            # Warn, once per process, of settings that slow down compilation or kernels.
            if decorator.front_end_problems:
                _warn_once(
                    "kernels: found a fault of the front end; expected none; Numba's own pipeline compiles with the same results "
                    f"in 2 to 4 times the time ({decorator.front_end_problems[0]})"
                )
            if not has_fma():
                _warn_once(
                    f"kernels: found a processor without fused multiply-add ({processor().partition(':')[0]}); expected one; they take "
                    "up to twice the time and round otherwise; unset NUMBA_CPU_NAME and NUMBA_CPU_FEATURES if they are set"
                )
        return kernel


_warn_once = functools.cache(warn)


@functools.cache  # a process needs few drivers and recorders, and keeps them
def _shared(part: Driver | Recorder) -> Compiled:
    available = signatures(part) if isinstance(part, Driver) else recorder_signatures(part.width)
    return _module(part.text, "driver", {part.entry: available[part.entry]}, f"the {part}")


def _kernel(source: KernelSource) -> Kernel:
    available = signatures(source.driver)
    driver, *recorders = map(_shared, source.shared)
    compiled = _modules.get(source.code)
    if compiled is None:
        n = source.equations.n
        description = f"a kernel for {n} oscillator{'s' * (n != 1)} ({source.integrator})"
        wanted = {name: available[name] for name in source.functions}
        compiled = _modules[source.code] = _module(source.code, "kernel", wanted, description)
    # The driver takes the functions of the scene and the recorders; None stands for a function that it does not call.
    by_name = ChainMap(compiled.functions, *(recorder.functions for recorder in recorders))
    table = Functions(available[source.driver.entry].args[0], [by_name.get(name) for name in source.driver.functions])
    return Kernel(source, compiled, driver, (table, *source.arguments))


# -- modules: loaded from the folder, or compiled into it --------------------------------------------------------


def _module(text: str, kind: str, wanted: dict[str, Any], description: str) -> Compiled:
    """Load or compile the functions `wanted`, with their types, of a text."""
    name = f"{kind}_{_fingerprint(text)[:32]}"
    try:
        with open_folder(cache_folder()) as folder:
            return _from_folder(text, name, wanted, description, folder)
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder
        problem = str(error)
    LOG.info("compiling %s, for this process alone", description)
    module, _ = _compile(text, Path("<memory>", f"{name}.py"), wanted)
    return replace(module, problem=problem)


def _from_folder(text: str, name: str, wanted: dict[str, Any], description: str, folder: Folder) -> Compiled:
    # The text is there for readers; it is written again if it was changed.
    path, content, problem = folder.path / f"{name}.py", text.encode(), ""
    try:
        if folder.read_trusted(path.name) != content:
            folder.write(path.name, content)
    except OSError as error:  # a folder that can only be read
        problem = str(error)
    if (module := _stored(text, name, wanted, folder, path)) is not None:
        return module
    with folder.locked(name):
        # Another process may have compiled the module meanwhile.
        if (module := _stored(text, name, wanted, folder, path)) is not None:
            return module
        LOG.info("compiling %s, kept for later runs", description)
        module, code = _compile(text, path, wanted)
        try:
            folder.store_code(name, dumps(code))
        except OSError as error:
            problem = problem or str(error)
    return replace(module, problem=problem)


def _stored(text: str, name: str, wanted: dict[str, Any], folder: Folder, path: Path) -> Compiled | None:
    """Load the functions from machine code in the folder; return None if there is none, or if it cannot be loaded."""
    stored = folder.load_code(name)
    if stored is None:
        return None
    try:
        return _compile(text, path, wanted, stored)[0]
    except Exception:
        return None


@dataclass(frozen=True, slots=True)
class _FunctionCache:
    """The cache of one function, with the interface that Numba's dispatcher expects, in the code of its module."""

    # Numba's own cache reads and writes files by their paths, unsigned.

    code: dict[Any, Any]  # compiled functions in the form that can be pickled, by name, types and processor
    name: str
    cache_path: None = None

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the compiled function; None if there is no code for these types and this processor."""
        target.refresh()
        reduced = self.code.get((self.name, signature, target.codegen().magic_tuple()))
        return None if reduced is None else CompileResult._rebuild(target, *reduced)

    def save_overload(self, signature: Any, compiled: Any) -> None:
        self.code[self.name, signature, compiled.codegen.magic_tuple()] = compiled._reduce()


def _compile(text: str, path: Path, wanted: dict[str, Any], stored: bytes = b"") -> tuple[Compiled, dict[Any, Any]]:
    """Compile functions of a module, or rebuild them from stored machine code; return them and their code."""
    # The text comes from memory, not from the file at `path` and not from `__pycache__`.
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    sys.modules[path.stem] = module  # Numba and pickle look the functions up there
    try:
        syntax_trees.execute(text, str(path), module.__dict__)
        code = dict(pickle.loads(stored)) if stored else {}
        functions = {name: getattr(module, name) for name in wanted}
        for name, function in functions.items():
            function._cache = _FunctionCache(code, name)
            function.compile(wanted[name])
            function.disable_compile()  # raise for arguments of other types instead of compiling again
    finally:
        del sys.modules[path.stem]
        for name in vars(module).keys() - {"__name__"}:  # Numba never frees a function that its module refers to
            delattr(module, name)
    hits = all(sum(function.stats.cache_hits.values()) for function in functions.values())
    return Compiled(functions, str(path), hits), code


# -- the names of modules ----------------------------------------------------------------------------------------

# The source files whose code becomes a part of machine code, besides the text of the module.
SOURCES = [
    *sorted(path for file in (decorator.__file__, lane_types.__file__) for path in Path(file).parent.glob("*.py")),
    Path(dimensions.__file__),
    Path(records.__file__),
    Path(function_table.__file__),
]

# Settings of Numba (NUMBA_OPT … in the environment) that change machine code; `processor` has the others.
FLAGS = (
    "BOUNDSCHECK", "DEBUG_JIT", "DEBUG_NRT", "DEBUG_NRT_STACK_LIMIT", "DEBUGINFO_DEFAULT", "DISABLE_INTEL_SVML",
    "ENABLE_PROFILING", "EXTEND_VARIABLE_LIFETIMES", "LLVM_REFPRUNE_FLAGS", "LLVM_REFPRUNE_PASS", "LOOP_VECTORIZE", "OPT", "SLP_VECTORIZE",
)  # fmt: skip


@functools.cache
def _sources() -> str:
    """Return the part of a fingerprint that is the same for all texts: sources and versions."""
    versions = [sys.version, numba.__version__, importlib.metadata.version("llvmlite"), platform.machine()]
    return "\n".join([*(path.read_text(encoding="utf-8") for path in SOURCES), *versions])


def _fingerprint(text: str) -> str:
    """Return the hash of everything that machine code depends on."""
    flags = [f"{name}={getattr(numba.config, name, None)!r}" for name in FLAGS]
    choices = [processor(), *flags, f"front end {decorator.uses_front_end()}"]
    return hashlib.sha256("\n".join([_sources(), *choices, text]).encode()).hexdigest()

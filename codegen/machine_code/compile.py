"""From the text of a kernel to machine code, through a cache on disk that is named by content.

The functions of a scene are one module; the driver that runs them and the functions that record are others, which
scenes share.  Scenes of one code share the first module too: kernels of loops are alike for all graphs of a size.  A
module file is named by the hash of everything that could change the machine code: its code, the sources of the lanes,
the versions of Python, Numba and llvmlite, and the processor.
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
from numba import types
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn

from ..driver import dimensions, records
from ..driver.dimensions import Dimensions, ModeDimensions
from ..driver.records import Step
from ..front_end import decorator, syntax_trees
from ..kernels.driver import Driver, KernelKind, Recorder
from ..kernels.kernel_text import KernelSource
from ..simd import lane_types
from ..simd.addresses import ADDRESS
from ..simd.lane_types import Lane, Mask, has_fma
from ..steps.safe_names import NAMES
from . import function_table
from .cache import Folder, cache_folder, open_folder
from .function_table import Functions, FunctionsType
from .installation import InstallationError
from .processor import processor

_vector, _matrix, _counts = types.float64[::1], types.float64[:, ::1], types.int64[:, ::1]
_cube = types.float64[:, :, ::1]
_input = types.Array(types.float64, 2, "C", readonly=True)
"""An array that a kernel only reads; it may be read-only or not."""
_graph = (types.UniTuple(types.int64[::1], len(NAMES)), _vector)
"""The links and the elimination program of a network of loops, and the weights of its links."""


def _sizes(kind: type[Dimensions] | type[ModeDimensions]) -> Any:
    """The type of the sizes that a driver is told."""
    return types.NamedUniTuple(types.int64, len(kind._fields), kind)


def _recorded(width: int) -> dict[str, Any]:
    """The types of the functions that record, and of those of a scene that these call, by name."""
    lane, mask, sizes = Lane(width), Mask(width), _sizes(Dimensions)
    values = types.void(lane, lane, lane, *[ADDRESS] * 4, types.UniTuple(types.int64, 2))
    called, cells = types.FunctionType(values), types.int64[::1]
    step = types.NamedTuple((lane, lane, *[ADDRESS] * 3), Step)
    return {
        "section": values,
        "values": values,
        "halt": lane(mask, step, *[ADDRESS] * 3, _matrix, sizes, called),
        "observe": types.void(mask, mask, step, *[ADDRESS] * 3, sizes),
        "cut": types.void(mask, step, ADDRESS, cells, _counts, _cube, ADDRESS, _matrix, sizes, called),
        "tally": types.void(types.int64, step, ADDRESS, cells, _matrix, ADDRESS, _matrix, sizes, called),
        "sample": types.void(types.int64, lane, step, ADDRESS, cells, _input, _cube, sizes),
    }


def signatures(driver: Driver) -> dict[str, Any]:
    """Return the types of the functions that a driver takes, and that of its own entry, by name."""
    more = _graph if driver.looped else ()
    if driver.kind is KernelKind.MODES:
        one = Lane(1)
        times = (one, one, one) if driver.series else (one, one)
        orbit = types.UniTuple(one, 2) if driver.series else one
        registers = [types.int64] * (1 if driver.series else 2)
        known = {
            "step": orbit(*times, *[ADDRESS] * 4, types.float64, types.float64, ADDRESS),
            "carry": types.float64(*[ADDRESS] * 4, *registers, types.float64),
            "pushes": types.void(one, *[ADDRESS] * 3),
            "release": types.void(types.int64, *[types.float64] * 2, *[ADDRESS] * 3, types.int64),
        }
        to_strengths = (types.int64[::1], _matrix, _matrix, _vector, _matrix, _cube, _vector)
        propagation = (*to_strengths, _matrix, _vector, _vector, _cube)
        arrays: tuple[Any, ...] = ((_input, _cube, _matrix), (_matrix, _matrix, _counts), propagation)
        own: tuple[Any, ...] = (_sizes(ModeDimensions), types.int64[::1])
    else:
        lane = Lane(driver.width)
        times = (lane, lane, lane) if driver.series else (lane, lane)
        result = types.UniTuple(lane, 2) if driver.series else lane
        step = result(*times, *[ADDRESS] * 4, types.float64, types.float64, *more)
        pushes = types.void(lane, *[ADDRESS] * 3, *more)
        known = {"step": step, "pushes": pushes, **_recorded(driver.width)}
        arrays = ((_matrix, _matrix, _counts, _cube, _cube, _matrix),)
        own = (_sizes(Dimensions), _vector, _matrix, types.Tuple(more))
    functions = FunctionsType({name: known[name] for name in driver.functions})
    tuples = (types.Tuple(kinds) for kinds in ((*[_input] * 3, _vector), *arrays))
    return {**known, driver.entry: types.void(functions, *own, types.int64, types.int64, *tuples)}


LOG = logging.getLogger(__name__)
"""Reports at the level INFO each compilation, which takes seconds."""

_lock = threading.RLock()
"""Held while a kernel is loaded or compiled.  A fork waits for it, so that no child begins amid a compilation."""
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_lock.acquire, after_in_parent=_lock.release, after_in_child=_lock.release)

_held: WeakValueDictionary[KernelSource, Kernel] = WeakValueDictionary()
"""The kernels of this process that somebody holds."""

_modules: WeakValueDictionary[str, Compiled] = WeakValueDictionary()
"""The functions of scenes that somebody holds, by their code."""


class EntryPoint(Protocol):
    """The compiled entry point of a driver: `drive` of a sweep, `march` of a kernel of modes.

    It takes the functions of a scene and runs cells on arrays that are described in its text.
    """

    def __call__(self, /, *arguments: Any) -> None: ...


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Compiled:
    """The compiled functions of one module."""

    functions: dict[str, Any]  # the functions by name
    path: str  # the file that holds the text; one of a folder `<memory>` if it is kept nowhere
    from_cache: bool  # True if the machine code was loaded from the cache, False if it was compiled
    problem: str = ""  # why the machine code is not kept on disk; empty if it is


@dataclass(frozen=True, eq=False)
class Kernel:
    """The compiled functions of a scene and the driver that runs them: `print(kernel.source)` shows them as text.

    `own` are the arguments of the driver that belong to the scene: its functions, sizes and links.
    """

    origin: KernelSource
    compiled: Compiled = field(repr=False)
    driver: Compiled = field(repr=False)
    own: tuple[Any, ...] = field(repr=False)

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
        """True if the functions of the scene were loaded from the cache; `driver.from_cache` says so of the driver."""
        return self.compiled.from_cache

    def drive(self, first: int, last: int, *arrays: np.ndarray) -> None:
        """Run the cells first … last-1."""
        # Numba finds the types of few tuples faster than those of many arrays
        self.entry(*self.own, first, last, *self.origin.driver.grouped(arrays))

    @property
    def source(self) -> str:
        """The text of the functions of the scene; `kernel.origin.driver.text` is what runs them."""
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

    Notes
    -----
    A kernel whose cache file is damaged is compiled anew.
    """
    _check_numba()
    return _load(source)


def load_shared(part: Driver | Recorder) -> Compiled:
    """Compile a driver or a recorder, or load its machine code from the cache."""
    _check_numba()
    with _lock:
        return _shared(part)


def forget() -> None:
    """Forget the kernels and drivers of this process: the next `load` takes them from the cache folder.

    What nobody holds is freed.
    """
    with _lock:
        _load.cache_clear()
        _shared.cache_clear()
        _held.clear()
        _modules.clear()


def _check_numba() -> None:
    if numba.config.DISABLE_JIT:
        raise InstallationError(
            "Numba: found compilation switched off (NUMBA_DISABLE_JIT); expected it on; unset NUMBA_DISABLE_JIT"
        )


@functools.lru_cache(maxsize=16)
def _load(source: KernelSource) -> Kernel:
    """The kernel; the last ones that were asked for are kept, others are freed when nobody holds them."""
    with _lock:  # not around the call: a loaded kernel waits for no compilation
        kernel = _held.get(source)
        if kernel is None:
            kernel = _held[source] = _kernel(source)
            if problem := kernel.compiled.problem or kernel.driver.problem:
                warn(f"kernels are not kept on disk: {problem}")
            _warn_of_slowness()
        return kernel


_warn_once = functools.cache(warn)


def _warn_of_slowness() -> None:
    """Warn, once a process, of what makes compilation or kernels slow."""
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


@functools.cache
def _shared(part: Driver | Recorder) -> Compiled:
    """The driver or the recorder; a process needs few, and keeps them."""
    known = signatures(part) if isinstance(part, Driver) else _recorded(part.width)
    return _module(part.text, "driver", {part.entry: known[part.entry]}, f"the {part}")


def _kernel(source: KernelSource) -> Kernel:
    known = signatures(source.driver)
    driver, *recorders = map(_shared, source.shared)
    compiled = _modules.get(source.code)
    if compiled is None:
        wanted = {name: known[name] for name in source.functions}
        compiled = _modules[source.code] = _module(source.code, "kernel", wanted, _what(source))
    found = ChainMap(compiled.functions, *(r.functions for r in recorders))
    functions = Functions(known[source.driver.entry].args[0], [found.get(name) for name in source.driver.functions])
    return Kernel(source, compiled, driver, (functions, *source.arguments))


def _what(source: KernelSource) -> str:
    n = source.equations.n
    return f"a kernel for {n} oscillator{'s' * (n != 1)} ({source.integrator})"


def _module(text: str, kind: str, wanted: dict[str, Any], what: str) -> Compiled:
    """The functions `wanted`, with their types, of a text; from the folder, or compiled into it."""
    name = f"{kind}_{_fingerprint(text)[:32]}"
    try:
        with open_folder(cache_folder()) as folder:
            return _from_folder(text, name, wanted, what, folder)
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder
        problem = str(error)
    LOG.info("compiling %s, for this process alone", what)
    return replace(_compile(text, Path("<memory>", f"{name}.py"), wanted, _MachineCode()), problem=problem)


def _from_folder(text: str, name: str, wanted: dict[str, Any], what: str, folder: Folder) -> Compiled:
    """The functions from the folder, or compiled into it; what cannot be loaded is compiled anew."""
    path, written, problem = folder.path / f"{name}.py", text.encode(), ""
    try:
        if folder.trusted(path.name) != written:
            folder.write(path.name, written)
    except OSError as error:  # a folder that can only be read
        problem = str(error)
    if (module := _stored(text, name, wanted, folder, path)) is not None:
        return module
    with folder.turn(name):
        if (module := _stored(text, name, wanted, folder, path)) is not None:
            return module
        LOG.info("compiling %s, kept for later runs", what)
        code = _MachineCode()
        module = _compile(text, path, wanted, code)
        try:
            folder.keep(name, code.data)
        except OSError as error:
            problem = problem or str(error)
    return replace(module, problem=problem)


def _stored(text: str, name: str, wanted: dict[str, Any], folder: Folder, path: Path) -> Compiled | None:
    """The functions by the machine code in the folder, None if there is none that can be loaded."""
    code = folder.machine_code(name)
    if code is None:
        return None
    try:
        return _compile(text, path, wanted, _MachineCode(code))
    except Exception:
        return None


class _MachineCode:
    """The machine code of a module as checked bytes, in place of the files that Numba reads and writes by their paths."""

    def __init__(self, stored: bytes = b"") -> None:
        self.stored = stored

    @functools.cached_property
    def compiled(self) -> dict[Any, Any]:
        """What was compiled, by function, types and processor; it can be read while its module is known to Python."""
        return dict(pickle.loads(self.stored)) if self.stored else {}

    @property
    def data(self) -> bytes:
        """All of it as bytes."""
        return dumps(self.compiled)


@dataclass(frozen=True, slots=True)
class _FunctionCache:
    """What Numba asks of the cache of a function: machine code is loaded from a module's and saved to it."""

    code: _MachineCode
    name: str
    cache_path: None = None

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled function; None if there is no code for these types and this processor."""
        target.refresh()
        found = self.code.compiled.get((self.name, signature, target.codegen().magic_tuple()))
        return None if found is None else CompileResult._rebuild(target, *found)

    def save_overload(self, signature: Any, compiled: Any) -> None:
        self.code.compiled[self.name, signature, compiled.codegen.magic_tuple()] = compiled._reduce()


def _compile(text: str, path: Path, wanted: dict[str, Any], code: _MachineCode) -> Compiled:
    """Compile the functions `wanted` of a module.

    The text comes from memory, not from the file at `path` and not from `__pycache__`.  The file is there for readers.
    """
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    sys.modules[path.stem] = module  # Numba looks its functions up there
    try:
        syntax_trees.execute(text, str(path), module.__dict__)
        functions = {name: getattr(module, name) for name in wanted}
        for name, function in functions.items():
            function._cache = _FunctionCache(code, name)
            function.compile(wanted[name])
            function.disable_compile()  # arrays of another type are a mistake of ours, not a reason to compile anew
    finally:
        del sys.modules[path.stem]
        for name in vars(module).keys() - {"__name__"}:  # Numba never frees a function that its module names
            delattr(module, name)
    hits = all(sum(function.stats.cache_hits.values()) for function in functions.values())
    return Compiled(functions, str(path), hits)


SOURCES = [
    *sorted(path for file in (decorator.__file__, lane_types.__file__) for path in Path(file).parent.glob("*.py")),
    Path(dimensions.__file__),
    Path(records.__file__),
    Path(function_table.__file__),
]
"""The files, besides the text of a module, whose code is in its machine code."""

FLAGS = (
    "BOUNDSCHECK", "DEBUG_JIT", "DEBUG_NRT", "DEBUG_NRT_STACK_LIMIT", "DEBUGINFO_DEFAULT", "DISABLE_INTEL_SVML",
    "ENABLE_PROFILING", "EXTEND_VARIABLE_LIFETIMES", "LLVM_REFPRUNE_FLAGS", "LLVM_REFPRUNE_PASS", "LOOP_VECTORIZE", "OPT", "SLP_VECTORIZE",
)  # fmt: skip
"""What Numba reads from the environment (NUMBA_OPT …) that changes machine code; `processor` has the rest."""


@functools.cache
def _sources() -> str:
    """The code besides the text of a module that its machine code depends on, and who makes machine code of it."""
    versions = [sys.version, numba.__version__, importlib.metadata.version("llvmlite"), platform.machine()]
    return "\n".join([*(path.read_text(encoding="utf-8") for path in SOURCES), *versions])


def _fingerprint(text: str) -> str:
    """The hash of everything that machine code depends on."""
    flags = [f"{name}={getattr(numba.config, name, None)!r}" for name in FLAGS]
    choices = [processor(), *flags, f"front end {decorator.uses_front_end()}"]
    return hashlib.sha256("\n".join([_sources(), *choices, text]).encode()).hexdigest()

"""The decorator of the functions of a kernel: Numba's, without what nobody calls."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba import types
from numba.core import base
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import InlineOverloads, NativeLowering, NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes, InlineInlinables, WithLifting

__all__ = ["njit", "resolved_once"]


class _Linked(JITCodeLibrary):
    """LLVM code of a function that only others of its module call: they link it, and it is optimised with them.

    Numba optimises a function and makes machine code of it before it links it into those that call it, and there it does
    so again.  Nothing calls this machine code, so all of it waits for the entry point.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Finish the code; there is no machine code to point to."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _Linked:
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing; only machine code has a place for objects of Python."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _LinkedLowering(NativeLowering):
    """Lowering into a `_Linked` library."""

    _name = "linked_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class _Compiler(CompilerBase):
    """Numba's compiler without the passes for what kernels have none of."""

    unused = (InlineClosureLikes, InlineInlinables, InlineOverloads, NopythonRewrites, WithLifting)
    """Closures, functions that are inlined by Numba, expressions of whole arrays, `with`."""

    def define_pipelines(self) -> list[PassManager]:
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [(self.instead(p), why) for p, why in manager.passes if p not in self.unused]
        manager.finalize()
        return [manager]

    @staticmethod
    def instead(one: type) -> type:
        """Return the pass that stands in the place of one of Numba's."""
        return one


class _LinkedCompiler(_Compiler):
    """The compiler with that lowering."""

    @staticmethod
    def instead(one: type) -> type:
        return _LinkedLowering if one is NativeLowering else one


ENTRY = {"pipeline_class": _Compiler}
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _LinkedCompiler}


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)`; a function that is not cached is no entry point, and cannot be called from Python.

    A kernel has some eighty functions and one entry point; wrappers and machine code of them all are half of its compilation.
    """
    return numba.njit(**{**options, **(ENTRY if options.get("cache") else INNER)})


@contextmanager
def resolved_once() -> Iterator[None]:
    """Let Numba find out once, not for each line, what an operator means for operands of given types.

    A kernel adds and multiplies lanes thousands of times; a fifth of its compilation went over the same dozen operators.
    Only one thread may be within.
    """
    resolve, has_loc = types.Function.get_call_type, base._has_loc
    known: dict[Any, Any] = {}

    def remembered(function: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return resolve(function, context, args, kws)
        key = function, tuple(args)
        if key not in known:
            known[key] = resolve(function, context, args, kws)
        return known[key]

    types.Function.get_call_type, base._has_loc = remembered, functools.cache(has_loc)
    try:
        yield
    finally:
        types.Function.get_call_type, base._has_loc = resolve, has_loc

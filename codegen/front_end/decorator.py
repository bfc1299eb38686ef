"""`njit` for kernel functions: no Python wrapper, and no machine code for functions that only kernels call."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numba
from numba.core.compiler import Compiler

# Reasons for which Numba's own pipeline compiled functions of this process, one per function.
front_end_problems: list[str] = []


def uses_front_end() -> bool:
    """Return False if SYNCHAIN_FRONT_END chooses Numba's own pipeline."""
    # Raises ValueError if SYNCHAIN_FRONT_END is neither empty nor "numba".
    choice = os.environ.get("SYNCHAIN_FRONT_END", "")
    if choice not in ("", "numba"):
        raise ValueError(f"SYNCHAIN_FRONT_END: found {choice!r}; expected 'numba' or nothing; unset it")
    return not choice


class _Compiler(Compiler):
    """Compiler of entry points: the front end, or Numba's own pipeline if the front end raises."""

    inner = False  # True: only kernels call the function, and link its LLVM code
    noinline = False  # True: LLVM must not inline the function into its callers

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.arguments = arguments

    def compile_extra(self, func: Any) -> Any:
        problem = ""
        if uses_front_end():
            try:
                from . import compiler  # here, because the import itself fails if Numba has renamed something

                return compiler.FrontEnd(*self.arguments, inner=self.inner, noinline=self.noinline).compile_extra(func)
            except Exception as error:  # another version of Numba may raise anything
                problem = f"{func.__name__}: {type(error).__name__}: {' '.join(str(error).split())}"
        # A faulty function fails here too, with Numba's message, and is not recorded as a problem of the front end.
        compiled = super().compile_extra(func)
        if problem:
            front_end_problems.append(problem)
        return compiled


class _InnerCompiler(_Compiler):
    inner = True


class _NoInlineCompiler(_InnerCompiler):
    noinline = True


def njit(*, cache: bool = False, separate: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)` with the compiler of kernel functions.

    Without `cache`, only kernels can call the function, not Python.  A kernel has some eighty functions and one entry
    point; wrappers and machine code of them all would be half of its compilation.

    Parameters
    ----------
    cache : bool
        Mark an entry point, whose machine code `machine_code.compile` keeps; Numba's own cache is not used.
    separate : bool
        Keep LLVM from inlining an inner function with many callers.
    **options
        Options of `numba.njit`.

    Examples
    --------
    >>> from synchain.codegen.simd import njit
    >>> @njit(cache=True, error_model="numpy")
    ... def double(x):
    ...     return 2.0 * x
    """
    if cache:
        return numba.njit(pipeline_class=_Compiler, **options)
    compiler = _NoInlineCompiler if separate else _InnerCompiler
    return numba.njit(pipeline_class=compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)

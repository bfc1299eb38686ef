"""The decorator of the functions of a kernel: Numba's, without what nobody calls.

A function is compiled by the front end (`compiler`), which reads its syntax tree.  Where the front end fails, for example
with a version of Numba that it does not know, Numba's own pipeline compiles the function, in two to four times the time.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numba
from numba.core.compiler import Compiler

front_end_problems: list[str] = []
"""Why Numba's own pipeline compiled functions of this process."""


def uses_front_end() -> bool:
    """Return False if SYNCHAIN_FRONT_END chooses Numba's own pipeline.

    Raises ValueError if SYNCHAIN_FRONT_END is neither empty nor "numba".
    """
    choice = os.environ.get("SYNCHAIN_FRONT_END", "")
    if choice not in ("", "numba"):
        raise ValueError(f"SYNCHAIN_FRONT_END: found {choice!r}; expected 'numba' or nothing; unset it")
    return not choice


class _Compiler(Compiler):
    """Compiles a function by the front end, or by Numba's own pipeline if the front end fails."""

    front_end = "EntryCompiler"

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.arguments = arguments

    def compile_extra(self, func: Any) -> Any:
        problem = ""
        if uses_front_end():
            try:
                from . import compiler

                return getattr(compiler, self.front_end)(*self.arguments).compile_extra(func)
            except Exception as error:  # another version of Numba may raise anything
                problem = f"{func.__name__}: {type(error).__name__}: {' '.join(str(error).split())}"
        compiled = super().compile_extra(func)  # raises what is wrong with the function itself
        if problem:
            front_end_problems.append(problem)
        return compiled


class _InnerCompiler(_Compiler):
    """The compiler of functions that only kernels call."""

    front_end = "InnerCompiler"


class _SeparateCompiler(_Compiler):
    """The compiler of functions that kernels call without taking them in."""

    front_end = "SeparateCompiler"


ENTRY = {"pipeline_class": _Compiler}
INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _InnerCompiler}


def njit(*, cache: bool = False, separate: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)`; a function without `cache` cannot be called from Python, only by kernels.

    A kernel has some eighty functions and one entry point; wrappers and machine code of them all are half of its compilation.
    `cache` marks entry points, whose machine code `machine_code.compile` keeps: Numba's own cache is not used.  `separate` keeps
    LLVM from inlining a function with many callers.
    """
    pipeline = {"pipeline_class": _SeparateCompiler} if separate else {}
    return numba.njit(**{**options, **(ENTRY if cache else INNER), **pipeline})

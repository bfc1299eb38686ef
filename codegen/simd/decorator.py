"""The decorator of the functions of a kernel: Numba's, without what nobody calls."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

__all__ = ["njit"]

UNWRAPPED = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return `numba.njit(**options)`; a function that is not cached is no entry point, and is not made callable from Python.

    A kernel has some eighty functions and one entry point; wrappers of them all are a seventh of its compilation.
    """
    return numba.njit(**(options if options.get("cache") else {**options, **UNWRAPPED}))

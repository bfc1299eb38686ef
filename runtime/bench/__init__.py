"""Benchmarks, one file each: cases as data, `measure(quick) -> list of rows`, and `COLUMNS`; run by `synchain bench`."""

from __future__ import annotations

import importlib
import pkgutil
import platform
from collections.abc import Sequence
from types import ModuleType
from typing import Any

__all__ = ["load", "machine", "markdown", "names"]


def names() -> tuple[str, ...]:
    """Names of all benchmarks: the files of this folder."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.ispkg and not m.name.startswith("_")))


def load(name: str) -> ModuleType:
    """Return the benchmark of that name; ValueError for an unknown one."""
    if name not in names():
        raise ValueError(f"unknown benchmark {name!r}; known: {', '.join(names())}")
    return importlib.import_module(f".{name}", __name__)


def machine() -> str:
    """One line about the processor and the versions, to stand over every table."""
    import llvmlite.binding as llvm
    import numba

    return f"{llvm.get_host_cpu_name()}, {platform.system()}, Python {platform.python_version()}, Numba {numba.__version__}"


def markdown(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(_cell(value) for value in row) + " |" for row in rows]
    return "\n".join(lines)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if value != 0 else "0"
    return str(value)

"""One-file plug-ins: found by listing their directory, called with the symbols their functions ask for by name."""

from __future__ import annotations

import difflib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

__all__ = ["call", "load", "names"]

OTHERWISE = {"coupling": ", or components such as 'x->x'"}
"""What a kind can be besides the name of a file, for the message that refuses a name."""


def names(kind: str) -> tuple[str, ...]:
    """Return the names of all plug-ins of a kind (``oscillator``, ``friction``, ``coupling``), sorted."""
    package = import_module(f".{kind}s", __package__)
    return tuple(sorted(m.name for m in pkgutil.iter_modules(package.__path__) if not m.name.startswith("_")))


def load(kind: str, name: str) -> ModuleType:
    """Return the plug-in module `name`; raises ValueError with the known names where there is none."""
    known = names(kind)
    if name not in known:
        close = difflib.get_close_matches(str(name), known, n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        raise ValueError(f"unknown {kind} {name!r}; known: {', '.join(known)}{OTHERWISE.get(kind, '')}{hint}")
    return import_module(f".{kind}s.{name}", __package__)


def call(function: Callable[..., Any], symbols: Mapping[str, Any]) -> Any:
    """Call a plug-in's function with those of `symbols` that its signature names.

    Raises ValueError where it asks for a name that is not among them.
    """
    wanted = inspect.signature(function).parameters
    for name in wanted:
        if name not in symbols:
            where = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
            raise ValueError(f"{where} asks for {name!r}; known: {', '.join(symbols)}; declare it as a parameter")
    return function(**{name: symbols[name] for name in wanted})

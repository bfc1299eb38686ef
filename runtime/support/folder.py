"""List and import the modules of a folder that has one file for each command, benchmark or paper."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from synchain.models.inputs.checks import short_repr, suggestion


def names(path: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the modules in the folders of a package, sorted, without those that begin with "_"."""
    return tuple(sorted(m.name for m in iter_modules(path) if not m.ispkg and not m.name.startswith("_")))


def check_name(what: str, name: str, path: Iterable[str]) -> None:
    """Raise ValueError if a package has no module of this name."""
    valid_names = names(path)
    if name not in valid_names:
        listing = ", ".join(valid_names)
        raise ValueError(f"unknown {what} {short_repr(name)}; known: {listing}{suggestion(name, valid_names)}")


def load(what: str, name: str, package: str, path: Iterable[str]) -> ModuleType:
    check_name(what, name, path)
    return import_module(f".{name}", package)

"""The commands of `synchain`, one file each.

A command has SUMMARY (one line), EXAMPLES (command lines), `configure(parser)` and
`execute(arguments) -> exit code`. It imports what it needs when it runs, so that `synchain --help`
is fast.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

__all__ = ["command", "names"]


def names() -> tuple[str, ...]:
    """All commands: the files of this folder, sorted."""
    return tuple(sorted(module.name for module in iter_modules(__path__) if not module.name.startswith("_")))


def command(name: str) -> ModuleType:
    """The module of a command; ValueError on an unknown name."""
    known = names()
    if name not in known:
        from synchain.models.inputs.checks import short_repr, suggestion

        raise ValueError(f"unknown command {short_repr(name)}; known: {', '.join(known)}{suggestion(name, known)}")
    return import_module(f".{name}", __name__)

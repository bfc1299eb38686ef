"""The commands of `synchain`, one file each.

A command has SUMMARY (one line), EXAMPLES (command lines), `configure(parser)` and
`execute(arguments) -> exit code`. It imports what it needs when it runs, so that `synchain --help`
is fast.
"""

from __future__ import annotations

from types import ModuleType

from ..support import folder

__all__ = ["command", "names"]


def names() -> tuple[str, ...]:
    """Return the names of all commands: the files of this folder, sorted."""
    return folder.names(__path__)


def command(name: str) -> ModuleType:
    """Return the module of a command; raise ValueError for an unknown name."""
    return folder.load("command", name, __name__, __path__)

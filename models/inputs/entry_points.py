"""Entry points of installed packages, by which they announce parts of models and integrators."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def announced(group: str) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group such as "synchain.integrators" by name; none is loaded."""
    return _announced(group, tuple(sys.path))


@lru_cache(maxsize=8)
def _announced(group: str, paths: tuple[str, ...]) -> Mapping[str, EntryPoint]:
    """Return the entry points of a group, looked up again only if `sys.path` has changed."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group=group)}

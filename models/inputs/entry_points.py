"""Entry points, by which installed packages register oscillators, laws, couplings, families and integrators."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def announced(group: str) -> Mapping[str, EntryPoint]:
    """Return name -> entry point for a group such as "synchain.integrators", without loading any."""
    return _announced(group, tuple(sys.path))


@lru_cache(maxsize=8)
def _announced(group: str, paths: tuple[str, ...]) -> Mapping[str, EntryPoint]:
    """Look up the entry points of a group; cached until `sys.path` changes."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group=group)}

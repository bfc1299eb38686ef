"""The names that results have for dimensions, coordinates and variables of their own."""

from __future__ import annotations

from collections.abc import Collection, Iterable

__all__ = ["ATTRIBUTES", "TAKEN", "expect_free"]

TAKEN = frozenset(
    {"cell", "component", "drive_phase", "end", "end_time", "ended_early", "node", "part", "periods_skipped", "point",
     "realisation", "rejected", "sample", "section", "section_count", "section_time", "status", "steps", "sync_error",
     "sync_error_end", "sync_error_max", "time", "trajectory", "transversal_exponent", "transversal_stderr", "verdict"}
)  # fmt: skip
"""What data of results have under these names already."""

ATTRIBUTES = frozenset(
    {"belongs_to", "data", "kind", "link", "message", "name", "names", "plot", "restore", "save", "scene", "state",
     "states", "stepped", "success", "summary"}
)  # fmt: skip
"""Attributes of results and of their data, which would hide variables of these names."""


def expect_free(what: str, names: Iterable[str], more: Collection[str] = ()) -> None:
    """Raise ValueError if a result has one of the names for something else: one of `TAKEN`, or of `more`."""
    for name in names:
        if name in TAKEN or name in more:
            raise ValueError(f"{what}: found the name {name!r}, which results have for something else; rename it")

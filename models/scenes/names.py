"""The names that results have for dimensions, coordinates and variables of their own."""

from __future__ import annotations

from collections.abc import Collection, Iterable

__all__ = ["TAKEN", "expect_free"]

TAKEN = frozenset(
    {"cell", "component", "data", "drive_phase", "end", "end_time", "ended_early", "kind", "link", "message", "name", "names", "node",
     "part", "periods_skipped", "plot", "point", "realisation", "rejected", "sample", "save", "scene", "section",
     "section_count", "section_time", "state", "status", "steps", "success", "sync_error", "sync_error_end",
     "sync_error_max", "time", "trajectory", "transversal_exponent", "transversal_stderr", "verdict"}
)  # fmt: skip
"""What results have under these names already."""


def expect_free(what: str, names: Iterable[str], more: Collection[str] = ()) -> None:
    """Raise ValueError if a result has one of the names for something else: one of `TAKEN`, or of `more`."""
    for name in names:
        if name in TAKEN or name in more:
            raise ValueError(f"{what}: found the name {name!r}, which results have for something else; rename it")

"""What can be recorded of a network's motion beside its final state."""

from __future__ import annotations

from ..inputs.words import Word


class Record(Word):
    """What a cell of a sweep records, and what its kernel therefore computes."""

    SYNC_ERROR = "sync_error"
    SECTION = "section"
    TRAJECTORY = "trajectory"

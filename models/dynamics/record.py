"""Kinds of records that a run stores beside the final state of the network."""

from __future__ import annotations

from ..inputs.words import Word


class Record(Word):
    """A record of each cell of a sweep; the kernel computes only the chosen records."""

    SYNC_ERROR = "sync_error"
    SECTION = "section"
    TRAJECTORY = "trajectory"
    EVENTS = "events"

"""Columns of the arrays that a kernel reads and writes, by name.

The text of every kernel defines the same numbers for itself (`clock_slots.py`); a test compares the
two.
"""

from __future__ import annotations

from enum import IntEnum


class Control(IntEnum):
    """Entries of the array `control` that steers a kernel."""

    RTOL = 0
    ATOL = 1
    FIRST_STEP = 2
    MAX_STEP = 3
    MAX_STEPS = 4
    DIRECTION = 5
    """Section points are taken where the section function falls (-1), rises (1) or either (0)."""
    CANCEL = 6
    """A number other than 0 stops the kernel while it runs."""
    NO_JUMPS = 7
    """A number other than 0 integrates a cell that repeats itself to its end."""
    FURTHER = 8
    """Behind those of every kernel: the directions of the second section and of those behind it."""


class SpanColumn(IntEnum):
    """Columns of `spans` (cells, 7), in non-dimensional time."""

    START = 0
    END = 1
    PERIOD = 2
    """After so much time the equations repeat themselves; 0 if they do not."""
    NEAR = 3
    """Synchronisation error below which a cell is known to stay synchronous; 0 if that is not
    known.
    """
    FIRST_STEP = 4
    LONGEST = 5
    """No step is longer: none can miss a swing of the drive."""
    LOOK = 6
    """Steps after which the cell first looks whether to pause; inf if it never does."""


class SumColumn(IntEnum):
    """Columns of `sums` (cells, 4): synchronisation error over the window, and the time at which
    the cell stopped.
    """

    MEAN = 0
    PEAK = 1
    LAST = 2
    STOPPED_AT = 3


class Tally(IntEnum):
    """Columns of each observed value in `sums`; behind those of `SumColumn` stands the time that was
    observed, then come the values one after the other.
    """

    FIRST = 0
    """The value at the beginning of the window."""
    SUM = 1
    """Integral of the distance from the first value."""
    SQUARES = 2
    LARGEST = 3
    LEAST = 4
    LATEST = 5
    SIZE = 6
    """The largest absolute value at the points of the last step."""


class Count(IntEnum):
    """Columns of `counts` (cells, COUNTS)."""

    STATUS = 0
    ACCEPTED = 1
    REJECTED = 2
    POINTS = 3
    SKIPPED = 4
    """Periods of the drive that were jumped over."""
    BY_METHOD = 5
    """Behind those that a kernel writes: the steps by each of up to MOST_METHODS integrators."""


MOST_METHODS = 3
"""Integrators that one cell may go through."""

TOLERANCES = slice(Count.BY_METHOD + MOST_METHODS, Count.BY_METHOD + MOST_METHODS + 2)
"""Columns of `counts` behind those: the bits of rtol and atol, with which the cell was integrated."""

COUNTS = TOLERANCES.stop
"""Columns of `counts`."""


class PointColumn(IntEnum):
    """Columns of a section point: its time, then the state."""

    TIME = 0
    STATE = 1

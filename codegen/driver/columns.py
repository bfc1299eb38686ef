"""Columns of the arrays that a kernel reads and writes, by name.

Kernels are compiled from plain integers, which `clock_slots.py` defines; tests/codegen/driver/test_columns.py compares
both.
"""

from __future__ import annotations

from enum import IntEnum


class Control(IntEnum):
    """Entries of the array `control`: tolerances and limits of a kernel."""

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
    """First entry beyond those of every kernel: the direction of the second section; those of further ones follow.

    The last entries are the sample times, if they are not equally spaced.
    """


class SpanColumn(IntEnum):
    """Columns of `spans` (cells, 8), in non-dimensional time."""

    START = 0
    END = 1
    PERIOD = 2
    """Period of the equations in time; 0 if they have none."""
    NEAR = 3
    """Synchronisation error below which a proof keeps a cell synchronous; 0 without a proof."""
    FIRST_STEP = 4
    LONGEST = 5
    """Longest step, so that no step misses a swing of the drive."""
    LOOK = 6
    """Steps after which the cell first tests whether to pause; inf without this test."""
    UNIT = 7
    """Unit of the sample times in `control`."""


class SumColumn(IntEnum):
    """Columns of `sums` (cells, 4): synchronisation error over the window, and the time of the end of the cell."""

    MEAN = 0
    PEAK = 1
    LAST = 2
    STOPPED_AT = 3


class Tally(IntEnum):
    """Columns of each observed value in `sums`, which follow those of `SumColumn` and the length of the window so far."""

    FIRST = 0
    """Value at the beginning of the window."""
    SUM = 1
    """Integral of the distance from the first value."""
    SQUARES = 2
    LARGEST = 3
    LEAST = 4
    LATEST = 5
    SIZE = 6
    """Largest absolute value at the points of the last step."""


class Count(IntEnum):
    """Columns of `counts` (cells, COUNTS)."""

    STATUS = 0
    ACCEPTED = 1
    REJECTED = 2
    POINTS = 3
    SKIPPED = 4
    """Periods of the drive that the cell skipped."""
    BY_METHOD = 5
    """First column beyond those of a kernel: the steps by each of up to MOST_METHODS integrators."""


MOST_METHODS = 3
"""Largest number of integrators of one cell."""

TOLERANCES = slice(Count.BY_METHOD + MOST_METHODS, Count.BY_METHOD + MOST_METHODS + 2)
"""Columns of `counts` for the bits of rtol and atol of the cell."""

COUNTS = TOLERANCES.stop
"""Number of columns of `counts`."""


class PointColumn(IntEnum):
    """Columns of a section point: its time, then the state."""

    TIME = 0
    STATE = 1

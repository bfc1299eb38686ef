"""The names that all modules of drivers share: those that specialise the text, and the numbers that it begins with.

The first stand here so that the text can be read and checked; each module defines them for itself.
"""

from __future__ import annotations

WIDTH = 1
"""Lanes in one register."""
LOOPED = False
"""True if the step loops over nodes and links; it then takes their arrays."""
CONTACTS = False
"""True if oscillators stick and slip: their third state is the mode, which events change."""
ROWS = False
"""True if these contacts are rows (models/mechanics/rows.py)."""
SERIES = False
"""True if the step is a Taylor step: it tells how long it is and how far its series reach, which are its dense output."""
LANES = 1
"""Modes in one register of a driver that carries deviations along an orbit."""

DIMENSION = 2
"""State variables; of the steps that loop over nodes and links, which contain the elimination."""

# --- kernel text below ---
# Each lane has its state in `y`, followed by its parameters, and what the driver remembers about it in `clock`.
# Times count from BASE, the beginning of the current period of the drive, so that they keep their digits in long runs.
TIME, STEP, STOP, START, END, MEMORY, CHANGE, ACCEPTED, REJECTED = 0, 1, 2, 3, 4, 5, 6, 7, 8
SYNC, SYNC_SUM, SYNC_PEAK, NEXT_SAMPLE, BASE, PERIOD, PERIODS = 9, 10, 11, 12, 13, 14, 15
LONGEST, LOOK, POWER, SAVED_AT, CYCLE, LEFT, SUM_BEFORE, SKIPPED, RUSH = 16, 17, 18, 19, 20, 21, 22, 23, 24
HALTED, MARK, MARKED_AT, LAPSE, HIGH, RECORD, ORIGIN = 25, 26, 27, 28, 29, 30, 31
# NEXT_SAMPLE is the index of the next sample of the trajectory.
# Start and end of the window counted from t = 0; the period at whose end a step must stop; that end, if it is this period.
FROM, UNTIL, DUE, BOUND, LOOKED_AT = 32, 33, 34, 35, 36
CLOCK = 37
# How a cell left its lane; a cell that pauses comes back, with this integrator or another one.
FINISHED, BUDGET, UNDERFLOW, DIVERGED, INTERRUPTED, CHATTERING, STOPPED, PAUSED, AMBIGUOUS = 1, 2, 3, 4, 5, 6, 7, 8, 9
# Columns of `spans`: of a sweep, behind start, end, period and the error of synchronous cells.
FIRST_OF_CELL, LONGEST_OF_CELL, FIRST_LOOK, UNIT_OF_CELL = 4, 5, 6, 7
# Columns of `control`, of `sums`, behind which stand the values that were observed for some time, and of `counts`.
RTOL, ATOL, FIRST_STEP, MAX_STEP, MAX_STEPS, DIRECTION, CANCEL, NO_JUMPS, FURTHER = 0, 1, 2, 3, 4, 5, 6, 7, 8
MEAN, PEAK, LAST, STOPPED_AT, OBSERVED = 0, 1, 2, 3, 4
STATUS, N_ACCEPTED, N_REJECTED, N_POINTS, N_SKIPPED = 0, 1, 2, 3, 4
# So many events in a row without time passing are chattering; an infinite number stands for an ambiguous event.
LONGEST_RUSH = 200.0
# A state of this size, 2^53, has diverged: its neighbours are further apart than anything that happens at size one.
FAR = 9007199254740992.0
# Growth is looked at after so many steps, and each time that their number has doubled.  A doubling counts if its time
# and that of the last one are within a factor of PACE while the state grows by CLIMB; together they must have raised it
# by TOWER.
FIRST_MARK, PACE, CLIMB, TOWER = 256.0, 1.1, 1.4142135623730951, 256.0
# A cell looks whether to pause each time that its steps are LOOKS times as many, and pauses if more than WORTH are to come.
LOOKS, WORTH = 4.0, 1024.0
ALL = (1 << WIDTH) - 1

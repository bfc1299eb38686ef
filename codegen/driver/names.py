"""The names that the driver uses and that each kernel module defines for itself.

They stand here so that the driver can be read and checked; the values belong to no model.
"""

from __future__ import annotations

from typing import Any

import numpy as np

WIDTH = 1
"""Lanes in one register."""
NODES = 1
COMPONENTS = 2
DIMENSION = 2
"""State variables: NODES * COMPONENTS, component by component."""
PARAMETERS = 1
DENSE_ROWS = 3
"""Coefficients of the dense output for each state variable."""
ERROR_ORDER = 4
SWITCHING = False
"""True where the kernel has a second, explicit step for cells that are not stiff at the moment."""
SMOOTH_ERROR_ORDER = 7
REPEATS = False
"""True where the right-hand side is periodic in time, so that a computation can repeat itself."""
WEIGHTED = False
MULTIPLICITY = np.ones(1)
"""How many oscillators each node stands for; used where WEIGHTED."""
DENSE = True
LOOPED = False
"""True where the step loops over nodes and links; its arrays then come as arguments."""
WORKSPACE = 0
"""Groups of scratch memory behind the dense output."""
CONTACTS = False
"""True where oscillators stick and slip: their third state is the mode, which events change."""
SYNC_ERROR = False
SECTION = False
TRAJECTORY = False
"""Records of this kernel; what is False costs nothing."""

JUMPS = False
"""True where slip begins with a jump of acceleration."""
OWNERS = np.zeros(1, np.int64)
"""The contact that each component of a deviation is a velocity of, -1 for the others; used where CONTACTS."""

LANES = 1
"""Modes in one register of a kernel that carries deviations along an orbit."""
MODE_SIZE = 2
"""State variables of one deviation."""
STRENGTHS = 1
"""Numbers that differ from mode to mode."""
SHARED = 3
"""Length of the array in which a step of the orbit leaves what the modes need."""


def step(t: Any, h: Any, y: Any, p: Any, y_new: Any, dense: Any, rtol: Any, atol: Any, *network: Any) -> Any:
    """One step from (t, y): writes y_new and the dense output, returns the error in units of the tolerance."""


def step_smooth(t: Any, h: Any, y: Any, p: Any, y_new: Any, dense: Any, rtol: Any, atol: Any) -> Any:
    """The explicit step of a switching kernel: the error as above, and a bound of the eigenvalues at the start."""


def section(theta: Any, t: Any, h: Any, bank: Any, y_new: Any, dense: Any) -> Any:
    """The section function at the fraction theta of the step."""


def mode_step(shared: Any, strengths: Any, old: Any, new: Any, which: Any) -> Any:
    """The orbit's last step, taken by the modes of one register: writes them, returns their error and their size."""


def pushes(t: Any, y: Any, p: Any, out: Any, network: Any) -> Any:
    """For each contact: sliding velocity, ground's velocity, accelerations under static friction both ways, in slip."""


def release(i: Any, after: Any, t: Any, y: Any, strengths: Any, modes: Any, which: Any) -> Any:
    """Where a contact begins to slip and friction drops at once, deviations that let go early have gained a velocity."""

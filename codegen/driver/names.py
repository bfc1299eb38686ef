"""The names by which the text of a driver is specialised; each driver module defines them for itself.

They stand here so that the text can be read and checked.
"""

from __future__ import annotations

WIDTH = 1
"""Lanes in one register."""
SWITCHING = False
"""True if the driver has a second, explicit step for cells that are not stiff at the moment."""
LOOPED = False
"""True if the step loops over nodes and links; it then takes their arrays."""
CONTACTS = False
"""True if oscillators stick and slip: their third state is the mode, which events change."""
SERIES = False
"""True if the step is a Taylor step: it tells how long it is and how far its series reach, which are its dense output."""
LANES = 1
"""Modes in one register of a driver that carries deviations along an orbit."""

DIMENSION = 2
"""State variables; of the steps that loop over nodes and links, which contain the elimination."""

"""Warn if undriven motion is so slow that the transient and the averaging time are too short for it."""

from __future__ import annotations

import math

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn

from ..cells.paces import fastest_rates

TURN = 2.0 * math.pi
"""Shortest time, times the fastest rate of a motion, in which the motion turns or settles: one full turn."""


def warn_of_slow_motion(
    equations: Equations, states: np.ndarray, parameter_values: np.ndarray, averaged: float
) -> None:
    """Warn if an average ends before undriven motion turns or settles.

    The batches of such an average agree because nothing has happened yet, so that its error is too small.
    Shapes: states (any, states), parameter_values (parameters,).
    """
    if equations.forced:
        return
    fastest = float(fastest_rates(equations, states, parameter_values).max())
    if 0.0 < fastest * averaged < TURN:
        warn(
            f"found an orbit that has neither turned nor settled in the average of {averaged:.3g} units of time, its fastest rate is "
            f"{fastest:.1g}; expected {TURN / fastest:.1g} units at least; lower precision, raise transient and periods, or take faster units"
        )

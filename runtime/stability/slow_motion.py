"""Undriven motion that is too slow for transients and averages, which are counted in units of 2 pi."""

from __future__ import annotations

import math

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn

from ..cells.paces import fastest_rates

TURN = 2.0 * math.pi
"""Fewest times the inverse of the fastest rate in which motion turns, or settles."""


def warn_of_slow_motion(equations: Equations, states: np.ndarray, numbers: np.ndarray, averaged: float) -> None:
    """Warn if an average ends before undriven motion turns or settles.

    Its batches agree, because nothing has happened, and their error is small for no reason.
    Shapes: states (any, states), numbers (parameters,).
    """
    if equations.forced:
        return
    fastest = float(fastest_rates(equations, states, numbers).max())
    if 0.0 < fastest * averaged < TURN:
        warn(
            f"found an orbit that has neither turned nor settled in the average of {averaged:.3g} units of time, its fastest rate is "
            f"{fastest:.1g}; expected {TURN / fastest:.1g} units at least; lower precision, raise transient and periods, or take faster units"
        )

"""Warn if undriven motion is so slow that the transient and the averaging time are too short for it."""

from __future__ import annotations

import math

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn

from ..cells.paces import fastest_rates
from .averages import ROUNDING

TURN = 2.0 * math.pi
"""Shortest time, times the fastest rate of a motion, in which the motion turns or settles: one full turn."""


CONTRACTED = 3.0
"""A motion has reached its attractor if volumes have shrunk by exp(-CONTRACTED) in each dimension (a choice)."""


def warn_of_slow_motion(
    equations: Equations,
    states: np.ndarray,
    parameter_values: np.ndarray,
    averaged: float,
    contraction: float,
    whole: float,
) -> None:
    """Warn if an average ends before undriven motion turns or settles.

    The batches of such an average agree because nothing has happened yet, so that its error is too small.
    `contraction`: mean rate at which volumes shrink in each dimension, NaN if unknown; `whole`: time of the transient and
    the average together.  Shapes: states (any, states), parameter_values (parameters,).
    """
    if equations.forced:
        return
    fastest = float(fastest_rates(equations, states, parameter_values).max())
    if 0.0 < fastest * averaged < TURN:
        warn(
            f"found an orbit that has neither turned nor settled in the average of {averaged:.3g} units of time, its fastest rate is "
            f"{fastest:.1g}; expected {TURN / fastest:.1g} units at least; lower precision, raise transient and periods, or take faster units"
        )
    elif contraction > ROUNDING * fastest and contraction * whole < CONTRACTED:
        warn(
            f"found volumes that shrink by a factor {math.exp(contraction * whole):.3g} in each dimension, in the transient and average "
            f"of {whole:.3g} units of time; expected {math.exp(CONTRACTED):.0f}, the motion may still approach its attractor; raise "
            "transient, or start nearer to the attractor"
        )

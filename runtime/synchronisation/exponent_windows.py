"""Compute windows of sigma from transversal exponents, or the reason why there are no exponents."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from synchain.models.scenes.scene import Scene

from ..prediction.intervals import Interval
from ..stability.exponents import initial_states
from ..stability.msf import MSF, msf
from ..stability.orbits import OrbitProblem
from ..support.error_text import interval_text
from ..support.execution import Execution


@dataclass(frozen=True, slots=True)
class ExponentWindows:
    """Ranges of sigma in which every transversal exponent of a network is negative.

    Parameters
    ----------
    intervals : tuple of (float, float)
        Lower and upper end of each window, in ascending order.
    errors : tuple of (float, float)
        Errors of the ends: 0 at sigma = 0, infinite at an end of the grid, and infinite if the average is too short for
        an estimate.
    absent : str
        Reason why there are no exponents of the network; empty if there are exponents.
    strengths, values : tuple of float
        Strengths alpha, and the exponents at these strengths.
    beyond : tuple of float
        Ends of windows that are ends of the grid; the windows may extend beyond.

    See Also
    --------
    synchain.thresholds
    """

    intervals: tuple[Interval, ...] = ()
    errors: tuple[Interval, ...] = ()
    absent: str = ""
    strengths: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    beyond: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.errors) != len(self.intervals):
            raise ValueError(
                f"{len(self.errors)} pairs of errors; expected one for each of {len(self.intervals)} windows"
            )
        if self.absent and self.intervals:
            raise ValueError(f"found windows and the reason {self.absent!r} for their absence; expected one of the two")

    @classmethod
    def of(cls, function: MSF) -> ExponentWindows:
        """Return the windows of a master stability function for the network of its scene."""
        windows = function.windows
        ends = [end for w in windows for end in ((w.low, w.low_mode), (w.high, w.high_mode))]
        return cls(
            tuple((window.low, window.high) for window in windows),
            tuple((window.low_error, window.high_error) for window in windows),
            strengths=tuple(map(float, function.alpha)),
            values=tuple(map(float, function.exponent)),
            beyond=tuple(end for end, lost in ends if lost is None and end),
        )

    def at(self, alpha: np.ndarray) -> np.ndarray:
        """Return exponents at strengths of any shape, by linear interpolation."""
        return np.interp(alpha, self.strengths, self.values)

    def text(self, grid_ends: Collection[float] = ()) -> str:
        """Return the windows as text with errors, and dots at ends of the grid, or the reason why there are none."""
        ends = (*self.beyond, *grid_ends)
        return f"not computed: {self.absent}" if self.absent else interval_text(self.intervals, self.errors, ends)


def exponent_windows(
    scene: Scene, alpha: np.ndarray, execution: Execution, precision: float | None, periods: float, seed: int
) -> ExponentWindows:
    """Compute the windows of a scene's network. Shapes: alpha (m,)."""
    try:
        OrbitProblem.of_modes(scene, alpha, initial_states(scene, 1, seed), 1)
    except ValueError as problem:
        return ExponentWindows(absent=str(problem))
    try:
        function = msf(
            scene,
            alpha,
            precision=precision,
            periods=periods,
            rng=seed,
            workers=execution.workers,
            show_progress=execution.show_progress,
            progress=execution.progress,
        )
    except FloatingPointError as problem:
        return ExponentWindows(absent=str(problem))
    return ExponentWindows.of(function)

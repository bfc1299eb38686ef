"""The master stability function of a scene: exponents against strength, the ranges where they are negative, their class.

Classes by the zeros of the function on alpha > 0: Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009); several
intervals ("ragged"): Stefański, Perlikowski & Kapitaniak, Phys. Rev. E 75, 016210 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np

from synchain.models.scenes.scene import Scene

from ..prediction.intervals import Interval
from ..prediction.synchronisability import Window, windows
from ..support.arrays import row
from .exponents import Exponents, exponents

__all__ = ["MSF", "Plane", "StabilityClass", "classify", "msf", "plane"]

FINE = 1001
"""Strengths at which the function is known at least; ends of ranges are interpolated between them."""


class StabilityClass(StrEnum):
    """Class of a master stability function by its zeros on the grid of alpha."""

    NEVER = "never stable"
    EVERYWHERE = "stable everywhere"
    HALF_LINE = "half-line"
    BOUNDED = "bounded interval"
    SEVERAL = "several intervals"


@dataclass(frozen=True, slots=True)
class MSF:
    """The function on a line of real strengths and what it says about the scene's network.

    `alpha` (m,) are the strengths asked for; `fine` holds the function on a grid at least FINE fine, which they are part
    of.
    """

    scene: Scene
    alpha: np.ndarray
    fine: Exponents

    @property
    def exponent(self) -> np.ndarray:
        """Exponents (m,) at `alpha`, per unit of non-dimensional time."""
        return np.asarray(self.fine.exponent[self._where])

    @property
    def stderr(self) -> np.ndarray:
        """Their standard errors (m,)."""
        return np.asarray(self.fine.stderr[self._where])

    @property
    def _where(self) -> np.ndarray:
        return np.searchsorted(self.fine.alpha, self.alpha)

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Ranges of alpha with a negative exponent."""
        return self.fine.intervals

    @property
    def uncertainties(self) -> tuple[Interval, ...]:
        """Standard errors of the ends of the intervals; 0 where the grid ends."""
        return tuple((low, high) for (_, low), (_, high) in self.fine.ranges)

    @property
    def kind(self) -> StabilityClass:
        """The class of the function on its grid, in words (see `classify`)."""
        return classify(self.intervals, float(self.fine.alpha[-1]), float(self.fine.alpha[0]))

    @property
    def attractors(self) -> tuple[str, ...]:
        """The kind of motion that each start has settled on."""
        return tuple(found.kind for found in self.fine.attractors)

    @property
    def errors(self) -> tuple[Interval, ...] | None:
        """The uncertainties of the ends; None if an average was too short to give them."""
        found = self.uncertainties
        return found if np.isfinite(found).all() else None

    @property
    def windows(self) -> tuple[Window, ...]:
        """Ranges of sigma in which every mode of the scene's network is stable; real eigenvalues only.

        Where a range ends with the grid of alpha no mode is lost.
        """
        return tuple(self._trimmed(window) for window in windows(self.open_ranges, self.scene.topology, self.errors))

    def _trimmed(self, window: Window) -> Window:
        """A window without the modes whose strength at its ends is an end of the grid."""
        low, high = (float(self.fine.alpha[k]) for k in (0, -1))
        modes = [
            None if mode is None or math.isclose(sigma * mode.size, end, rel_tol=1e-12) else mode
            for sigma, mode, end in ((window.low, window.low_mode, low), (window.high, window.high_mode, high))
        ]
        return replace(window, low_mode=modes[0], high_mode=modes[1])

    @property
    def open_ranges(self) -> tuple[Interval, ...]:
        """The intervals as they are used for a network: what lies beyond the grid counts as unstable."""
        return self.intervals

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: alpha, exponent, stderr, intervals, uncertainties, class, attractors, time, starts."""
        return {
            "alpha": self.alpha.tolist(),
            "exponent": self.exponent.tolist(),
            "stderr": self.stderr.tolist(),
            "intervals": [list(interval) for interval in self.intervals],
            "uncertainties": [list(pair) for pair in self.uncertainties],
            "class": self.kind.value,
            "attractors": list(self.attractors),
            "time": self.fine.time,
            "starts": self.fine.starts,
        }


@dataclass(frozen=True, slots=True)
class Plane:
    """The function on a rectangle of complex strengths: alpha (a,), beta (b,), exponent and stderr (a, b)."""

    scene: Scene
    alpha: np.ndarray
    beta: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    attractors: tuple[str, ...]
    time: float

    @property
    def contours(self) -> tuple[np.ndarray, ...]:
        """The zero contour as lines (points, 2) of alpha and beta."""
        from contourpy import contour_generator

        lines = contour_generator(self.alpha, self.beta, self.exponent.T).lines(0.0)
        return tuple(np.asarray(line) for line in lines)

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: alpha, beta, exponent and stderr (rows of alpha), contours, attractors, time."""
        return {
            "alpha": self.alpha.tolist(),
            "beta": self.beta.tolist(),
            "exponent": self.exponent.tolist(),
            "stderr": self.stderr.tolist(),
            "contours": [line.tolist() for line in self.contours],
            "attractors": list(self.attractors),
            "time": self.time,
        }


def msf(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray,
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    starts: int = 4,
    rtol: float = 1e-6,
    seed: int = 0,
    workers: int | None = None,
    show_progress: bool | None = False,
    **parameters: float,
) -> MSF:
    """Return the master stability function of a scene's oscillator and coupling on a line of real strengths.

    alpha = -sigma gamma; `alpha` must increase.  Options as for `exponents`.  Raises ValueError as `exponents` does, and
    for strengths that do not increase.
    """
    line = row("alpha", alpha, 2, rising=True)
    fine = np.union1d(line, np.linspace(line[0], line[-1], FINE))
    found = exponents(
        scene,
        fine,
        precision=precision,
        periods=periods,
        transient=transient,
        starts=starts,
        rtol=rtol,
        seed=seed,
        workers=workers,
        show_progress=show_progress,
        **parameters,
    )
    return MSF(scene, line, found)


def plane(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray,
    beta: Sequence[float] | np.ndarray,
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    starts: int = 4,
    rtol: float = 1e-6,
    seed: int = 0,
    workers: int | None = None,
    show_progress: bool | None = False,
    **parameters: float,
) -> Plane:
    """Return the master stability function on the rectangle alpha + i beta = -sigma gamma; options as for `exponents`.

    The function takes the same value at conjugate strengths, so only |beta| is integrated.
    Raises ValueError as `exponents` does, and for rows that do not increase.
    """
    across, up = row("alpha", alpha, 2, rising=True), row("beta", beta, 2, rising=True)
    heights, place = np.unique(np.abs(up), return_inverse=True)
    found = exponents(
        scene,
        (across[:, None] + 1j * heights).reshape(-1),
        precision=precision,
        periods=periods,
        transient=transient,
        starts=starts,
        rtol=rtol,
        seed=seed,
        workers=workers,
        show_progress=show_progress,
        **parameters,
    )
    table, error = (row.reshape(len(across), -1)[:, place] for row in (found.exponent, found.stderr))
    kinds = tuple(a.kind for a in found.attractors)
    return Plane(scene, across, up, table, error, kinds, found.time)


def classify(intervals: Sequence[Interval], end: float, begin: float = 0.0) -> StabilityClass:
    """The class of a function that is negative on `intervals` of the grid begin … end.

    "never stable" (no zero), "stable everywhere" on the grid, "half-line" (one zero, stable from there to the end of the
    grid), "bounded interval" (also one that begins with the grid), "several intervals".
    """
    if not intervals:
        return StabilityClass.NEVER
    if len(intervals) > 1:
        return StabilityClass.SEVERAL
    low, high = intervals[0]
    if high < end:
        return StabilityClass.BOUNDED
    return StabilityClass.HALF_LINE if low > begin else StabilityClass.EVERYWHERE

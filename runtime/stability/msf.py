"""The master stability function of a scene: exponents, ranges where they are negative, their class.

Sources: classes by the zeros of the function on alpha > 0, Huang, Chen, Lai & Pecora, Phys. Rev. E
80, 036204 (2009); several intervals ("ragged"), Stefański, Perlikowski & Kapitaniak, Phys. Rev. E
75, 016210 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.keywords import ORBITS, Given, with_numbers
from ..prediction.intervals import Interval
from ..prediction.synchronisability import Window, windows
from ..results.labelled import Labelled, dataset, ends_of, words_of
from ..support.arrays import row
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging
from .exponents import Exponents, transversal

__all__ = ["MSF", "Plane", "StabilityClass", "classify", "msf", "plane"]

FINE = 1001
"""Least number of strengths at which the function is computed; ends of ranges are interpolated."""


class StabilityClass(StrEnum):
    """Class of a master stability function by its zeros on the grid of alpha.

    NEVER has no zero and is positive, EVERYWHERE no zero and is negative. HALF_LINE is stable from
    one zero to the end of the grid. BOUNDED is one interval, which may begin with the grid.
    """

    NEVER = "never stable"
    EVERYWHERE = "stable everywhere"
    HALF_LINE = "half-line"
    BOUNDED = "bounded interval"
    SEVERAL = "several intervals"


@dataclass(frozen=True, slots=True, repr=False)
class MSF(Labelled):
    """The function on a line of real strengths.

    Parameters
    ----------
    scene : Scene
        Scene with the oscillator, the coupling, their parameters and a network.
    alpha : ndarray, shape (m,)
        Requested strengths.
    fine : Exponents
        The function on at least FINE strengths, which contain `alpha`.
    """

    scene: Scene
    alpha: np.ndarray
    fine: Exponents

    @property
    def data(self) -> xr.Dataset:
        """The function over alpha, and the intervals where it is negative."""
        return dataset(
            {
                "exponent": (("alpha",), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("alpha",), self.stderr, "standard error of the exponent"),
                "interval": (("range", "end"), np.reshape(self.intervals, (-1, 2)), "alpha with a negative exponent"),
                "interval_error": (("range", "end"), np.reshape(self.uncertainties, (-1, 2)), "errors of the ends"),
                "window": (
                    ("window_number", "end"),
                    np.reshape([(w.low, w.high) for w in self._known_windows], (-1, 2)),
                    "sigma at which every mode of the network dies out",
                ),
            },
            {"alpha": self.alpha, "end": ["low", "high"]},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, class, stable ranges of alpha and of sigma, motion."""
        return (
            ("scene", repr(self.scene)),
            ("class", f"{self.kind}, for alpha {ends_of(self.fine.alpha)}"),
            ("negative for alpha", words_of(self.intervals, self.errors)),
            ("sigma", self._without_windows or words_of([(w.low, w.high) for w in self._known_windows])),
            ("motion", ", ".join(dict.fromkeys(self.attractors))),
            ("average", f"{self.fine.time:.6g} units of time for each of {self.fine.starts} starts"),
        )

    @property
    def _known_windows(self) -> tuple[Window, ...]:
        """The windows, none where nothing is known of them."""
        return () if self._without_windows else self.windows

    @property
    def _without_windows(self) -> str:
        """Why nothing is known of windows; empty if they are known."""
        graph = self.scene.topology
        if not graph.link_count:
            return "not known: no links"
        real = graph.undirected or not any(isinstance(value, complex) for value in graph.spectrum.values)
        return "" if real else f"not known: {graph.name}({graph.n}) has complex eigenvalues, which need `plane`"

    @property
    def exponent(self) -> np.ndarray:
        """Exponents (m,) at `alpha`, per unit of non-dimensional time."""
        return np.asarray(self.fine.exponent[self._where])

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors (m,) of the exponents."""
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
        """Errors of the ends of the intervals, of averages and of interpolation; 0 at an end of the grid."""
        return tuple((low, high) for (_, low), (_, high) in self.fine.ranges)

    @property
    def kind(self) -> StabilityClass:
        """Class of the function on its grid."""
        return classify(self.intervals, float(self.fine.alpha[-1]), float(self.fine.alpha[0]))

    @property
    def attractors(self) -> tuple[str, ...]:
        """Kind of motion of each start."""
        return tuple(attractor.kind for attractor in self.fine.attractors)

    @property
    def errors(self) -> tuple[Interval, ...] | None:
        """The uncertainties of the ends; None if an average was too short to estimate them."""
        uncertainties = self.uncertainties
        return uncertainties if np.isfinite(uncertainties).all() else None

    @property
    def windows(self) -> tuple[Window, ...]:
        """Ranges of sigma in which every mode of the scene's network is stable.

        Eigenvalues must be real. No mode is lost at an end that comes from an end of the grid. The errors of ends at
        which one is are infinite if an average was too short to estimate them.
        """
        return tuple(self._trimmed(window) for window in windows(self.open_ranges, self.scene.topology, self.errors))

    def _trimmed(self, window: Window) -> Window:
        """Remove the modes of a window whose strength at its ends is an end of the grid, and errors that are unknown."""
        low, high = (float(self.fine.alpha[k]) for k in (0, -1))
        modes = [
            None if mode is None or math.isclose(sigma * mode.size, end, rel_tol=1e-12) else mode
            for sigma, mode, end in ((window.low, window.low_mode, low), (window.high, window.high_mode, high))
        ]
        known = self.errors is not None
        low_error, high_error = (
            0.0 if mode is None else error if known else math.inf
            for mode, error in zip(modes, (window.low_error, window.high_error), strict=True)
        )
        return replace(window, low_mode=modes[0], high_mode=modes[1], low_error=low_error, high_error=high_error)

    @property
    def open_ranges(self) -> tuple[Interval, ...]:
        """The intervals as used for a network: the function counts as unstable beyond the grid."""
        return self.intervals

    def as_dict(self) -> dict[str, object]:
        """Return the function for JSON.

        Returns
        -------
        dict
            alpha, exponent, stderr, intervals, uncertainties, class, attractors, time and starts.
        """
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


@dataclass(frozen=True, slots=True, repr=False)
class Plane(Labelled):
    """The function on a rectangle of complex strengths alpha + i beta.

    Parameters
    ----------
    scene : Scene
        Scene with the oscillator, the coupling and a network.
    alpha : ndarray, shape (a,)
        Real parts.
    beta : ndarray, shape (b,)
        Imaginary parts.
    exponent : ndarray, shape (a, b)
        Exponents per unit of non-dimensional time.
    stderr : ndarray, shape (a, b)
        Standard errors.
    attractors : tuple of str
        Kind of motion of each start.
    time : float
        Time averaged over.
    """

    scene: Scene
    alpha: np.ndarray
    beta: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    attractors: tuple[str, ...]
    time: float

    @property
    def data(self) -> xr.Dataset:
        """The function over alpha and beta."""
        return dataset(
            {
                "exponent": (("alpha", "beta"), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("alpha", "beta"), self.stderr, "standard error of the exponent"),
                "attractor": (("start",), list(self.attractors), "motion of each start"),
            },
            {"alpha": self.alpha, "beta": self.beta},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, grid, share of stable strengths, motion."""
        return (
            ("scene", repr(self.scene)),
            ("grid", f"{len(self.alpha)} alpha {ends_of(self.alpha)}, {len(self.beta)} beta {ends_of(self.beta)}"),
            ("negative", f"{float((self.exponent < 0).mean()):.1%} of the grid"),
            ("motion", ", ".join(dict.fromkeys(self.attractors))),
            ("average", f"{self.time:.6g} units of time for each start"),
        )

    @property
    def contours(self) -> tuple[np.ndarray, ...]:
        """The zero contour as lines, each of shape (points, 2), of alpha and beta."""
        from contourpy import contour_generator

        lines = contour_generator(self.alpha, self.beta, self.exponent.T).lines(0.0)
        return tuple(np.asarray(line) for line in lines)

    def as_dict(self) -> dict[str, object]:
        """Return the function for JSON.

        Returns
        -------
        dict
            alpha, beta, exponent and stderr (rows of alpha), contours, attractors and time.
        """
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
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> MSF:
    """Compute the master stability function of an oscillator and coupling on a line.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator and the coupling.
    alpha : array_like, shape (m,)
        Increasing real strengths alpha = -sigma gamma.
    precision, periods, transient, starts, rtol, seed
        See `synchain.runtime.exponents`.
    workers, show_progress, progress, parameters, **more
        See `synchain.runtime.exponents`.

    Returns
    -------
    MSF

    Raises
    ------
    ValueError
        If the strengths do not increase, and as in `exponents`.
    FloatingPointError
        If an integration fails.
    """
    expect_vanishing("msf", a_scene(scene).equations)
    line = row("alpha", alpha, 2, rising=True)
    fine = np.union1d(line, np.linspace(line[0], line[-1], FINE))
    given = Given(msf, parameters, more, ORBITS)
    averaging = Averaging(precision, periods, transient, seed, Execution(workers, None, show_progress, progress))
    return MSF(_known(given, scene), line, transversal(given, scene, fine, starts, rtol, averaging))


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
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Plane:
    """Compute the master stability function on the rectangle alpha + i beta = -sigma gamma.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator and the coupling.
    alpha : array_like, shape (a,)
        Increasing real parts.
    beta : array_like, shape (b,)
        Increasing imaginary parts. Conjugate strengths have the same exponent, so that only abs(beta)
        is integrated.
    precision, periods, transient, starts, rtol, seed
        See `synchain.runtime.exponents`.
    workers, show_progress, progress, parameters, **more
        See `synchain.runtime.exponents`.

    Returns
    -------
    Plane

    Raises
    ------
    ValueError
        If a row does not increase, and as in `exponents`.
    FloatingPointError
        If an integration fails.
    """
    expect_vanishing("plane", a_scene(scene).equations)
    across, up = row("alpha", alpha, 2, rising=True), row("beta", beta, 2, rising=True)
    heights, place = np.unique(np.abs(up), return_inverse=True)
    given = Given(plane, parameters, more, ORBITS)
    averaging = Averaging(precision, periods, transient, seed, Execution(workers, None, show_progress, progress))
    strengths = (across[:, None] + 1j * heights).reshape(-1)
    half_plane = transversal(given, scene, strengths, starts, rtol, averaging)
    table, error = (row.reshape(len(across), -1)[:, place] for row in (half_plane.exponent, half_plane.stderr))
    kinds = tuple(a.kind for a in half_plane.attractors)
    return Plane(_known(given, scene), across, up, table, error, kinds, half_plane.time)


def _known(given: Given, scene: Scene) -> Scene:
    """The scene with its parameters; a lone oscillator has none of the links."""
    return with_numbers(scene, {name: value for name, value in given.values.items() if scene.takes(name)})


def classify(intervals: Sequence[Interval], end: float, begin: float = 0.0) -> StabilityClass:
    """Classify a function that is negative on some intervals of its grid.

    Parameters
    ----------
    intervals : sequence of (float, float)
        Intervals of alpha with a negative exponent.
    end, begin : float
        Ends of the grid.

    Returns
    -------
    StabilityClass
    """
    if not intervals:
        return StabilityClass.NEVER
    if len(intervals) > 1:
        return StabilityClass.SEVERAL
    low, high = intervals[0]
    if high < end:
        return StabilityClass.BOUNDED
    return StabilityClass.HALF_LINE if low > begin else StabilityClass.EVERYWHERE

"""Compute the master stability function of a scene: exponents, ranges of negative exponents, and stability class.

Each stage takes the result of the stage before:

1. `exponents.coupled_cell`: scene and keywords → one cell with a link between equal oscillators.
2. `exponents.orbits_of`: cell, strengths alpha → `OrbitProblem` of the modes, and initial states.
3. `exponents.along`: problem, initial states → `Exponents`. After the transient of each start, `find_attractor`
   looks for a fixed point or a cycle, whose exponents follow from eigenvalues; a `March` averages other motion.
4. Here: `Exponents` on a line → `MSF`, with the stability class and the windows of sigma of the network.
   `exponent_plane`: `Exponents` on a grid → `Plane`. If an axis is a parameter of the scene, stages 2 and 3 run for
   each synchronous orbit.

Sources: classes by the zeros of the function on alpha > 0, Huang, Chen, Lai & Pecora, Phys. Rev. E
80, 036204 (2009); several intervals ("ragged"), Stefański, Perlikowski & Kapitaniak, Phys. Rev. E
75, 016210 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.inputs.display import HasPlot
from synchain.models.scenes.open_stops import without_open_stops
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.sweeps.axis import Axis

from ..cells.run_keywords import ORBITS, Given, with_numbers
from ..prediction.intervals import Interval
from ..prediction.mode_windows import NetworkMode, defective_rows
from ..prediction.synchronisability import Answer, Verdict, Window, verdict, windows
from ..results.labelled import Labelled, as_json, dataset, scene_text
from ..support.arrays import row
from ..support.error_text import range_text
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, document_keywords
from .exponents import Exponents, exponent_rows, transversal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FINE = 1001
"""Least number of strengths of a master stability function; ends of ranges are interpolated between strengths (a
choice)."""


STRENGTH_COUNT, TOP = 241, 1.2
"""Default number of strengths of a function, and the last strength if the scene determines none: 1.2, as in the figures
of
the paper."""


class StabilityClass(StrEnum):
    """Stability class: the number and position of the zeros of a master stability function on the grid of alpha.

    NEVER: the function is positive and has no zero. EVERYWHERE: it is negative and has no zero.
    HALF_LINE: it is negative from one zero to the end of the grid. BOUNDED: it is negative in one
    interval, which may begin with the grid. UNDECIDED: no exponent is negative by more than its error, but
    some may be negative.
    """

    NEVER = "never stable"
    EVERYWHERE = "stable everywhere"
    HALF_LINE = "half-line"
    BOUNDED = "bounded interval"
    SEVERAL = "several intervals"
    UNDECIDED = "undecided within the errors"


@dataclass(frozen=True, slots=True, repr=False)
class MSF(Labelled):
    """Master stability function on a line of real strengths.

    Parameters
    ----------
    scene : Scene
        Scene with the oscillator, the coupling, their parameters and a network.
    alpha : ndarray, shape (m,)
        Requested strengths.
    fine : Exponents
        The exponents at 1001 strengths or more, among them `alpha`.

    See Also
    --------
    synchain.msf
    """

    scene: Scene
    alpha: np.ndarray
    fine: Exponents

    @property
    def data(self) -> xr.Dataset:
        """The function over alpha, and the intervals in which the function is negative."""
        windows = () if self._why_no_windows else self.windows
        return dataset(
            {
                "exponent": (("alpha",), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("alpha",), self.stderr, "standard error of the exponent"),
                "interval": (("range", "end"), np.reshape(self.intervals, (-1, 2)), "alpha with a negative exponent"),
                "interval_error": (("range", "end"), np.reshape(self.uncertainties, (-1, 2)), "errors of the ends"),
                "window": (
                    ("window_number", "end"),
                    np.reshape([(w.low, w.high) for w in windows], (-1, 2)),
                    "sigma at which every mode of the network dies out",
                ),
            },
            {"alpha": self.alpha, "end": ["low", "high"]},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, class, stable ranges of alpha and sigma, whether the network can synchronise, sizes, motion."""
        fine, unknown = self.fine, self._why_no_windows
        sigma = [unknown] if unknown else [window.text() for window in self.windows]
        possible = [] if unknown else [("possible", self.verdict.text), *defective_rows(self.scene.topology)]
        rows = [
            ("scene", scene_text(self.scene)),
            ("strength", f"alpha = -sigma gamma{coupling_text(self.scene)}, {range_text(fine.alpha)}"),
            ("class", f"{self.kind}{f' ({self.gamma})' if self.gamma else ''}"),
            ("negative for alpha", fine.negative),
            *[("sigma", text) for text in sigma or ["none"]],
            *possible,
            *exponent_rows(fine.exponent, fine.stderr, fine.motions, fine.time, self.scene.period, fine.error_at_zero),
            *fine.accuracy,
        ]
        if any("..." in text for _, text in rows):
            rows.append(("...", "the grid of alpha ends here, the range may go on"))
        return tuple(rows)

    @property
    def _why_no_windows(self) -> str:
        """The reason why windows are not defined for the network; empty if they are defined."""
        graph = self.scene.topology
        if not graph.link_count:
            return "not known: no links"
        if not graph.undirected and any(isinstance(value, complex) for value in graph.spectrum.values):
            return f"not known: {graph.name}({graph.n}) has complex eigenvalues, which need `plane`"
        try:
            windows((), graph)
        except ValueError as problem:
            return f"not known: {problem}"
        return ""

    @property
    def verdict(self) -> Verdict:
        """Whether the network can synchronise for some sigma > 0; GRID_ENDS if a longer grid may change the answer."""
        on_grid = verdict(self.intervals, self.scene.topology, self.errors)
        first, last = self.fine.alpha[[0, -1]]
        longer = [(min(a, 0.0) if a == first else a, math.inf if b == last else b) for a, b in self.intervals]
        same = verdict(longer, self.scene.topology, self.errors).answer == on_grid.answer
        return on_grid if same else replace(on_grid, answer=Answer.GRID_ENDS)

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
        """Ranges of alpha with a negative exponent; for a network the function counts as positive beyond the grid."""
        return self.fine.intervals

    @property
    def uncertainties(self) -> tuple[Interval, ...]:
        """Errors of the ends of the intervals, from averages and interpolation; 0 at an end of the grid."""
        return tuple((low, high) for (_, low), (_, high) in self.fine.ranges)

    @property
    def kind(self) -> StabilityClass:
        """Class of the function on its grid; only signs that are certain count."""
        if self.undecided and not self.intervals:
            return StabilityClass.UNDECIDED
        return classify(self.intervals, float(self.fine.alpha[-1]), float(self.fine.alpha[0]))

    @property
    def gamma(self) -> str:
        """Class Γ0, Γ1, Γ2 … by the number of zeros on alpha > 0; empty if the function is not positive at first."""
        alpha, inside = self.fine.alpha, [end for pair in self.intervals for end in pair]
        if (
            self.kind is StabilityClass.UNDECIDED
            or alpha[-1] <= 0.0
            or any(low <= max(alpha[0], 0.0) for low, _ in self.intervals)
        ):
            return ""
        return f"Γ{sum(0.0 < end < alpha[-1] for end in inside)}"

    @property
    def undecided(self) -> tuple[Interval, ...]:
        """Ranges of alpha where the exponent changes its sign by less than two standard errors."""
        return self.fine.undecided

    @property
    def attractors(self) -> tuple[str, ...]:
        """Kind of motion of each start."""
        return tuple(attractor.kind for attractor in self.fine.attractors)

    @property
    def errors(self) -> tuple[Interval, ...] | None:
        """The uncertainties of the ends of the intervals; None if an average was too short to estimate them."""
        uncertainties = self.uncertainties
        return uncertainties if np.isfinite(uncertainties).all() else None

    @property
    def windows(self) -> tuple[Window, ...]:
        """Ranges of sigma in which every mode of the scene's network is stable.

        The eigenvalues must be real. An end of a window that follows from an end of the grid has no mode that becomes
        unstable, and an infinite error. If an average was too short to estimate errors, all errors except those at
        sigma = 0 are infinite.
        """
        first, last = map(float, self.fine.alpha[[0, -1]])
        windows_of_modes = windows(self.intervals, self.scene.topology, self.errors)

        def lost(sigma: float, mode: NetworkMode | None, grid_end: float) -> NetworkMode | None:
            """Return the mode that becomes unstable at an end; None if its strength there is the end of the grid."""
            return None if mode is None or math.isclose(sigma * mode.size, grid_end, rel_tol=1e-12) else mode

        def uncertainty(sigma: float, mode: NetworkMode | None, error: float) -> float:
            return 0.0 if sigma == 0.0 else error if self.errors is not None and mode is not None else math.inf

        trimmed = []
        for w in windows_of_modes:
            low, high = lost(w.low, w.low_mode, first), lost(w.high, w.high_mode, last)
            errors = (uncertainty(w.low, low, w.low_error), uncertainty(w.high, high, w.high_error))
            trimmed.append(replace(w, low_mode=low, high_mode=high, low_error=errors[0], high_error=errors[1]))
        return tuple(trimmed)

    def plot(self, ax: Axes | None = None, sigma: float | None = None, **style: Any) -> Axes:
        """Draw exponents over the strength of a mode, with the modes of the network marked on the curve.

        Grey bands are the ranges of negative exponents, the blue band is two standard errors wide
        on either side.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default pyplot's current ones, or those of a new figure.
        sigma : float, optional
            Coupling strength for which the modes are marked, at ``sigma |gamma|``; by default that of the scene.
        **style
            Keywords of the curve, such as `color` and `linewidth`.

        Returns
        -------
        matplotlib axes

        Examples
        --------
        >>> import synchain as sc
        >>> function = sc.msf(sc.Scene("duffing", "spring", sc.graphs.chain(4)), [0, 0.1, 0.2], periods=50)
        >>> axes = function.plot(sigma=0.05)
        """
        axes: Axes = HasPlot.plot(self, ax, sigma=sigma, **style)
        return axes

    def as_dict(self) -> dict[str, object]:
        """Return the function for JSON.

        Returns
        -------
        dict
            alpha, exponent, stderr, intervals, uncertainties, class, attractors, time, starts, windows and verdict. The
            windows and the verdict are None if the network has no links, or complex eigenvalues.
        """
        judged = not self._why_no_windows
        return as_json(
            {
                "alpha": self.alpha,
                "exponent": self.exponent,
                "stderr": self.stderr,
                "intervals": self.intervals,
                "uncertainties": self.uncertainties,
                "class": self.kind.value,
                "attractors": self.attractors,
                "time": self.fine.time,
                "starts": self.fine.starts,
                "windows": [window.as_dict() for window in self.windows] if judged else None,
                "verdict": self.verdict.as_dict() if judged else None,
            }
        )


@document_keywords
def msf(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray | None = None,
    *,
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    starts: int = 4,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
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
    alpha : array_like, shape (m,), optional
        Increasing real strengths alpha = -sigma gamma. By default 241 strengths from 0 on, which cover all modes of the
        network at the values of sigma that the scene sweeps, or up to twice the scene's sigma. If sigma is 0, they end
        at 1.2.
    {orbits}
    {parameters}

    Returns
    -------
    MSF

    Raises
    ------
    ValueError
        If the strengths do not increase, and as in `exponents`.
    FloatingPointError
        If an integration fails.

    See Also
    --------
    plane : Takes complex strengths, or parameters as axes.
    exponents : Computes the exponents of given modes.

    Examples
    --------
    >>> import synchain as sc
    >>> function = sc.msf(sc.Scene("duffing", "spring", sc.graphs.chain(4), parameters={"sigma": 0.1}), periods=50)
    >>> float(function.alpha[0]), round(float(function.alpha[-1]), 10)
    (0.0, 0.69)
    """
    averaging = Averaging.for_scene(
        scene, precision, periods, transient, rng, Execution(workers, None, show_progress, progress)
    )
    return on_a_line(Given(msf, parameters, more, ORBITS), scene, alpha, starts, rtol, averaging)


def on_a_line(
    given: Given,
    scene: Scene,
    alpha: Sequence[float] | np.ndarray | None,
    starts: int,
    rtol: float | None,
    averaging: Averaging,
) -> MSF:
    """Compute a master stability function, for the arguments of a public function."""
    expect_vanishing(given.function.__name__, without_open_stops(with_parameters(given, check_scene(scene))).equations)
    line = row(
        "alpha",
        default_strengths(with_parameters(given, scene, scene.axes)) if alpha is None else alpha,
        2,
        rising=True,
    )
    fine = np.union1d(line, np.linspace(line[0], line[-1], FINE))
    return MSF(with_parameters(given, scene), line, transversal(given, scene, fine, starts, rtol, averaging))


def coupling_text(scene: Scene) -> str:
    """Return the coupling for a summary; also for a lone oscillator with a single coupling."""
    return f" (coupling: {scene.coupling})" if scene.coupling else ""


def with_parameters(given: Given, scene: Scene, axes: Sequence[Axis] = ()) -> Scene:
    """Return the scene with the parameters of a call that it takes, and with the axes that the call does not fix."""
    values = {name: value for name, value in given.values.items() if scene.takes(name)}
    return with_numbers(scene, values, axes=[axis for axis in axes if axis.name not in values])


def default_strengths(scene: Scene, count: int = STRENGTH_COUNT) -> np.ndarray:
    """Return strengths (count,) from 0 on that cover all modes of a network at every sigma that the scene sweeps.

    If the scene does not sweep sigma, cover twice its sigma. Without links, and if sigma is 0, the strengths end at
    TOP.
    """
    low = high = 0.0
    if len(scene.model.linked) == 1:
        swept = next((axis.values for axis in scene.axes if axis.name == scene.strength), None)
        sigma = (2.0 * scene.parameters[scene.strength],) if swept is None else swept
        largest = max(abs(value) for value in scene.topology.spectrum.values)
        low, high = (_rounded_up(largest * end(0.0, *sigma)) for end in (min, max))
    return np.linspace(low, high if high > low else TOP, count)


def _rounded_up(value: float) -> float:
    """Return a number, rounded away from zero to two digits."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 1)
    return float(f"{math.copysign(math.ceil(abs(value) / unit * (1.0 - 1e-12)) * unit, value):.2g}")


def classify(intervals: Sequence[Interval], end: float, begin: float = 0.0) -> StabilityClass:
    """Return the class of a function that is negative on some intervals of a grid from `begin` to `end`."""
    if not intervals:
        return StabilityClass.NEVER
    if len(intervals) > 1:
        return StabilityClass.SEVERAL
    low, high = intervals[0]
    if high < end:
        return StabilityClass.BOUNDED
    return StabilityClass.HALF_LINE if low > begin else StabilityClass.EVERYWHERE

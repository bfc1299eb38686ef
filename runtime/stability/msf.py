"""Compute the master stability function of a scene: exponents, ranges of negative exponents, and stability class.

Each stage takes the result of the stage before:

1. `exponents.coupled_cell`: scene and keywords → one cell with a link between equal oscillators.
2. `exponents.orbits_of`: cell, strengths alpha → `OrbitProblem` of the modes, and initial states.
3. `exponents.along`: problem, initial states → `Exponents`. After the transient of each start, `find_attractor`
   looks for a fixed point or a cycle, whose exponents follow from eigenvalues; a `March` averages other motion.
4. Here: `Exponents` on a line → `MSF`, with the stability class and the windows of sigma of the network;
   `Exponents` on a grid → `Plane`. If an axis is a parameter of the scene, stages 2 and 3 run for each
   synchronous orbit.

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
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.open_stops import without_open_stops
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.sweeps.axis import Axis

from ..cells.run_keywords import ORBITS, Given, chosen, with_numbers
from ..prediction.intervals import Interval
from ..prediction.mode_windows import NetworkMode, defective_rows
from ..prediction.mode_windows import transversal_modes as network_modes
from ..prediction.synchronisability import Answer, Verdict, Window, verdict, windows, windows_complex
from ..results.labelled import Labelled, as_json, dataset, drive_text, scene_text
from ..support.arrays import row
from ..support.error_text import range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, document_keywords
from .exponents import RTOL, Exponents, coupled_cell, exponent_rows, transversal, with_partner
from .largest_exponents import check_parameters, largest_exponents
from .transversal_modes import SharedOrbit, shared_orbits, still_strengths, transversal_modes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STRENGTHS = ("alpha", "beta")
"""Axes of a plane with these names are the real and imaginary part of a mode's strength. A parameter may have one of
these
names too."""

NAMES = frozenset(
    {"attractor", "attractors", "contours", "exponent", "mode", "modes", "number", "start", "stderr", "windows"}
)
"""Names in the data of a plane that no axis may have, in addition to the reserved names of all results."""

MOST_MODES = 6
"""Largest number of modes in a summary (a choice)."""

LOOKED_UP = 2001
"""Number of values of sigma at which the exponents of a network's modes are interpolated in a plane (a choice)."""

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
            ("strength", f"alpha = -sigma gamma{_coupling(self.scene)}, {range_text(fine.alpha)}"),
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
        """Ranges of alpha with a negative exponent."""
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
        windows_of_modes = windows(self.open_ranges, self.scene.topology, self.errors)

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

    @property
    def open_ranges(self) -> tuple[Interval, ...]:
        """The intervals that are used for a network, for which the function counts as positive beyond the grid."""
        return self.intervals

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


@dataclass(frozen=True, slots=True, repr=False)
class Plane(Labelled):
    """Exponents over two axes: strengths of a mode, parameters of the scene, or one of each.

    Parameters
    ----------
    scene : Scene
        Scene with the oscillator, the coupling and a network.
    across, up : ndarray, shapes (a,) and (b,)
        The values of the axes.
    exponent : ndarray, shape (a, b)
        Exponents per unit of non-dimensional time. Over two parameters, the largest exponent of all transversal modes.
    stderr : ndarray, shape (a, b)
        Standard errors.
    attractors : ndarray of str, shape (a or 1, b or 1, starts)
        Kind of motion of each start. The length is 1 along an axis that does not change the synchronous orbit.
    time : float
        Length of the longest average.
    names : (str, str)
        Names of the axes: "alpha", "beta", or parameters.
    modes : tuple of str
        Over two parameters, the exact eigenvalues of each transversal mode, one for each layer; for layers that do not
        commute, the nodes of each block of differences.
    mode : ndarray of int, shape (a, b), optional
        Index in `modes` of the mode with the largest exponent.
    strengths : tuple of str
        Names of the axes that are strengths of a mode; all other axes are parameters.

    See Also
    --------
    synchain.plane
    """

    scene: Scene
    across: np.ndarray
    up: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    attractors: np.ndarray
    time: float
    names: tuple[str, str] = STRENGTHS
    modes: tuple[str, ...] = ()
    mode: np.ndarray | None = None
    strengths: tuple[str, ...] = STRENGTHS

    @property
    def parameters(self) -> tuple[str, ...]:
        """The axes that are parameters."""
        return tuple(name for name in self.names if name not in self.strengths)

    @property
    def data(self) -> xr.Dataset:
        """The exponents over both axes."""
        moving = [name for name, size in zip(self.names, self.attractors.shape, strict=False) if size > 1]
        variables: dict[str, tuple[Sequence[str], Any, str]] = {
            "exponent": (self.names, self.exponent, "largest transversal exponent per unit of time"),
            "stderr": (self.names, self.stderr, "standard error of the exponent"),
            "attractor": ((*moving, "start"), self.motion, "motion of each start"),
        }
        if self.mode is not None:
            variables["mode"] = (self.names, self.mode, "the mode with the largest exponent, by its place in modes")
            variables["modes"] = (("number",), list(self.modes), "eigenvalues of each transversal mode")
        return dataset(variables, dict(zip(self.names, (self.across, self.up), strict=True)), self.scene)

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, grid, zero contours, stable points, the largest modes, stable ranges of sigma, sizes, motion."""
        axes, stable = list(zip(self.names, (self.across, self.up), strict=True)), self.exponent < 0
        strength = "alpha = -sigma gamma" if self.parameters else "alpha + i beta = -sigma gamma"
        modes = f"the largest of {len(self.modes)} transversal modes of {self.scene.n} nodes"
        imaginary = STRENGTHS[1] if STRENGTHS[1] in self.strengths else None
        labels = [f"{name} (imaginary part)" if name == imaginary else name for name in self.names]
        grid = [f"{len(values)} {label} {range_text(values)}" for label, (_, values) in zip(labels, axes, strict=True)]
        contours = [
            ", ".join(
                f"{name} {with_error(part.min())} … {with_error(part.max())}"
                for name, part in zip(self.names, line.T, strict=True)
            )
            for line in self.contours
        ]
        rows = [
            ("scene", scene_text(self.scene, self.parameters)),
            ("exponents", modes if self.modes else f"{strength}{_coupling(self.scene)}"),
            ("grid", ", ".join(grid)),
            *[("zero contour", text) for text in contours or ["none"]],
            ("negative", f"at {stable.sum()} of {stable.size} points, {stable.mean():.1%}"),
        ]
        if self.mode is not None:  # list the most frequent modes first
            counts = np.bincount(self.mode.ravel(), minlength=len(self.modes))
            gammas = [text if ", " in text else text[1:-1] for text in self.modes]  # no brackets for one layer
            most = [k for k in np.argsort(-counts, kind="stable")[:MOST_MODES] if counts[k]]
            rows += [("largest for", f"gamma = {gammas[k]}, at {counts[k]} of {stable.size} points") for k in most]
        if self.has_windows:
            rows += [("sigma", window.text(errors=False)) for window in self.windows] or [
                ("sigma", "none in this plane")
            ]
            rows += defective_rows(self.scene.topology)
        attractors = self.attractors.reshape(-1).tolist()
        period = self.scene.period if drive_text(self.scene, self.parameters) else None
        rows += exponent_rows(self.exponent, self.stderr, attractors, self.time, period)
        if any("..." in text for _, text in rows):
            rows.append(("...", "a mode leaves the plane here, the range may go on"))
        return tuple(rows)

    @property
    def has_windows(self) -> bool:
        """True if both axes are strengths of a mode and the scene has a network."""
        return not self.parameters and self.scene.topology.link_count > 0

    @property
    def windows(self) -> tuple[Window, ...]:
        """Ranges of sigma in which every mode of the scene's network is stable, if both axes are strengths.

        The exponent is interpolated between the strengths, and counts as positive beyond the plane.
        """
        from scipy.interpolate import RegularGridInterpolator

        # find the largest sigma, minus a rounding error, at which the strengths -sigma gamma of all modes are in the
        # plane
        graph, units = self.scene.topology, [-complex(m.eigenvalue.value) for m in network_modes(self.scene.topology)]
        beta = max(-self.up[0], self.up[-1]) if self.up[0] < 0 else self.up[-1]
        across = [
            (self.across[-1] if unit.real > 0 else -self.across[0]) / abs(unit.real) for unit in units if unit.real
        ]
        limits = [*across, *(beta / abs(unit.imag) for unit in units if unit.imag)]
        top = (1 - 1e-12) * float(min(limits, default=0.0))
        if top <= 0.0:
            return ()
        # interpolation needs finite numbers; conjugate strengths have the same exponent, so `stable` tries both
        size = np.max(np.abs(self.exponent[np.isfinite(self.exponent)]), initial=1e-300)
        value = np.nan_to_num(self.exponent, nan=size, posinf=size, neginf=-size)
        at = RegularGridInterpolator((self.across, self.up), value, bounds_error=False, fill_value=math.inf)

        def stable(points: np.ndarray) -> np.ndarray:
            pairs = [at(np.stack([points.real, sign * points.imag], axis=1)) for sign in (1.0, -1.0)]
            return np.asarray(np.minimum(*pairs) < 0)

        return windows_complex(stable, graph, np.linspace(0.0, top, LOOKED_UP), 1e-6 * top).windows

    @property
    def motion(self) -> np.ndarray:
        """Kind of motion; dimensions are the axes that change the synchronous orbit, followed by the starts."""
        along = [size for size in self.attractors.shape[:2] if size > 1]
        return self.attractors.reshape([*along, self.attractors.shape[2]])

    @property
    def contours(self) -> tuple[np.ndarray, ...]:
        """Lines of the zero contour, each of shape (points, 2), in the coordinates of both axes."""
        from contourpy import contour_generator

        lines = contour_generator(self.across, self.up, self.exponent.T).lines(0.0)
        return tuple(np.asarray(line) for line in lines)

    def as_dict(self) -> dict[str, object]:
        """Return the exponents for JSON.

        Returns
        -------
        dict
            Both axes by their names, exponent and stderr (one row for each value of the first axis), contours,
            attractors, time and windows. The windows are None unless both axes are strengths and the scene has links.
            Over two parameters, also "modes" and "mode".
        """
        of_modes = {} if self.mode is None else {"modes": self.modes, "mode": self.mode}
        return as_json(
            {
                self.names[0]: self.across,
                self.names[1]: self.up,
                "exponent": self.exponent,
                "stderr": self.stderr,
                "contours": self.contours,
                "attractors": self.motion,
                "time": self.time,
                **of_modes,
                "windows": [window.as_dict() for window in self.windows] if self.has_windows else None,
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
    expect_vanishing(given.function.__name__, without_open_stops(_with_parameters(given, check_scene(scene))).equations)
    line = row(
        "alpha",
        default_strengths(_with_parameters(given, scene, scene.axes)) if alpha is None else alpha,
        2,
        rising=True,
    )
    fine = np.union1d(line, np.linspace(line[0], line[-1], FINE))
    return MSF(_with_parameters(given, scene), line, transversal(given, scene, fine, starts, rtol, averaging))


@document_keywords
def plane(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray | None = None,
    beta: Sequence[float] | np.ndarray | None = None,
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
    parameters: Mapping[str, float | Sequence[float] | np.ndarray] | None = None,
    **more: float | Sequence[float] | np.ndarray,
) -> Plane:
    """Compute transversal exponents over two axes: strengths of a mode, parameters of the scene, or one of each.

    ``plane(scene, alpha, beta)`` computes the master stability function over alpha + i beta = -sigma gamma.
    ``plane(scene, alpha, g=values)`` computes it over alpha and a parameter that changes the synchronous orbit, such as
    the strength of links that act between equal states. ``plane(scene, k=values, g=values)`` computes the largest
    exponent of all transversal modes of the scene's network over two parameters, such as the strengths of two layers of
    links. Exponents are computed along every synchronous orbit.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator and the coupling. Over two parameters, a network.
    alpha : array_like, shape (a,), optional
        Increasing real parts.
    beta : array_like, shape (b,), optional
        Increasing imaginary parts. Conjugate strengths have the same exponent, so that exponents are
        computed at abs(beta) only.
    {orbits}
    parameters, **more
        Parameters of the scene. A number sets a parameter; an increasing sequence of numbers makes an axis.

    Returns
    -------
    Plane

    Raises
    ------
    ValueError
        If there are not two axes, if the values of an axis do not increase or have no effect, and as in `exponents`.
    FloatingPointError
        If an integration fails.

    See Also
    --------
    synchain.msf
    synchain.exponents

    References
    ----------
    Several layers: Sorrentino, New J. Phys. 14, 033035 (2012); links that act between equal states: Belykh, de Lange &
    Hasler, Phys. Rev. Lett. 94, 188101 (2005).

    Examples
    --------
    >>> import synchain as sc
    >>> node = sc.Field({"x": "v", "v": "x - x**3 - 0.25*v + 0.4*cos(t)"}, initial={"x": 0.5})
    >>> scene = sc.Scene(node, "v->v", sc.graphs.ring(4), time_unit="time")
    >>> found = sc.plane(scene, [0.0, 0.5, 1.0], [0.0, 1.0], starts=1, periods=200, show_progress=False)
    >>> found.exponent.shape
    (3, 2)
    """
    execution = Execution(workers, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, rng, execution)
    call = Given(plane, parameters, more, ORBITS)
    call.checked(with_partner(scene))
    rows, fixed = call.parted()

    # collect the two axes: strengths of a mode, or parameters
    strengths = {name: values for name, values in zip(STRENGTHS, (alpha, beta), strict=True) if values is not None}
    if both := strengths.keys() & rows.keys():
        raise ValueError(
            f"plane: found an axis of strengths and one of a parameter, both named {min(both)!r}; expected two names; "
            "rename the parameter"
        )
    if len(strengths) + len(rows) != 2 or list(strengths) == ["beta"]:
        raise ValueError(
            f"plane: found the axes {', '.join((*strengths, *rows)) or 'none'}; expected alpha and beta, alpha and a "
            "parameter, or two parameters, each with a row of values"
        )
    expect_free("plane", rows, NAMES)
    axes = {name: row(name, values, 2, rising=True) for name, values in (*strengths.items(), *rows.items())}
    shown = _with_parameters(fixed, scene)
    if rows:
        return _over_parameters(shown, call, scene, axes, tuple(strengths), starts, rtol, averaging)

    # both axes are strengths: integrate all modes along one orbit, and only one of two conjugate strengths
    if "beta" not in call.values and check_scene(scene).takes("beta"):
        warn(
            "plane: found beta, the imaginary part of strengths, and a parameter of that name; "
            "write parameters={'beta': …} for the parameter",
            UserWarning,
        )
    expect_vanishing("plane", without_open_stops(_with_parameters(fixed, check_scene(scene))).equations)
    across, up = axes.values()
    heights, index = np.unique(np.abs(up), return_inverse=True)
    half_plane = transversal(fixed, scene, (across[:, None] + 1j * heights).reshape(-1), starts, rtol, averaging)
    table, error = (values.reshape(len(across), -1)[:, index] for values in (half_plane.exponent, half_plane.stderr))
    return Plane(shown, across, up, table, error, _kinds(half_plane)[None, None], half_plane.time)


def _over_parameters(
    shown: Scene,
    call: Given,
    scene: Scene,
    axes: Mapping[str, np.ndarray],
    strengths: tuple[str, ...],
    starts: int,
    rtol: float | None,
    averaging: Averaging,
) -> Plane:
    """Compute exponents over two axes, one synchronous orbit after the other.

    `strengths`: names of the axes that are strengths of a mode.
    """
    rows = {name: values for name, values in axes.items() if name not in strengths}
    if len(rows) == 2 and not check_scene(scene).model.linked:
        raise ValueError(
            "plane: found two parameters and a scene without links; expected a network, or alpha and a parameter"
        )
    if not strengths:  # the exponents depend on all strengths of the scene
        call.expect_one_cell(scene)
    _, fixed = call.parted()
    at_first = {**fixed.values, **{name: values[0] for name, values in rows.items()}}
    cell = coupled_cell(replace(fixed, table=at_first), scene, chosen(scene, "rtol", rtol, RTOL))
    still = still_strengths(cell)
    for name in rows:
        if strengths and name in still and len(cell.strengths) == 1:
            raise ValueError(
                f"plane: found the axes alpha and {name}; expected another parameter: alpha = -{name} gamma"
            )
    check_parameters("plane", cell, {name: values[-1:] for name, values in rows.items()})

    # group the points of the grid by synchronous orbit
    (first, second), shape = axes, tuple(map(len, axes.values()))
    modes = () if strengths else tuple(map(str, transversal_modes(cell)))
    if modes:
        grid = np.meshgrid(*axes.values(), indexing="ij")
        orbits = list(shared_orbits(cell, {name: values.ravel() for name, values in zip(axes, grid, strict=True)}))
    else:  # one orbit for each value of the parameter, with all strengths alpha
        points = np.arange(math.prod(shape)).reshape(shape)
        place = np.arange(shape[0])[:, None]
        orbits = [SharedOrbit(points[:, k], {second: float(x)}, axes[first], place) for k, x in enumerate(axes[second])]

    found = largest_exponents(cell, orbits, starts, averaging)
    exponent, stderr, index = (values.reshape(shape) for values in (found.exponent, found.stderr, found.mode))
    unmoved = still if modes else strengths
    kinds = found.kinds.reshape(*shape, -1)
    attractors = kinds[tuple(slice(1) if name in unmoved else slice(None) for name in axes)]
    across, up = axes.values()
    mode_index = index if modes else None
    return Plane(
        shown, across, up, exponent, stderr, attractors, found.time, (first, second), modes, mode_index, strengths
    )


def _coupling(scene: Scene) -> str:
    """Return the coupling for a summary; also for a lone oscillator with a single coupling."""
    return f" (coupling: {scene.coupling})" if scene.coupling else ""


def _kinds(exponents: Exponents) -> np.ndarray:
    """Return the kind of motion (starts,) of each start."""
    return np.array([attractor.kind for attractor in exponents.attractors])


def _with_parameters(given: Given, scene: Scene, axes: Sequence[Axis] = ()) -> Scene:
    """Return the scene with the parameters of a call, and with the axes that the call does not fix.

    A lone oscillator has no parameters of links.
    """
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

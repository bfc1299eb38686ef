"""The master stability function of a scene: exponents, ranges where they are negative, their class.

Sources: classes by the zeros of the function on alpha > 0, Huang, Chen, Lai & Pecora, Phys. Rev. E
80, 036204 (2009); several intervals ("ragged"), Stefański, Perlikowski & Kapitaniak, Phys. Rev. E
75, 016210 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.dynamics.variational import mode
from synchain.models.inputs.checks import check_integer
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import ORBITS, Given, with_numbers
from ..prediction.intervals import Interval
from ..prediction.mode_windows import defective_rows
from ..prediction.mode_windows import transversal_modes as network_modes
from ..prediction.synchronisability import Answer, Verdict, Window, verdict, windows, windows_complex
from ..results.labelled import Labelled, as_json, dataset, drive_text, scene_text
from ..support.arrays import row
from ..support.error_text import range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging
from .exponents import Exponents, along, coupled_cell, exponent_rows, orbits_of, transversal, with_partner
from .transversal_modes import SharedOrbit, shared_orbits, still_strengths, transversal_modes

STRENGTHS = ("alpha", "beta")
"""What the axes of a plane are called that are strengths of a mode; a parameter may have such a name too."""

NAMES = frozenset(
    {"attractor", "attractors", "contours", "exponent", "mode", "modes", "number", "start", "stderr", "windows"}
)
"""What a plane has under these names beside those of all results."""

MOST_MODES = 6
"""Modes that a summary lists."""

LOOKED_UP = 2001
"""Values of sigma at which the modes of a network are looked up in a plane."""

FINE = 1001
"""Least number of strengths at which the function is computed; ends of ranges are interpolated."""


class StabilityClass(StrEnum):
    """Class of a master stability function by its zeros on the grid of alpha.

    NEVER has no zero and is positive, EVERYWHERE no zero and is negative. HALF_LINE is stable from
    one zero to the end of the grid. BOUNDED is one interval, which may begin with the grid.
    UNDECIDED has no exponent that is negative by more than its error, but some that may be.
    """

    NEVER = "never stable"
    EVERYWHERE = "stable everywhere"
    HALF_LINE = "half-line"
    BOUNDED = "bounded interval"
    SEVERAL = "several intervals"
    UNDECIDED = "undecided within the errors"


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
        """Scene, class, stable ranges of alpha and of sigma, whether the network can synchronise, sizes, motion."""
        fine, graph = self.fine, self.scene.topology
        sigma = [self._without_windows] if self._without_windows else [window.text() for window in self.windows]
        possible = [] if self._without_windows else [("possible", self.verdict.text), *defective_rows(graph)]
        rows = [
            ("scene", scene_text(self.scene)),
            ("strength", f"alpha = -sigma gamma{_coupling(self.scene)}, {range_text(fine.alpha)}"),
            ("class", f"{self.kind}{f' ({self.gamma})' if self.gamma else ''}"),
            ("negative for alpha", fine.negative),
            *[("sigma", text) for text in sigma or ["none"]],
            *possible,
            *exponent_rows(fine.exponent, fine.stderr, self.attractors, fine.time, self.scene.period),
            *fine.accuracy,
        ]
        if any("..." in text for _, text in rows):
            rows.append(("...", "the grid of alpha ends here, the range may go on"))
        return tuple(rows)

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
        if not graph.undirected and any(isinstance(value, complex) for value in graph.spectrum.values):
            return f"not known: {graph.name}({graph.n}) has complex eigenvalues, which need `plane`"
        try:
            windows((), graph)
        except ValueError as problem:
            return f"not known: {problem}"
        return ""

    @property
    def verdict(self) -> Verdict:
        """Whether the network can synchronise for some sigma > 0; GRID_ENDS if a longer line of alpha may change the answer."""
        found = verdict(self.intervals, self.scene.topology, self.errors)
        first, last = self.fine.alpha[[0, -1]]
        longer = [(0.0 if a == first else a, math.inf if b == last else b) for a, b in self.intervals]
        same = verdict(longer, self.scene.topology, self.errors).answer == found.answer
        return found if same else replace(found, answer=Answer.GRID_ENDS)

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
        """Class of the function on its grid, by the signs that are certain."""
        if self.undecided and not self.intervals:
            return StabilityClass.UNDECIDED
        return classify(self.intervals, float(self.fine.alpha[-1]), float(self.fine.alpha[0]))

    @property
    def gamma(self) -> str:
        """Class by the number of zeros on alpha > 0, Γ0, Γ1, Γ2 …, of a function that is positive before them; else empty."""
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
        """Ranges of alpha where the exponent seems to change its sign, but by less than two errors."""
        return self.fine.undecided

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

        Eigenvalues must be real. No mode is lost at an end that comes from an end of the grid: its error is infinite. So are
        those of ends at which one is, if an average was too short to estimate them.
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
            0.0 if end == 0.0 else error if known and mode is not None else math.inf
            for mode, end, error in zip(
                modes, (window.low, window.high), (window.low_error, window.high_error), strict=True
            )
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
            alpha, exponent, stderr, intervals, uncertainties, class, attractors, time, starts, windows and verdict; windows and
            verdict are None without links and for complex eigenvalues.
        """
        judged = not self._without_windows
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
        Exponents per unit of non-dimensional time; over two parameters the largest one of all transversal modes.
    stderr : ndarray, shape (a, b)
        Standard errors.
    attractors : ndarray of str, shape (a or 1, b or 1, starts)
        Kind of motion of each start; 1 for an axis that does not move the synchronous orbit.
    time : float
        Time averaged over, the longest one.
    names : (str, str)
        What the axes are: "alpha", "beta", or parameters.
    modes : tuple of str
        Over two parameters, the exact eigenvalues of each transversal mode, those of all layers together.
    mode : ndarray of int, shape (a, b), optional
        The mode with the largest exponent, by its place in `modes`.
    strengths : tuple of str
        The axes of these names are strengths of a mode; all others are parameters.
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
            ("grid", ", ".join(f"{len(values)} {self._called(name)} {range_text(values)}" for name, values in axes)),
            *[("zero contour", text) for text in contours or ["none"]],
            ("negative", f"at {stable.sum()} of {stable.size} points, {stable.mean():.1%}"),
        ]
        if self.mode is not None:  # the most frequent modes first
            counts = np.bincount(self.mode.ravel(), minlength=len(self.modes))
            gammas = [text if ", " in text else text[1:-1] for text in self.modes]  # of one layer without brackets
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
        """True if the plane is that of complex strengths and the scene has a network."""
        return not self.parameters and self.scene.topology.link_count > 0

    @property
    def windows(self) -> tuple[Window, ...]:
        """Ranges of sigma in which every mode of the scene's network is stable, if both axes are strengths.

        The exponent is interpolated between the strengths; beyond the plane it counts as unstable.
        """
        from scipy.interpolate import RegularGridInterpolator

        # rays -sigma gamma of the modes, up to the first that leaves the plane, less a rounding error
        graph, units = self.scene.topology, [-complex(m.eigenvalue.value) for m in network_modes(self.scene.topology)]
        beta = max(-self.up[0], self.up[-1]) if self.up[0] < 0 else self.up[-1]
        across = [
            (self.across[-1] if unit.real > 0 else -self.across[0]) / abs(unit.real) for unit in units if unit.real
        ]
        limits = [*across, *(beta / abs(unit.imag) for unit in units if unit.imag)]
        top = (1 - 1e-12) * float(min(limits, default=0.0))
        if top <= 0.0:
            return ()
        size = np.max(np.abs(self.exponent[np.isfinite(self.exponent)]), initial=1e-300)
        value = np.nan_to_num(self.exponent, nan=size, posinf=size, neginf=-size)
        at = RegularGridInterpolator((self.across, self.up), value, bounds_error=False, fill_value=math.inf)

        def stable(points: np.ndarray) -> np.ndarray:
            pairs = [at(np.stack([points.real, sign * points.imag], axis=1)) for sign in (1.0, -1.0)]
            return np.asarray(np.minimum(*pairs) < 0)

        return windows_complex(stable, graph, np.linspace(0.0, top, LOOKED_UP), 1e-6 * top).windows

    def _called(self, name: str) -> str:
        """What an axis is."""
        return f"{name} (imaginary part)" if name == STRENGTHS[1] and name in self.strengths else name

    @property
    def motion(self) -> np.ndarray:
        """Kind of motion of each start, along the axes that move the synchronous orbit and then the starts."""
        along = [size for size in self.attractors.shape[:2] if size > 1]
        return self.attractors.reshape([*along, self.attractors.shape[2]])

    @property
    def contours(self) -> tuple[np.ndarray, ...]:
        """The zero contour as lines, each of shape (points, 2), of both axes."""
        from contourpy import contour_generator

        lines = contour_generator(self.across, self.up, self.exponent.T).lines(0.0)
        return tuple(np.asarray(line) for line in lines)

    def as_dict(self) -> dict[str, object]:
        """Return the exponents for JSON.

        Returns
        -------
        dict
            Both axes by their names, exponent and stderr (rows of the first), contours, attractors, time and windows, None
            unless both axes are strengths and the scene has links; over two parameters "modes" and "mode" too.
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
    expect_vanishing("msf", check_scene(scene).equations)
    line = row("alpha", alpha, 2, rising=True)
    fine = np.union1d(line, np.linspace(line[0], line[-1], FINE))
    given = Given(msf, parameters, more, ORBITS)
    averaging = Averaging(precision, periods, transient, seed, Execution(workers, None, show_progress, progress))
    return MSF(_known(given, scene), line, transversal(given, scene, fine, starts, rtol, averaging))


def plane(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray | None = None,
    beta: Sequence[float] | np.ndarray | None = None,
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
    parameters: Mapping[str, float | Sequence[float] | np.ndarray] | None = None,
    **more: float | Sequence[float] | np.ndarray,
) -> Plane:
    """Compute transversal exponents over two axes: strengths of a mode, parameters of the scene, or one of each.

    ``plane(scene, alpha, beta)`` is the master stability function over alpha + i beta = -sigma gamma.
    ``plane(scene, alpha, g=values)`` is that over alpha and a parameter, such as the strength of links that act between equal
    states, which moves the synchronous orbit.  ``plane(scene, k=values, g=values)`` is the largest exponent of all
    transversal modes of the scene's network over two parameters, such as the strengths of two layers of links.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator and the coupling; over two parameters, a network whose layers have matrices that commute.
    alpha : array_like, shape (a,), optional
        Increasing real parts.
    beta : array_like, shape (b,), optional
        Increasing imaginary parts. Conjugate strengths have the same exponent, so that only abs(beta)
        is integrated.
    precision, periods, transient, starts, rtol, seed
        See `synchain.runtime.exponents`; the average is that along each synchronous orbit.
    workers, show_progress, progress
        See `synchain.runtime.exponents`.
    parameters, **more
        Parameters of the scene to set, by a number, or axes, by an increasing row of values.

    Returns
    -------
    Plane

    Raises
    ------
    ValueError
        If there are not two axes, if the values of one do not increase or do not matter, if matrices of layers do not
        commute, and as in `exponents`.
    FloatingPointError
        If an integration fails.

    References
    ----------
    Several layers: Sorrentino, New J. Phys. 14, 033035 (2012); links that act between equal states: Belykh, de Lange &
    Hasler, Phys. Rev. Lett. 94, 188101 (2005).
    """
    averaging = Averaging(precision, periods, transient, seed, Execution(workers, None, show_progress, progress))
    whole = Given(plane, parameters, more, ORBITS)
    whole.checked(with_partner(scene))
    rows, given = whole.parted()
    strengths = {name: values for name, values in zip(STRENGTHS, (alpha, beta), strict=True) if values is not None}
    if beta is not None and "beta" not in whole.values and check_scene(scene).takes("beta"):
        warn(
            "plane: found beta, the imaginary part of strengths, and a parameter of that name; "
            "write parameters={'beta': …} for the parameter",
            UserWarning,
        )
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
    known = _known(given, scene)
    if len(rows) == 2 and not check_scene(scene).model.linked:
        raise ValueError(
            "plane: found two parameters and a scene without links; expected a network, or alpha and a parameter"
        )
    if rows:
        if not strengths:  # exponents depend on all those of the scene
            whole.expect_one_cell(scene)
        cell = coupled_cell(
            replace(given, table={**given.values, **{name: axes[name][0] for name in rows}}), scene, rtol
        )
        _check_parameters(cell, {name: axes[name] for name in rows}, bool(strengths))
        return _over_parameters(known, cell, axes, tuple(strengths), starts, averaging)
    expect_vanishing("plane", check_scene(scene).equations)
    across, up = axes.values()
    heights, place = np.unique(np.abs(up), return_inverse=True)
    half_plane = transversal(given, scene, (across[:, None] + 1j * heights).reshape(-1), starts, rtol, averaging)
    table, error = (row.reshape(len(across), -1)[:, place] for row in (half_plane.exponent, half_plane.stderr))
    return Plane(known, across, up, table, error, _kinds(half_plane)[None, None], half_plane.time)


def _coupling(scene: Scene) -> str:
    """Return the coupling of a scene with a single one, also of a lone oscillator, for a summary."""
    return f" (coupling: {scene.coupling})" if scene.coupling else ""


def _check_parameters(cell: Scene, rows: Mapping[str, np.ndarray], beside_alpha: bool) -> None:
    """Raise ValueError for values out of range, and for parameters that exponents do not depend on."""
    orbit, still = mode(cell.equations).orbit, still_strengths(cell)
    for name, values in rows.items():
        with_numbers(cell, {name: values[-1]})
        if beside_alpha and name in still and len(cell.strengths) == 1:
            raise ValueError(
                f"plane: found the axes alpha and {name}; expected another parameter: alpha = -{name} gamma"
            )
        if name not in still and name not in orbit.parameters:
            known = ", ".join((*orbit.parameters, *sorted(still)))
            raise ValueError(f"plane: no exponent depends on {name!r}; expected one of {known}")


def _over_parameters(
    known: Scene,
    cell: Scene,
    axes: Mapping[str, np.ndarray],
    strengths: tuple[str, ...],
    starts: int,
    averaging: Averaging,
) -> Plane:
    """Exponents over two axes, one synchronous orbit after the other."""
    first, second = axes
    shape = (len(axes[first]), len(axes[second]))
    modes = () if strengths else tuple(map(str, transversal_modes(cell)))
    orbits = list(shared_orbits(cell, _columns(axes)) if modes else _orbits_of_line(axes[first], second, axes[second]))
    exponent, stderr, worst = np.empty(shape), np.empty(shape), np.empty(shape, dtype=int)
    kinds, longest = np.empty((*shape, check_integer("starts", starts, 1)), dtype=object), 0.0
    with averaging.reporter(len(orbits)) as reporter:
        for done, orbit in enumerate(orbits, start=1):
            scene, at = with_numbers(cell, orbit.numbers), np.unravel_index(orbit.cells, shape)
            found = along(orbits_of(scene, orbit.strengths, starts, averaging), orbit.strengths, averaging, reporter)
            table, rows = found.exponent[orbit.place], np.arange(len(orbit.cells))
            worst[at] = largest = table.argmax(axis=1)
            exponent[at], stderr[at] = table[rows, largest], found.stderr[orbit.place][rows, largest]
            kinds[at], longest = _kinds(found), max(longest, found.time)
            reporter.advance(reporter.total * done / len(orbits) - reporter.done)
    still = still_strengths(cell) if modes else strengths
    attractors = kinds[tuple(slice(1) if name in still else slice(None) for name in axes)].astype(str)
    of_modes = (modes, worst if modes else None)
    return Plane(
        known, axes[first], axes[second], exponent, stderr, attractors, longest, (first, second), *of_modes, strengths
    )


def _columns(axes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The value of each axis at every point of their grid."""
    return {name: values.ravel() for name, values in zip(axes, np.meshgrid(*axes.values(), indexing="ij"), strict=True)}


def _orbits_of_line(alpha: np.ndarray, name: str, values: np.ndarray) -> Iterator[SharedOrbit]:
    """One orbit for each value of a parameter, with the strengths alpha of a single mode."""
    for k, value in enumerate(values):
        cells = np.arange(len(alpha)) * len(values) + k
        yield SharedOrbit(cells, {name: float(value)}, alpha, np.arange(len(alpha))[:, None])


def _kinds(found: Exponents) -> np.ndarray:
    """The kind of motion (starts,) of each start."""
    return np.array([attractor.kind for attractor in found.attractors])


def _known(given: Given, scene: Scene) -> Scene:
    """The scene with its parameters, which fix its axes; a lone oscillator has none of the links."""
    return with_numbers(scene, {name: value for name, value in given.values.items() if scene.takes(name)}, axes=())


def classify(intervals: Sequence[Interval], end: float, begin: float = 0.0) -> StabilityClass:
    """Classify a function that is negative on some intervals of its grid."""
    if not intervals:
        return StabilityClass.NEVER
    if len(intervals) > 1:
        return StabilityClass.SEVERAL
    low, high = intervals[0]
    if high < end:
        return StabilityClass.BOUNDED
    return StabilityClass.HALF_LINE if low > begin else StabilityClass.EVERYWHERE

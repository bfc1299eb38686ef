"""Compute exponents over two axes: strengths of a mode, parameters of the scene, or one of each.

If both axes are strengths, all modes are integrated along one orbit (`exponents.transversal`). If an axis is a parameter
of the scene, the exponents are computed along every synchronous orbit (`largest_exponents`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.open_stops import without_open_stops
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import ORBITS, Given, chosen
from ..prediction.mode_windows import defective_rows
from ..prediction.mode_windows import transversal_modes as network_modes
from ..prediction.synchronisability import Window, windows_complex
from ..results.labelled import Labelled, as_json, dataset, drive_text, scene_text
from ..support.arrays import row
from ..support.error_text import range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, document_keywords
from .exponents import RTOL, Exponents, coupled_cell, exponent_rows, transversal, with_partner
from .largest_exponents import check_parameters, largest_exponents
from .msf import coupling_text, with_parameters
from .transversal_modes import SharedOrbit, shared_orbits, still_strengths, transversal_modes

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
            ("exponents", modes if self.modes else f"{strength}{coupling_text(self.scene)}"),
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
    shown = with_parameters(fixed, scene)
    if rows:
        return _over_parameters(shown, call, scene, axes, tuple(strengths), starts, rtol, averaging)

    # both axes are strengths: integrate all modes along one orbit, and only one of two conjugate strengths
    if "beta" not in call.values and check_scene(scene).takes("beta"):
        warn(
            "plane: found beta, the imaginary part of strengths, and a parameter of that name; "
            "write parameters={'beta': …} for the parameter",
            UserWarning,
        )
    expect_vanishing("plane", without_open_stops(with_parameters(fixed, check_scene(scene))).equations)
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
    """Compute exponents over two axes, orbit by orbit; `strengths`: axes that are strengths of a mode."""
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


def _kinds(exponents: Exponents) -> np.ndarray:
    """Return the kind of motion (starts,) of each start."""
    return np.array([attractor.kind for attractor in exponents.attractors])

"""Report on exponents over two axes: text, JSON, files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..prediction.modes import transversal_modes
from ..prediction.synchronisability import Window, windows_complex
from ..stability.msf import Plane
from .drive import drive_period
from .words import defective_rows, finite, headline, how, rows_of, window_dict, window_text, write_files

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["PlaneReport", "plane_windows"]

MOST_MODES = 6
"""Modes that a report lists."""

STEPS = 2001
"""Values of sigma at which a network is looked up in the plane."""


@dataclass(frozen=True, slots=True)
class PlaneReport:
    """Exponents over two axes, and what a function of complex strengths says about a network.

    Attributes
    ----------
    plane : Plane
        The exponents.
    network : bool
        Whether the scene has a network to be judged: by alpha + i beta alone.
    """

    plane: Plane
    network: bool

    def as_dict(self) -> dict[str, object]:
        """Return Plane.as_dict and "windows" in JSON types.

        A number that is not finite is null; so are the windows without a network.
        """
        report: dict[str, object] = {**self.plane.as_dict(), "windows": None}
        if self.network:
            report["windows"] = [window_dict(window) for window in plane_windows(self.plane)]
        return {name: finite(value) for name, value in report.items()}

    def text(self) -> str:
        """Return the report as lines of text."""
        plane = self.plane
        contours = [
            ", ".join(
                f"{name} {part.min():z.4f} … {part.max():z.4f}" for name, part in zip(plane.names, line.T, strict=True)
            )
            for line in plane.contours
        ]
        axes = zip(plane.names, (plane.across, plane.up), strict=True)
        rows = [
            ("plane", ", ".join(f"{name} {values[0]:g} … {values[-1]:g}" for name, values in axes)),
            *[("zero contour", words) for words in contours or ["none"]],
            ("negative", f"at {np.count_nonzero(plane.exponent < 0)} of {plane.exponent.size} points"),
            ("smallest, largest", f"{np.min(plane.exponent):z.4f}, {np.max(plane.exponent):z.4f}"),
            *_mode_rows(plane),
            *how(
                drive_period(plane.scene, plane.parameters), plane.motion.reshape(-1).tolist(), plane.time, plane.stderr
            ),
        ]
        lines = [f"{headline(plane.scene, plane.parameters)}, {_meaning(plane)}", *rows_of(rows)]
        if self.network:
            graph = plane.scene.topology
            ranges = [window_text(window, error=False) for window in plane_windows(plane)] or ["none in this plane"]
            lines += [
                f"{graph.name}({graph.n}): every mode dies out for",
                *rows_of([*(("sigma", words) for words in ranges), *defective_rows(graph)]),
            ]
            if any("..." in words for words in ranges):
                lines.append("...: a mode leaves the plane here, the range may go on")
        return "\n".join(lines)

    def write(self, folder: Path) -> list[Path]:
        """Write plane.csv and plane.png with the rays of the network; dots mark sigma."""
        from ..figures.plane import draw_plane, draw_rays, table

        def draw(axes: Axes) -> None:
            draw_plane(axes, self.plane)
            if self.network:
                scene = self.plane.scene
                draw_rays(axes, self.plane, (scene.parameters[scene.strength] if scene.model.linked else 0.0) or None)

        return write_files(folder, "plane", table(self.plane), draw)


def _meaning(plane: Plane) -> str:
    """What the exponents are those of."""
    if plane.modes:
        return f"the largest of {len(plane.modes)} transversal modes of {plane.scene.n} nodes"
    return "alpha = -sigma gamma" if plane.parameters else "alpha + i beta = -sigma gamma"


def _mode_rows(plane: Plane) -> list[tuple[str, str]]:
    """At how many points which mode has the largest exponent, the most frequent ones first."""
    if plane.mode is None:
        return []
    counts = np.bincount(plane.mode.reshape(-1), minlength=len(plane.modes))
    order = [k for k in np.argsort(-counts, kind="stable")[:MOST_MODES] if counts[k]]
    gammas = [words if ", " in words else words[1:-1] for words in plane.modes]  # of one layer without brackets
    return [("largest for", f"gamma = {gammas[k]}, at {counts[k]} of {plane.mode.size} points") for k in order]


def plane_windows(plane: Plane) -> tuple[Window, ...]:
    """Return the windows of sigma in which all modes of the network are stable.

    The exponent is interpolated between the strengths of the plane; outside it counts as unstable.

    Parameters
    ----------
    plane : Plane
        Exponents (alpha, beta) of a scene with a network.

    Returns
    -------
    tuple of Window
        Windows with the modes that are lost at their ends.
    """
    from scipy.interpolate import RegularGridInterpolator

    size = np.max(np.abs(plane.exponent[np.isfinite(plane.exponent)]), initial=1e-300)
    value = np.nan_to_num(plane.exponent, nan=size, posinf=size, neginf=-size)
    at = RegularGridInterpolator((plane.across, plane.up), value, bounds_error=False, fill_value=math.inf)
    graph = plane.scene.topology
    top = min((_leaves(plane, -complex(mode.eigenvalue.value)) for mode in transversal_modes(graph)), default=0.0)
    if not 0 < top < math.inf:
        return ()

    def stable(points: np.ndarray) -> np.ndarray:
        pairs = [at(np.stack([points.real, sign * points.imag], axis=1)) for sign in (1.0, -1.0)]
        return np.asarray(np.minimum(*pairs) < 0)

    return windows_complex(stable, graph, np.linspace(0.0, top, STEPS), 1e-6 * top).windows


def _leaves(plane: Plane, unit: complex) -> float:
    """The sigma at which a mode leaves the plane, reduced by a rounding error."""
    across, up = plane.across, plane.up
    reach = max(-up[0], up[-1]) if up[0] < 0 else up[-1]
    edge = across[-1] if unit.real > 0 else -across[0]
    limits = [edge / abs(unit.real)] if unit.real else []
    if unit.imag:
        limits.append(reach / abs(unit.imag))
    return (1 - 1e-12) * float(min(limits, default=math.inf))

"""What the exponents over complex strengths say about a scene's network: as text, as JSON, and as
files.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..prediction.modes import transversal
from ..prediction.one_way import windows_complex
from ..prediction.synchronisability import Window
from ..stability.msf import Plane
from .words import defective_rows, finite, headline, how, rows_of, window_dict, window_text, write_files

__all__ = ["PlaneReport", "plane_windows"]

STEPS = 2001
"""Values of sigma at which a network is looked up in the plane."""


@dataclass(frozen=True, slots=True)
class PlaneReport:
    """The function over a plane; `network` where the scene has one to be judged."""

    plane: Plane
    network: bool

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: Plane.as_dict and "windows"; null where a number is not finite or there is no
        network.
        """
        report: dict[str, Any] = {**self.plane.as_dict(), "windows": None}
        if self.network:
            report["windows"] = [window_dict(window) for window in plane_windows(self.plane)]
        return dict(finite(report))

    def text(self) -> str:
        """The report as lines."""
        plane = self.plane
        alpha, beta = plane.alpha, plane.beta
        contours = [
            ", ".join(
                f"{name} {part.min():.4f} … {part.max():.4f}"
                for name, part in zip(("alpha", "beta"), line.T, strict=True)
            )
            for line in plane.contours
        ]
        rows = [
            ("plane", f"alpha {alpha[0]:g} … {alpha[-1]:g}, beta {beta[0]:g} … {beta[-1]:g}"),
            *[("zero contour", words) for words in contours or ["none"]],
            ("negative", f"at {np.count_nonzero(plane.exponent < 0)} of {plane.exponent.size} strengths"),
            ("smallest, largest", f"{np.min(plane.exponent):.4f}, {np.max(plane.exponent):.4f}"),
            *how(plane.scene, plane.attractors, plane.time, plane.stderr),
        ]
        lines = [f"{headline(plane.scene)}, alpha + i beta = -sigma gamma", *rows_of(rows)]
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
        """Write plane.csv and plane.png, with the rays of the network and dots at the scene's
        sigma.
        """
        from ..figures.plane import draw_plane, draw_rays, table

        def draw(axes: Any) -> None:
            draw_plane(axes, self.plane)
            if self.network:
                draw_rays(axes, self.plane, self.plane.scene.parameters.get("sigma") or None)

        return write_files(folder, "plane", table(self.plane), draw)


def plane_windows(plane: Plane) -> tuple[Window, ...]:
    """The windows of sigma in which every mode of the scene's network lies where the plane is
    negative.

    Between the strengths of the plane the exponent is interpolated; what lies outside counts as
    unstable.
    """
    from scipy.interpolate import RegularGridInterpolator

    size = np.max(np.abs(plane.exponent[np.isfinite(plane.exponent)]), initial=1e-300)
    value = np.nan_to_num(plane.exponent, nan=size, posinf=size, neginf=-size)
    at = RegularGridInterpolator((plane.alpha, plane.beta), value, bounds_error=False, fill_value=math.inf)
    graph = plane.scene.topology
    top = min((_leaves(plane, -complex(mode.eigenvalue.value)) for mode in transversal(graph)), default=0.0)
    if not 0 < top < math.inf:
        return ()

    def stable(points: np.ndarray) -> np.ndarray:
        pairs = [at(np.stack([points.real, sign * points.imag], axis=1)) for sign in (1.0, -1.0)]
        return np.asarray(np.minimum(*pairs) < 0)

    return windows_complex(stable, graph, np.linspace(0.0, top, STEPS), 1e-6 * top).windows


def _leaves(plane: Plane, unit: complex) -> float:
    """The sigma at which a mode leaves the plane; just inside, so that rounding does not put it
    out.
    """
    reach = max(-plane.beta[0], plane.beta[-1]) if plane.beta[0] < 0 else plane.beta[-1]
    edge = plane.alpha[-1] if unit.real > 0 else -plane.alpha[0]
    limits = [edge / abs(unit.real)] if unit.real else []
    if unit.imag:
        limits.append(reach / abs(unit.imag))
    return (1 - 1e-12) * float(min(limits, default=math.inf))

"""Where networks with one-way links synchronise: complex alpha = -sigma gamma against a stable region of the complex plane.

Where eigenvectors are missing (a feed-forward chain) the equations of the modes do not fall apart, but the condition on the
eigenvalues stays: Nishikawa & Motter, Phys. Rev. E 73, 065106 (2006).  Complex alpha: Pecora & Carroll, Phys. Rev. Lett. 80,
2109 (1998).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from synchain.models.graphs.topology import Topology

from .intervals import find
from .modes import NetworkMode, has_loose_parts, transversal_modes
from .synchronisability import Window

__all__ = ["OneWay", "windows_complex"]

Region = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class OneWay:
    """Windows of sigma, and the modes that lack eigenvectors: there errors may grow at first, but die out in the end."""

    windows: tuple[Window, ...]
    defective: tuple[NetworkMode, ...]


def windows_complex(
    stable: Region, graph: Topology, sigma_grid: Sequence[float] | np.ndarray, resolution: float
) -> OneWay:
    """The intervals of sigma on which every transversal mode is stable, found on a grid and refined by bisection.

    `stable` maps complex alpha (m,) with imaginary part >= 0 to truth values (m,): conjugate modes share their stability.
    Windows that fit between two points of the grid are not seen.  Raises ValueError for a grid that does not increase, a
    resolution that is not positive, and a `stable` that does not answer every point.
    """
    modes = tuple(mode for mode in transversal_modes(graph) if complex(mode.eigenvalue.value).imag <= 0)
    values = np.array([mode.eigenvalue.value for mode in modes] + [0.0] * has_loose_parts(graph), dtype=complex)

    def verdicts(sigma: np.ndarray) -> np.ndarray:
        alpha = -np.multiply.outer(sigma, values)
        answer = np.asarray(stable(alpha.ravel() + 0.0), dtype=bool)
        if answer.shape != (alpha.size,):
            raise ValueError(
                f"stable: found shape {answer.shape} for {alpha.size} points; expected one truth value for each"
            )
        return answer.reshape(alpha.shape)

    def lost(sigma: float) -> NetworkMode | None:
        bad = np.flatnonzero(~verdicts(np.array([sigma]))[0, : len(modes)])
        return modes[bad[0]] if len(bad) else None

    grid = np.asarray(sigma_grid, dtype=float)
    found, _ = find(lambda sigma: np.atleast_1d(verdicts(sigma).all(axis=1)), grid, resolution)
    reach = 0.5 * resolution
    made = []
    for low, high in found:
        inner = (low > grid[0], high < grid[-1])
        made.append(
            Window(
                low, high, reach * inner[0], reach * inner[1],
                lost(low - reach) if inner[0] else None, lost(high + reach) if inner[1] else None,
            )
        )  # fmt: skip
    return OneWay(tuple(made), tuple(mode for mode in transversal_modes(graph) if mode.defective))

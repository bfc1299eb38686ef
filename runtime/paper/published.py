"""Published results of the paper, as data for comparison; no computation uses them.

Source: Marszal, Saha, Jankowski & Stefański, Synchronization in arrays of coupled self-induced
friction oscillators, Eur. Phys. J. Special Topics (2016).
"""

from __future__ import annotations

from typing import NamedTuple

from synchain.models.scenes.scene import Scene

from ..prediction.intervals import Interval


class Published(NamedTuple):
    n: int  # number of oscillators
    omega: float  # drive frequency
    intervals: tuple[Interval, ...]  # synchronous ranges of sigma, rising and disjoint
    remark: str  # remark of the paper


PUBLISHED = (
    Published(2, 1.15, ((0.0, 0.233),), "periodic"),
    Published(2, 1.40, ((0.045, 0.300),), "non-periodic"),
    Published(2, 1.55, ((0.088, 0.297),), "non-periodic"),
    Published(3, 1.15, ((0.0, 0.155),), "follows Wu-Chua"),
    Published(3, 1.55, ((0.176, 0.196),), "both modes inside"),
    Published(4, 1.15, ((0.0, 0.136),), "all three modes inside"),
    Published(4, 1.40, ((0.153, 0.177),), "narrow window"),
)

PAIRS = (1.15, 1.40, 1.55)  # frequencies at which the paper measures two oscillators
NOT_PERIODIC = (1.40, 1.55)  # frequencies for which the paper finds no synchronisation of five and more oscillators


def published(n: int, omega: float) -> Published | None:
    """Return the published row for n oscillators at omega, or None if the paper has none."""
    for row in PUBLISHED:
        if (row.n, row.omega) == (n, omega):
            return row
    if n >= 5 and omega in NOT_PERIODIC:
        return Published(n, omega, (), "none: the ratio of the eigenvalues outgrows the range of alpha")
    return None


def published_ranges(scene: Scene) -> tuple[Interval, ...]:
    """Return the published synchronous ranges of sigma for a scene's chain; empty if there are none."""
    row = published(scene.n, scene.parameters["omega"])
    return row.intervals if row else ()

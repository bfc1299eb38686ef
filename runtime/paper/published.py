"""Published results of the paper, as data for comparison; no computation uses them.

Source: Marszal, Saha, Jankowski & Stefański, Synchronization in arrays of coupled self-induced
friction oscillators, Eur. Phys. J. Special Topics (2016).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..prediction.intervals import Interval


@dataclass(frozen=True, slots=True)
class Published:
    """Published synchronous ranges of a chain."""

    n: int  # number of oscillators
    omega: float  # drive frequency
    intervals: tuple[Interval, ...]  # synchronous ranges of sigma
    remark: str  # remark of the paper

    def __post_init__(self) -> None:
        if self.n < 2 or not self.omega > 0:
            raise ValueError(f"published row n = {self.n}, omega = {self.omega}; expected n >= 2 and omega > 0")
        ends = [end for interval in self.intervals for end in interval]
        if ends != sorted(ends):
            raise ValueError(f"published intervals {self.intervals}; expected them in rising order and disjoint")


PUBLISHED = (
    Published(2, 1.15, ((0.0, 0.233),), "periodic"),
    Published(2, 1.40, ((0.045, 0.300),), "non-periodic"),
    Published(2, 1.55, ((0.088, 0.297),), "non-periodic"),
    Published(3, 1.15, ((0.0, 0.155),), "follows Wu-Chua"),
    Published(3, 1.55, ((0.176, 0.196),), "both modes inside"),
    Published(4, 1.15, ((0.0, 0.136),), "all three modes inside"),
    Published(4, 1.40, ((0.153, 0.177),), "narrow window"),
)

PAIRS = (1.15, 1.40, 1.55)
"""Frequencies at which the paper measures two oscillators."""

NOT_PERIODIC = (1.40, 1.55)
"""Frequencies for which the paper finds no synchronisation of five and more oscillators."""


def published(n: int, omega: float) -> Published | None:
    """Return the published row for n oscillators at omega, or None if the paper has none."""
    for row in PUBLISHED:
        if row.n == n and row.omega == omega:
            return row
    if n >= 5 and omega in NOT_PERIODIC:
        return Published(n, omega, (), "none: the ratio of the eigenvalues outgrows the range of alpha")
    return None

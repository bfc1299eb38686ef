"""Certificates: exponents of the synchronous state of each cell, and the verdicts that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

NEAR = 1e-11
"""Synchronisation error below which a certified cell ends, relative to the size of the motion."""

ERRORS, CHANCE = 3.5, 1e-6
"""An exponent is certainly negative if it is below 0 by so many standard errors of a normal variable, or as many of
Student's as are equally certain; the chance of a burst from NEAR to BURST that a cell may end early with.
"""

BURST, SYNCHRONOUS = 1e-6, 1e-3
"""Synchronisation error that a certified cell must not reach again; mean error below which a cell counts as synchronous;
relative to the size of the motion.
"""

VERDICTS = (
    "did not finish",
    "synchronous, certified by the exponent",
    "synchronous, exponent zero within its error",
    "synchronous by round-off only: the state is unstable",
    "not synchronous, the state is unstable",
    "not synchronous, exponent zero within its error",
    "not synchronous although the state is stable: another attractor, or too short a transient",
    "synchronous on average, but not throughout, although the state is stable: bursts (bubbling), or too short a transient",
)


@dataclass(frozen=True, slots=True)
class Certificate:
    """The largest transversal exponent (cells,) of the network's synchronous state in each cell,
    and its standard error.

    diffusion (cells,): variance of the logarithm of a deviation, per unit of time, about its mean
    growth.  margin (cells,): how far below 0 an exponent must be to be certainly negative.  size (cells,): how far the
    motion moves, the norm over components.
    """

    exponent: np.ndarray
    stderr: np.ndarray
    diffusion: np.ndarray
    margin: np.ndarray
    size: np.ndarray

    @property
    def near(self) -> np.ndarray:
        """The synchronisation error (cells,) below which a cell is taken to stay synchronous; 0 if
        that is not safe.

        A deviation whose logarithm drifts down at the rate -exponent and diffuses ever climbs by g
        with the chance exp(-2 g |exponent| / diffusion) (Redner, A Guide to First-Passage Processes
        (Cambridge, 2001), section 3.2).
        """
        climb = math.log(BURST / NEAR)
        rare = -2.0 * climb * self.exponent > -math.log(CHANCE) * self.diffusion
        return np.where((self.exponent + self.margin < 0.0) & rare, NEAR * self.size, 0.0)

    def take(self, cells: np.ndarray) -> Certificate:
        """The part for some cells."""
        return Certificate(*(getattr(self, part.name)[cells] for part in fields(self)))

    def verdicts(self, finished: np.ndarray, error: np.ndarray, largest: np.ndarray) -> np.ndarray:
        """Index into VERDICTS for each cell, from whether it finished, its mean and its largest
        synchronisation error.

        Near the loss of stability trajectories within the synchronous state are unstable, and a
        small distance bursts although the exponent is negative (Ashwin, Buescu & Stewart, Phys.
        Lett. A 193, 126 (1994)).
        """
        allowed = SYNCHRONOUS * self.size
        sign = np.where(self.exponent + self.margin < 0.0, -1, np.where(self.exponent > 2 * self.stderr, 1, 0))
        together = np.where((sign < 0) & (largest >= allowed), 7, np.array([1, 2, 3])[sign + 1])
        apart = np.array([6, 5, 4])[sign + 1]
        return np.where(finished, np.where(error < allowed, together, apart), 0)

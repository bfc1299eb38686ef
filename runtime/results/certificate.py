"""Certificates: the exponent of the synchronous state of each cell, and the verdict on each cell."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

NEAR = 1e-11  # synchronisation error, relative to the size of the motion, below which a certified cell ends

# Standard errors below 0 at which an exponent is certainly negative (a choice: an error probability of 2e-4). For
# averages of few blocks Student's distribution replaces the normal one, at the same probability.
ERRORS = 3.5

CHANCE = 1e-6  # largest probability of a burst from NEAR to BURST at which a cell may end early (a choice)
BURST = 1e-6  # synchronisation error, relative to the size of the motion, that counts as a burst of a certified cell
SYNCHRONOUS = 1e-3  # mean error below which a cell counts as synchronous, relative to the size of the motion

# Verdicts on a cell; a result stores their indices.
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
    """Largest transversal exponent of the network's synchronous state in each cell; arrays (cells,)."""

    exponent: np.ndarray
    stderr: np.ndarray  # standard error of the exponent
    diffusion: np.ndarray  # variance of the logarithm of a deviation about its mean growth, per unit of time
    margin: np.ndarray  # an exponent below -margin is certainly negative
    size: np.ndarray  # amplitude of the motion, the norm over components

    @property
    def near(self) -> np.ndarray:
        """Synchronisation error (cells,) below which a cell stays synchronous; 0 if a burst is too probable."""
        # The logarithm of a deviation drifts at the rate `exponent` < 0 and diffuses. The probability that it ever
        # climbs by g is exp(-2 g |exponent| / diffusion): Redner, A Guide to First-Passage Processes (Cambridge, 2001),
        # section 3.2.
        climb = math.log(BURST / NEAR)
        rare = -2.0 * climb * self.exponent > -math.log(CHANCE) * self.diffusion
        return np.where((self.exponent + self.margin < 0.0) & rare, NEAR * self.size, 0.0)

    def take(self, cells: np.ndarray) -> Certificate:
        return Certificate(*(getattr(self, part.name)[cells] for part in fields(self)))

    def verdicts(self, finished: np.ndarray, error: np.ndarray, largest: np.ndarray) -> np.ndarray:
        """Return an index into VERDICTS for each cell. Shapes (cells,): finished; mean and largest error."""
        allowed = SYNCHRONOUS * self.size
        sign = np.where(self.exponent + self.margin < 0.0, -1, np.where(self.exponent > 2 * self.stderr, 1, 0))
        # Near the loss of stability some trajectories within the synchronous state are unstable, so small deviations
        # burst although the exponent is negative: Ashwin, Buescu & Stewart, Phys. Lett. A 193, 126 (1994).
        together = np.where((sign < 0) & (largest >= allowed), 7, np.array([1, 2, 3])[sign + 1])
        apart = np.array([6, 5, 4])[sign + 1]
        return np.where(finished, np.where(error < allowed, together, apart), 0)

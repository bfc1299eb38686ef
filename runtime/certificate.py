"""What the transversal exponents say about each cell of a sweep: whether its synchronous state is stable.

Two oscillators can become equal bit for bit by rounding and then stay together although the state is unstable (Pikovsky,
Phys. Rev. Lett. 73, 2931 (1994)), and a cell that starts outside the basin or waits too short a time is not synchronous
although the state is stable.  The exponents tell these cases apart, and let a cell that is certain to stay synchronous
end early.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from synchain.models.periodicity import rest_in_sweep
from synchain.models.scene import Scene
from synchain.models.tangent import mode

from .exponent import Exponents, exponents
from .orbits import unit_of_time
from .plan import axis_columns

__all__ = ["VERDICTS", "Certificate", "certify", "check_certifiable"]

NEAR = 1e-11
"""Synchronisation error below which a certified cell ends."""

ERRORS, CHANCE = 5.0, 1e-6
"""A cell may end early where its exponent is below 0 by so many standard errors, and where the chance of a burst from
NEAR to BURST is below CHANCE."""

BURST, SYNCHRONOUS = 1e-6, 1e-3
"""Synchronisation error that a certified cell must not reach again; mean error below which a cell counts as synchronous,
as in `synchain.runtime.threshold`."""

MOST = 10**7
"""Cells of the largest certified sweep: exponents and verdicts of all of them are held in memory."""

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
    """The largest transversal exponent (cells,) of the network's synchronous state in each cell, and its standard error.

    diffusion (cells,): variance of the logarithm of a deviation, per unit of time, about its mean growth.
    """

    exponent: np.ndarray
    stderr: np.ndarray
    diffusion: np.ndarray

    @property
    def near(self) -> np.ndarray:
        """The synchronisation error (cells,) below which a cell is taken to stay synchronous; 0 where that is not safe.

        A deviation whose logarithm drifts down at the rate -exponent and diffuses ever climbs by g with the chance
        exp(-2 g |exponent| / diffusion) (Redner, A Guide to First-Passage Processes (Cambridge, 2001), section 3.2).
        """
        climb = math.log(BURST / NEAR)
        rare = -2.0 * climb * self.exponent > -math.log(CHANCE) * self.diffusion
        return np.where((self.exponent + ERRORS * self.stderr < 0.0) & rare, NEAR, 0.0)

    def take(self, cells: np.ndarray) -> Certificate:
        """The part for some cells."""
        return Certificate(self.exponent[cells], self.stderr[cells], self.diffusion[cells])

    def verdicts(self, finished: np.ndarray, error: np.ndarray, largest: np.ndarray) -> np.ndarray:
        """Index into VERDICTS for each cell, from whether it finished, its mean and its largest synchronisation error.

        Near the loss of stability trajectories within the synchronous state are unstable, and a small distance bursts
        although the exponent is negative (Ashwin, Buescu & Stewart, Phys. Lett. A 193, 126 (1994)).
        """
        sign = np.where(self.exponent + 2 * self.stderr < 0.0, -1, np.where(self.exponent > 2 * self.stderr, 1, 0))
        together = np.where((sign < 0) & (largest >= SYNCHRONOUS), 7, np.array([1, 2, 3])[sign + 1])
        apart = np.array([6, 5, 4])[sign + 1]
        return np.where(finished, np.where(error < SYNCHRONOUS, together, apart), 0)


def certify(scene: Scene, *, precision: float = 2e-3, periods: float = 2000, workers: int | None = None) -> Certificate:
    """Return the exponents of every cell's synchronous state; cells that differ only in sigma and starts share one orbit.

    Of several kinds of attractor found by four starts the least stable counts.  Raises ValueError as `exponents` does.
    """
    check_certifiable(scene)
    columns = axis_columns(scene)
    own = [name for name in columns if name in scene.parameters and name != "sigma"]
    sigma = np.broadcast_to(columns.get("sigma", np.array(scene.parameters["sigma"])), (scene.cells,))
    groups: dict[tuple[float, ...], list[int]] = defaultdict(list)
    for cell in range(scene.cells):
        groups[tuple(float(columns[name][cell]) for name in own)].append(cell)
    gamma = _transversal(scene)
    exponent, stderr, diffusion = (np.empty(scene.cells) for _ in range(3))
    for values, cells in groups.items():
        asked = -sigma[cells][:, None] * gamma
        strengths, place = np.unique(asked, return_inverse=True)
        single = scene.replace(axes=(), zipped=False, continuation="none", **dict(zip(own, values, strict=True)))
        found = exponents(single, strengths, precision=precision, periods=periods, workers=workers)
        worst, error = _least_stable(found)
        table = worst[place].reshape(asked.shape)
        rows, worst_mode = np.arange(len(cells)), table.argmax(axis=1)
        exponent[cells] = table[rows, worst_mode]
        stderr[cells] = error[place].reshape(asked.shape)[rows, worst_mode]
        diffusion[cells] = stderr[cells] ** 2 * found.time * found.averaged
    return Certificate(exponent, stderr, diffusion)


def check_certifiable(scene: Scene) -> None:
    """Raise ValueError where the synchronous state of a scene has no transversal exponents."""
    if not scene.equations.links:
        raise ValueError("a certificate needs coupled oscillators; found a scene without links")
    if scene.cells > MOST:
        raise ValueError(f"a certificate needs memory for every cell; found {scene.cells}, expected at most {MOST}")
    mode(scene.equations)
    unit_of_time(scene)
    frequency = scene.drive.frequency
    rest = None if frequency is None else rest_in_sweep(frequency, scene.parameters, scene.axes, scene.zipped)
    if rest is not None:
        raise ValueError(f"a certificate needs a drive with a period; found {rest[0]} = {rest[1]:g} in the sweep")


def _transversal(scene: Scene) -> np.ndarray:
    """The transversal eigenvalues: all but one zero."""
    spectrum = scene.topology.spectrum
    values = [complex(v) for v, m in zip(spectrum.values, spectrum.multiplicities, strict=True) if v != 0.0 or m > 1]
    found = np.array(values)
    return found.real if np.all(found.imag == 0.0) else found


def _least_stable(found: Exponents) -> tuple[np.ndarray, np.ndarray]:
    """Exponent and error (m,) of the attractor that is least stable at each strength."""
    means = [found.by_start[rows].mean(axis=0) for rows in found.groups]
    return np.max(means, axis=0), found.stderr

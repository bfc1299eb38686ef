"""Certification: the transversal exponents of every cell of a sweep say whether its synchronous
state is stable.

Two oscillators can become equal bit for bit by rounding and then stay together although the state
is unstable (Pikovsky, Phys. Rev. Lett. 73, 2931 (1994)), and a cell that starts outside the basin
or waits too short a time is not synchronous although the state is stable.  The exponents tell these
cases apart, and let a cell that is certain to stay synchronous end early.
"""

from __future__ import annotations

import numpy as np

from synchain.models.dynamics.variational import mode
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.sweep import rest_in_sweep

from ..cells.keywords import with_numbers
from ..cells.plan import Planner
from ..results.certificate import Certificate
from ..stability.exponents import Exponents, exponents
from ..stability.network import shared_orbits, transversal_modes
from ..stability.orbits import unit_of_time

__all__ = ["certify", "check_certifiable"]

MOST = 10**7
"""Cells of the largest certified sweep: exponents and verdicts of all of them are held in memory."""


def certify(scene: Scene, *, precision: float = 2e-3, periods: float = 2000, workers: int | None = None) -> Certificate:
    """Return the exponents of every cell's synchronous state.

    Cells that differ only in their starts and in the strength of links that vanish between equal states share one orbit.  Of
    several kinds of attractor found by four starts the least stable counts.

    Parameters
    ----------
    scene : Scene
        A sweep, with its axes.
    precision, periods, workers
        As for `exponents`.

    Raises
    ------
    ValueError
        If the synchronous state has no transversal exponents; as `exponents` does.
    """
    check_certifiable(scene)
    exponent, stderr, diffusion = (np.empty(scene.cells) for _ in range(3))
    for group in shared_orbits(scene, Planner(scene).columns(np.arange(scene.cells))):
        single = with_numbers(scene, group.numbers, axes=(), zipped=False, continuation="none")
        found = exponents(
            single, group.strengths, precision=precision, periods=periods, workers=workers, show_progress=False
        )
        worst, error = _least_stable(found)
        table = worst[group.place]
        rows, worst_mode = np.arange(len(group.cells)), table.argmax(axis=1)
        exponent[group.cells] = table[rows, worst_mode]
        stderr[group.cells] = error[group.place][rows, worst_mode]
        diffusion[group.cells] = stderr[group.cells] ** 2 * found.time * found.averaged
    return Certificate(exponent, stderr, diffusion)


def check_certifiable(scene: Scene) -> None:
    """Raise ValueError if the synchronous state of a scene has no transversal exponents."""
    if not scene.equations.link_count:
        raise ValueError("a certificate needs coupled oscillators; found a scene without links")
    if scene.cells > MOST:
        raise ValueError(f"a certificate needs memory for every cell; found {scene.cells}, expected at most {MOST}")
    if scene.realisations:
        raise ValueError(f"a certificate is for a sweep; found {scene.realisations} realisations, expected axes alone")
    mode(scene.equations)
    transversal_modes(scene)
    unit_of_time(scene)
    frequency = scene.drive.frequency
    rest = None if frequency is None else rest_in_sweep(frequency, scene.parameters, scene.axes, scene.zipped)
    if rest is not None:
        raise ValueError(f"a certificate needs a drive with a period; found {rest[0]} = {rest[1]:g} in the sweep")


def _least_stable(found: Exponents) -> tuple[np.ndarray, np.ndarray]:
    """Exponent and error (m,) of the attractor that is least stable at each strength."""
    means = [found.by_start[rows].mean(axis=0) for rows in found.groups]
    return np.max(means, axis=0), found.stderr

"""Averages along chaotic orbits: how far they lie from the truth in units of their errors, and how long they are."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.models import Scene, chain
from synchain.runtime.stability.averages import Averaging
from synchain.runtime.stability.exponents import average, initial_states
from synchain.runtime.stability.orbits import Orbits
from synchain.runtime.support.execution import Execution

SYSTEMS = {
    "friction, 1.40": (Scene("friction", topology=chain(2), parameters={"omega": 1.4}), [0.0, 0.1, 0.3, 0.5]),
    "friction, 1.55": (Scene("friction", topology=chain(2), parameters={"omega": 1.55}), [0.0, 0.1, 0.3, 0.5]),
    "set-valued, 1.40": (
        Scene("friction", topology=chain(2), contact="set-valued", parameters={"omega": 1.4}),
        [0.0, 0.2, 0.5],
    ),
    "Rössler": (Scene("rossler", "x->x", chain(2)), [0.0, 0.1, 0.5, 2.0, 5.0]),
    "Lorenz": (Scene("lorenz", "x->x", chain(2)), [0.0, 2.0, 8.0]),
}
"""Chaotic scenes, and the strengths of their modes."""

STARTS, TRUTH = 256, 2000
"""Independent averages of each length; periods of each of those that stand for the truth."""


def settled(name: str) -> Orbits:
    """Orbits of a system on its attractor."""
    scene, alpha = SYSTEMS[name]
    scene = scene.replace(rtol=1e-6)
    orbits = Orbits.make(scene, np.array(alpha), initial_states(scene, STARTS, seed=1), workers=1)
    orbits.settle(200)
    return orbits


def averages(orbits: Orbits, periods: float) -> tuple[np.ndarray, np.ndarray]:
    """Means and errors (starts, m) over the next periods of each orbit."""
    averaging = Averaging(0.0, periods, 0.0, 0, Execution(1, show_progress=False))
    part = orbits.part(list(range(STARTS)))
    part.prepare(periods)
    with averaging.reporter() as reporter:
        mean, error, time = average(part, averaging, reporter)
    assert time == pytest.approx(periods * orbits.unit, rel=1e-12)
    return mean, error


def distances(name: str, lengths: tuple[int, ...]) -> dict[int, np.ndarray]:
    """Distances (starts, m) of averages of each length from the truth, in units of their errors."""
    orbits = settled(name)
    truth = averages(orbits, TRUTH)[0].mean(axis=0)
    found = {periods: averages(orbits, periods) for periods in lengths}
    return {periods: np.abs(mean - truth) / error for periods, (mean, error) in found.items()}

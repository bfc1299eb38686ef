"""Cases whose reference is a tight run of this program: smooth networks, and the exact law.

The reference is DOP853 at rtol = 1e-14, a method and a step control
other than those of the rows it serves; independent integrators in 50 digits confirm both methods
(tests/codegen/integrators, tests/codegen/driver).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.orbits import unit_of_time

from .cases import Case, read_case
from .own_program import prepare

REFERENCE = (1e-14, 1e-15)


_LINKED = {"parameters": {"sigma": 0.1}}
_SMOOTHED = {"kappa": 10.0, "sigma": 0.1}
"""The smoothed law has a kink, |w|; over the slow belt each oscillator passes it twice a period."""
_APART: dict[str, Any] = {"initial": {"x": (0.3, 0.4), "v": (0.0, 0.05)}}
_SCALED: dict[str, Any] = {"coupling": "x->x", **_LINKED}

SMOOTH: dict[str, tuple[str, int, dict[str, Any], int]] = {
    "Duffing, n = 2": ("chain", 2, {"oscillator": "duffing", **_LINKED}, 20),
    "pendulum, n = 2": ("chain", 2, {"oscillator": "pendulum", **_LINKED}, 200),
    "FPUT ring, n = 8": ("ring", 8, {"oscillator": "mass", "coupling": "fput"}, 50),
    "slow belt, κ = 10, n = 2": ("chain", 2, {"parameters": {**_SMOOTHED, "theta_b": 0.02}, **_APART}, 50),
    "van der Pol, n = 2": ("chain", 2, {"oscillator": "van_der_pol", **_LINKED}, 50),
    "Lorenz, n = 2": ("chain", 2, {"oscillator": "lorenz", **_SCALED}, 1),
    "Rössler, n = 3": ("ring", 3, {"oscillator": "rossler", **_SCALED}, 10),
}
"""Family and size of the graph, other arguments of the scene, length in units of time.

Chaos keeps two of them short.
"""

EXACT = {f"exact law, n = {n}": f"friction, n = {n}" for n in (1, 2, 4)}
"""Cases of the set-valued law, and those of the smoothed one with the same numbers."""


def computed_case(name: str) -> Case:
    """Return a case with its reference; ValueError for an unknown name."""
    if name in EXACT:
        return exact_law(read_case(EXACT[name]))
    if name not in SMOOTH:
        raise ValueError(f"unknown case {name!r}; known: {'; '.join((*SMOOTH, *EXACT))}")
    family, n, arguments, length = SMOOTH[name]
    scene = Scene(topology=topology(family, n), record=(), **arguments)
    return solved(Case(name, scene, unit_of_time(scene) * reading_times(length), np.empty((0, 0))))


def reading_times(length: int) -> np.ndarray:
    """Return the middle and the end (2,) of a case in units of time: peers need rising times."""
    return length * np.array([0.5, 1.0])


def exact_law(case: Case) -> Case:
    """Return the same problem under the set-valued law; states (m, 3 n), the modes included."""
    parameters = {name: value for name, value in case.scene.parameters.items() if name != "kappa"}
    scene = case.scene.replace(contact="set-valued", parameters=parameters)
    return solved(Case(case.name.replace("friction", "exact law"), scene, case.times, np.empty((0, 0))))


def solved(case: Case) -> Case:
    """Return a case with its states by the reference method."""
    states, _ = prepare(case, "dop853", 1)(*REFERENCE, case.times)
    return Case(case.name, case.scene, case.times, states)

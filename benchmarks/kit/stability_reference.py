"""End states of hard cases by other means: SciPy's Radau at a tight tolerance, normal modes, closed
forms.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from synchain.codegen.export.python import to_python
from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.families import topology
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.scene import Scene

from . import stability_events
from .cases import normal_modes

RTOL, ATOL = 1e-11, 1e-13
FLOOR = {
    "radau": 1e-11,
    "smooth": 1e-6,
    "modes": 1e-13,
    "growth": 1e-13,
    "wave": 1e-13,
    "steady": 1e-10,
    "alone": 1e-11,
    "explicit": 1e-11,
    "none": 0.0,
    "rebounds": 1e-13,
    "coulomb": 1e-13,
    "spring": 1e-13,
    "pool": 1e-13,
}
"""How far a reference itself may be off, relative to the size of the state; "smooth" is another
law, O(kappa^-1/2) away.
"""


def end_state(scene: Scene, reference: str) -> np.ndarray:
    """The positions and velocities (2 n,) at the end of the scene's window."""
    return REFERENCES[reference](scene)


@functools.lru_cache(maxsize=8)
def _functions(equations: Equations) -> tuple[Callable[..., np.ndarray], Callable[..., np.ndarray]]:
    """Right-hand side f(t, y, p) and Jacobian j(t, y, p) of the equations as plain Python."""
    state = [sp.Symbol(name, real=True) for name in equations.state]
    numbers = [sp.Symbol(name, real=True) for name in equations.parameters]
    rows = [[equations.jacobian().get((r, c), sp.S.Zero) for c in range(len(state))] for r in range(len(state))]
    arguments = (TIME, state, numbers)
    return (
        sp.lambdify(arguments, list(equations.rhs()), "math", cse=True),
        sp.lambdify(arguments, rows, "math", cse=True),
    )


def _radau(scene: Scene, start: np.ndarray | None = None) -> np.ndarray:
    from scipy.integrate import solve_ivp

    f, j = _functions(scene.equations)
    p = [scene.parameters[name] for name in scene.equations.parameters]
    y0 = np.array(scene.y0) if start is None else start
    done = solve_ivp(
        lambda t, y: f(t, y, p),
        (0.0, scene.transient + scene.window),
        y0,
        method="Radau",
        jac=lambda t, y: np.array(j(t, y, p)),
        rtol=RTOL,
        atol=ATOL,
    )
    if not done.success:
        raise RuntimeError(f"Radau stopped at t = {done.t[-1]:g}: {done.message}")
    return np.array(done.y[:, -1])


def _explicit(scene: Scene) -> np.ndarray:
    """SciPy's DOP853 on the exported equations, in steps that a kink costs little and that miss no
    pulse.
    """
    from scipy.integrate import solve_ivp

    space: dict[str, Any] = {}
    exec(to_python(scene.equations, {name: scene.parameters[name] for name in scene.equations.parameters}), space)
    tight = {"rtol": 3e-13, "atol": min(3e-14, 1e-5 * scene.atol), "max_step": scene.window / 2000.0}
    done = solve_ivp(space["rhs"], (0.0, scene.window), np.array(scene.y0), method="DOP853", **tight)
    if not done.success:
        raise RuntimeError(f"DOP853 stopped at t = {done.t[-1]:g}: {done.message}")
    return np.array(done.y[:, -1])


def _none(scene: Scene) -> np.ndarray:
    """Not a number: the motion ends in a singularity before the window does."""
    return np.full(len(scene.y0), math.nan)


def _smooth(scene: Scene) -> np.ndarray:
    """The law of "set-valued" contact smoothed over 1e-12."""
    start = {name: scene.initial[name] for name in ("x", "v")}
    return _radau(scene.replace(contact="atan", initial=start).replace(kappa=1e12))


def _alone(scene: Scene) -> np.ndarray:
    """Coupled oscillators that start equal: each of them as one alone."""
    start = {name: values[0] for name, values in scene.initial.items()}
    numbers = {name: value for name, value in scene.parameters.items() if name != "sigma"}
    return np.repeat(_radau(scene.replace(topology=topology("chain", 1), initial=start, parameters=numbers)), scene.n)


def _modes(scene: Scene) -> np.ndarray:
    return np.asarray(normal_modes(scene, np.array([scene.window]))[0])


def _growth(scene: Scene) -> np.ndarray:
    """Two oscillators x'' = -x + sigma (x_j - x_i): their mean swings, their difference grows where
    sigma < -1/2.
    """
    x, t = np.array(scene.y0[:2]), scene.window
    mean, half = x.mean(), 0.5 * (x[0] - x[1])
    root = np.sqrt(1.0 + 2.0 * scene.parameters["sigma"] + 0j)
    apart, rate = half * np.cos(root * t).real, (-half * root * np.sin(root * t)).real
    common, common_rate = mean * math.cos(t), -mean * math.sin(t)
    return np.array([common + apart, common - apart, common_rate + rate, common_rate - rate])


def _wave(scene: Scene) -> np.ndarray:
    """The longest wave of a chain: x_i = cos(pi (i + 1/2)/n) cos(w t), w^2 = 1 + 4 sigma
    sin^2(pi/2n); of one: cos t.
    """
    shape, n, t = np.array(scene.y0[: scene.n]), scene.n, scene.window
    w = math.sqrt(1.0 + 4.0 * scene.parameters.get("sigma", 0.0) * math.sin(math.pi / (2 * n)) ** 2)
    return np.concatenate([shape * math.cos(w * t), -w * shape * math.sin(w * t)])


def _steady(scene: Scene) -> np.ndarray:
    """The linear oscillator x'' = -x - delta v + u cos(omega t), long after its transient."""
    delta, u, omega = (scene.parameters[name] for name in ("delta", "u", "omega"))
    swing = u / (1.0 - omega**2 + 1j * delta * omega)
    turn = np.exp(2j * math.pi * ((scene.transient % 1.0 + scene.window) % 1.0))
    return np.array([(swing * turn).real, (1j * omega * swing * turn).real])


REFERENCES: dict[str, Callable[[Scene], np.ndarray]] = {
    "radau": _radau,
    "smooth": _smooth,
    "alone": _alone,
    "modes": _modes,
    "growth": _growth,
    "wave": _wave,
    "steady": _steady,
    "explicit": _explicit,
    "none": _none,
    "rebounds": stability_events.rebounds,
    "coulomb": stability_events.coulomb,
    "spring": stability_events.spring,
    "pool": stability_events.pool,
}
"""Name -> end state of a scene."""

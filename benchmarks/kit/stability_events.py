"""Hard cases with events, and their end states in closed form: rebounds, loads, grazing, chatter and mass ratios."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import sympy as sp

from synchain.models.definitions.inline import Lagrangian, friction_law
from synchain.models.graphs.families import topology
from synchain.models.mechanics.impacts import Friction, Stop
from synchain.models.mechanics.oscillator import Oscillator
from synchain.models.scenes.scene import Scene

X, Y, V, U = sp.symbols("x y v u", real=True)
E, F, C, N, M = sp.symbols("e f c N m", real=True)

BALL = Lagrangian(V**2 / 2, X, coordinates={X: V}, parameters={E: 0.5}, events=[Stop(X, E)])
"""A ball that falls from the height 1 on a floor."""
SPRING = Lagrangian(
    V**2 / 2, X**2 / 2 - F * X, coordinates={X: V}, parameters={F: 0, C: 1, E: 0.8}, events=[Stop(C - X, E)]
)
"""A mass on a spring that rests at f, with a stop at c."""
BLOCK = Lagrangian(
    V**2 / 2, X**2 / 2, coordinates={X: V}, parameters={N: 1}, contact="set-valued",
    events=[Friction(-V, N, friction_law("sign(w)"))],
)  # fmt: skip
"""A mass on a spring with dry friction under the load N."""
POOL = Lagrangian(
    V**2 / 2 + M * U**2 / 2, coordinates={X: V, Y: U}, parameters={M: 1}, events=[Stop(X, 1), Stop(Y - X, 1)]
)
"""A ball of mass 1 between a wall and a ball of mass m, without losses."""

METHODS = ("taylor", "dop853", "rodas5p")


def events(quick: bool) -> Iterator[tuple[str, Scene, str, float]]:
    """Yield name, scene, name of the reference and growth: how much a small change of the state grows until the end."""
    for method in METHODS[:1] if quick else METHODS:
        for e in (0.0, 0.5, 1.0) if quick else (0.0, 1e-6, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999, 1.0):
            yield f"ball, e = {e:g}, {method}", _scene(BALL, method, 7.0, {"x": 1.0, "v": 0.0}, e=e), "rebounds", 10.0
        for power in (-6, 0, 6) if quick else range(-6, 7):
            scene = _scene(BLOCK, method, 20.0, {"x": 1.0, "v": 0.0}, N=0.3 * 10.0**power)
            yield f"load 0.3e{power}, {method}", scene, "coulomb", 1.0
        for power in (3, 8) if quick else range(1, 16, 2):
            # the speed at the stop is sqrt(2 d): an error of the place changes the speed by 1/sqrt(2 d) as much, and
            # by no more than the impact itself, here 3 sqrt(d) in units of 100 tolerances
            root = 10.0 ** (-power / 2)
            scene = _scene(SPRING, method, 4.0, {"x": 0.0, "v": 1.0}, c=1.0 - root**2)
            yield f"grazing by 1e-{power}, {method}", scene, "spring", min(1.0 / root, 1.0 + 3e6 * root)
        for c in () if quick else (1.0 + 1e-3, 1.0 + 1e-6):
            scene = _scene(SPRING, method, 4.0, {"x": 0.0, "v": 1.0}, c=c)
            yield f"missed by {c - 1.0:.0e}, {method}", scene, "spring", 1.0
        for f in (1.5,) if quick else (1.0 + 1e-3, 1.1, 1.5, 10.0):
            for e in (0.8,) if quick else (0.3, 0.8, 0.95):
                scene = _scene(SPRING, method, 12.0, {"x": 0.0, "v": 0.0}, f=f, e=e)
                yield f"chatter, f = {f:g}, e = {e:g}, {method}", scene, "spring", 10.0
        for power in (-4, 4) if quick else range(-8, 9, 2):
            scene = _scene(POOL, method, 4.0, {"x": 1.0, "v": 0.0, "y": 2.0, "u": -1.0}, m=10.0**power)
            yield f"mass ratio 1e{power}, {method}", scene, "pool", 10.0 ** (abs(power) / 2)


def _scene(node: Oscillator, method: str, window: float, initial: dict[str, object], **parameters: float) -> Scene:
    return Scene(
        node, None, topology("chain", 1), record=(), time_unit="time", transient=0.0, window=window, integrator=method,
        initial=initial, parameters=parameters, max_steps=2_000_000,
    )  # fmt: skip


def rebounds(scene: Scene) -> np.ndarray:
    """Return the ball at the end: flights of lengths 2 u from the speeds u = sqrt(2) e**k."""
    e, left, speed = scene.parameters["e"], scene.window - math.sqrt(2.0), math.sqrt(2.0)
    if e < 1.0 and left >= 2.0 * speed * e / (1.0 - e):
        return np.zeros(2)
    speed *= e
    while left > 2.0 * speed:
        left, speed = left - 2.0 * speed, e * speed
    return np.array([left * (speed - left / 2.0), speed - left])


def coulomb(scene: Scene) -> np.ndarray:
    """Return the block at the end: half swings about -N and N, each by 2 N shorter, until |x| <= N at a turn."""
    load, place, left = scene.parameters["N"], 1.0, scene.window
    while abs(place) > load:
        middle = math.copysign(load, place)
        if left < math.pi:
            return np.array([middle + (place - middle) * math.cos(left), -(place - middle) * math.sin(left)])
        place, left = 2.0 * middle - place, left - math.pi
    return np.array([place, 0.0])


def spring(scene: Scene) -> np.ndarray:
    """Return the mass on a spring at the end, arc by arc from stop to stop; it rests there once rebounds are tiny."""
    e, f, c = (scene.parameters[name] for name in "efc")
    x, v, left = scene.initial["x"][0], scene.initial["v"][0], scene.window
    # x - f = size cos(angle + t); the stop is hit where the angle is -acos((c - f)/size)
    size, angle = math.hypot(x - f, v), math.atan2(-v, x - f)
    wait = (-math.acos((c - f) / size) - angle) % (2.0 * math.pi) if abs(c - f) <= size else math.inf
    speed = math.sqrt(max(0.0, (size - (c - f)) * (size + (c - f))))
    while wait <= left:
        left, speed = left - wait, e * speed
        if f > c and speed < 1e-9:
            return np.array([c, 0.0])
        size, angle = math.hypot(c - f, speed), math.atan2(speed, c - f)
        wait = 2.0 * (math.pi - angle) if f <= c else 2.0 * math.atan2(speed, f - c)
    return np.array([f + size * math.cos(angle + left), -size * math.sin(angle + left)])


def pool(scene: Scene) -> np.ndarray:
    """Return both balls at the end: a straight line in the plane of sqrt(m) x, folded into the wedge between the walls.

    Galperin, Regular and Chaotic Dynamics 8, 375 (2003).
    """
    root, start, u = math.sqrt(scene.parameters["m"]), scene.initial, scene.initial["u"][0]
    across, along = start["x"][0], root * (start["y"][0] + u * scene.window)
    wedge, radius, angle = math.atan2(1.0, root), math.hypot(across, along), math.atan2(across, along)
    turns = math.floor(angle / wedge)
    folded, direction = angle - turns * wedge, math.pi - turns * wedge
    if turns % 2:
        folded, direction = wedge - folded, wedge - direction
    places = np.array([radius * math.sin(folded), radius * math.cos(folded) / root])
    return np.array([*places, -root * u * math.sin(direction), -u * math.cos(direction)])

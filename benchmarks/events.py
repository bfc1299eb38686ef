"""Events beside other ways to compute them: impacts beside SciPy and heyoka, exact beside smoothed
friction.

"bouncing ball": y'' = -1 with restitution 1 from eight heights. A row has the time of one impact of
one ball, and the error of the places at the end against the closed form. SciPy's DOP853 starts anew
at each terminal event, for a tenth of the time; heyoka steps eight balls at once and calls a function
in Python at each event.

"cart-pole": contacts of cart and joint, ten units of time from 256 starts. A row has the time of one
motion, and the largest error of all states at the end against the exact law by another integrator
at rtol 1e-13. The smoothed law has kappa = 1e8. A second table compares the fastest tolerances whose
error is at most 1e-6, or the least error that the smoothed law reaches.

Times are CPU times, the least of several calls.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

from synchain.models.definitions.inline import Lagrangian
from synchain.models.graphs.families import topology
from synchain.models.mechanics.impacts import Stop
from synchain.models.mechanics.oscillator import friction
from synchain.models.scenes.scene import Scene
from synchain.runtime.sweeps.run import run

from .kit.clock import best_time
from .kit.tables import markdown

Row = tuple[str, str, int, float, float, float]

COLUMNS = ("case", "program", "lanes", "rtol", "error", "microseconds")
BALL, CART = "bouncing ball", "cart-pole"
GOAL = 1e-6
"""Error of the cart-pole at which times are compared, if the smoothed law reaches it."""
HEIGHTS = np.linspace(0.5, 0.6, 8)
EXACT, SMOOTHED = "exact law", "smoothed law"


def notes() -> Iterator[str]:
    """Yield a line for a peer that is not installed."""
    try:
        import heyoka  # noqa: F401
    except ImportError:
        yield "heyoka: not installed, left out"


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS."""
    return [*_balls(quick), *_carts(quick)]


def summary(rows: Sequence[Row]) -> str:
    """Return a second table in Markdown: times of others over the times of this program."""
    balls = {(program, lanes): time for case, program, lanes, _, _, time in rows if case == BALL}
    made: list[tuple[str, str, float]] = []
    for (program, lanes), time in balls.items():
        if program != "synchain":
            made.append((BALL, f"{program} over synchain, lanes: {lanes}", time / balls["synchain", lanes]))
    carts = [(program, error, time) for case, program, _, _, error, time in rows if case == CART]
    # kappa bounds the error of the smoothed law, whatever its rtol
    reached = max(GOAL, 1.01 * min((error for program, error, _ in carts if program == SMOOTHED), default=0.0))
    fastest = {
        name: min((time for program, error, time in carts if program == name and error <= reached), default=np.nan)
        for name in (EXACT, SMOOTHED)
    }
    made.append((CART, f"smoothed over exact law, error {reached:.2g}", fastest[SMOOTHED] / fastest[EXACT]))
    return markdown(("case", "what", "ratio"), made)


def _balls(quick: bool) -> Iterator[Row]:
    impacts, rtol = 100 if quick else 10_000, 1e-10
    # the lowest ball has the most impacts; 0.3 after a top errors of time are seen in its place
    end = 2.0 * impacts * np.sqrt(2.0 * HEIGHTS[0]) + 0.3
    programs: list[tuple[str, int, float, Callable[[], np.ndarray]]]
    programs = [("synchain", n, end, _own_balls(n, end, rtol)) for n in (1, 8)]
    programs.append(("SciPy DOP853", 1, end / 10.0, lambda: _scipy_ball(end / 10.0, rtol)))
    try:
        import heyoka
    except ImportError:
        pass
    else:
        programs += [("heyoka", 8, end, _heyoka_balls(heyoka, end, rtol))]
    for name, lanes, length, solve in programs:
        right, counts = _flights(length)
        error = float(np.abs(solve() - right[:lanes]).max())
        yield BALL, name, lanes, rtol, error, 1e6 * best_time(solve, quick) / counts[:lanes].sum()


def _flights(end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of the balls at the end, and the number of impacts of each."""
    period = 2.0 * np.sqrt(2.0 * HEIGHTS)
    counts = np.floor(end / period + 0.5)
    late = end - counts * period  # time from the nearest top
    return HEIGHTS - late**2 / 2.0, counts


def _own_balls(count: int, end: float, rtol: float) -> Callable[[], np.ndarray]:
    y, v = sp.symbols("y v")
    ball = Lagrangian(v**2 / 2, y, coordinates={y: v}, events=[Stop(y, 1)])
    scene = Scene(
        ball, topology=topology("chain", 1), record=(), transient=0.0, window=end, time_unit="time",
        integrator="taylor", rtol=rtol, atol=rtol / 10, max_steps=10_000_000,
    )  # fmt: skip
    return lambda: run(scene, y_1=HEIGHTS[:count], workers=1, show_progress=False).end.values[:, 0, 0]


def _scipy_ball(end: float, rtol: float) -> np.ndarray:
    def place(t: float, z: np.ndarray) -> float:
        return float(z[0])

    place.terminal, place.direction = True, -1  # type: ignore[attr-defined]
    t, z = 0.0, [HEIGHTS[0], 0.0]
    while True:
        done = solve_ivp(lambda t, z: (z[1], -1.0), (t, end), z, "DOP853", events=place, rtol=rtol, atol=rtol / 10)
        t, z = done.t[-1], [0.0, -done.y[1, -1]]
        if done.status == 0:
            return np.array([done.y[0, -1]])


def _heyoka_balls(heyoka: Any, end: float, rtol: float) -> Callable[[], np.ndarray]:
    y, v = heyoka.make_vars("y", "v")

    def rebound(integrator: Any, slope: int, lane: int) -> bool:
        integrator.state[1, lane] = -integrator.state[1, lane]
        return True

    hit = heyoka.t_event_batch(y, direction=heyoka.event_direction.negative, callback=rebound)
    start = np.array([HEIGHTS, np.zeros(8)])
    ta = heyoka.taylor_adaptive_batch([(y, v), (v, heyoka.expression(-1.0))], start, tol=rtol, t_events=[hit])

    def solve() -> np.ndarray:
        ta.set_time(0.0)
        ta.state[:] = start
        ta.reset_cooldowns()
        ta.propagate_until(end)
        return np.array(ta.state[0])

    return solve


def _carts(quick: bool) -> Iterator[Row]:
    cells = 8 if quick else 256
    exact, smoothed = _cart("set-valued"), _cart("atan").replace(kappa=1e8)

    def solve(scene: Scene, rtol: float, method: str) -> np.ndarray:
        given = scene.replace(rtol=rtol, atol=rtol / 10, integrator=method)
        found = run(given, x_1=np.linspace(0.3, 0.7, cells), workers=1, show_progress=False)
        return np.asarray(found.end.values[:, :4, 0])

    right = solve(exact, 1e-13, "dop853")
    for name, scene, method, digits in (
        (EXACT, exact, "taylor", (6, 8) if quick else (4, 5, 6, 8, 10)),
        (SMOOTHED, smoothed, "rodas5p", (8,) if quick else (6, 8)),
    ):
        for d in digits:
            rtol = 10.0**-d
            error = float(np.abs(solve(scene, rtol, method) - right).max())
            seconds = best_time(lambda s=scene, r=rtol, m=method: solve(s, r, m), quick)  # type: ignore[misc]
            yield CART, name, 8, rtol, error, 1e6 * seconds / cells


def _cart(contact: str) -> Scene:
    """Return a cart on a shaken plate with a pole; both have dry friction."""
    x, v, angle, rate, t, w = sp.symbols("x v th om t w")
    kinetic = v**2 / 2 + (v**2 + 2 * v * rate * sp.cos(angle) + rate**2) / 4
    forces = {x: sp.Rational(3, 5) * friction(sp.Rational(3, 10) * sp.cos(2 * t) - v), angle: friction(-rate) / 20}
    node = Lagrangian(
        kinetic, x**2 / 2 - sp.cos(angle) / 2, forces, coordinates={x: v, angle: rate},
        friction=sp.sign(w), contact=contact,
    )  # fmt: skip
    return Scene(
        node, topology=topology("chain", 1), record=(), transient=0.0, window=10.0, time_unit="time",
        initial={"th": 1.0, "om": 0.1}, max_steps=10_000_000,
    )  # fmt: skip

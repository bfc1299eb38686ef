"""Loads that jump in time set bodies free that set-valued friction holds, at the jump and once, however short they last."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from synchain import Lagrangian, Scene, friction_law
from synchain.graphs import chain
from synchain.runtime.sweeps.run import run

LOAD, LIMIT = 0.2, 0.3
BOX = Lagrangian(
    "v**2/2", "x**2/2", {"x": "friction(-v) + sign(cos(t/2))/5"}, coordinates={"x": "v"}, contact="set-valued",
    friction=friction_law("mu*sign(w)", {"mu": LIMIT}, static="mu"), name="box",
)  # fmt: skip


@pytest.mark.parametrize("integrator", ["dop853", "rodas5p"])
def test_a_load_that_jumps_beyond_the_limit_sets_a_body_free(integrator: str) -> None:
    """At t = pi the body leaves its place x0 for half a turn about LIMIT - LOAD; the next jump, at 3 pi, does not move it."""
    places = np.linspace(0.12, 0.29, 16)
    scene = Scene(
        BOX, None, chain(1), initial={"x": [places[0]], "v": [0.0]}, record=(), transient=0.0, window=12.0,
        time_unit="time", integrator=integrator, rtol=1e-9, max_steps=2000,
    )  # fmt: skip
    result = run(scene, x_1=places, show_progress=False, width=4)
    ends = result.states("end")
    np.testing.assert_allclose(ends[:, 0], 2 * (LIMIT - LOAD) - places, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(ends[:, 1:], 0.0)
    assert result.steps.max() < 100


@pytest.mark.parametrize("integrator", ["dop853", "rodas5p"])
def test_no_pulse_on_a_body_at_rest_is_stepped_over(integrator: str) -> None:
    """Each pulse speeds the body up by PULSE - LIMIT for its length, a twentieth of the period; then friction stops it."""
    pulse, length, limit = 0.5, 2 * np.arccos(0.99), LIMIT
    node = Lagrangian(
        "v**2/2", "0", {"x": "friction(-v) + (1/2 if sin(t) > 99/100 else 0)"}, coordinates={"x": "v"},
        contact="set-valued", friction=BOX.friction, name="pushed",
    )  # fmt: skip
    scene = Scene(
        node, None, chain(1), initial={"x": [0.0], "v": [0.0]}, record=(), transient=0.0, window=62.0,
        time_unit="time", integrator=integrator, max_steps=5000,
    )  # fmt: skip
    speed = (pulse - limit) * length
    way = 10 * (0.5 * speed * length + 0.5 * speed**2 / limit)
    for rtol, error in ((1e-4, 1e-2), (1e-9, 1e-7)):
        result = run(scene.replace(rtol=rtol), show_progress=False, width=4)
        np.testing.assert_allclose(result.states("end"), [way, 0.0, 0.0], rtol=error, atol=0)


BELT, OMEGA = 0.1, 1.15


def exact(x: float, end: float, load: tuple[float, float], force: float) -> list[float]:
    """Where a mass on a belt is, and its velocity, from v = BELT on: arcs of circles between events and jumps.

    The load is 1 + load[1] and force while cos(OMEGA t) > 0, 1 - load[1] and -force else; load[0] is the coefficient.
    """
    t, v, jumps = 0.0, BELT, 0
    mode = None
    while t < end:
        sign = -1.0 if jumps % 2 else 1.0
        limit, push, until = load[0] * (1 + sign * load[1]), sign * force, min(end, (jumps + 0.5) * np.pi / OMEGA)
        if mode is None:
            mode = 0.0 if abs(x - push) <= limit else np.sign(x - push)
        if mode == 0.0:
            leave = t + (limit + push - x) / BELT
            x, v, mode = x + BELT * (min(leave, until) - t), BELT, 1.0 if leave < until else None
            t, jumps = min(leave, until), jumps + (leave >= until)
            continue
        centre, span = push + mode * limit, until - t
        apart, looks = x - centre, np.linspace(0.0, span, 4001)
        gap = lambda s, a=apart, v=v, m=mode: m * (BELT + a * np.sin(s) - v * np.cos(s))  # noqa: E731
        closed = np.flatnonzero(gap(looks)[1:] < 0.0)
        way = brentq(gap, looks[max(closed[0], 1)], looks[closed[0] + 1], xtol=1e-15) if len(closed) else span
        x, v = centre + apart * np.cos(way) + v * np.sin(way), v * np.cos(way) - apart * np.sin(way)
        t, jumps = (t + way, jumps) if len(closed) else (until, jumps + 1)
        if len(closed):
            v, mode = BELT, None
    return [x, v]


@pytest.mark.parametrize("integrator", ["dop853", "rodas5p"])
@pytest.mark.parametrize(
    ("text", "load", "force"),
    [
        ("(1 + 0.4*sign(cos(1.15*t)))*friction(0.1 - v)", 0.4, 0.0),
        ("friction(0.1 - v) + (0.3 if cos(1.15*t) > 0 else -0.3)", 0.0, 0.3),
    ],
)
def test_square_waves_of_load_and_force(text: str, load: float, force: float, integrator: str) -> None:
    """Also where a load that falls lets go for less than a quarter of a step, which no look into it sees."""
    node = Lagrangian(
        "v**2/2", "x**2/2", {"x": text}, coordinates={"x": "v"}, contact="set-valued", friction=BOX.friction
    )
    starts = np.linspace(-0.5, 0.5, 26)
    scene = Scene(
        node, None, chain(1), initial={"x": [0.2], "v": [BELT]}, record=(), transient=0.0, window=30.0,
        time_unit="time", integrator=integrator, rtol=1e-9, max_steps=5000,
    )  # fmt: skip
    states = run(scene, x_1=starts, show_progress=False, width=4).states("end")
    wanted = [exact(x, 30.0, (LIMIT, load), force) for x in starts]
    np.testing.assert_allclose(states[:, :2], wanted, rtol=0, atol=1e-7)

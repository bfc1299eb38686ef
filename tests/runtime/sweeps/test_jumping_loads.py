"""Loads that jump in time set bodies free that set-valued friction holds, at the jump and once, however short they last."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Lagrangian, Scene, friction_law
from synchain.models import chain
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
    found = run(scene, x_1=places, show_progress=False, width=4)
    ends = found.states("end")
    np.testing.assert_allclose(ends[:, 0], 2 * (LIMIT - LOAD) - places, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(ends[:, 1:], 0.0)
    assert found.steps.max() < 100


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
        found = run(scene.replace(rtol=rtol), show_progress=False, width=4)
        np.testing.assert_allclose(found.states("end"), [way, 0.0, 0.0], rtol=error, atol=0)

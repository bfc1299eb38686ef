"""The benchmark of events: places of balls in closed form, exact beside smoothed friction, closed forms of hard cases."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import events
from benchmarks.kit import stability_events
from synchain import run


def test_balls_end_where_their_parabolas_do() -> None:
    rows = list(events._balls(quick=True))
    assert [row[1:3] for row in rows][:3] == [("synchain", 1), ("synchain", 8), ("SciPy DOP853", 1)]
    assert all(row[4] < 1e-9 for row in rows)
    assert rows[2][5] > 2 * rows[0][5]


@pytest.mark.long
def test_smoothed_friction_nears_the_exact_law() -> None:
    rows = list(events._carts(quick=True))
    assert all(row[4] < (1e-6 if row[1] == events.EXACT else 1e-4) for row in rows)
    ball = [("bouncing ball", "synchain", 1, 0.0, 0.0, 1.0), ("bouncing ball", "SciPy DOP853", 1, 0.0, 0.0, 60.0)]
    assert "60" in events.summary([*ball, *rows])
    assert "smoothed over exact law" in events.summary([*ball, *rows])


def test_closed_forms_of_hard_cases_keep_their_laws() -> None:
    """Pool keeps energy and order, a ball in flight its energy; a later window continues an earlier one."""
    for name, scene, reference, _ in stability_events.events(quick=True):
        end = getattr(stability_events, reference)(scene)
        if reference == "pool":
            x, y, v, u = end
            m = scene.parameters["m"]
            assert 0 <= x <= y
            assert v**2 + m * u**2 == pytest.approx(m), name
        step = 1e-6
        before, after = (
            getattr(stability_events, reference)(scene.replace(window=scene.window + d)) for d in (-step, step)
        )
        half = len(end) // 2
        assert (after - before)[:half] / (2 * step) == pytest.approx(end[half:], abs=1e-5), name


def test_a_wrong_restitution_is_seen() -> None:
    """The end of a ball with another restitution is further off than the benchmark allows."""
    scene = next(scene for name, scene, _, _ in stability_events.events(quick=True) if name == "ball, e = 1, taylor")
    end = run(scene, show_progress=False).states("end")[:2]
    wrong = stability_events.rebounds(scene.replace(e=0.999))
    right = stability_events.rebounds(scene)
    assert np.abs(end - right).max() < 1e-5 < np.abs(end - wrong).max()

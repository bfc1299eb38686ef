"""The record of events: times in closed form and in 40 digits, joint events of equal nodes, files."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.runtime.cells.observable_arrays import Sections

X, Y, V, T, W = sp.symbols("x y v t w")
R, SIGN = sp.Rational, sp.sign(sp.Symbol("w"))
METHODS = ("dop853", "taylor")


def scene(node, window: float, integrator: str, n: int = 1, **more) -> sc.Scene:
    given = {"topology": sc.graphs.chain(n), "rtol": 1e-12, "atol": 1e-13, "record": ("events",), **more}
    return sc.Scene(node, transient=0, window=window, time_unit="time", integrator=integrator, **given)


def events(given: sc.Scene, **swept):
    found = sc.run(given, workers=1, show_progress=False, **swept)
    assert (found.status.values == 1).all(), found.message
    return found.events


@pytest.mark.parametrize("integrator", METHODS)
def test_a_shaken_plate_holds_and_lets_go(integrator: str) -> None:
    """x'' = 0.8 f(sin t - x') from rest: roots of sin; both kinds of steps find the same five events."""
    slider = sc.Lagrangian(V**2 / 2, 0, {X: R(4, 5) * sc.friction(sp.sin(T) - V)}, coordinates={X: V}, friction=SIGN, contact="set-valued")  # fmt: skip
    found = events(scene(slider, 8.0, integrator, initial={"x": [0.0]}))
    times = [1.131102585651283, 2.498091544796509, 4.457800232775676, 5.639684198386302, 7.599392886365469]
    assert found.event_time.values == pytest.approx(times, abs=1e-11)
    assert list(found.event_before.values) == [1, 0, -1, 0, 1]
    assert list(found.event_after.values) == [0, -1, 0, 1, 0]
    assert int(found.event_count) == 5


@pytest.mark.parametrize("integrator", METHODS)
def test_a_ball_that_bounces_and_closes(integrator: str) -> None:
    """h = 1, g = 9.81, e = 0.8: impact k at t_1 (1 + 2 sum e**j); the last event closes the stop."""
    ball = sc.Lagrangian(V**2 / 2, R(981, 100) * Y, coordinates={Y: V}, events=[sc.Stop(Y, R(4, 5))])
    found = events(scene(ball, 5.0, integrator, initial={"y": [1.0]}))
    first, e = np.sqrt(2 / 9.81), 0.8
    right = first * (1 + 2 * np.cumsum(np.concatenate([[0.0], e ** np.arange(1, 30)])))
    assert found.event_time.values[:20] == pytest.approx(right[:20], abs=1e-10)
    assert found.event_time.values[4] == pytest.approx(2.584160102089535, abs=1e-12)
    assert (found.event_after.values[:-1] == 1).all()
    assert found.event_after.values[-1] == 0
    assert found.event_time.values[-1] == pytest.approx(9 * first, abs=1e-5)


@pytest.mark.parametrize("integrator", METHODS)
def test_a_relay_and_a_neuron(integrator: str) -> None:
    relay = sc.Field({X: Y, Y: -sp.sign(X + R(7, 10) * Y)}, contact="set-valued")
    found = events(scene(relay, 8.0, integrator, initial={"x": [3.0], "y": [0.0]}))
    assert found.event_time.values == pytest.approx([1.847547840571399, 4.142643521714198], abs=1e-11)
    assert list(found.event_after.values) == [-1, 0]
    V_, U = sp.symbols("V U")
    cell = sc.Field(
        {V_: V_**2 / 25 + 5 * V_ + 140 - U + 10, U: (V_ / 5 - U) / 50}, events=[sc.Reset(V_ - 30, {V_: -65, U: U + 8})]
    )
    spikes = [3.12705530387698, 26.2260246341484, 71.0570973282096, 115.869510996278, 160.681924664374]
    found = events(scene(cell, 200.0, integrator, initial={"V": [-65.0], "U": [-13.0]}))
    assert found.event_time.values == pytest.approx(spikes, abs=2e-10)


@pytest.mark.parametrize("integrator", METHODS)
def test_equal_nodes_and_patches_have_joint_events(integrator: str, tmp_path) -> None:
    """Three equal pads of two patches in a ring: all six rows change in each event, at one time to the last bit."""
    slide, ph, si = R(1, 5) - V, *sp.symbols("ph si")
    near, far = (sc.friction(slide + sign * si / 2) for sign in (-1, 1))
    forces = {X: R(4, 5) * sp.cos(R(9, 10) * T) + R(3, 10) * (near + far), ph: R(3, 20) * (near - far)}
    pad = sc.Lagrangian(V**2 / 2 + si**2 / 10, X**2 / 2, forces, coordinates={X: V, ph: si}, friction=SIGN, contact="set-valued")  # fmt: skip
    ring = scene(pad, 9.0, integrator, topology=sc.graphs.ring(3), coupling="spring on x", initial={"x": [0.3] * 3, "v": [0.0] * 3, "ph": [0.0] * 3, "si": [0.0] * 3})  # fmt: skip
    found = sc.run(ring, sigma=[0.1, 0.4], workers=1, show_progress=False)
    for cell in range(2):
        times = found.events.event_time.values[cell]
        times = times[np.isfinite(times)]
        assert len(times) % 3 == 0
        by_node = [times[found.events.event_node.values[cell][: len(times)] == node] for node in (1, 2, 3)]
        assert np.array_equal(by_node[0], by_node[1])
        assert np.array_equal(by_node[0], by_node[2])
        assert sorted(set(found.events.event_row.values[cell][: len(times)])) == [1, 2]
    found.save(tmp_path / "pads.nc")
    again = sc.open_result(tmp_path / "pads.nc")
    assert again.events.equals(found.events)
    resumed = sc.run(ring, sigma=[0.1, 0.4], workers=1, show_progress=False)
    assert resumed.events.equals(found.events)


def test_friction_on_a_belt_has_the_same_record() -> None:
    """A block on a belt, F_s = 1, F_k = 1/2, v = 1/5: circular arcs, slip 2 (pi - atan(F_s - F_k)/v), stick 2 (F_s - F_k)/v."""
    law = sc.friction_law("sign(w)/2", static="1")
    block = sc.Lagrangian(V**2 / 2, X**2 / 2, {X: sc.friction(R(1, 5) - V)}, coordinates={X: V}, friction=law, contact="set-valued")  # fmt: skip
    for integrator in METHODS:
        found = events(scene(block, 40.0, integrator, initial={"x": [0.9], "v": [0.2]}))
        slip, stick = 2 * (np.pi - np.arctan(0.5 / 0.2)), 2 * 0.5 / 0.2
        assert np.diff(found.event_time.values)[:4] == pytest.approx([slip, stick, slip, stick], abs=1e-9)
        assert not scene(block, 1.0, integrator).equations.has_rows


def test_numbers_of_events_and_states_that_are_held_at_zero() -> None:
    """A slider between a stop and a ground at rest: v = 0 to the last bit while it sticks; numbers of events by node."""
    friction = sc.Friction(-V, load=R(1, 10))
    block = sc.Lagrangian(V**2 / 2, X**2 / 2, {X: sp.cos(T / 2) / 4}, coordinates={X: V}, friction=SIGN, contact="set-valued",
                          events=[friction, sc.Stop(X + R(1, 4), R(1, 2))])  # fmt: skip
    given = scene(block, 40.0, "dop853", n=2, record=("events", "trajectory"), samples=400, coupling="spring on x",
                  initial={"x": [0.5, 0.3], "v": [0.0, 0.0]})  # fmt: skip
    result = sc.run(given, sigma=0.1, show_progress=False)
    held = result.trajectory.sel(component="slip").values == 0.0
    assert 50 < held.sum() < 700
    assert (result.trajectory.sel(component="v").values[held] == 0.0).all()
    found, count = result.events, int(result.events.event_count)
    rows, before, after = (found[f"event_{name}"].values[:count] for name in ("row", "before", "after"))
    assert not ((rows == 1) & (before == after)).any()
    for i in (1, 2):
        mine = found.event_node.values[:count] == i
        assert int(found.event_impacts.sel(node=i)) == (mine & (rows == 2)).sum() > 0
        assert int(found.event_slips.sel(node=i)) == (mine & (rows == 1) & (before == 0.0)).sum() > 0
    assert (
        dict(result.summary)["events"]
        == f"{int(found.event_impacts.sum())} impacts, {int(found.event_slips.sum())} slips"
    )
    assert "event_resets" not in result


def test_a_contact_that_stays_in_its_mode_has_no_event() -> None:
    block = sc.Lagrangian(V**2 / 2, X**2 / 2, coordinates={X: V}, friction=SIGN, contact="set-valued",
                          events=[sc.Friction(-V), sc.Stop(X + 1)])  # fmt: skip
    points = np.array([[[1.0, 0.0, -1.0, -1.0], [2.0, 0.0, -1.0, 0.0], [3.0, 1.0, 1.0, 1.0], [np.nan] * 4]])
    variables = {name: values for name, _, values in Sections(scene(block, 1.0, "taylor")).variables(points, 3)}
    assert int(variables["event_count"][0]) == 2
    assert variables["event_time"][0].tolist()[:2] == [2.0, 3.0]
    assert np.isnan(variables["event_time"][0][2])
    assert variables["event_impacts"].tolist() == [[1]]
    assert variables["event_slips"].tolist() == [[0]]


def test_refusals() -> None:
    smooth = sc.Lagrangian(V**2 / 2, X**2 / 2, coordinates={X: V})
    with pytest.raises(ValueError, match="record: found 'events', but no node has any"):
        scene(smooth, 1.0, "taylor")
    ball = sc.Lagrangian(V**2 / 2, Y, coordinates={Y: V}, events=[sc.Stop(Y)])
    with pytest.raises(ValueError, match="record: found 'events' beside section"):
        scene(ball, 1.0, "taylor", record=("events", "section"))
    with pytest.raises(ValueError, match="the result has no events"):
        _ = sc.run(scene(ball, 1.0, "taylor", record=(), initial={"y": [1.0]}), show_progress=False).events


def test_every_event_of_a_motion_that_repeats_itself_is_recorded() -> None:
    """One impact in each period of the drive; runs without a record of events leap over periods that repeat."""
    x, v, t = sp.symbols("x v t")
    hit = sc.Lagrangian(v**2 / 2, x**2 / 2, {x: 0.9 * sp.cos(0.8 * t) - 0.1 * v}, coordinates={x: v},
                        events=[sc.Stop(0.6 - x, 0.7)])  # fmt: skip
    given = sc.Scene(hit, topology=sc.graphs.chain(1), record=["events"], transient=300, window=400, initial={"x": 0.1})
    found = sc.run(given, workers=1, show_progress=False)
    assert int(found.event_count) == int(found.event_impacts.sum()) == 400
    times = found.events.event_time.values.ravel()
    assert np.diff(times) == pytest.approx(2 * np.pi / 0.8, rel=1e-9)

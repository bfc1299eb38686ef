"""Stops, resets and contacts among the events of a model: impact times in closed form, orbits in 40 digits.

The orbits with several kinds of events come from a hand-written pair of equations and Taylor series of heyoka.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

import synchain as sc
from synchain.models.scenes.file import load_scene
from synchain.results import Status

X, Y, V, T, TH, OM, G, E = sp.symbols("x y v t th om g e")
R = sp.Rational
METHODS = ("dop853", "taylor")
BALL = sc.Lagrangian(
    V**2 / 2, G * Y, coordinates={Y: V}, parameters={G: 9.81, E: 0.8}, events=[sc.Stop(Y, restitution=E)]
)


def scene(node, window: float, integrator: str, n: int = 1, **more) -> sc.Scene:
    given = {"topology": sc.graphs.chain(n), "rtol": 1e-12, "atol": 1e-13, "record": (), **more}
    return sc.Scene(node, transient=0, window=window, time_unit="time", integrator=integrator, **given)


def end(given: sc.Scene, **swept) -> np.ndarray:
    found = sc.run(given, workers=1, show_progress=False, **swept)
    assert (found.status.values == 1).all(), found.message
    return found.data["end"].values


@pytest.mark.parametrize("integrator", METHODS)
def test_a_ball_comes_to_rest(integrator: str) -> None:
    """h = 1, e = 0.8: fifth impact at 2.584160102089535; all rebounds end at 9 sqrt(2/9.81) = 4.0637."""
    drop = scene(BALL, 5.0, integrator, initial={"y": [1.0]})
    assert list(end(drop).ravel()) == [0.0, 0.0, 0.0]
    assert end(drop.replace(window=4.0637))[2] == 1.0
    fifth = 2.584160102089535
    for after in (-1e-6, 1e-6):
        y, v, _ = end(drop.replace(window=fifth + after)).ravel()
        speed = np.sqrt(2 * 9.81) * 0.8 ** (4 + (after > 0))
        assert y == pytest.approx(abs(after) * speed, abs=1e-11)
        assert abs(v) == pytest.approx(speed, abs=2e-5)
    e = np.linspace(0.1, 0.9, 8)
    together = end(drop.replace(window=2.0), e=e)
    assert all(np.array_equal(end(drop.replace(window=2.0), e=[each])[0], each_end) for each, each_end in zip(e, together, strict=True))  # fmt: skip


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
def test_restitution_that_depends_on_the_speed(integrator: str) -> None:
    """Balls fall to speed 1; e = 1 - c |v|**2 is from 0 to 1 only if 0 <= c <= 1."""
    c = sp.Symbol("c")
    ball = sc.Lagrangian(V**2 / 2, Y, coordinates={Y: V}, parameters={c: 0.25}, events=[sc.Stop(Y, 1 - c * V**2)])
    drop = scene(ball, 1.5, integrator, initial={"y": [0.5]})
    assert end(drop).ravel() == pytest.approx([0.75 / 2 - 1 / 8, 0.75 - 0.5, 1.0], abs=1e-9)
    found = sc.run(drop, workers=1, show_progress=False, c=[-0.5, 0.0, 0.9, 1.5])
    assert [Status(code).name for code in found.status.values] == ["AMBIGUOUS", "FINISHED", "FINISHED", "AMBIGUOUS"]


@pytest.mark.parametrize("integrator", METHODS)
def test_a_ball_on_a_shaken_table_repeats_itself(integrator: str) -> None:
    """g = 1, e = 0.8, table sin(2 pi t)/80, one impact a period at t = 0.12494… with v = 1/2 after it."""
    phase, late = 0.1249440531877598, sp.Symbol("late")
    gap = X - sp.sin(2 * sp.pi * (T + late)) / 80
    ball = sc.Lagrangian(
        V**2 / 2, X, coordinates={X: V}, parameters={late: phase + 0.5}, events=[sc.Stop(gap, R(4, 5))]
    )
    top = np.sin(2 * np.pi * phase) / 80 + 0.125
    assert end(scene(ball, 1.0, integrator, initial={"x": [top]})).ravel() == pytest.approx([top, 0.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("integrator", METHODS)
def test_stick_static_drop_and_stop_in_one_orbit(integrator: str) -> None:
    """A cart-pole that sticks to a shaken ground, lets go with a jump and hits a stop once a period."""
    law = sc.friction_law("sign(w)", static="6/5")
    pull = R(3, 5) * sc.friction(R(4, 5) * sp.cos(R(6, 5) * T) - V)
    cart = sc.Lagrangian(
        V**2 / 2 + (V**2 + 2 * V * OM * sp.cos(TH) + OM**2) / 4,
        X**2 / 2 - sp.cos(TH) / 2,
        {X: pull - V / 4, TH: -OM / 4},
        coordinates={X: V, TH: OM},
        friction=law,
        contact="set-valued",
        events=[sc.Stop(R(1, 5) - X, R(7, 10))],
    )
    start = {"x": [0.00282212838818], "th": [-0.63680895403904], "v": [0.69619124352542], "om": [-0.43433774329057]}
    period = 2 * np.pi / 1.2
    found = end(scene(cart, period, integrator, initial=start)).ravel()
    assert found[:4] == pytest.approx([each[0] for each in start.values()], abs=1e-12)
    assert list(found[4:]) == [1.0, 1.0]
    # it sticks from 3.7454 to 4.4907 and is hit at 0.2831
    assert list(end(scene(cart, 4.0, integrator, initial=start))[4:, 0]) == [0.0, 1.0]
    ring = scene(cart, 3 * period, integrator, topology=sc.graphs.ring(3), coupling="spring on x", initial={k: v * 3 for k, v in start.items()})  # fmt: skip
    together = end(ring, sigma=[0.1, 0.3])
    assert np.array_equal(together, np.broadcast_to(together[:, :, :1], together.shape))


@pytest.mark.parametrize("integrator", METHODS)
def test_neurons_that_are_reset(integrator: str) -> None:
    """Izhikevich: the state at t = 200 by two programs in 40 digits; integrate-and-fire locked 1:1 to its drive."""
    V_, U = sp.symbols("V U")
    cell = sc.Field(
        {V_: V_**2 / 25 + 5 * V_ + 140 - U + 10, U: (V_ / 5 - U) / 50}, events=[sc.Reset(V_ - 30, {V_: -65, U: U + 8})]
    )
    found = end(scene(cell, 200.0, integrator, initial={"V": [-65.0], "U": [-13.0]})).ravel()
    assert found == pytest.approx([-60.5411414683953, -7.22043125523832], abs=1e-10)
    drive = R(6, 5) + R(3, 10) * sp.sin(2 * sp.pi * T / R(17, 10))
    lif = sc.Field({V: drive - V}, events=[sc.Reset(V - 1, {V: 0})])
    before, after = (
        end(scene(lif, 170.4359846523211 + d, integrator, initial={"v": [0.3]})).item() for d in (-1e-9, 1e-9)
    )
    assert before == pytest.approx(1.0, abs=1e-8)
    assert after == pytest.approx(0.0, abs=1e-8)


def test_events_beside_smooth_equations_and_in_loops() -> None:
    """Twelve balls on springs, stepped in loops, hit the floor like each pair of neighbours written out."""
    tied = scene(BALL, 1.5, "dop853", 12, coupling="spring", initial={"y": [1.0] * 12})
    single = end(scene(BALL, 1.5, "dop853", initial={"y": [1.0]})).ravel()
    found = end(tied, sigma=[0.5])[0]
    assert pytest.approx(np.tile(single, (12, 1)), abs=1e-11) == found.T
    unequal = {"y": list(np.linspace(0.6, 1.0, 9))}
    loops = end(scene(BALL, 1.5, "dop853", 9, coupling="spring", initial=unequal), sigma=[0.5])[0]
    series = end(scene(BALL, 1.5, "taylor", 9, coupling="spring", initial=unequal), sigma=[0.5])[0]
    np.testing.assert_allclose(loops, series, atol=1e-9)
    assert (series[0] >= 0).all()


def test_a_contact_follows_from_virtual_work() -> None:
    """The slider of a crank as an event with its own law equals the force written by hand."""
    hand = sc.Lagrangian(OM**2 / 2, 0, {TH: R(3, 10) * sp.sin(TH) * sc.friction(-OM * sp.sin(TH))}, coordinates={TH: OM}, friction=sp.sign(sp.Symbol("w")), contact="set-valued")  # fmt: skip
    law = sc.friction_law("sign(w)")
    event = sc.Lagrangian(OM**2 / 2, 0, coordinates={TH: OM}, contact="set-valued", events=[sc.Friction(-OM * sp.sin(TH), R(3, 10), law)])  # fmt: skip
    start = {"th": [0.5], "om": [2.0]}
    one, other = (end(scene(node, 9.0, "taylor", initial=start)) for node in (hand, event))
    np.testing.assert_allclose(one, other, atol=1e-13)
    smooth = scene(event, 9.0, "taylor", contact="sign", initial=start)
    assert not smooth.equations.sticks


FILE = """
topology = { name = "chain", n = 1 }
window = 2.0
transient = 0.0
time_unit = "time"
record = []
[initial]
y = [1.0]
[oscillator]
coordinates = { y = "v" }
kinetic = "v**2/2"
potential = "g*y"
parameters = { g = 9.81, e = 0.8 }
events = [{ stop = "y", restitution = "e" }, { friction = "-v", load = "1/10", law = "coulomb" }, { reset = "y - 2", sets = { v = "-v" } }]
"""


def test_events_in_files(tmp_path) -> None:
    path = tmp_path / "ball.toml"
    path.write_text(FILE, encoding="utf-8")
    read = load_scene(path)
    kinds = [type(event).__name__ for event in read.model.kinds[0].oscillator.model.events]
    assert kinds == ["Stop", "Friction", "Reset"]
    assert sc.Scene.from_dict(read.as_dict()) == read
    read.save(tmp_path / "again.toml")
    assert load_scene(tmp_path / "again.toml").equations.digest == read.equations.digest
    assert {"open", "slip"} <= set(read.replace(contact="set-valued").components)


@pytest.mark.parametrize("integrator", METHODS)
def test_the_error_of_clocks_that_reset_one_after_the_other(integrator: str) -> None:
    """x' = 1, reset from 1 to 0, apart by d: the distance is d, and 1 - d for a time d of each period."""
    clock, apart = sc.Field({X: 1}, events=[sc.Reset(X - 1, {X: 0})]), 1e-6
    pair = scene(clock, 3.0, integrator, 2, coupling="x->x", initial={"x": [0.25, 0.25 + apart]}, record=("sync_error",))  # fmt: skip
    found = sc.run(pair, workers=1, show_progress=False, sigma=[0.0])
    assert float(found.sync_error[0]) == pytest.approx(2 * apart * (1 - apart), rel=1e-7)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sc.Stop(Y, 1.5), "found the restitution 3/2; expected a number from 0 to 1"),
        (lambda: sc.Stop(Y, in_order="yes"), "found in_order = 'yes'; expected True or False"),
        (lambda: sc.Stop(V), r"found the gap v; expected a function of coordinates and time"),
        (
            lambda: sc.Reset(Y - 1, {Y: 2}),
            "found the guard 1 just after; expected a negative value, else it fires without end",
        ),
        (lambda: sc.Reset(Y - 1, {}), "found no new values; expected a value of at least one state"),
        (lambda: sc.Friction(-V, law=sp.sign(V)), "event 1: law: found .*; expected a name"),
        (lambda: "stop", "event 1: found 'stop'.*; expected Friction or Stop or Reset"),
    ],
)
def test_what_is_no_event(make, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        sc.Lagrangian(V**2 / 2, Y, coordinates={Y: V}, events=[make()])


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (-0.1, "found node 1 with the gap y = -0.1; expected 0 or more; change y in initial"),
        (0.0, "gap y = 0, which closes at the speed 1; expected an open gap, .*; change y or v in"),
    ],
)
def test_a_start_behind_a_stop(start: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        end(scene(BALL, 1.0, "taylor", initial={"y": [start], "v": [-1.0]}))
    with pytest.raises(TypeError, match="expected Reset"):
        sc.Field({V: -V}, events=[sc.Stop(V)])


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize("strength", [1.001, 1.05, 1.5])
def test_a_ball_is_thrown_off_a_table_and_lands(integrator: str, strength: float) -> None:
    """x'' = -1 over A sin(3 t): it is thrown where A 9 sin(3 t) = 1 and lands where the parabola meets the table."""
    A, w = sp.Symbol("A"), 3.0
    ball = sc.Lagrangian(
        V**2 / 2, X, coordinates={X: V}, parameters={A: strength / 9}, events=[sc.Stop(X - A * sp.sin(3 * T), 0)]
    )
    size, begin = strength / 9, np.arcsin(1 / strength) / w
    thrown = lambda t: size * np.sin(w * begin) + size * w * np.cos(w * begin) * (t - begin) - (t - begin) ** 2 / 2  # noqa: E731
    land = brentq(lambda t: thrown(t) - size * np.sin(w * t), begin + 1e-3, begin + 2.0, xtol=1e-15)
    for rtol in (1e-5, 1e-9):
        given = scene(ball, 1.0, integrator, initial={"x": [0.0], "v": [strength / 3]}, rtol=rtol, atol=rtol / 10)
        for t in (begin + 0.4 * (land - begin), land - 1e-3, land + 1e-3, land + 0.1):
            x, _, mode = end(given.replace(window=float(t))).ravel()
            assert mode == (t < land)
            assert x == pytest.approx(thrown(t) if t < land else size * np.sin(w * t), abs=10 * rtol)


@pytest.mark.parametrize("unit", [1e-3, 1e-6])
def test_impacts_do_not_depend_on_the_unit_of_length(unit: float) -> None:
    """The default atol follows the start of the coordinates; the mode of a stop is 1 in any unit."""

    def impacts(length: float) -> np.ndarray:
        stop = sc.Stop(Y - length * sp.sin(100 * T) / 500, restitution=R(3, 10))
        shaken = sc.Lagrangian(V**2 / 2, G * Y, coordinates={Y: V}, parameters={G: 9.81 * length}, events=[stop])
        given = {"initial": {"y": [length / 100]}, "record": ["events"], "rtol": 1e-8, "atol": None}
        found = sc.run(scene(shaken, 0.5, "taylor", **given), show_progress=False)
        return found.events.event_time.values.ravel()

    np.testing.assert_allclose(impacts(unit), impacts(1.0), rtol=1e-5)


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize(
    ("length", "time"), [(1e-12, 1.0), (1e-12, 1e-6), (1e-9, 1e-9), (1e-6, 1.0), (1.0, 1e3), (1e6, 1e3), (1e12, 1.0)]
)
def test_a_ball_rests_after_as_many_impacts_in_any_unit(integrator: str, length: float, time: float) -> None:
    """g = 1, e = 9/10: the rebound after impact 132 is the first one below 1e-12 of the height of the drop."""
    ball = sc.Lagrangian(V**2 / 2, length / time**2 * Y, coordinates={Y: V}, events=[sc.Stop(Y, R(9, 10))])
    drop = scene(ball, 30.0 * time, integrator, initial={"y": [length]}, record=["events"], rtol=1e-9, atol=None)
    found = sc.run(drop, workers=1, show_progress=False)
    times = found.events.event_time.values.ravel()
    assert np.isfinite(times).sum() == 132
    assert np.nanmax(times) / time == pytest.approx(np.sqrt(2) * (19 - 18 * 0.9**131), rel=1e-9)
    assert not found.data["end"].values.any()


@pytest.mark.parametrize(("integrator", "error"), [("taylor", 1e-13), ("dop853", 1e-11)])
def test_elastic_impacts_keep_the_energy(integrator: str, error: float) -> None:
    """10 000 impacts of a ball, each of which is noticed a rounding error below the table."""
    drop = scene(BALL, 20_000 * np.sqrt(2 / 9.81), integrator, initial={"y": [1.0]}, max_steps=10**6)
    y, v, _ = end(drop, e=[1.0]).ravel()
    assert v**2 / 2 / 9.81 + y == pytest.approx(1.0, abs=error)

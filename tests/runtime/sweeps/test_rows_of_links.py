"""Contacts and stops between bodies: blocks on each other, cradles, and parts of a network that they join.

Right values: closed forms, and a second program (heyoka at 1e-17, KKT conditions of held rows) that shares nothing with
the package.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.models.scenes.file import load_scene
from synchain.runtime.support.status import Status

X, V, TH, OM, T, N, E = sp.symbols("x v th om t N e")
R = sp.Rational
METHODS = ("dop853", "taylor")
LAW = sc.friction_law("sign(w)")
BLOCK = sc.Lagrangian(V**2 / 2, 0, coordinates={X: V})
RUB = sc.Potential(0, {N: 4}, events=[sc.Friction("v_j - v_i", load="W*N", law=LAW)])
CRADLE = sc.Potential(0, {E: 0.9}, events=[sc.Stop("x_j - x_i", restitution=E)])


def scene(node, coupling, graph, window: float, integrator: str, **more) -> sc.Scene:
    given = {"rtol": 1e-12, "atol": 1e-13, "record": (), **more}
    return sc.Scene(node, coupling, graph, transient=0, window=window, time_unit="time", integrator=integrator, **given)


def end(given: sc.Scene, **swept) -> dict[str, np.ndarray]:
    """The last states by component; the last axis is that of the nodes."""
    found = sc.run(given, workers=1, show_progress=False, **swept)
    assert (found.status.values == 1).all(), found.message
    return {str(name): found.data["end"].sel(component=name).values for name in found.data["component"].values}


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
def test_a_block_on_a_block_on_the_ground(integrator: str) -> None:
    """Masses 1 on 2, loads 4 between and 3 at the ground: locked at 2/3 with velocity 1/3, at rest at 1."""
    lower = sc.Lagrangian(V**2, 0, {X: 3 * sc.friction(-V)}, coordinates={X: V}, friction=LAW, contact="set-valued")
    group = {"oscillator": lower, "friction": LAW, "at": [2]}
    pair = scene(
        BLOCK,
        RUB,
        sc.graphs.chain(2),
        1.5,
        integrator,
        nodes=[group],
        initial={"x": 0.0, "v": [3.0, 0.0]},
        record=["events"],
    )
    result = sc.run(pair, workers=1, show_progress=False)
    last = result.end
    assert last.sel(component="x").values == pytest.approx([7 / 6, 1 / 6], abs=1e-12)
    assert list(last.sel(component="v").values) == [0.0, 0.0]
    assert float(last.sel(component="slip", node=2)) == float(last.sel(component="slip_link", node=2)) == 0.0
    events = result.events
    assert events.event_time.values == pytest.approx([2 / 3, 1.0], abs=1e-12)
    # both rows belong to node 2: its contact with the ground, then that of its link
    assert list(zip(events.event_node.values, events.event_row.values, strict=True)) == [(2, 2), (2, 1)]
    at_lock = end(pair.replace(window=2 / 3 + 1e-9, record=()))
    assert at_lock["v"] == pytest.approx([1 / 3, 1 / 3], abs=2e-9)


@pytest.mark.parametrize("integrator", METHODS)
def test_a_cart_pole_with_a_block_on_it_that_hits_a_stop(integrator: str) -> None:
    """Two contacts of a node, a contact of a link and a stop in one part of four rows; the second program's state."""
    cart = sc.Lagrangian(
        V**2 / 2 + (V**2 + 2 * V * OM * sp.cos(TH) + OM**2) / 4,
        X**2 / 2 - sp.cos(TH) / 2,
        {X: R(3, 5) * sc.friction(R(3, 10) * sp.cos(2 * T) - V), TH: R(1, 20) * sc.friction(-OM)},
        coordinates={X: V, TH: OM},
        friction=LAW,
        contact="set-valued",
    )
    block = sc.Lagrangian(R(3, 20) * V**2, X**2 / 8, coordinates={X: V}, events=[sc.Stop(R(1, 10) - X, R(3, 5))])
    rub = sc.Potential(0, events=[sc.Friction("v_j - v_i", load=R(1, 4), law=LAW)])
    start = {"x": [0.5, 0.0], "v": [0.0, 0.3], "th": [1.0], "om": [0.1]}
    group = {"oscillator": block, "friction": "none", "at": [2]}
    pair = scene(cart, rub, sc.graphs.chain(2), 10.0, integrator, nodes=[group], initial=start, record=["events"])
    result = sc.run(pair, workers=1, show_progress=False)
    last = {
        name: result.end.sel(component=name).values for name in ("x", "th", "v", "om", "slip_x", "slip_th", "slip_link")
    }
    assert last["x"] == pytest.approx([0.248134481847352, -0.219962958769241], abs=1e-12)
    assert [last["th"][0], last["om"][0]] == pytest.approx([-0.463822228415366, -0.137508741481614], abs=1e-12)
    assert last["v"] == pytest.approx([0.122424618544018] * 2, abs=1e-12)
    assert (last["slip_x"][0], last["slip_th"][0], last["slip_link"][1]) == (0.0, 1.0, 0.0)
    times = result.events.event_time.values
    expected = [0.08453660798596, 0.23522906080924, 0.52359309950646, 0.61473715454543, 0.68643538578720]
    assert [*times[:5], times[-1]] == pytest.approx([*expected, 8.02882757930057], abs=2e-11)


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
def test_a_cradle_of_three(integrator: str) -> None:
    """e = 0.9, places 0 1 2, v = (1, 0, 0): impacts at 1, 39/19 and 381."""
    given = scene(
        BLOCK,
        CRADLE,
        sc.graphs.chain(3),
        400.0,
        integrator,
        initial={"x": [0, 1, 2], "v": [1, 0, 0]},
        record=["events"],
    )
    result = sc.run(given, workers=1, show_progress=False)
    assert result.events.event_time.values == pytest.approx([1.0, 39 / 19, 381.0], abs=1e-10)
    assert list(result.events.event_node.values) == [2, 3, 2]
    assert list(result.data["event_impacts"].values) == [0, 2, 1]
    assert result.end.sel(component="v").values == pytest.approx([0.047625, 0.049875, 0.9025], abs=1e-10)


def test_links_that_move_blocks_that_rub() -> None:
    """x' = v + sigma (x_j - x_i) beside a contact: blocks with v = 1, -1 lock at 1/4, then their distance decays."""
    pair = sc.graphs.chain(2)
    rates, start = sc.Rates({"x": "k*W*(x_j - x_i)"}, {"k": 0.5}), {"x": [0.0, 0.0], "v": [1.0, -1.0]}
    settings = {"transient": 0, "window": 1.0, "time_unit": "time", "rtol": 1e-12, "atol": 1e-13, "record": ()}
    last = end(sc.Scene(BLOCK, links=[(RUB, pair), (rates, pair)], initial=start, integrator="dop853", **settings))
    at_lock = 10 - 10 * np.exp(-0.25) - 8 * 0.25  # of d' = 2 - 8 t - d, d(0) = 0
    assert last["x"][0] - last["x"][1] == pytest.approx(at_lock * np.exp(-0.75), abs=1e-11)
    assert list(last["v"]) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert list(last["slip_link"])[1] == 0.0
    with pytest.raises(ValueError, match="found a link that changes the rate of x, which is in"):
        _ = sc.Scene(BLOCK, links=[(CRADLE, pair), (rates, pair)], initial=start, **settings).equations


@pytest.mark.parametrize("integrator", METHODS)
def test_equal_pairs_have_equal_bits_and_lanes_too(integrator: str) -> None:
    """Five pairs of balls in springs hit at once, each as the first; eight cells in lanes end as each by itself."""
    ball = sc.Lagrangian(V**2 / 2, X**2 / 2, coordinates={X: V})
    pairs = sc.graphs.from_edges([(k, k + 1) for k in range(0, 10, 2)], n=10)
    start = {"x": [-1.0, 0.25] * 5, "v": [0.3, -0.1] * 5}
    many = scene(ball, CRADLE, pairs, 12.0, integrator, initial=start)
    restitutions = np.linspace(0.2, 1.0, 8)
    together = end(many, e=restitutions)
    for name in ("x", "v"):
        two = together[name].reshape(8, 5, 2)
        assert np.array_equal(two, np.broadcast_to(two[:, :1], two.shape)), name
    alone = end(many, e=restitutions[3:4])
    assert all(np.array_equal(alone[name][0], together[name][3], equal_nan=True) for name in together)
    # a single pair, whose part has the same shape
    one = end(
        scene(ball, CRADLE, sc.graphs.chain(2), 12.0, integrator, initial={"x": [-1.0, 0.25], "v": [0.3, -0.1]}),
        e=restitutions,
    )
    assert one["x"] == pytest.approx(together["x"][:, :2], abs=1e-10)


@pytest.mark.parametrize("integrator", METHODS)
def test_a_row_of_five_blocks_is_dragged_along(integrator: str) -> None:
    """The first rubs on the second with 1; the others stick with 3/4, 1/2, 1/4 until all move together from t = 4 on."""
    blocks = scene(
        BLOCK, RUB, sc.graphs.chain(5), 3.0, integrator, parameters={"N": 1}, initial={"x": 0.0, "v": [5, 0, 0, 0, 0]}
    )
    moving = end(blocks)
    assert moving["x"] == pytest.approx([15 - 4.5, *[9 / 8] * 4], abs=1e-12)
    assert list(moving["slip_link"][1:]) == [-1.0, 0.0, 0.0, 0.0]
    held = end(blocks.replace(window=6.0))
    assert held["x"] == pytest.approx([14.0, 4.0, 4.0, 4.0, 4.0], abs=1e-12)
    assert held["v"] == pytest.approx([1.0] * 5, abs=1e-13)
    assert list(held["slip_link"][1:]) == [0.0] * 4


@pytest.mark.parametrize("integrator", METHODS)
def test_impacts_at_one_instant_that_feel_each_other_are_ambiguous(integrator: str) -> None:
    """A ball that is hit from both sides at once; a moment apart the order is known."""
    both = scene(BLOCK, CRADLE, sc.graphs.chain(3), 3.0, integrator, initial={"x": [0, 1, 2], "v": [1, 0, -1]})
    result = sc.run(both, workers=1, show_progress=False)
    assert Status(int(result.status)) is Status.AMBIGUOUS
    assert end(both.replace(initial={"x": [0, 1, 2.1], "v": [1, 0, -1]}))["v"].sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
def test_static_friction_between_blocks(integrator: str) -> None:
    """The force t on the first block: the friction that drags the second is t/2 until it reaches 3/2 at t = 3, then 1."""
    force = sp.Symbol("F")
    pulled = sc.Lagrangian(V**2 / 2, 0, {X: force * T}, coordinates={X: V}, parameters={force: 0})
    law = sc.friction_law("sign(w)", static=R(3, 2))
    rub = sc.Potential(0, {N: 1}, events=[sc.Friction("v_j - v_i", load="W*N", law=law)])
    given = scene(pulled, rub, sc.graphs.chain(2), 4.0, integrator, parameters={"F": [1.0, 0.0]},
                  initial={"x": 0.0, "v": 0.0}, record=["events"])  # fmt: skip
    found = sc.run(given, workers=1, show_progress=False)
    assert found.events.event_time.values == pytest.approx([3.0], abs=1e-11)
    assert found.end.sel(component="v").values == pytest.approx([2.25 + 3.5 - 1, 2.25 + 1], abs=1e-11)


def one_after_another(v: list[float], e: float) -> list[float]:
    """Impacts of neighbours of mass 1 in turn, from the first pair to the last, until none approach."""
    v, approaching = [float(each) for each in v], True
    while approaching:
        approaching = False
        for k in range(len(v) - 1):
            if (speed := v[k] - v[k + 1]) > 1e-14:
                middle, approaching = (v[k] + v[k + 1]) / 2, True
                v[k : k + 2] = middle - e * speed / 2, middle + e * speed / 2
    return v


IN_ORDER = sc.Potential(0, {E: 1}, events=[sc.Stop("x_j - x_i - 1", restitution=E, in_order=True)])


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
@pytest.mark.parametrize(
    ("e", "speeds"),
    [
        (1, [1, 0, 0, 0, 0]),  # the last ball leaves with the speed of the first
        (0.9, [1, 0, 0]),
        (0.3, [1, 0, 0, -0.4]),
        (0, [1, 0, 0, 0]),  # plastic: all move on together
    ],
)
def test_balls_in_touch_rebound_one_after_another(e: float, speeds: list[float], integrator: str) -> None:
    """Balls at rest in touch, hit by the first, and at the same time by the last."""
    places = [-0.5, *range(1, len(speeds))]
    places[-1] -= speeds[-1] * 0.5
    touching = scene(
        BLOCK,
        IN_ORDER,
        sc.graphs.chain(len(speeds)),
        1.5,
        integrator,
        parameters={"e": e},
        initial={"x": places, "v": [float(v) for v in speeds]},
    )
    assert end(touching)["v"] == pytest.approx(one_after_another(speeds, e), abs=1e-12)


def test_stops_in_order_are_read_and_shown(tmp_path: Path) -> None:
    """Stops of a node too: a corner whose walls are not at right angles."""
    given = scene(BLOCK, IN_ORDER, sc.graphs.chain(3), 1.0, "auto", initial={"x": [0, 1, 2]})
    given.save(tmp_path / "cradle.toml")
    assert "in_order = true" in (tmp_path / "cradle.toml").read_text(encoding="utf-8")
    assert load_scene(tmp_path / "cradle.toml").equations.digest == given.equations.digest
    assert "in order" in sc.export.text(given.equations)
    assert "in order" not in sc.export.text(given.replace(coupling=CRADLE).equations)
    y, u = sp.symbols("y u")
    walls = [sc.Stop(Y_GAP, restitution=1, in_order=True) for Y_GAP in (y, X - y)]
    corner = sc.Lagrangian((V**2 + u**2) / 2, 0, coordinates={X: V, y: u}, events=walls)
    # by hand: reversed at y = 0, reflected at x = y: (v, u) -> (v, -u) -> (-u, v), and the same again
    falls = scene(
        corner, None, sc.graphs.chain(1), 2.0, "taylor", initial={"x": [2.0], "y": [1.0], "v": [-2.0], "u": [-1.0]}
    )
    assert end(falls)["v"][0] == pytest.approx(2.0, abs=1e-12)
    assert end(falls)["u"][0] == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(ValueError, match="found stops with in_order = True; expected False"):
        sc.export.to_c(falls.equations)


@pytest.mark.parametrize(("length", "time"), [(1.0, 1.0), (1e-9, 1e6), (1e6, 1e-3)])
def test_a_sticking_block_that_is_hit_slips_in_any_unit(length: float, time: float) -> None:
    """Blocks on the ground, friction coefficient 1/10: the first hits the second at v^2 = 1 - 2/10, e = 9/10."""
    law = sc.friction_law("sign(w)")
    block = sc.Lagrangian(V**2 / 2, 0, {X: N * sc.friction(-V)}, coordinates={X: V}, parameters={N: length / time**2 / 10},
                          friction=law, contact="set-valued")  # fmt: skip
    pair = scene(block, CRADLE, sc.graphs.chain(2), 20 * time, "taylor", atol=1e-13 * length,
                 initial={"x": [0, length], "v": [length / time, 0]})  # fmt: skip
    ways = np.array([0.05, 0.95]) ** 2 * 0.8 / 0.2
    assert end(pair)["x"] / length - 1 == pytest.approx(ways, rel=1e-9)


def test_balls_of_different_masses() -> None:
    """e = 1: masses 1, 2, 3 from the parameter of each node; momentum and energy stay."""
    m = sp.Symbol("m")
    ball = sc.Lagrangian(m * V**2 / 2, 0, coordinates={X: V}, parameters={m: 1})
    masses = np.array([1.0, 2.0, 3.0])
    balls = scene(
        ball,
        CRADLE,
        sc.graphs.chain(3),
        9.0,
        "taylor",
        parameters={"m": list(masses), "e": 1},
        initial={"x": [0, 1, 2], "v": [1, 0, 0]},
    )
    v = end(balls)["v"]
    # the second gets 2/3, of which it hands 8/15 to the third
    assert v == pytest.approx([-1 / 3, -2 / 15, 8 / 15], abs=1e-13)
    assert masses @ v == pytest.approx(1.0, abs=1e-13)


def test_every_link_may_have_its_own_load() -> None:
    """N = 1 of the first link slows the outer block, 3 of the second holds the third block."""
    blocks = scene(
        BLOCK, RUB, sc.graphs.chain(3), 1.0, "dop853", parameters={"N": [1.0, 3.0]}, initial={"x": 0.0, "v": [5, 0, 0]}
    )
    found = end(blocks)
    assert found["v"] == pytest.approx([4.0, 0.5, 0.5], abs=1e-12)


def test_scene_files_hold_rows_of_links(tmp_path: Path) -> None:
    both = sc.Potential(
        "k*W*(x_i - x_j)**2/2",
        {"k": 0.3, "e": 0.5},
        events=[sc.Stop("x_j - x_i + 1", "e"), sc.Friction("v_i - v_j", "W", law="coulomb")],
    )
    given = scene("harmonic", both, sc.graphs.ring(3), 1.0, "dop853")
    given.save(tmp_path / "scene.toml")
    again = load_scene(tmp_path / "scene.toml")
    assert again == given
    assert again.equations.digest == given.equations.digest
    # a change of the restitution is another scene
    other = sc.Potential(both.energy, {"k": 0.3, "e": 0.5}, events=[sc.Stop("x_j - x_i + 1", "e**2"), both.events[1]])
    assert given.replace(coupling=other).equations.digest != given.equations.digest


def test_text_names_contacts_and_stops() -> None:
    given = scene(
        BLOCK, sc.Potential(0, {E: 1, N: 4}, events=[*CRADLE.events, *RUB.events]), sc.graphs.chain(2), 1.0, "dop853"
    )
    text = sc.export.text(given.equations)
    assert "x_1'' = N sgn(x_2' - x_1')" in text
    assert "x_2'' = -N sgn(x_2' - x_1')" in text
    assert text.count("stop at the gap") == 1


REFUSED = {
    "one end": (lambda: sc.Potential(0, events=[sc.Stop("x_j")]), "of one end"),
    "no law": (lambda: sc.Potential(0, events=[sc.Friction("v_j - v_i")]), "found no friction law"),
    "reset": (lambda: sc.Potential(0, events=[sc.Reset("x_j - x_i", {"x": "0"})]), "expected a Friction or a Stop"),
    "speed in a gap": (
        lambda: scene(BLOCK, sc.Potential(0, events=[sc.Stop("v_j - v_i")]), sc.graphs.chain(2), 1.0, "auto").equations,
        "expected a function of coordinates and time",
    ),
    "large": (lambda: scene(BLOCK, CRADLE, sc.graphs.chain(17), 1.0, "auto").equations, "found 17 nodes; expected at most 16"),
    "large part": (
        lambda: sc.run(scene(BLOCK, CRADLE, sc.graphs.chain(10), 1.0, "auto", initial={"x": list(range(10))})),
        "found 9 contacts and stops that share nodes; expected at most 8",
    ),
    "one way": (
        lambda: scene(BLOCK, RUB, sc.graphs.from_edges([(0, 1)], n=2, directed=True), 1.0, "auto").equations,
        "expected links of equal weights both ways",
    ),
    "start": (
        lambda: sc.run(scene(BLOCK, CRADLE, sc.graphs.chain(2), 1.0, "dop853", initial={"x": [1.0, 0.0]})),
        "start: found node 2 with the gap -x_1 \\+ x_2 = -1; expected 0 or more; change x_1 or x_2 in initial, an axis or ranges",
    ),
    "msf": (lambda: sc.msf(scene("harmonic", RUB, sc.graphs.ring(3), 1.0, "auto"), [0.1]), "friction in links holds equal oscillators together"),
    "exponents": (
        lambda: sc.exponents(scene("harmonic", RUB, sc.graphs.ring(3), 1.0, "auto"), [0.1]),
        "friction in links holds equal oscillators together",
    ),
    "closed": (lambda: sc.msf(scene("harmonic", CRADLE, sc.graphs.ring(3), 1.0, "auto"), [0.1]), "gap 0 between equal oscillators; expected a positive gap"),
    "open": (
        lambda: sc.msf(scene("harmonic", sc.Potential(0, events=[sc.Stop("x_j - x_i + 1")]), sc.graphs.ring(3), 1.0, "auto"), [0.1]),
        "found stops alone, which are open between equal oscillators; expected an energy",
    ),
    "export": (lambda: sc.export.to_c(scene(BLOCK, CRADLE, sc.graphs.chain(2), 1.0, "auto").equations), "found contacts or stops in links"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case: str) -> None:
    action, words = REFUSED[case]
    with pytest.raises((ValueError, TypeError), match=words):
        action()


A, K = sp.symbols("a k")
BALL = sc.Lagrangian(V**2 / 2, X**4 / 4, {X: sp.cos(T) - V / 5}, coordinates={X: V})
BUFFER = sc.Potential(
    "k*W*(x_i - x_j)**2/2", {"k": 0.3, "e": 0.9, "a": 1}, events=[sc.Stop("x_j - x_i + a", restitution="e")]
)
CLOSED = r"found stops in links, which are open .* if the gap a is positive"
SPRING = sc.Potential("k*W*(x_i - x_j)**2/2", {"k": 0.3})


def test_stops_that_are_open_in_synchrony_change_no_exponent() -> None:
    """The gap between equal oscillators is a; the exponents are those of the springs, to the last bit."""
    settings = {"precision": 1.0, "periods": 60, "transient": 20, "show_progress": False, "starts": 1}
    buffers, springs = (scene(BALL, link, sc.graphs.ring(3), 1.0, "auto") for link in (BUFFER, SPRING))
    expected = sc.msf(springs, [0.0, 0.6], **settings).exponent
    with pytest.warns(UserWarning, match="left out the stops in links, which are open between equal oscillators"):
        found = sc.msf(buffers.replace(e=0.5), [0.0, 0.6], a=0.2, **settings)
    assert np.array_equal(found.exponent, expected)
    assert found.exponent[0] != found.exponent[1]
    for gap in (0.0, -1.0):
        with pytest.raises(ValueError, match=CLOSED):
            sc.msf(buffers, [0.0, 0.6], a=gap, **settings)
        with pytest.raises(ValueError, match=CLOSED):
            sc.exponents(buffers.replace(a=gap), [0.6], **settings)
    moving = sc.Potential("k*W*(x_i - x_j)**2/2", {"k": 0.3}, events=[sc.Stop("x_j + x_i + 9")])
    with pytest.raises(ValueError, match="found stops in links"):
        sc.msf(scene(BALL, moving, sc.graphs.ring(3), 1.0, "auto"), [0.0, 0.6], **settings)


def test_parts_have_no_common_nodes() -> None:
    given = scene(BLOCK, CRADLE, sc.graphs.from_edges([(0, 1), (3, 2), (2, 4)], n=6), 1.0, "auto")
    parts = given.equations.parts
    assert [part.nodes for part in parts] == [(0, 1), (2, 3, 4)]
    assert all(not set(a.nodes) & set(b.nodes) for a, b in pairwise(parts))

"""Several contacts of a node, moving grounds, masses that depend on places, nodes of several kinds: friction by rows.

Right values: roots of sin in 40 digits, work balances by quadrature, and a second program (NumPy, DOP853, bisection of
whole steps) that shares nothing with the package.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.codegen.driver.gaps import K
from synchain.codegen.driver.rows import GROUPS
from synchain.codegen.steps.row_step import MOST_EVENTS

X, V, T, TH, OM, PH, SI, W = sp.symbols("x v t th om ph si w")
R, SIGN = sp.Rational, sp.sign(sp.Symbol("w"))
METHODS = ("dop853", "taylor")


def contact(
    T_: sp.Expr, V_: sp.Expr, Q: dict[sp.Symbol, sp.Expr], coordinates: dict[sp.Symbol, sp.Symbol], law=SIGN, **more
):
    return sc.Lagrangian(T_, V_, Q, coordinates=coordinates, friction=law, contact="set-valued", **more)


def scene(node, window: float, integrator: str, n: int = 1, **more) -> sc.Scene:
    given = {"topology": sc.graphs.chain(n), "rtol": 1e-12, "atol": 1e-13, "record": (), **more}
    return sc.Scene(node, transient=0, window=window, time_unit="time", integrator=integrator, **given)


def end(given: sc.Scene, **swept) -> np.ndarray:
    found = sc.run(given, workers=1, show_progress=False, **swept)
    assert (found.status.values == 1).all()
    return found.data["end"].values


SLIDER = contact(V**2 / 2, 0, {X: R(4, 5) * sc.friction(sp.sin(T) - V)}, {X: V})


@pytest.mark.parametrize("integrator", [*METHODS, "rodas5p"])
def test_a_block_on_a_shaken_plate(integrator: str) -> None:
    """x'' = 0.8 f(sin t - x') from rest: it sticks, and slips where cos t = -0.8; the place at t = 8 in 40 digits."""
    x, v, slip = end(scene(SLIDER, 8.0, integrator, initial={"x": [0.0]})).ravel()
    assert x == pytest.approx(1.08291961440, abs=2e-11)
    assert v == pytest.approx(np.sin(8.0), abs=1e-12)
    assert slip == 0.0


@pytest.mark.parametrize("integrator", METHODS)
def test_the_slider_of_a_crank_passes_its_dead_centres(integrator: str) -> None:
    """W(q): J = R = 1 under the load 0.3; omega**2/2 = 2 - 0.3 times the way of the slider, which stops at t = 10.0458."""
    work = R(3, 10) * sp.sin(TH) * sc.friction(-OM * sp.sin(TH))
    crank = contact(OM**2 / 2, 0, {TH: work}, {TH: OM})
    start = {"th": [0.5], "om": [2.0]}
    for window, moving in ((10.0, True), (11.0, False)):
        th, om, slip = end(scene(crank, window, integrator, initial=start)).ravel()
        assert (slip != 0) == moving
        way = (1 + np.cos(0.5)) + 2 + 2 + (1 + np.cos(th))  # from 1/2 to pi, 2 pi, 3 pi and on
        assert om**2 / 2 == pytest.approx(2 - 0.3 * way, abs=1e-12)
    assert th == pytest.approx(10.78306244919092, abs=1e-12)


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize("static", [None, "13/10"])
def test_two_equal_patches_are_one(integrator: str, static: str | None) -> None:
    """A pad that could turn, with patches at +-1/2, moves as a block with one contact; both rows change together."""
    law = sc.friction_law("sign(w)", static=static)
    slide = R(1, 5) - V
    near, far = (sc.friction(slide + sign * SI / 2) for sign in (-1, 1))
    pull = R(4, 5) * sp.cos(R(9, 10) * T)
    pad = contact(V**2 / 2 + SI**2 / 10, X**2 / 2, {X: pull + R(3, 10) * (near + far), PH: R(3, 20) * (near - far)}, {X: V, PH: SI}, law)  # fmt: skip
    block = contact(V**2 / 2, X**2 / 2, {X: pull + R(3, 5) * sc.friction(slide)}, {X: V}, law)
    x, ph, v, si, *slips = end(scene(pad, 20.0, integrator, initial={"x": [0.3]})).ravel()
    one = end(scene(block, 20.0, integrator, initial={"x": [0.3]})).ravel()
    assert [x, v] == pytest.approx(one[:2], abs=2e-12)
    assert abs(ph) < 1e-14
    assert abs(si) < 1e-14
    assert slips == [one[2]] * 2


def cart_pole(**more):
    kinetic = V**2 / 2 + (V**2 + 2 * V * OM * sp.cos(TH) + OM**2) / 4
    forces = {X: R(3, 5) * sc.friction(R(3, 10) * sp.cos(2 * T) - V), TH: R(1, 20) * sc.friction(-OM)}
    return contact(kinetic, X**2 / 2 - sp.cos(TH) / 2, forces, {X: V, TH: OM}, **more)


START = {"x": [0.5], "th": [1.0], "om": [0.1]}


@pytest.mark.parametrize("integrator", METHODS)
def test_a_cart_pole_with_two_contacts(integrator: str) -> None:
    """Ten events; the second program ends at this state."""
    found = end(scene(cart_pole(), 10.0, integrator, initial=START)).ravel()
    assert found[:4] == pytest.approx(CART, abs=2e-12)
    assert list(found[4:]) == [0.0, 1.0]


CART = [0.152852421263816, -0.510469083756546, 0.122424618544015, -0.185184704559302]


@pytest.mark.parametrize("integrator", METHODS)
def test_lanes_and_equal_nodes_have_equal_bits(integrator: str) -> None:
    """Eight cells in lanes end as each by itself, and three equal nodes change their modes together."""
    strengths = np.linspace(0.1, 0.8, 8)
    ring = scene(cart_pole(), 6.0, integrator, 3, topology=sc.graphs.ring(3),
                 coupling="spring on x", initial={"x": [0.5, 0.1, 0.2], "th": [1.0, 0.2, -0.4]})  # fmt: skip
    together = end(ring, sigma=strengths)
    for k, strength in enumerate(strengths):
        assert np.array_equal(end(ring, sigma=[strength])[0], together[k])
    alike = end(ring.replace(initial={"x": [0.5] * 3, "th": [1.0] * 3}), sigma=strengths)
    assert np.array_equal(alike, np.broadcast_to(alike[:, :, :1], alike.shape))


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize("n", [3, 10])
def test_layers_of_links_act_on_rows_as_one_layer_on_contacts(integrator: str, n: int) -> None:
    """Two layers of springs need rows; they move the network as one layer of the sum, written out and in loops."""
    node = contact(V**2 / 2, X**2 / 2, {X: sp.cos(R(9, 10) * T) / 2 + R(3, 10) * sc.friction(R(1, 5) - V)}, {X: V})
    spring = [sc.Potential(f"{k}*W*(x_i - x_j)**2/2", {k: value}) for k, value in (("k", 0.2), ("c", 0.1), ("s", 0.3))]
    start = {"x": list(np.linspace(-0.4, 0.9, n)), "v": list(np.linspace(0.3, -0.2, n))}
    layers = scene(node, 12.0, integrator, links=[(spring[0], sc.graphs.chain(n)), (spring[1], sc.graphs.chain(n))], topology=None, initial=start)  # fmt: skip
    one = scene(node, 12.0, integrator, n, coupling=spring[2], initial=start)
    assert layers.equations.has_rows
    assert not one.equations.has_rows
    np.testing.assert_allclose(end(layers), end(one), atol=2e-11)


@pytest.mark.parametrize("n", [2, 9])
def test_friction_beside_another_kind(n: int) -> None:
    """A frictionless node of another kind that is not linked: the others move as without it, in both forms of a step."""
    node = contact(V**2 / 2, X**2 / 2, {X: sp.cos(R(9, 10) * T) / 2 + R(3, 10) * sc.friction(R(1, 5) - V)}, {X: V})
    other = sc.Lagrangian(V**2 / 2, X**2 / 2, coordinates={X: V})
    start = {"x": list(np.linspace(-0.4, 0.9, n)), "v": [0.1] * n}
    mixed = scene(node, 9.0, "dop853", n, coupling="spring", nodes=[{"oscillator": other, "friction": "none", "at": [n]}], initial=start, parameters={"sigma": 0.0})  # fmt: skip
    alone = scene(node, 9.0, "dop853", n, coupling="spring", initial=start, parameters={"sigma": 0.0})
    np.testing.assert_allclose(end(mixed)[:, :-1], end(alone)[:, :-1], atol=2e-12)
    assert end(mixed)[:2, -1] == pytest.approx([0.9 * np.cos(9) + 0.1 * np.sin(9), 0.1 * np.cos(9) - 0.9 * np.sin(9)])


@pytest.mark.filterwarnings("ignore:no cell")
def test_friction_that_drives_a_rotation_has_no_single_answer() -> None:
    """A torque with the wrong sign: K of the two held patches is no P-matrix, which the cell says."""
    slide = R(1, 5) - V
    near, far = (sc.friction(slide + sign * SI / 2) for sign in (-1, 1))
    forces = {X: R(4, 5) * sp.cos(R(9, 10) * T) + R(3, 10) * (near + far), PH: R(3, 20) * (far - near)}
    pad = contact(V**2 / 2 + SI**2 / 10, X**2 / 2, forces, {X: V, PH: SI})
    found = sc.run(scene(pad, 20.0, "dop853", initial={"x": [0.3]}), workers=1, show_progress=False)
    assert found.status.values == 9
    assert "several motions agree" in found.message


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize(
    ("between", "force", "release", "free"),
    [
        (R(3, 10), R(1, 5) + T / 50, 20.0, 1),  # the first block alone, at 0.3 + 0.3
        (R(3, 10), R(1, 5) - 3 * T / 100, 80 / 3, 1),  # the same to the other side, past forces of zero
        (R(3, 5), R(1, 5) + T / 50, 30.0, 2),  # both together, at 0.3 + 0.5
    ],
)
def test_contacts_that_depend_on_each_other(between, force, release: float, free: int, integrator: str) -> None:
    """Two blocks of mass 1 on the ground, loads 0.3 and 0.5, rub on each other; at rest the forces are not unique."""
    y, u = sp.symbols("y u")
    law = sc.friction_law("sign(w)")
    contacts = [
        sc.Friction(-V, load=R(3, 10), law=law),
        sc.Friction(-u, load=R(1, 2), law=law),
        sc.Friction(V - u, load=between, law=law),
    ]
    blocks = sc.Lagrangian((V**2 + u**2) / 2, 0, {X: force}, coordinates={X: V, y: u}, contact="set-valued", events=contacts)  # fmt: skip
    start = {"v": [1.0], "u": [0.5]}
    given = scene(blocks, release + 1.0, integrator, initial=start, record=("events",))
    result = sc.run(given, workers=1, show_progress=False)
    times = result.events.event_time.values[: int(result.event_count)]
    assert np.sum(times > 3.0) == 2  # of the two contacts that begin to slide
    assert times[times > 3.0] == pytest.approx(release, abs=1e-9)
    slope = float(force.diff(T))
    speed = slope / 2 / free  # after one unit of time
    assert result.end.sel(component="v").values == pytest.approx(speed, abs=1e-9)
    assert result.end.sel(component="u").values == pytest.approx(speed if free == 2 else 0.0, abs=1e-9)
    with pytest.raises(ValueError, match="found contacts that depend on each other"):
        sc.lyapunov_spectrum(given)
    # a start at rest too
    rest = sc.run(given.replace(initial={}), workers=1, show_progress=False)
    assert rest.events.event_time.values[: int(rest.event_count)] == pytest.approx([release] * 2, abs=1e-9)


def test_refusals_of_contacts() -> None:
    with pytest.raises(ValueError, match="contacts 1 and 2 slide together; add their loads"):
        scene(contact(V**2 / 2, X**2 / 2, {X: sc.friction(-V) + 2 * sc.friction(-2 * V)}, {X: V}), 1.0, "dop853")
    with pytest.raises(ValueError, match=r"found the sliding velocity .*; expected a linear function of velocities"):
        scene(contact(V**2 / 2, X**2 / 2, {X: sc.friction(sp.sin(T))}, {X: V}), 1.0, "dop853")


def test_a_contact_lands_again_in_the_step_of_its_release() -> None:
    """At loose tolerances a slip from release to landing is one Taylor step, whose gap begins at zero to rounding."""
    start, places = {"th": [1.0], "om": [0.1]}, np.linspace(0.3, 0.7, 64)
    right = end(scene(cart_pole(), 10.0, "dop853", initial=start), x_1=places)
    loose = end(scene(cart_pole(), 10.0, "taylor", initial=start, rtol=1e-8, atol=1e-9), x_1=places)
    np.testing.assert_allclose(loose, right, atol=1e-8)


def test_rows_that_are_decided_together_fit_their_memory() -> None:
    level = sp.Symbol("v")
    many = [sc.Reset(level - k, {level: -1}) for k in range(1, MOST_EVENTS + 2)]
    cells = [sc.Scene(sc.Field({level: 1 - level}, events=many[:n])) for n in (MOST_EVENTS, MOST_EVENTS + 1)]
    assert sc.kernel(cells[0]).equations.has_rows
    with pytest.raises(ValueError, match="events: found 53 of a node, or of nodes that they join; expected at most 52"):
        sc.kernel(cells[1])
    assert GROUPS - K == MOST_EVENTS

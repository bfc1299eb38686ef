"""Fields whose motion slides along the zeros of signs in their rates: crossing, sliding, exit, two surfaces; closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import synchain as sc

X, Y, Z, T, C = sp.symbols("x y z t c")
R = sp.Rational
METHODS = ("dop853", "taylor")


def scene(node, window: float, integrator: str, n: int = 1, **more) -> sc.Scene:
    given = {"topology": sc.graphs.chain(n), "rtol": 1e-12, "atol": 1e-13, "record": (), **more}
    return sc.Scene(node, transient=0, window=window, time_unit="time", integrator=integrator, **given)


def end(given: sc.Scene, **swept) -> np.ndarray:
    found = sc.run(given, workers=1, show_progress=False, **swept)
    assert (found.status.values == 1).all(), found.message
    return found.data["end"].values


RELAY = sc.Field({X: Y, Y: -sp.sign(X + C * Y)}, contact="set-valued", parameters={C: 0.7})


@pytest.mark.parametrize("integrator", METHODS)
def test_a_relay_crosses_and_then_slides(integrator: str) -> None:
    """x'' = -sgn(x + 0.7 x') from (3, 0): crosses at 1.8475, slides from 4.142643521714198 as exp(-t/0.7)."""
    start = {"x": [3.0], "y": [0.0]}
    x, y, slip = end(scene(RELAY, 8.0, integrator, initial=start)).ravel()
    assert [x, y] == pytest.approx([-0.00126693327942588, 0.001809904684894115], abs=1e-13)
    assert slip == 0.0
    assert [end(scene(RELAY, t, integrator, initial=start))[2, 0] for t in (1.8475, 1.8476, 4.1426, 4.1427)] == [
        1,
        -1,
        -1,
        0,
    ]


@pytest.mark.parametrize("integrator", METHODS)
def test_motion_slides_along_two_surfaces_and_leaves_one(integrator: str) -> None:
    """x' = a(t) - s_x + s_y/2, y' = 1/5 - s_y: on both s_y = 1/5, s_x = a + 1/10, until a(t) = t/2 reaches 9/10 at t = 9/5.

    z' = s_x + 2 s_y counts both; behind the exit x' = a - 1 + 1/10.
    """
    node = sc.Field(
        {X: T / 2 - sp.sign(X) + sp.sign(Y) / 2, Y: R(1, 5) - sp.sign(Y), Z: sp.sign(X) + 2 * sp.sign(Y)},
        contact="set-valued",
    )
    start = {"x": [0.0], "y": [0.0], "z": [0.0]}
    x, y, z, *slips = end(scene(node, 1.5, integrator, initial=start)).ravel()
    assert [x, y] == pytest.approx([0.0, 0.0], abs=1e-14)
    assert z == pytest.approx(1.5**2 / 4 + 0.1 * 1.5 + 0.4 * 1.5, abs=1e-12)
    assert slips == [0.0, 0.0]
    x, y, z, *slips = end(scene(node, 3.0, integrator, initial=start)).ravel()
    late = 3.0 - 1.8
    assert x == pytest.approx(late**2 / 4, abs=1e-12)
    assert z == pytest.approx(1.8**2 / 4 + 0.5 * 1.8 + 1.4 * late, abs=1e-12)
    assert slips == [1.0, 0.0]


def test_a_function_of_one_sign_is_exact_off_the_surface_and_convex_on_it() -> None:
    """exp(sign(x)) and a Piecewise: on x = 0 the rates cosh(1) + s sinh(1) - 2 and y' = 1 + s are Filippov's."""
    choice = sp.Piecewise((2, X > 0), (0, True))
    node = sc.Field({X: 2 - sp.exp(sp.sign(X)), Y: choice}, contact="set-valued")
    s = (2 - np.cosh(1)) / np.sinh(1)
    x, y, slip = end(scene(node, 1.0, "taylor", initial={"x": [0.0], "y": [0.0]})).ravel()
    assert abs(x) < 1e-16
    assert slip == 0.0
    assert y == pytest.approx(1 + s, abs=1e-13)
    x, y, slip = end(scene(node, 0.1, "taylor", initial={"x": [1.0], "y": [0.0]})).ravel()
    assert [x, y, slip] == pytest.approx([1 + 0.1 * (2 - np.e), 0.2, 1.0], abs=1e-13)


@pytest.mark.parametrize("integrator", METHODS)
def test_a_relay_that_its_state_only_crosses(integrator: str) -> None:
    """Feedback by a relay of 1/(s + 1)**3: half a period h = 1.839875335432399 between switches (Astrom 1995)."""
    a, b, c = sp.symbols("a b c")
    loop = sc.Field({a: -sp.sign(c) - a, b: a - b, c: b - c}, contact="set-valued")
    start = {"a": [-0.7258679257978837], "b": [-0.2906309222293034], "c": [-1e-300]}
    given = scene(loop, 12.0, integrator, initial=start, record=("events",))
    found = sc.run(given, workers=1, show_progress=False).events
    assert np.diff(found.event_time.values) == pytest.approx([1.839875335432399] * 5, abs=1e-11)
    assert 0.0 not in found.event_after.values


@pytest.mark.parametrize("n", [3, 9])
def test_a_network_that_slides_is_projected_along_its_surface(n: int) -> None:
    """Relays with links on y: on x + c y = 0 the links cannot push it off; x = -c y decays by exp(-t/c) in each."""
    start = {"x": list(np.linspace(0.1, 0.2, n)), "y": list(-np.linspace(0.1, 0.2, n) / 0.7)}
    found = [
        end(scene(RELAY, 2.0, integrator, n, coupling="y->y", initial=start), sigma=np.linspace(0.05, 0.4, 8))
        for integrator in METHODS
    ]
    for each in found:
        decay = np.array(start["x"]) * np.exp(-2.0 / 0.7)
        np.testing.assert_allclose(each[:, 0], np.broadcast_to(decay, (8, n)), atol=1e-12)
        assert (each[:, 2] == 0).all()


def test_refusals_and_files() -> None:
    with pytest.raises(
        ValueError, match=r"sliding along x = 0 and y = 0 at once is not defined by sign\(x\)\*sign\(y\); write"
    ):
        sc.Field({X: -sp.sign(X) * sp.sign(Y) - sp.sign(X), Y: -sp.sign(Y) * (1 + sp.sign(X))}, contact="set-valued")
    with pytest.raises(ValueError, match="found no sign of states in the rates"):
        sc.Field({X: Y, Y: -X}, contact="set-valued")
    with pytest.raises(ValueError, match="found contact 'atan'; expected 'sign' or 'set-valued' for a field"):
        sc.Field({X: -sp.sign(X)}, contact="atan")
    given = scene(RELAY, 1.0, "taylor")
    assert sc.Scene.from_dict(given.as_dict()) == given
    assert given.equations.has_rows
    assert not given.replace(contact="sign").equations.has_rows


def test_a_repelling_surface_has_no_single_motion() -> None:
    """On x = 0 of x' = sign(x) + 2 y motion may leave to both sides or stay; where 2|y| > 1 it crosses."""
    node = sc.Field({X: sp.sign(X) + 2 * Y, Y: -1}, contact="set-valued")
    x, _, slip = end(scene(node, 1.0, "taylor", initial={"x": [-0.5], "y": [2.0]})).ravel()
    crossing = (3 - np.sqrt(9 - 4 * 0.5)) / 2  # x = -1/2 + 3 t - t**2
    late = 1.0 - crossing
    assert [x, slip] == pytest.approx([late * (1 + 2 * (2 - crossing)) - late**2, 1.0], abs=1e-12)
    with pytest.raises(ValueError, match="found no single motion of node 1 that agrees"):
        end(scene(node, 1.0, "taylor", initial={"x": [0.0], "y": [0.0]}))

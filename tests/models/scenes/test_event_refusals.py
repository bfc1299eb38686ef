"""What the design of events refuses, line by line, each with its words; and what it accepts beside them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

import synchain as sc

x, v, y, th, om, t, e, c = sp.symbols("x v y th om t e c")
ALONE, PAIR = sc.graphs.chain(1), sc.graphs.chain(2)


def body(*events: Any, force: Any = 0, potential: Any = x**2 / 2, **given: Any) -> Any:
    return sc.Lagrangian(v**2 / 2, potential, {x: force}, coordinates={x: v}, events=list(events), **given)


def slider(*events: Any, **given: Any) -> Any:
    return body(*events, friction=given.pop("friction", "coulomb"), contact="set-valued", **given)


def scene(node: Any, coupling: Any = None, **given: Any) -> sc.Scene:
    graph = ALONE if coupling is None else PAIR
    return sc.Scene(node, coupling, graph, transient=0, window=4, time_unit="time", **given)


HIT = body(sc.Stop(sp.Rational(1, 2) - x, 0.7), force=sp.cos(t))
DROP = slider(force=sc.friction(sp.Rational(1, 5) - v), friction="coulomb_static")
BOUNCE = body(sc.Stop(x, e), potential=x, parameters={e: 0.5}, initial={x: 1})
KNOCK = sc.Potential(0, {e: 0.9}, events=[sc.Stop("x_j - x_i + 1", restitution=e)])
WEAK = sc.friction_law("a*sign(w)/(1 + abs(w))", {"a": 0.4, "b": 0.3}, static="b", name="weak")

REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "a link that moves the coordinate of a gap": (
        lambda: scene(BOUNCE, "x->x").equations,
        "events: found a link that changes the rate of x, which is in x; expected forces, which change velocities",
    ),
    "a product of signs": (
        lambda: sc.Field({x: -sp.sign(x) * sp.sign(y), y: -2 * sp.sign(y) - sp.sign(x)}, contact="set-valued"),
        r"sliding along x = 0 and y = 0 at once is not defined by sign\(x\)\*sign\(y\); write a sum, or contact='sign'",
    ),
    "a load with the speed": (
        lambda: scene(slider(force=(1 + v**2) * sc.friction(-v))).equations,
        "which depends on the velocity v; expected a load of places and time",
    ),
    "two contacts of one level": (
        lambda: scene(slider(sc.Friction(-v), sc.Friction(-2 * v))).equations,
        "contacts 1 and 2 slide together; add their loads",
    ),
    "two stops of one gap": (
        lambda: scene(body(sc.Stop(x + 1), sc.Stop(2 * x + 2))).equations,
        "contacts 1 and 2 slide together; add their loads",
    ),
    "a static drop beside dampers": (
        lambda: sc.exponents(scene(DROP, "damper"), [0.1]),
        "links act on velocities, so the order of simultaneous releases matters; expected springs",
    ),
    "impacts beside dampers": (
        lambda: sc.msf(scene(HIT, "damper"), [0.0, 0.1]),
        "found links of v, which events change at once, so the order of simultaneous events matters",
    ),
    "a reset above its guard": (
        lambda: sc.Field({x: 1}, events=[sc.Reset(x - 1, {x: 2})]),
        "reset x - 1: found the guard 1 just after; expected a negative value",
    ),
    "a restitution above one": (lambda: body(sc.Stop(x, 1.5)), "found the restitution 3/2; expected a number from 0 to 1"),
    "a parameter above one": (lambda: scene(BOUNCE, parameters={"e": 1.5}), r"stop x: found the restitution e = 1\.5"),
    "an axis below zero": (lambda: scene(BOUNCE, axes={"e": [0.5, -0.25]}), r"stop x: found the restitution e = -0\.25"),
    "one node above one": (lambda: scene(BOUNCE, "spring", parameters={"e_2": 2}), "stop x: found the restitution e_2 = 2"),
    "a link above one": (
        lambda: scene("harmonic", KNOCK, parameters={"e": 1.5}), r"stop .*: found the restitution e = 1\.5; expected a number"
    ),
    "one link above one": (lambda: scene("harmonic", KNOCK, axes={"e_1_2": [0.5, 1.25]}), r"found the restitution e_1_2 = 1\.25"),
    "an expression above one": (
        lambda: scene(body(sc.Stop(x, 2 * e), parameters={e: 0.25}), axes={"e": [0.25, 0.75]}),
        r"stop x: found the restitution 2\*e = 1\.5 at e = 0\.75; expected a number",
    ),
    "an expression that peaks inside a grid": (
        lambda: scene(body(sc.Stop(x, 5 * e * (1 - e)), parameters={e: 0.1}), axes={"e": [0, 0.5, 1]}),
        r"= 1\.25 at e = 0\.5; expected a number from 0 to 1",
    ),
    "an expression of zipped axes below zero": (
        lambda: scene(body(sc.Stop(x, e - c), parameters={e: 0.5, c: 0}), axes={"e": [0.2, 0.6], "c": [0.1, 0.7]}, zipped=True),
        r"found the restitution -c \+ e = -0\.1 at c = 0\.7, e = 0\.6",
    ),
    "static below kinetic": (
        lambda: scene(slider(force=sc.friction(-v), friction=WEAK)),
        r"friction weak: found the static coefficient 0\.3 below 0\.4 of slow slip at a = 0\.4, b = 0\.3; expected at least",
    ),
    "static below kinetic in one cell": (
        lambda: scene(slider(force=sc.friction(-v), friction=WEAK), axes={"a": [0.3, 0.2], "b": [0.4, 0.25]}),
        r"0\.25 below 0\.3 of slow slip at a = 0\.3, b = 0\.25",
    ),
    "static below kinetic in an event": (
        lambda: scene(body(sc.Friction(-v, law=WEAK), contact="set-valued")), r"friction weak: found the static coefficient 0\.3 below 0\.4"
    ),
    "static below kinetic in a link": (
        lambda: scene("harmonic", sc.Potential(0, events=[sc.Friction("v_j - v_i", load="W", law=WEAK)])),
        r"friction weak: found the static coefficient 0\.3 below 0\.4",
    ),
    "a stop condition beside stops of links": (
        lambda: scene("harmonic", KNOCK, stop="x_1 - 2"), "stop: found stops in links; expected links without events"
    ),
    "a stop condition beside stops": (lambda: scene(HIT, stop="x_1 - 2"), "stop: found stops of nodes; expected smooth equations"),
    "a start behind a guard": (
        lambda: sc.run(scene(sc.Field({x: 1}, initial={x: 1}, events=[sc.Reset(x - 1, {x: 0})]))),
        "found node 1 with the guard x - 1 at or above 0; expected a start in front of it",
    ),
    "a gap of time alone": (lambda: body(sc.Stop(t - 1)), "found the gap t - 1; expected a function of coordinates and time"),
    "a gap of speeds": (lambda: body(sc.Stop(x - v)), "expected a function of coordinates and time"),
    "sliding without a speed": (
        lambda: slider(sc.Friction(x)), "event 1: found the sliding velocity x; expected one with a velocity"
    ),
    "sliding that is not linear": (
        lambda: scene(slider(sc.Friction(-(v**3)))).equations, "expected a linear function of velocities"
    ),
    "a state that is not there": (lambda: sc.Field({x: 1}, events=[sc.Reset(x - 1, {"z": 0})]), "sets has the key 'z'"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_one_line(name: str) -> None:
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=words) as refusal:
        make()
    assert "\n" not in str(refusal.value)


def test_a_table_of_laws_names_the_way_to_a_law_for_each_contact() -> None:
    with pytest.raises(
        TypeError, match=r"friction: found .*; a law of one contact: events=\[Friction\(w, load, law\)\]"
    ):
        body(friction={"": "coulomb"}, force=sc.friction(-v))


@pytest.mark.parametrize(
    "rate", [1 - sp.exp(sp.sign(x)), 1 - 2 * sp.Heaviside(x), sp.Piecewise((-1 - x, x > 0), (2 - x, True))]
)
def test_functions_of_one_sign_slide(rate: sp.Expr) -> None:
    node = sc.Field({x: rate}, contact="set-valued", initial={x: 1})
    end = sc.run(scene(node), show_progress=False).end
    np.testing.assert_array_equal(end.values.ravel(), [0.0, 0.0])


def test_static_friction_may_equal_that_of_slow_slip() -> None:
    node = slider(force=sc.friction(-v), friction=WEAK)
    axes = {"a": [0.3, 0.2], "b": [0.3, 0.2]}
    assert scene(node, axes=axes, zipped=True).zipped
    with pytest.raises(ValueError, match=r"0\.2 below 0\.3"):
        scene(node, axes=axes)


def test_cells_that_end_in_words() -> None:
    """Stops that feel each other, and a reset whose value is a parameter: the message names what to look at."""
    corner = sc.Lagrangian(v**2 / 2 + om**2 / 2, x + th, coordinates={x: v, th: om}, initial={x: 1, th: 1},
                           events=[sc.Stop(x + th / 2, 0.5), sc.Stop(th + x / 2, 0.5)])  # fmt: skip
    with pytest.warns(RuntimeWarning, match="stops that feel each other are hit at once"):
        sc.run(scene(corner), show_progress=False)
    endless = sc.Field({x: 1}, parameters={c: 2}, events=[sc.Reset(x - 1, {x: c})])
    with pytest.warns(RuntimeWarning, match="check friction laws, restitutions, and that guards are negative"):
        sc.run(scene(endless), show_progress=False)

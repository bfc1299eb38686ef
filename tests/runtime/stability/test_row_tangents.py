"""Deviations through impacts, resets, static drops and sliding: multipliers in closed form and in 40 digits.

The values of the cart-pole come from a hand-written pair of equations and differences of its orbits; those of the impact
oscillator from linear flows and Newton's method in 40 digits.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.runtime.bifurcation.flow import flow_of

X, V, T, TH, OM = sp.symbols("x v t th om")
R = sp.Rational
FINE = {"integrator": "taylor", "record": (), "rtol": 1e-11, "atol": 1e-13}
IMPACT = sc.Lagrangian(
    V**2 / 2,
    X**2 / 2,
    {X: sp.cos(R(4, 5) * T) / 2 - V / 10},
    coordinates={X: V},
    events=[sc.Stop(R(3, 5) - X, R(7, 10))],
)


def lone(node, **initial: float) -> sc.Scene:
    return sc.Scene(
        node, topology=sc.graphs.chain(1), initial={name: [value] for name, value in initial.items()}, **FINE
    )


def ring(node, coupling, **initial: float) -> sc.Scene:
    start = {name: [value] * 3 for name, value in initial.items()}
    return sc.Scene(node, coupling, sc.graphs.ring(3), initial=start, **FINE)


def multipliers(scene: sc.Scene) -> np.ndarray:
    return np.sort_complex(sc.periodic_orbit(scene, 1).multipliers)


def test_impact_oscillators_in_a_ring() -> None:
    """One impact a period; multipliers, and exponents of modes: complex pairs have ln(e)/T - 0.05."""
    pair = -0.07497024465844425 + 0.4666788456971145j * np.array([-1, 1])
    assert multipliers(lone(IMPACT, x=0.4, v=-0.5)) == pytest.approx(pair, abs=1e-12)
    found = sc.exponents(ring(IMPACT, "spring", x=0.4, v=-0.5), [0.0, 0.3, 0.45]).exponent
    assert found == pytest.approx([-0.095413264323899, -0.095413264323899, -0.086012350043361], abs=1e-12)


def test_starts_behind_a_stop_come_nearer() -> None:
    """x'' = -x + cos(5t/2), stop at 0: multipliers of a mode by hand; copies of the start lie behind the stop."""
    w, e, alpha, T_ = 2.5, 0.8, np.array([0.0, 1.0, 3.0]), 2 * np.pi / 2.5
    node = sc.Lagrangian(V**2 / 2, X**2 / 2, {X: sp.cos(R(5, 2) * T)}, coordinates={X: V}, events=[sc.Stop(X, R(4, 5))])
    psi = np.arctan(-np.tan(T_ / 2) * (1 - e) / (w * (1 + e)))
    speed, turn = (np.tan(T_ / 2) * np.cos(psi) - w * np.sin(psi)) / (1 - w**2), np.sqrt(1 + alpha)
    both = -2 * e * np.cos(turn * T_) + (1 + e) * np.cos(psi) * np.sin(turn * T_) / (turn * speed)
    exact = [np.log(np.abs(np.roots([1, -each, e**2])).max()) / T_ for each in both]
    found = sc.exponents(ring(node, "spring", x=0.001, v=0.6), alpha, starts=4)
    assert found.exponent == pytest.approx(exact, abs=1e-7)


def test_a_ball_on_a_shaken_table() -> None:
    """The derivative of the flight map: a pair of multipliers with the product e**2."""
    phase, late = 0.1249440531877598, sp.Symbol("late")
    gap = X - sp.sin(2 * sp.pi * (T + late)) / 80
    ball = sc.Lagrangian(
        V**2 / 2, X, coordinates={X: V}, parameters={late: phase + 0.5}, events=[sc.Stop(gap, R(4, 5))]
    )
    top = np.sin(2 * np.pi * phase) / 80 + 0.125
    pair = 0.2549107471568807 + 0.7583010688268353j * np.array([-1, 1])
    orbit = sc.periodic_orbit(lone(ball, x=top, v=0.0), 1)
    assert np.sort_complex(orbit.multipliers) == pytest.approx(pair, abs=1e-11)
    assert orbit.phases.words == "open jumps"
    with pytest.raises(ArithmeticError, match=r"found node 1 with the gap .* = -"):
        sc.periodic_orbit(lone(ball, x=0.13, v=0.0), 1, start=[-0.02, 0.0])


def test_stick_static_drop_and_stop() -> None:
    """A cart-pole that sticks, lets go with a jump and is hit once a period: one direction is lost in stick."""
    pull = R(3, 5) * sc.friction(R(4, 5) * sp.cos(R(6, 5) * T) - V)
    cart = sc.Lagrangian(
        V**2 / 2 + (V**2 + 2 * V * OM * sp.cos(TH) + OM**2) / 4,
        X**2 / 2 - sp.cos(TH) / 2,
        {X: pull - V / 4, TH: -OM / 4},
        coordinates={X: V, TH: OM},
        friction=sc.friction_law("sign(w)", static="6/5"),
        contact="set-valued",
        events=[sc.Stop(R(1, 5) - X, R(7, 10))],
    )
    start = {"x": 0.00282212838818, "th": -0.63680895403904, "v": 0.69619124352542, "om": -0.43433774329057}
    inner = 0.02909021801 + 0.21253561006j * np.array([-1, 1])
    # one kernel for both: at strength 0 the eigenvalues of the propagator are the multipliers
    found = sc.exponents(ring(cart, "spring on x", **start).replace(rtol=1e-10), [0.0, 0.3, 0.9], transient=20)
    assert found.exponent[1:] == pytest.approx([-0.202301849904, -0.115207487003], abs=2e-11)
    alone = np.sort_complex(np.linalg.eigvals(found.attractors[0].propagators[1, 0]))
    assert np.abs(alone - np.array([-0.2183177345564, 0.0, *inner])).max() < 2e-11


def test_integrate_and_fire() -> None:
    """Locked 1:1 to its drive: the multiplier is F+/F- exp(-T)."""
    cell = sc.Field({V: R(6, 5) + R(3, 10) * sp.sin(2 * sp.pi * T / R(17, 10)) - V}, events=[sc.Reset(V - 1, {V: 0})])
    assert multipliers(lone(cell, v=0.3)) == pytest.approx([0.548231306332175], abs=1e-12)


def test_the_cycle_of_a_relay() -> None:
    """Feedback of 1/(s + 1)**3 by a relay that the motion only crosses: multipliers by matrix exponentials in 40 digits."""
    a, b, c = sp.symbols("a b c")
    loop = sc.Field({a: -sp.sign(c) - a, b: a - b, c: b - c}, contact="set-valued")
    start = {"a": -0.7258679257978837, "b": -0.2906309222293034, "c": -0.3}
    assert multipliers(lone(loop, **start)) == pytest.approx([1.089112220369835e-4, 0.1474487637037114, 1.0], abs=1e-11)
    found = sc.exponents(ring(loop, "a->a", **start), [0.0, 0.2, 0.5])
    assert found.attractors[0].kind == "periodic"
    assert found.exponent == pytest.approx([0.0, -0.068745533495445, -0.17990528081179], abs=1e-12)


def test_a_cycle_of_stick_and_slip_is_closed() -> None:
    """Undriven friction on a belt: exponents by multipliers of the cycle, as `periodic_orbit` computes them."""
    belt = sc.Lagrangian(
        V**2 / 2,
        X**2 / 2,
        {X: sc.friction(R(1, 5) - V)},
        coordinates={X: V},
        friction="exponential",
        contact="set-valued",
    )
    scene = ring(belt, "spring", x=0.3, v=0.0)
    found, orbit = sc.exponents(scene, [0.0, 0.5], transient=20), sc.periodic_orbit(scene)
    assert found.attractors[0].kind == "periodic"
    assert found.exponent[0] == pytest.approx(0.0, abs=1e-11)
    growth = np.log(abs(orbit.transversal_multipliers(0.5)[0])) / orbit.period
    assert found.exponent[1] == pytest.approx(growth, abs=1e-10)


def test_motion_that_is_held_for_good() -> None:
    """A body at rest on a stop, with a drive that does not lift it, and one that friction holds beside a free one."""
    for drive in (sp.S.Zero, sp.cos(T) / 2):
        pressed = sc.Lagrangian(V**2 / 2, X, {X: drive - V / 10}, coordinates={X: V}, events=[sc.Stop(X, R(1, 2))])
        found = sc.exponents(ring(pressed, "spring", x=0.1, v=0.0), [0.0, 0.5], transient=20)
        assert np.all(found.exponent == -np.inf)
    held = sc.Lagrangian(
        V**2 / 2 + OM**2 / 2,
        X**2 / 2 + TH**2 / 2,
        {X: sc.friction(-V), TH: -OM / 5},
        coordinates={X: V, TH: OM},
        friction="coulomb",
        contact="set-valued",
        events=[sc.Stop(TH + 5, R(1, 2))],
    )
    found = sc.exponents(ring(held, "spring on th", x=0.1, v=0.0, th=0.0, om=0.0), [0.0, 0.5], transient=20)
    assert found.exponent == pytest.approx([0.0, 0.0], abs=1e-14)
    assert found.attractors[0].kind == "fixed point"


def test_links_that_a_sliding_node_balances() -> None:
    """On x + c y = 0 a deviation decays as exp(-t/c), whatever the strength of links of y."""
    relay = sc.Field({X: V, V: -sp.sign(X + R(7, 10) * V) + sp.cos(T) / 10}, contact="set-valued")
    assert sc.exponents(ring(relay, "v->v", x=1.0, v=0.0), [0.0, 0.5]).exponent == pytest.approx(
        [-1 / 0.7] * 2, abs=1e-9
    )


@pytest.mark.parametrize(
    ("coupling", "words"),
    [
        ("damper", r"found links of v, which events change at once.*; expected links of states that no"),
        ("v->x", "found a link that changes the rate of x, which is in 3/5 - x; expected forces"),
    ],
)
def test_links_of_states_that_an_impact_changes_are_refused(coupling: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        sc.exponents(ring(IMPACT, coupling, x=0.4, v=-0.5), [0.3])


def chain(node, coupling, **initial: list[float]) -> sc.Scene:
    return sc.Scene(node, coupling, sc.graphs.chain(2), initial=initial, parameters={"sigma": 0.15}, **FINE)


def test_multipliers_of_a_network_are_those_of_its_modes() -> None:
    """Two oscillators that hit their stops at one instant: the modes 0 and 2 sigma = 0.3 of the springs."""
    orbit = sc.periodic_orbit(chain(IMPACT, "spring", x=[0.4, 0.4], v=[-0.5, -0.5]), 1, clusters=(0, 1))
    pairs = np.array([-0.07497024465844425 + 0.4666788456971145j, 0.3911885970952671 + 0.2652944856343134j])
    found = orbit.multipliers[np.argsort(orbit.multipliers.real)]
    assert np.abs(found.real - pairs.real.repeat(2)).max() < 1e-11
    assert np.abs(abs(found.imag) - pairs.imag.repeat(2)).max() < 1e-11
    with pytest.raises(ValueError, match="found 33 oscillators or clusters; expected at most 32"):
        sc.lyapunov_spectrum(
            ring(IMPACT, "spring", x=0.4, v=-0.5).replace(topology=sc.graphs.ring(33), initial={"x": [0.4] * 33})
        )


def test_exponents_of_a_cluster_state_of_impact_oscillators() -> None:
    """The orbit of the clusters is the synchronous one: its only block is the mode alpha = 0.15, a complex pair."""
    start = {"x": [0.4] * 3, "v": [-0.5] * 3}
    star = sc.Scene(IMPACT, "spring", sc.graphs.star(3), initial=start, parameters={"sigma": 0.15}, **FINE)
    found = sc.cluster_exponents(star, [0, 1, 1], periods=100, transient=20)
    assert found.exponent == pytest.approx([-0.095413264323899], abs=1e-3)


A, B, C, S = sp.symbols("a b c s")
SHAKEN = sc.Lagrangian(
    V**2 / 2,
    X**2 / 2,
    {X: A * sp.cos(R(4, 5) * T) - V / 10},
    coordinates={X: V},
    parameters={A: 0.5, B: 0.6, C: 0.7},
    events=[sc.Stop(B - X, C)],
)
DROP = sc.Lagrangian(
    V**2 / 2,
    X**2 / 2,
    {X: A * sc.friction(B - V)},
    coordinates={X: V},
    parameters={A: 0.6, B: 0.3},
    friction=sc.friction_law("sign(w)", static=C, parameters={C: 1.2}),
    contact="set-valued",
    events=[sc.Stop(R(4, 5) - X, R(1, 2))],
)
RELAY = sc.Field(
    {X: V, V: -sp.sign(X + C * V - B) + A * sp.cos(T)}, contact="set-valued", parameters={A: 0.1, B: 0.1, C: 0.7}
)
CELL = sc.Field({V: A + sp.sin(T) / 3 - V}, events=[sc.Reset(V - B, {V: C})], parameters={A: 1.8, B: 1.0, C: 0.1})


@pytest.mark.parametrize(
    ("node", "coupling", "start", "time"),
    [
        (SHAKEN, "spring", [0.2, -0.1, 0.3, 0.2], 11.0),
        (DROP, "spring", [0.3, -0.2, 0.2, 0.1], 7.0),
        (RELAY, "v->v", [0.1, 0.7, 0.0, 0.3], 3.0),  # the first one begins on its surface
        (CELL, None, [0.3], 7.0),
    ],
)
def test_derivatives_of_a_network_through_events(node, coupling, start: list[float], time: float) -> None:
    """By the start and by parameters, beside differences of the motion; no two events at one instant."""
    names = ("a", "b", "c", *(["sigma"] if coupling else []))
    state = np.array(start)
    n = 2 if coupling else 1
    initial = {s: start[k * n : k * n + n] for k, s in enumerate(("x", "v") if coupling else ("v",))}
    scene = (
        chain(node, coupling, **initial)
        if coupling
        else sc.Scene(node, None, sc.graphs.chain(1), initial=initial, **FINE)
    )
    expect_differences(scene, names, state, time)


def expect_differences(scene: sc.Scene, names: tuple[str, ...], state: np.ndarray, time: float) -> None:
    """Derivatives by the start and by parameters are those of differences of the motion."""
    size = len(state)
    flow, length = flow_of(scene, scene.equations, names, state), np.array([time])
    image, step = flow.linearise(scene.parameters, state[None], length, np.ones(size)), 1e-6

    def difference(name: str | None, direction: np.ndarray) -> np.ndarray:
        ends = []
        for h in (step, -step):
            values = {**scene.parameters, **({name: scene.parameters[name] + h} if name else {})}
            ends.append(flow.advance(values, (state + h * direction)[None], length)[0])
        return (ends[0] - ends[1]) / (2 * step)

    for k, name in enumerate(names):
        assert image.columns[0][:, k] == pytest.approx(difference(name, np.zeros(size)), abs=1e-7)
    for k, direction in enumerate(np.eye(size)):
        assert image.propagators[0][:, k] == pytest.approx(difference(None, direction), abs=1e-7)


PAIR, PAIRS = sc.graphs.chain(2), sc.graphs.from_edges([(0, 1), (2, 3)], n=4)
BALL = sc.Lagrangian(
    V**2 / 2, X**4 / 4, {X: A * sp.cos(R(13, 10) * T) / 2 - V / 10}, coordinates={X: V}, parameters={A: 1.0}
)
HIT = sc.Stop("x_j - x_i + 1/2", restitution="e")
CRADLE = sc.Potential("k*W*(x_i - x_j)**2/2", {"k": 0.2, "e": 0.8}, events=[HIT])
WITH_STOP = sc.Potential(
    0, {"N": 0.3, "e": 0.7}, events=[sc.Friction("v_j - v_i", load="N", law=sc.friction_law("sign(w)")), HIT]
)


def rub(law: str, static: str | None = None) -> sc.Potential:
    contact = sc.Friction("v_j - v_i", load="N", law=sc.friction_law(law, static=static))
    return sc.Potential(0, {"N": 0.5}, events=[contact])


JOINED = {
    "a cradle of five": ([(CRADLE, sc.graphs.chain(5))], ("e", "k")),
    "stick and slip of three blocks": ([(rub("sign(w)*(1 + 1/(1 + abs(w)))/2"), sc.graphs.chain(3)), ("damper", sc.graphs.ring(3))], ("N", "sigma")),
    "a static drop": ([(rub("sign(w)", "6/5"), PAIR), ("spring", PAIR)], ("N", "sigma")),
    "a static drop under springs of others": ([(rub("sign(w)", "6/5"), PAIRS), ("spring", sc.graphs.ring(4))], ("N", "sigma")),
    "friction and a stop": ([(WITH_STOP, PAIR), ("damper", PAIR)], ("N", "e", "sigma")),
    "two parts": ([(rub("sign(w)"), PAIRS), ("damper", sc.graphs.ring(4))], ("N", "sigma")),
    "a ball beside a pair": ([(CRADLE, sc.graphs.from_edges([(0, 1)], n=3)), ("spring", sc.graphs.ring(3))], ("e", "sigma")),
}  # fmt: skip


def joined(links) -> sc.Scene:
    n = links[0][1].n
    start = {"x": [0.0, 0.3, 0.5, 0.2, 0.1][:n], "v": [0.6, -0.4, 0.1, 0.3, -0.2][:n]}
    values = {"a": [1.5, -1.2, 0.4, 0.9, -0.7][:n], **({"sigma": 0.3} if len(links) > 1 else {})}
    return sc.Scene(BALL, links=links, initial=start, parameters=values, time_unit="time", **FINE)


@pytest.mark.parametrize("case", JOINED)
def test_derivatives_through_events_of_links(case: str) -> None:
    links, names = JOINED[case]
    scene = joined(links)
    state = np.array([*scene.initial["x"], *scene.initial["v"]])
    expect_differences(scene, names, state, 8.0)


def test_links_between_parts_of_states_that_an_impact_changes_are_refused() -> None:
    links = [(CRADLE, sc.graphs.from_edges([(0, 1)], n=3)), ("damper", sc.graphs.ring(3))]
    with pytest.raises(ValueError, match=r"found links of v, which events change at once.*; expected links of states"):
        sc.lyapunov_spectrum(joined(links))


def test_the_cycle_of_blocks_that_rub() -> None:
    """The exponents of the network are those of the multipliers of its cycle; stick loses one direction."""
    scene, period = joined([(rub("sign(w)"), PAIR), ("spring", PAIR)]).replace(a=[3.0, 0.6]), 2 * np.pi / 1.3
    end = sc.run(scene.replace(window=60 * period, transient=0), workers=1, show_progress=False).end
    near = scene.replace(initial={str(name): list(end.sel(component=name).values) for name in ("x", "v")})
    orbit = sc.periodic_orbit(near, 1)
    found = sc.lyapunov_spectrum(near, precision=0.5, periods=60, transient=30, show_progress=False).exponent
    sizes = np.sort(np.abs(orbit.multipliers))[::-1]
    assert np.log(sizes[:-1]) / period == pytest.approx(found[:-1], abs=1e-3)
    assert (found[-1], sizes[-1]) == (-np.inf, pytest.approx(0.0, abs=1e-9))


def test_impacts_between_balls_contract_areas() -> None:
    """Each impact multiplies areas by e^2: the sum of the exponents is -2/10 + 2 log(e) times the rate of impacts."""
    scene = joined([(CRADLE, PAIR)]).replace(a=[3.0, -3.0])
    found = sc.lyapunov_spectrum(scene, precision=0.5, periods=80, transient=30, show_progress=False)
    events = sc.run(scene.replace(window=500, transient=0, record=("events",)), workers=1, show_progress=False).events
    impacts = int((events.event_time > 150).sum())
    assert impacts > 60
    assert found.exponent.sum() == pytest.approx(-0.2 + 2 * np.log(0.8) * impacts / 350, abs=3e-3)


@pytest.mark.parametrize("damping", [R(1, 4), 3])
@pytest.mark.parametrize("inertia", [0, R(1, 3)])
def test_a_body_in_stick_beside_a_coordinate_that_decays(damping, inertia) -> None:
    """x is held by 3/5, th decays: one neutral direction. The speed of x is a rounding error, and no unit of time."""
    node = sc.Lagrangian(
        V**2 / 2 + OM**2 / 2 + inertia * V * OM,
        X**2 / 2 + TH**2 / 2 + X * TH / 10,
        {X: R(3, 5) * sc.friction(-V), TH: -damping * OM},
        coordinates={X: V, TH: OM},
        friction=sc.friction_law("sign(w)"),
        contact="set-valued",
    )
    found = sc.exponents(ring(node, "spring on x", x=0.3, v=0.0, th=0.5, om=0.0), [0.0, 0.3], starts=1)
    assert found.motions == ("fixed point",)
    assert found.exponent == pytest.approx([0.0, 0.0], abs=1e-12)
    assert 0.5 < float(found.unit.split(", ")[1].split()[0]) < 30.0

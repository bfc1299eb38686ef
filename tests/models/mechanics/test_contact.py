"""Set-valued friction: what is derived, what is refused, and that kernels, networks and exponents work with it."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from parts import node
from scipy.integrate import quad

from synchain import Lagrangian, Scene, exponents, friction_law, run
from synchain.graphs import topology
from synchain.models.dynamics.reduction import substitute_constants
from synchain.models.mechanics.contact import SLIP
from synchain.models.mechanics.events import set_valued

X, V, W, MU = (sp.Symbol(name, real=True) for name in ("x", "v", "w", "mu"))
FORCE = sp.Function("f", real=True)


def scene(n: int = 1, **more: object) -> Scene:
    settings = {"topology": topology("chain", n), "contact": "set-valued", "transient": 0.0, "window": 20.0}
    return Scene(**{**settings, **more})  # type: ignore[arg-type]


def test_the_derived_node_is_the_smooth_one_away_from_the_jump() -> None:
    exact, plain = node("friction", "exponential", "set-valued"), node("friction", "exponential", "sign")
    ground = sp.Symbol("theta_b", real=True)
    for sign in (1, -1):
        at = {V: ground - sign * sp.Rational(1, 3)}
        rate = exact.rhs[1].xreplace({SLIP: sp.Integer(sign)}).xreplace(at)
        assert sp.simplify(rate - plain.rhs[1].xreplace(at)) == 0
    assert exact.rhs[1].xreplace({SLIP: sp.S.Zero}) == 0
    (event,) = exact.events
    assert event.target == ground
    epsilon, mu_s = (sp.Symbol(name, real=True) for name in ("epsilon", "mu_s"))
    assert sp.simplify(event.limits[0] - event.limits[1] - 2 * epsilon * mu_s) == 0
    assert not event.jumps


@pytest.mark.parametrize(
    ("acceleration", "law", "message"),
    [
        (-X, sp.sign(W), "friction acts 0 times"),
        (-X + FORCE(X), sp.sign(W), "must fall with v"),
        (-X + FORCE(V), sp.sign(W), "must fall with v"),
        (-X + FORCE(-V) ** 2, sp.sign(W), "acts nonlinearly in .*; expected a multiple of it"),
        (
            -X + (1 + V) * FORCE(-V),
            sp.sign(W),
            r"found friction under the load v \+ 1, which depends on the velocity v",
        ),
        (-X + FORCE(-V), W, "has no jump"),
        (-X + FORCE(-V), sp.sign(W) + 1, r"has f\(w\) \+ f\(-w\) = 2; expected 0, an odd law"),
        (-X + FORCE(-V), sp.sign(W) * sp.Piecewise((1, W > 0), (2, True)), "expected 0, an odd law"),
        (-X + FORCE(-V), sp.sign(sp.sin(9 * W)), r"the law sign\(sin\(9\*w\)\) has another kink at w = 0 than sign"),
        (-X + FORCE(-V), sp.sign(W) * (1 + sp.Abs(sp.sin(9 * W))), "has another kink at w = 0"),
        (-X + FORCE(-V), sp.sign(W) * (1 + sp.Max(W, -W)), "has another kink at w = 0"),
        (-X + FORCE(-V), sp.sign(W) + sp.atan(1 / W), "has another kink at w = 0"),
        (-X + FORCE(-V), sp.sign(W) * sp.sin(W) / W, "has no finite value at w = 0"),
        (-X + FORCE(-V), sp.sign(W) / sp.sqrt(sp.Abs(W)), "has no finite value at w = 0"),
    ],
)
def test_what_has_no_set_valued_form(acceleration: sp.Expr, law: sp.Expr, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        set_valued(acceleration, FORCE, law, W, None, V)


EDGE = sp.Abs(W) - sp.Rational(1, 5)


@pytest.mark.parametrize(
    "law",
    [
        sp.sign(W) * (1 + 3 * sp.Abs(W - 5 * W**3)), sp.sign(W * (W**2 - sp.Rational(1, 25))), sp.sign(W) * (1 + sp.Abs(EDGE)),
        sp.sign(W) * (1 - sp.sign(EDGE) / 3), sp.sign(W) * sp.Piecewise((1, EDGE < 0), (2, True)), sp.sign(W) * sp.Max(EDGE, 1),
        sp.sign(W) * sp.Abs(MU), sp.sign(W) * sp.Abs(MU - 1), sp.sign(W * MU), sp.sign(W) * sp.exp(-sp.Abs(W / MU)),
        sp.sign(W + W**3), -sp.sign(-W - W**3), sp.sign(W * sp.Abs(W)), sp.sign(W**3) * sp.exp(-sp.Abs(W)), MU * sp.sign(sp.tanh(W)),
    ],
)  # fmt: skip
def test_friction_in_slip_is_the_law(law: sp.Expr) -> None:
    rate, event = set_valued(FORCE(-V), FORCE, law, W, None, V)
    slow = law.xreplace({W: sp.Rational(1, 10**9)})
    for value in (sp.Rational(-2, 3), sp.Rational(3, 2)):
        assert (event.departures[0] - slow).xreplace({MU: value}).evalf() == pytest.approx(0, abs=1e-8)
        for w in map(sp.Rational, ("-1", "-0.3", "-0.1", "0.1", "0.3", "1")):
            force = rate.xreplace({V: -w, SLIP: sp.sign(w), MU: value})
            assert float(force) == pytest.approx(float(law.xreplace({W: w, MU: value})))


@pytest.mark.parametrize("n", [1, 9])
def test_kinks_in_slip_are_passed(n: int) -> None:
    """The distance to rest from v = 1 is the integral of v/f(v); one body in written-out steps, nine in loops."""
    law = friction_law("mu*sign(w)*(1 + 3*abs(w - 5*w**3))", {"mu": 0.3})
    body = Lagrangian("v**2/2", 0, {"x": "friction(-v)"}, coordinates={"x": "v"}, friction=law, contact="set-valued")
    apart = Scene(body, "spring", topology("chain", n), initial={"x": 0.0, "v": 1.0}, parameters={"sigma": 0.0} if n > 1 else {},
                  transient=0.0, window=6.0, time_unit="time", rtol=1e-10)  # fmt: skip
    result = run(apart, show_progress=False)
    kink = 1 / np.sqrt(5)
    slow, fast = (
        quad(lambda v: v / (0.3 * (1 + 3 * abs(v - 5 * v**3))), *ends, epsabs=1e-12)[0]
        for ends in ((0, kink), (kink, 1))
    )
    assert result.success
    np.testing.assert_allclose(result.states("end")[:n], slow + fast, rtol=1e-8)


def test_the_smooth_law_tends_to_the_exact_one() -> None:
    """Period two at omega = 1.15: the distance after 20 periods falls like 1/sqrt(kappa), the exact law's error does not
    count."""
    exact = run(scene(rtol=1e-12, record=("section",)), show_progress=False).states("end")[0]
    gaps = []
    for kappa in (1e5, 1e7, 1e9):
        smooth = run(scene(contact="atan", rtol=1e-10, parameters={"kappa": kappa}), show_progress=False)
        gaps.append(abs(smooth.states("end")[0] - exact))
    assert gaps[0] < 3e-3
    ratios = [gaps[0] / gaps[1], gaps[1] / gaps[2]]
    assert all(8.0 < ratio < 30.0 for ratio in ratios)


@pytest.mark.long
def test_results_converge_with_the_tolerance_and_stick_is_exact() -> None:
    ends = [
        run(scene(2, rtol=rtol, parameters={"sigma": 0.1}), show_progress=False).states("end")
        for rtol in (1e-6, 1e-9, 1e-13)
    ]
    assert np.abs(ends[0] - ends[2]).max() < 1e-6
    assert np.abs(ends[1] - ends[2]).max() < 1e-9
    path = run(scene(record=("trajectory",), samples=2001), show_progress=False).states("trajectory")
    stuck = path[path[:, 2] == 0.0]
    assert 0.1 * len(path) < len(stuck) < 0.9 * len(path)
    assert np.all(stuck[:, 1] == 0.1)
    slipping = path[path[:, 2] != 0.0]
    assert np.all(np.sign(0.1 - slipping[:, 1]) * slipping[:, 2] >= 0.0)


def test_equal_oscillators_stay_equal_although_the_state_is_unstable() -> None:
    full = run(scene(3, initial={"x": [0.3, 0.3, 0.3]}, parameters={"sigma": 0.9, "omega": 1.4}, window=300.0),
                reduce=False, show_progress=False)  # fmt: skip
    assert full.sync_error.item() == 0.0
    assert np.ptp(full.states("end").reshape(3, 3), axis=1).max() == 0.0


@pytest.mark.parametrize("width", [1, *(pytest.param(width, marks=pytest.mark.long) for width in (2, 4))])
def test_lanes_do_not_change_a_bit(width: int) -> None:
    cells = {"omega": np.linspace(1.0, 1.4, 21), "show_progress": False}
    s = scene(rtol=1e-12, window=50.0, record=("section",))  # the drivers of other tests, and a kernel of another
    np.testing.assert_array_equal(run(s, width=width, **cells).end, run(s, width=8, workers=2, **cells).end)


def test_exponents_of_the_exact_law_are_the_limit_of_the_smooth_one() -> None:
    """omega = 1.15: where the exponent changes sign, at kappa = 1e7 and 1e9 and in the exact law."""
    alpha = np.linspace(0.46, 0.47, 11)
    zeros = []
    for more in ({"kappa": 1e7}, {"kappa": 1e9}, {}):
        s = Scene(
            topology=topology("chain", 2), contact="atan" if more else "set-valued", parameters={"omega": 1.15, **more}
        )
        zeros.append(exponents(s, alpha, starts=1, rtol=1e-8).intervals[0][1])
    assert abs(zeros[1] - zeros[2]) < abs(zeros[0] - zeros[2]) < 2e-6
    assert abs(zeros[1] - zeros[2]) < 3e-7


@pytest.mark.long
def test_starts_on_the_ground_stick_or_slip_by_their_load() -> None:
    cells = run(scene(window=1e-6, time_unit="time", parameters={"u": 0.0}), x_1=[0.0, 0.59, 0.61, -0.61], v_1=0.1,
                show_progress=False)  # fmt: skip
    assert list(cells.states("end")[:, 2]) == [0.0, 0.0, 1.0, -1.0]


@pytest.mark.long
def test_slip_that_begins_slower_than_a_step_can_tell_does_not_chatter() -> None:
    """The load passes its limit by 9e-6 where the drive turns: the sliding velocity grows from zero at that rate."""
    s = scene(integrator="rodas5p", rtol=1e-6, window=4.0, parameters={"omega": 1.4}, record=())
    start = {"x_1": [float.fromhex("0x1.d3815b289d0f8p-2")], "v_1": 0.1}
    loose = run(s, show_progress=False, **start)
    tight = run(s.replace(rtol=1e-12, integrator="auto"), show_progress=False, **start)
    assert loose.success
    assert np.abs(loose.states("end") - tight.states("end")).max() < 1e-3


def test_a_static_coefficient_below_the_kinetic_one_is_refused() -> None:
    message = "friction coulomb_static: found mu_s = 0.1 below mu_k = 0.2; expected mu_k <= mu_s"
    with pytest.raises(ValueError, match=message):
        scene(friction="coulomb_static", parameters={"mu_s": 0.1})
    with pytest.raises(ValueError, match=message):
        scene(friction="coulomb_static", axes={"mu_s": [0.1, 0.5]})
    scene(friction="coulomb_static", axes={"mu_s": [0.1, 0.5], "mu_k": [0.05, 0.5]}, zipped=True)
    scene(friction="coulomb_static", contact="atan", parameters={"mu_s": 0.1})


def test_the_clock_starts_anew_where_there_is_no_drive() -> None:
    from synchain.runtime.cells.initial_modes import CLOCK, local_clock

    driven, rows = scene().equations, np.zeros(3)
    alone = substitute_constants(driven, {"u": 0})
    np.testing.assert_array_equal(local_clock(driven, rows + 5.0), rows + 5.0)
    np.testing.assert_array_equal(local_clock(alone, rows), rows + CLOCK)
    assert np.frexp(CLOCK)[0] == 0.5

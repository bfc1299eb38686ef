"""Stick and slip against closed forms: amplitudes, arcs, periods, decay, a Hopf point, a share of starts, and
tangents."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from synchain import Scene, exponents, run
from synchain.graphs import topology
from synchain.plugins import allow_code
from synchain.results import Result
from synchain.runtime.stability.orbits import OrbitProblem

ONE = topology("chain", 1)


def block(friction: str, x: float = 0.0, v: float = 0.0, **more: Any) -> Scene:
    """One block without a drive and with load 1, unless told otherwise; keywords set the scene or its parameters.

    All record sections, so that they share drivers.
    """
    keys = {"transient", "window", "record", "section", "samples", "rtol", "max_steps", "oscillator", "time_unit"}
    parameters_of_node = {name: more.pop(name) for name in keys & set(more)}
    settings = {"transient": 0.0, "rtol": 1e-13, "record": ("section",), "time_unit": "time", **parameters_of_node}
    start = {"x": [x], "v": [v]}
    return Scene(
        topology=ONE, friction=friction, contact="set-valued", initial=start, parameters={"epsilon": 1.0, "u": 0.0,
        **more}, **settings,
    )  # fmt: skip


def finished(scene: Scene, **axes: Any) -> Result:
    width = 4 if any(map(np.ndim, axes.values())) else 1  # drivers of other tests
    result = run(scene, show_progress=False, workers=1, reduce=False, width=width, **axes)
    assert np.all(result.status == 1)
    return result


@pytest.mark.parametrize(("omega", "r"), [(0.7, 0.3), (0.9, 0.5), (1.15, 0.2), (1.4, 0.3), (2.0, 0.1)])
def test_amplitude_under_coulomb_friction(omega: float, r: float) -> None:
    """Den Hartog, Phil. Mag. 9, 801 (1930): symmetric motion without stops has X^2 = V^2 - r^2 U^2."""
    beta = mpf(omega)
    far = 1 / (1 - beta**2)
    late = mp.sin(mp.pi / beta) / (beta * (1 + mp.cos(mp.pi / beta)))
    amplitude = float(mp.sqrt(far**2 - mpf(r) ** 2 * late**2))
    scene = block(
        "coulomb", amplitude, 0.1, theta_b=0.0, mu=r, u=1.0, omega=omega, transient=2000, window=3, time_unit="period",
        section="v_1 falling",
    )  # fmt: skip
    turns = finished(scene).states("section")[:, 0]
    assert len(turns) == 3
    np.testing.assert_allclose(turns, amplitude, rtol=0, atol=1e-12)


def test_arcs_on_a_belt() -> None:
    """Slip is a circle round x = F_k: t_slip = 2 (pi - atan((F_s - F_k)/v)), t_stick = 2 (F_s - F_k)/v."""
    hold, drag, belt, end = 1.0, 0.6, 0.3, 60.0
    slip, stick = 2.0 * (math.pi - math.atan((hold - drag) / belt)), 2.0 * (hold - drag) / belt
    starts = np.array([-0.5, 0.0, 0.1, 0.2, 0.9])
    scene = block("coulomb_static", 0.0, belt, theta_b=belt, mu_s=hold, mu_k=drag, window=end)
    states = finished(scene, x_1=starts).states("end")
    phase = (end - (hold - starts) / belt) % (slip + stick)
    sliding, circle = phase < slip, math.hypot(hold - drag, belt)
    angle = math.atan2(belt, hold - drag) - phase
    x = np.where(sliding, drag + circle * np.cos(angle), hold + belt * (phase - slip - stick))
    v = np.where(sliding, circle * np.sin(angle), belt)
    assert set(sliding) == {True, False}
    np.testing.assert_array_equal(states[:, 2], sliding)
    np.testing.assert_allclose(states[:, 0], x, rtol=0, atol=3e-12)
    np.testing.assert_allclose(states[:, 1], v, rtol=0, atol=3e-12)


def test_cycle_of_leine() -> None:
    """Leine et al., Nonlinear Dynamics 16, 41 (1998), fig. 5 and table: m = k = F_s = 1, v_dr = 0.2, delta = 3."""
    scene = block("hyperbolic", 0.0, 0.2, theta_b=0.2, mu_s=1.0, delta=3.0, window=100.0, section="v_1 falling")
    data = finished(scene).data
    np.testing.assert_allclose(np.diff(data.section_time), 12.001031294831, rtol=0, atol=1e-10)
    top = finished(scene.replace(window=float(data.section_time[-1]))).states("end")
    assert abs(top[1]) < 1e-7, "where x is stationary: its error is the square of that"
    y, h = np.array([1.0, 0.2]), float(data.section_time[0] - 5.0) / 4000  # slip begins at x = 1, t = 5
    for _ in range(4000):
        y = runge_kutta(y, h)
    assert abs(y[1]) < 1e-10
    assert top[0] == pytest.approx(y[0], abs=1e-12)


def runge_kutta(y: np.ndarray, h: float) -> np.ndarray:
    """One classical step of Leine's block in slip."""

    def rates(state: np.ndarray) -> np.ndarray:
        return np.array([state[1], -state[0] + 1.0 / (1.0 + 3.0 * (0.2 - state[1]))])

    a = rates(y)
    b = rates(y + h / 2 * a)
    c = rates(y + h / 2 * b)
    return y + h / 6 * (a + 2 * b + 2 * c + rates(y + h * c))


@pytest.mark.parametrize("hold", [0.1, 0.19])
def test_free_decay(hold: float) -> None:
    """Under Coulomb friction the amplitude falls by 2 F_k/k each half cycle, until the spring no longer overcomes F_s."""
    drag = 0.1
    friction, coefficients = (
        ("coulomb", {"mu": drag}) if hold == drag else ("coulomb_static", {"mu_k": drag, "mu_s": hold})
    )
    scene = block(friction, theta_b=0.0, window=40.0, **coefficients)
    starts = np.linspace(0.05, 1.53, 38)
    ends = finished(scene, x_1=starts).states("end")
    for x, (end, v, slip) in zip(starts, ends, strict=True):
        resting = x
        while abs(resting) > hold:
            resting = 2.0 * math.copysign(drag, resting) - resting
        assert end == pytest.approx(resting, abs=2e-12)
        assert (v, slip) == (0.0, 0.0)


# -- the oscillator of bSTAB -----------------------------------------------------------------------------------

BELT_DAMPER = """
# Stender & Hoffmann, Nonlinear Dynamics 107, 1451 (2022): block on a belt with a spring and a damper to the ground
from synchain import Lagrangian

OSCILLATOR = Lagrangian("v**2/2", "x**2/2", {"x": "friction(theta_b - v) - 2*xi*v"}, coordinates={"x": "v"},
                        parameters={"theta_b": 1.5, "xi": 0.05})
"""
STRIBECK = {"mu_s": 1.0, "mu_k": 0.5, "a": 2.0, "xi": 0.05}


@pytest.fixture(scope="module")
def damped(tmp_path_factory: pytest.TempPathFactory) -> str:
    path: Path = tmp_path_factory.mktemp("plugins") / "belt_damper.py"
    path.write_text(BELT_DAMPER, encoding="utf-8")
    allow_code(path)
    return str(path)


def damped_scene(oscillator: str, x: float, v: float, window: float, rtol: float, speed: float) -> Scene:
    return Scene(
        oscillator=oscillator,
        topology=ONE,
        friction="exponential",
        contact="set-valued",
        time_unit="time",
        transient=0.0,
        window=window,
        rtol=rtol,
        record=("section",),
        section="v_1 falling",
        parameters={**STRIBECK, "theta_b": speed},
        initial={"x": [x], "v": [v]},
    )


def test_hopf_point(damped: str) -> None:
    """Near steady sliding deviations grow like exp(t (b e^{-a v_d}/2 - xi)), b = a (mu_s - mu_k); zero at v_d =
    ln(10)/2."""
    hopf = 0.5 * math.log(10.0)
    assert math.exp(-2.0 * hopf) / 2.0 == pytest.approx(0.05, rel=1e-15)
    for speed in (hopf - 0.1, hopf, hopf + 0.1):
        rate = math.exp(-2.0 * speed) / 2.0 - 0.05
        resting = 0.5 + 0.5 * math.exp(-2.0 * speed)
        turns = 10.0 * 2.0 * math.pi / math.sqrt(1.0 - rate**2)
        # odd parts of the deviation alone: what is left is cubic
        ends = [
            finished(damped_scene(damped, resting + x, 0.0, turns, 1e-13, speed)).states("end")[0]
            for x in (1e-4, -1e-4)
        ]
        assert math.log((ends[0] - ends[1]) / 2e-4) / turns == pytest.approx(rate, abs=2e-8)


@pytest.mark.long
def test_share_of_starts_at_rest(damped: str) -> None:
    """Stender & Hoffmann's bSTAB: 0.3040 ± 0.0065 of [-2, 2] x [0, 2] at v_d = 1.5; three sigma allowed."""
    dice, count = np.random.default_rng(1), 2000
    scene = damped_scene(damped, 0.0, 0.0, 400.0, 1e-7, 1.5)
    starts = {"x_1": dice.uniform(-2.0, 2.0, count), "v_1": dice.uniform(0.0, 2.0, count)}
    scene = scene.replace(axes=starts, zipped=True, record=())
    ends = finished(scene).states("end")
    resting = 0.5 + 0.5 * math.exp(-3.0)
    distance = np.hypot(ends[:, 0] - resting, ends[:, 1])
    assert not np.any((distance > 0.05) & (distance < 0.5)), "every start has decided"
    share = float(np.mean(distance < 0.05))
    deviation = math.sqrt(0.304 * 0.696 / count)
    assert abs(share - 0.3040) < 3.0 * math.hypot(deviation, 0.0065)


def test_events_keep_their_digits_in_long_runs(damped: str) -> None:
    """Without a drive the clock starts anew every 8 units: the top of the stick-slip cycle is the same at t = 1e3 and
    1e5."""
    scene = damped_scene(damped, 1.0, 0.0, 30.0, 1e-12, 1.0)
    tops = [finished(scene.replace(transient=t)).states("section")[:, 0] for t in (1e3, 1e5)]
    assert min(map(len, tops)) >= 2
    assert np.ptp(np.concatenate(tops)) < 2e-12


# -- tangents --------------------------------------------------------------------------------------------------


def flow(scene: Scene, x: float, v: float) -> np.ndarray:
    return np.asarray(finished(scene, x_1=x, v_1=v).states("end")[:2])


@pytest.mark.parametrize(
    ("values", "x", "v", "kinds"),
    [
        ({"theta_b": 0.0, "u": 1.0, "omega": 1.15}, 1.3, 0.1, {1.0, -1.0}),
        ({"theta_b": 0.1, "u": 1.0, "omega": 0.9}, 0.4, 0.7, {1.0, -1.0}),
        ({"theta_b": 0.1, "u": 0.1, "omega": 1.15}, 0.3, 0.0, {1.0, 0.0}),
        ({"theta_b": 0.1, "u": 0.5, "omega": 1.15}, -0.3, -0.5, {1.0, -1.0, 0.0}),
    ],
)
def test_propagator_against_differences_of_the_flow(
    values: dict[str, float], x: float, v: float, kinds: set[float]
) -> None:
    """Turns multiply the deviation of the velocity by a ratio, landings by 0: seen in neighbouring orbits."""
    scene = Scene(
        topology=ONE, contact="set-valued", parameters={"epsilon": 1.0, **values}, initial={"x": [x], "v": [v]},
        transient=0, window=1.0, rtol=1e-12, record=("trajectory",), samples=400,
    )  # fmt: skip
    modes = finished(scene).states("trajectory")[:, 2]
    assert set(modes) == kinds
    pair = scene.replace(record=(), samples=0, topology=topology("chain", 2), initial={"x": [x, x], "v": [v, v]})
    problem = OrbitProblem.of_modes(pair, np.array([0.0]), np.array([[x, v, 0.0]]), 1)
    start = problem.with_slip_states(np.array([[x, v, 0.0]]))
    propagator = problem.propagators(problem.integrator(start), 1.0)[0][0, 0]
    d = 1e-6
    by_x, by_v = (flow(scene, x + p, v + q) - flow(scene, x - p, v - q) for p, q in ((d, 0.0), (0.0, d)))
    expected = np.stack([by_x, by_v], axis=1) / (2 * d)
    np.testing.assert_allclose(propagator, expected, rtol=0, atol=1e-6)


def lost(contact: str, **numbers: float) -> float:
    """Where the exponent of the period-two orbit at omega = 1.15 changes sign above alpha = 0.46."""
    scene = Scene(topology=topology("chain", 2), contact=contact, parameters={"omega": 1.15, **numbers})
    result = exponents(scene, np.linspace(0.455, 0.475, 21), starts=1, rtol=1e-10, workers=1)
    assert {attractor.kind for attractor in result.attractors} == {"periodic, 2 drive periods"}
    changes = [end for interval in result.ranges for end, _ in interval if 0.4551 < end < 0.4749]
    assert len(changes) == 1
    return changes[0]


def test_threshold_of_the_smooth_law_approaches_that_of_the_set_valued_one() -> None:
    limit = lost("set-valued")
    assert limit == pytest.approx(0.46503, abs=1e-4)
    distances = [abs(lost("atan", kappa=kappa) - limit) for kappa in (1e5, 1e7, 1e9)]
    assert distances[0] > 3.0 * distances[1] > 9.0 * distances[2]

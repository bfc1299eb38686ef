"""Events of set-valued friction: found, grazed, simultaneous, repeated, and the same whatever carries them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp
from event_reference import Reference
from mpmath import mp, mpf

import synchain as sc
from synchain import Scene, run
from synchain.graphs import Topology, topology
from synchain.results import Result, Status

pytestmark = pytest.mark.long

ONE, THREE = topology("chain", 1), topology("chain", 3)


def scene(graph: Topology, x: list[float], v: list[float], window: float = 1.0, **more: Any) -> Scene:
    """Set-valued friction without a transient; other keywords are the scene's."""
    settings: dict[str, Any] = {"transient": 0.0, "record": (), "window": window, **more}
    return Scene(topology=graph, contact="set-valued", initial={"x": x, "v": v}, **settings)


def ran(scene: Scene, **more: Any) -> Result:
    """All cells, as they stand, to the end."""
    result = run(scene, show_progress=False, **{"reduce": False, "workers": 1, **more})
    assert np.all(result.status == Status.FINISHED)
    return result


def ends(scene: Scene, **more: Any) -> np.ndarray:
    return np.asarray(ran(scene, **more).states("end"))


# -- events that only just happen ------------------------------------------------------------------------------


def test_no_graze_is_missed() -> None:
    """A frictional circle that tops the belt speed by d > 0 touches, sticks and leaves on the circle of the belt speed."""
    drag, over = 1e-3, np.geomspace(1e-9, 1.5e-6, 20)
    network = scene(ONE, [drag], [-1.0], 6.0, friction="coulomb", time_unit="time", rtol=1e-11,
                 parameters={"theta_b": 1.0, "epsilon": 1.0, "mu": drag, "u": 0.0})  # fmt: skip
    end = ends(network, v_1=-(1.0 + over))
    np.testing.assert_allclose(np.hypot(end[:, 0] - drag, end[:, 1]), 1.0, rtol=0, atol=2e-10)
    under = ends(network, v_1=-(1.0 - over))
    np.testing.assert_allclose(np.hypot(under[:, 0] - drag, under[:, 1]), 1.0 - over, rtol=0, atol=2e-12)


def test_no_short_release_is_missed() -> None:
    """A load that exceeds static friction by d for a moment moves the block by about d^2; exactly: by the slip's own arc."""
    hold, drive = 1.2, 1.0
    over = np.geomspace(1e-4, 0.1, 16)
    network = scene(ONE, [0.0], [0.0], 0.95, friction="coulomb", rtol=1e-12,
                 parameters={"theta_b": 0.0, "epsilon": 1.0, "mu": hold, "u": drive, "omega": 0.9})  # fmt: skip
    starts = hold - drive + over
    states = ends(network, x_1=starts)
    assert np.all(states[:, 2] == 0.0)
    for start, end in zip(starts, states[:, 0], strict=True):
        assert end == pytest.approx(slipped(start, hold, drive, 0.9), abs=1e-11)


def slipped(x0: float, hold: float, drive: float, omega: float) -> float:
    """Where a block at rest at x0 stops again after slip with v < 0: x'' = -x + hold + u cos(omega t)."""
    leave = math.acos((x0 - hold) / drive) / omega
    far = drive / (1.0 - omega**2)
    p, q = x0 - hold - far * math.cos(omega * leave), far * omega * math.sin(omega * leave)

    def speed(s: float) -> float:
        return -p * math.sin(s) + q * math.cos(s) - far * omega * math.sin(omega * (leave + s))

    low, high = 2.2 * (math.pi / omega - leave), 4.5 * (math.pi / omega - leave)
    assert speed(low) < 0.0 < speed(high)
    for _ in range(200):
        half = 0.5 * (low + high)
        low, high = (half, high) if speed(half) < 0.0 else (low, half)
    return hold + p * math.cos(low) + q * math.sin(low) + far * math.cos(omega * (leave + low))


# -- many at once ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "n"), [("chain", 2), ("ring", 4), ("star", 6)])
def test_equal_starts_stay_equal_to_the_last_bit(name: str, n: int) -> None:
    """Also where synchrony is unstable: omega = 1.4 is chaotic, sigma = 0.01 too weak."""
    network = scene(topology(name, n), [0.3] * n, [0.0] * n, 500, parameters={"omega": 1.4, "sigma": 0.01})
    end = ends(network).reshape(3, n)
    assert np.all(end == end[:, :1])
    apart = ends(network.replace(window=100), x_1=0.3 + 1e-9).reshape(3, n)
    assert np.abs(apart[0] - apart[0, 0]).max() > 1e-3, "a small difference grows"


def test_three_free_oscillators_do_what_each_does_alone() -> None:
    three = scene(THREE, [0.3] * 3, [0.0] * 3, 40, parameters={"omega": 1.4, "sigma": 0.0}, coupling="spring")
    end = ends(three).reshape(3, 3)
    assert np.all(end == end[:, :1])
    alone = ends(scene(ONE, [0.3], [0.0], 40, parameters={"omega": 1.4}, rtol=1e-8))
    assert np.abs(end[:, 0] - alone).max() < 1e-5


def test_permuted_nodes_give_permuted_ends() -> None:
    x, v = [0.3, -0.2, 0.1], [0.0, 0.2, -0.1]
    network = scene(THREE, x, v, 20, parameters={"omega": 1.15, "sigma": 0.3}, rtol=1e-10)
    end = ends(network).reshape(3, 3)
    back = ends(network.replace(initial={"x": x[::-1], "v": v[::-1]})).reshape(3, 3)
    np.testing.assert_array_equal(back[:, ::-1][2], end[2])
    np.testing.assert_allclose(back[:, ::-1], end, rtol=0, atol=1e-11)


def test_lanes_and_threads_do_not_matter() -> None:
    network = scene(THREE, [0.3, -0.2, 0.1], [0.0, 0.2, -0.1], 30, parameters={"omega": 1.4})
    strengths = np.linspace(0.0, 0.4, 19)
    first = ends(network, sigma=strengths, width=8)
    for width, workers in ((1, 1), (4, 2), (8, 2)):
        np.testing.assert_array_equal(ends(network, sigma=strengths, width=width, workers=workers), first)


# -- stick -----------------------------------------------------------------------------------------------------


def test_stuck_is_the_speed_of_the_belt_to_the_last_bit() -> None:
    network = scene(THREE, [0.3, -0.2, 0.1], [0.0, 0.2, -0.1], 10, parameters={"omega": 1.15, "sigma": 0.2},
                 record=("trajectory",), samples=3001)  # fmt: skip
    data = ran(network).states("trajectory")
    slips, speeds = data[:, 6:], data[:, 3:6]
    assert set(np.unique(slips)) <= {-1.0, 0.0, 1.0}
    stuck = slips == 0.0
    assert 0.05 < stuck.mean() < 0.95
    assert np.abs(speeds[stuck] - 0.1).max() <= 2e-16  # samples are interpolated: a rounding
    states = ends(network.replace(record=(), samples=0), x_1=np.linspace(-0.5, 0.5, 101))
    assert np.all(states[:, 3:6][states[:, 6:] == 0.0] == 0.1)
    assert np.any(states[:, 6:] == 0.0)


@pytest.mark.parametrize("beside", [0.0, 1e-300, -1e-300, 1e-17, -1e-17])
@pytest.mark.parametrize("belt", [0.0, 0.1, -0.1])
def test_starts_at_the_speed_of_the_belt(belt: float, beside: float) -> None:
    network = scene(ONE, [0.2], [belt + beside], 3, parameters={"theta_b": belt, "u": 0.1, "omega": 1.15}, rtol=1e-10)
    exact = ends(network, v_1=belt)
    np.testing.assert_allclose(ends(network), exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("x", [0.65, -0.65])
def test_starts_that_cannot_stick(x: float) -> None:
    """Beyond the static limit epsilon mu_s = 0.6 the block leaves at once, towards the spring's rest."""
    network = scene(ONE, [x], [0.0], 0.01, time_unit="time", parameters={"theta_b": 0.0, "u": 0.0})
    end = ends(network)
    assert end[2] == math.copysign(1.0, x)
    assert end[1] == pytest.approx(-math.copysign(0.05 * 0.01, x), rel=1e-2)


def test_mirrored_belt_gives_mirrored_motion() -> None:
    network = scene(ONE, [0.3], [0.05], 20.5, parameters={"theta_b": 0.1, "u": 0.0, "omega": 1.0})
    back = scene(ONE, [-0.3], [-0.05], 20.5, parameters={"theta_b": -0.1, "u": 0.0, "omega": 1.0})
    np.testing.assert_array_equal(ends(back), -ends(network))


def test_huge_amplitude() -> None:
    """The amplitude falls by 2 F_k/k each half cycle also where it is a million times that."""
    network = scene(ONE, [1e6], [0.0], 10.0 * math.pi + 1e-3, time_unit="time", friction="coulomb", rtol=1e-11, atol=1e-5,
                 parameters={"theta_b": 0.0, "epsilon": 1.0, "mu": 0.5, "u": 0.0})  # fmt: skip
    x, v, _ = ends(network)
    assert math.hypot(x - 0.5, v) == pytest.approx(1e6 - 10.0 - 0.5, abs=1e-3)


def test_no_friction() -> None:
    """With mu = 0 nothing ever sticks for a time: the oscillator is harmonic."""
    network = scene(ONE, [0.3], [0.0], 37.0, time_unit="time", friction="coulomb", rtol=1e-12,
                 parameters={"theta_b": 0.1, "epsilon": 1.0, "mu": 0.0, "u": 0.0})  # fmt: skip
    np.testing.assert_allclose(ends(network)[:2], [0.3 * math.cos(37.0), -0.3 * math.sin(37.0)], rtol=0, atol=1e-10)


def test_a_guard_that_fires_without_end_ends_with_its_status() -> None:
    x, a = sp.symbols("x a")
    clock = sc.Field({x: 1}, parameters={a: 0}, events=[sc.Reset(x - 1, {x: a})])
    network = sc.Scene(clock, topology=sc.graphs.chain(1), transient=0, window=3, time_unit="time", initial={"x": 0.5})
    result = run(network, show_progress=False, a=[2.0, 0.0])
    assert list(result.status.values) == [Status.CHATTERING, Status.FINISHED]


# -- a second integrator ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4])
def test_against_taylor_series_in_thirty_digits(seed: int) -> None:
    dice = np.random.default_rng([2, seed])
    graph = [ONE, topology("chain", 2), THREE][seed % 3]
    n = graph.n
    values = {
        "theta_b": dice.uniform(-0.1, 0.4), "epsilon": dice.uniform(0.5, 2.0), "u": dice.uniform(0.05, 0.6),
        "omega": dice.uniform(1.25, 2.0), "mu_s": 0.3, "mu_k": dice.uniform(0.1, 0.3), "a": dice.uniform(0.5, 4.0),
    }  # fmt: skip
    values = {name: float(value) for name, value in values.items()}
    coupled = {"sigma": float(dice.uniform(0.05, 1.0))} if n > 1 else {}
    x, v = dice.uniform(-0.5, 0.5, n).tolist(), dice.uniform(-0.5, 0.5, n).tolist()
    result = ran(scene(graph, x, v, 20, parameters={**values, **coupled}, rtol=1e-12))
    with mp.workdps(30):
        pairs = sorted({(min(a, b), max(a, b)) for a, b, _ in graph.links})
        reference = Reference({"sigma": 0.0, **values, **coupled}, pairs, x, v)
        reference.advance(mpf(float(result.data.end_time)))
        expected = [float(q) for q in (*reference.x, *reference.v, *reference.slip)]
    assert len(reference.events) > 30
    np.testing.assert_allclose(result.states("end"), expected, rtol=0, atol=1e-9)

"""Lyapunov spectra by lifted networks: above eight oscillators, with mass matrices, of several kinds of oscillators."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from pendula import ByHand, pendulum

import synchain as sc
from synchain.runtime.stability.lifted_integrator import LiftedIntegrator
from synchain.runtime.stability.motion import rates_of
from synchain.runtime.stability.tangent_frame import TangentFrame

B, KAPPA = sp.symbols("b kap")


def stuart_landau(n: int) -> sc.Scene:
    """A ring of Stuart-Landau oscillators in phase."""
    node = sc.Field({"x": "x - y - (x**2 + y**2)*(x - y/2)", "y": "y + x - (x**2 + y**2)*(y + x/2)"})
    i, j, W = sc.ends(node)
    turned = {i.x: KAPPA * W * (j.x - i.x - B * (j.y - i.y)), i.y: KAPPA * W * (j.y - i.y + B * (j.x - i.x))}
    return sc.Scene(node, sc.Rates(turned, {"kap": 0.3, "b": -1.0}), sc.graphs.ring(n), initial={"x": 1.0, "y": 0.0})


def of_modes(n: int) -> np.ndarray:
    """Exponents of the synchronous motion: real parts of eigenvalues of 2 x 2 blocks in the turning frame."""
    strengths = 0.3 * (2.0 - 2.0 * np.cos(2.0 * np.pi * np.arange(n) / n))
    blocks = [np.array([[-2.0 - k, -k], [-1.0 + k, -k]]) for k in strengths]
    return np.sort(np.concatenate([np.linalg.eigvals(block).real for block in blocks]))[::-1]


@pytest.fixture(scope="module")
def ring() -> sc.results.Lyapunov:
    return sc.lyapunov_spectrum(stuart_landau(16), transient=20, periods=30, rtol=1e-8)


def test_the_ring_of_sixteen_has_the_exponents_of_its_modes(ring: sc.results.Lyapunov) -> None:
    """The second one by 30 digits: -0.0241115514; the sum is the divergence, 16 (2 - 4 - 1.2)."""
    exact = of_modes(16)
    assert exact[1] == pytest.approx(-0.0241115514, abs=1e-10)
    assert ring.resolved.all()
    np.testing.assert_allclose(ring.exponent[:16], exact[:16], atol=1e-7)
    np.testing.assert_allclose(ring.exponent, exact, atol=0.05)  # close exponents separate slowly
    assert ring.exponent.sum() == pytest.approx(-51.2, abs=1e-7)
    assert ring.divergence == pytest.approx(-51.2, abs=1e-7)


def test_the_largest_exponents_alone(ring: sc.results.Lyapunov) -> None:
    few = sc.lyapunov_spectrum(stuart_landau(16), count=3, transient=40, periods=30, rtol=1e-8)
    np.testing.assert_allclose(few.exponent, ring.exponent[:3], atol=1e-6)
    assert np.isnan(few.divergence)
    assert np.isnan(few.divergence_error)
    assert "divergence" in dict(ring.summary)
    assert "divergence" not in dict(few.summary)


@pytest.mark.parametrize(
    "scene", [sc.Scene("lorenz", "x->x", sc.graphs.chain(2)), sc.Scene("duffing", None)], ids=["lorenz", "duffing"]
)
@pytest.mark.parametrize("parts", [1, 8])
def test_both_kernels_agree(scene: sc.Scene, parts: int) -> None:
    """The growth of random directions over some blocks: of the lifted network, and of the kernel of modes."""
    scene, found = scene.replace(rtol=1e-10, atol=1e-11), []
    basis = np.linalg.qr(np.random.default_rng(3).normal(size=(len(scene.y0), 2)))[0]
    for make in (TangentFrame._of_modes, TangentFrame._of_lift):
        frame = make(scene, scene.equations, basis)
        frame.turns, frame.parts = frame.turns._replace(time=1.7), parts
        if isinstance(frame.integrator, LiftedIntegrator):
            frame.integrator.units[:] = 1.0
        found.append(frame.advance(np.full(3, parts))[0][:, :2])
    np.testing.assert_allclose(*found, atol=1e-6)


@pytest.mark.long
def test_a_pendulum_at_rest_has_the_eigenvalues_of_its_mass_matrix() -> None:
    """The matrix of the rates by central differences of equations written by hand."""
    hand = ByHand(4, 1.0, 0.3)
    steps = 1e-5 * np.eye(8)
    matrix = np.array([hand.rates(0.0, h) - hand.rates(0.0, -h) for h in steps]).T / 2e-5
    scene = sc.Scene(pendulum(4), None, initial={"q1": 0.01}, parameters={"delta": 0.3})
    result = sc.lyapunov_spectrum(scene, transient=60, periods=60)
    np.testing.assert_allclose(result.exponent, np.sort(np.linalg.eigvals(matrix).real)[::-1], atol=2e-3)
    assert result.exponent.sum() == pytest.approx(np.trace(matrix), abs=1e-5)


@pytest.mark.long
def test_exponents_of_a_conservative_pendulum_come_in_pairs() -> None:
    """Two pendula of four links, whose masses depend on the angles: 16 exponents in pairs, and chaos."""
    scene = sc.Scene(
        pendulum(4), "spring on q1", sc.graphs.chain(2), initial={"q1": [1.0, 0.5], "q4": [2.0, -1.0]},
        parameters={"delta": 0.0, "sigma": 0.5},
    )  # fmt: skip
    result = sc.lyapunov_spectrum(scene, transient=10, periods=100, rtol=1e-8)
    assert result.exponent[0] > 0.1
    np.testing.assert_allclose(result.exponent + result.exponent[::-1], 0.0, atol=0.02)


@pytest.mark.long
def test_two_kinds_of_oscillators_in_two_layers() -> None:
    """Linear equations: the exponents are the real parts of the eigenvalues."""
    fast = {"oscillator": sc.Field({"x": "-3*x"}, initial={"x": 1.0}), "at": [1]}
    slow = {"oscillator": sc.Field({"x": "w", "w": "-x - w/5"}, initial={"x": 1.0}), "at": [2, 3]}
    scene = sc.Scene(nodes=[fast, slow], coupling="x->x", topology=sc.graphs.chain(3), parameters={"sigma": 0.5})
    result = sc.lyapunov_spectrum(scene, transient=40, periods=60)
    matrix = np.array(
        [
            [-3.5, 0.5, 0.0, 0.0, 0.0],
            [0.5, -1.0, 0.5, 1.0, 0.0],
            [0.0, 0.5, -0.5, 0.0, 1.0],
            [0.0, -1.0, 0.0, -0.2, 0.0],
            [0.0, 0.0, -1.0, 0.0, -0.2],
        ]
    )
    np.testing.assert_allclose(result.exponent, np.sort(np.linalg.eigvals(matrix).real)[::-1], atol=2e-3)
    assert result.exponent.sum() == pytest.approx(np.trace(matrix), abs=1e-6)


@pytest.mark.long
def test_nine_friction_oscillators_take_a_stiff_method() -> None:
    """The start slips, so that only the layer of the smoothed jump is stiff; the kernel of modes takes the same method."""
    scene = sc.Scene(topology=sc.graphs.chain(9), parameters={"omega": 1.15, "sigma": 0.1})
    frame = TangentFrame.make(scene, 2, 0)
    assert isinstance(frame.integrator, LiftedIntegrator)
    assert frame.integrator.kernel.origin.method.implicit
    _, least, lost = frame.advance(np.array([3]))
    assert frame.integrator.steps < 10_000
    assert least.min() > 0.1
    assert not lost.any()


def of_kinds() -> sc.Scene:
    fast = {"oscillator": sc.Field({"x": "-3*x*cos(x)"}), "at": [1]}
    slow = {"oscillator": sc.Field({"x": "w", "w": "-x - w/5"}), "at": [2, 3]}
    return sc.Scene(nodes=[fast, slow], coupling="x->x", topology=sc.graphs.chain(3), parameters={"sigma": 0.5})


def of_link_numbers() -> sc.Scene:
    phase, link = sc.Field({"th": "om"}, parameters={"om": 0.0}), sc.Rates({"th": "K*W*sin(th_j - th_i)"}, {"K": 2})
    numbers = {"om": [0.1, 0.2, 0.3], "K": [1.0, 2.0, 3.0, 4.0]}
    return sc.Scene(phase, link, sc.graphs.chain(3), parameters=numbers)


@pytest.mark.parametrize("make", [of_kinds, of_link_numbers, lambda: stuart_landau(5)])
def test_rates_by_templates_are_those_of_the_network(make: Callable[[], sc.Scene]) -> None:
    scene = make()
    equations = scene.equations
    state = np.random.default_rng(5).normal(size=len(scene.y0))
    known = dict(zip(equations.state, state, strict=True)) | dict(scene.parameters)
    exact = [e.xreplace({s: sp.Float(known[s.name]) for s in e.free_symbols}) for e in equations.rhs()]
    rates = rates_of(equations, dict(scene.parameters))
    np.testing.assert_allclose(rates.values(state), np.array(exact, dtype=float), rtol=1e-13)
    assert np.all(rates.sizes(state) >= np.abs(rates.values(state)) * (1 - 1e-13))


def test_rates_of_a_mass_matrix_are_those_by_hand() -> None:
    state = np.random.default_rng(6).normal(size=8)
    rates = rates_of(sc.Scene(pendulum(4), None).equations, {"gravity": 1.0, "delta": 0.3})
    np.testing.assert_allclose(rates.values(state), ByHand(4, 1.0, 0.3).rates(0.0, state), rtol=1e-11)


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="found 33 oscillators or clusters; expected at most 32"):
        sc.lyapunov_spectrum(sc.Scene(topology=sc.graphs.chain(33), contact="set-valued"))
    with pytest.raises(ValueError, match="count = 33; expected 1 … 32"):
        sc.lyapunov_spectrum(stuart_landau(16), count=33)
    node = sc.Field({"x": "v", "v": "-x**3 + v/2"}, initial={"x": 1.0})
    with pytest.raises(FloatingPointError, match="the state grew without bound"):
        sc.lyapunov_spectrum(sc.Scene(node, "x->v", sc.graphs.ring(9)), count=2)

"""Deviations of nearly equal nodes: closed forms of linear networks, runs of others, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Field, Rates, Scene, exponents
from synchain.graphs import from_matrix, topology
from synchain.runtime.synchronisation.mismatch import mismatch

pytestmark = pytest.mark.long

RING = topology("ring", 6)
OMEGA = 1.3
DRIVEN = Field(
    {"x": "v", "v": "-k*x - c*v + f*cos(omega*t)"}, parameters={"k": 1.0, "c": 0.3, "f": 1.0, "omega": OMEGA}
)


def test_a_driven_linear_network_has_its_closed_form() -> None:
    """Amplitudes of the whole network at the frequency of the drive, linearised in two parameters by NumPy."""
    k, c = 1.0 + 1e-5 * np.array([3.0, -1, 2, 0, 1, -2]), 0.3 + 1e-5 * np.array([1.0, 2, -3, 1, 0, 0])
    scene = Scene(
        DRIVEN, "x->v", RING, parameters={"k": k.tolist(), "c": c.tolist(), "sigma": 0.4},
        transient=60, window=20, rtol=1e-10,
    )  # fmt: skip
    found = mismatch(scene)
    g, one = np.array(RING.rows, dtype=float), np.eye(6)
    mean_amplitude = 1.0 / (k.mean() - OMEGA**2 + 1j * OMEGA * c.mean())
    response = np.linalg.inv((k.mean() - OMEGA**2 + 1j * OMEGA * c.mean()) * one - 0.4 * g)
    x = response @ (-(k - k.mean() + 1j * OMEGA * (c - c.mean())) * mean_amplitude)
    expected = np.sqrt([np.mean(np.abs(x) ** 2) / 2, np.mean(np.abs(OMEGA * x) ** 2) / 2])
    np.testing.assert_allclose(found.deviation, expected, rtol=1e-6)
    np.testing.assert_allclose(found.simulated(), found.deviation, rtol=1e-4)


def test_modes_have_the_exponents_of_the_master_stability_function() -> None:
    """One mode for each eigenvalue that the mismatch of a single parameter excites."""
    scene = Scene(DRIVEN, "x->v", RING, parameters={"k": [1.1, 1, 1, 0.9, 1, 1], "sigma": 0.4})
    found = mismatch(scene)
    np.testing.assert_allclose(found.gamma, [-1.0, -4.0])  # antisymmetric about the centre: no mode -3
    np.testing.assert_allclose((found.size**2).sum(), 0.02)
    alone = scene.replace(parameters={"k": 1.0, "sigma": 0.4})
    np.testing.assert_allclose(found.exponent, exponents(alone, [0.4, 1.6], starts=1).exponent, atol=1e-9)


def test_the_error_of_the_prediction_shrinks_with_the_mismatch() -> None:
    """A relaxation oscillator with unequal damping: relative error of first order in the mismatch."""
    errors = []
    for size in (0.08, 0.02):
        mu = (1.0 + size * np.array([1.0, -0.5, 0.2, -0.3, 0.8, -1.2])).tolist()
        scene = Scene(
            "van_der_pol", "damper", RING, parameters={"mu": mu, "sigma": 0.5}, initial={"x": 1.0, "v": 0.0},
            transient=300, window=600, time_unit="time",
        )  # fmt: skip
        found = mismatch(scene)
        errors.append(np.abs(found.simulated() / found.deviation - 1.0).max())
    assert errors[0] < 0.1
    assert errors[1] < errors[0] / 2


def test_links_that_act_between_equal_states_move_the_mean_motion() -> None:
    """x' = -a x + 1 + K sum of x_j: equilibrium with the sum of weights, deviations by the eigenvalues of W."""
    node, a = Field({"x": "1 - a*x"}, parameters={"a": 2.0}), 2.0 + 1e-4 * np.array([1.0, -2, 0, 1, 0, 0])
    scene = Scene(
        node, Rates({"x": "K*W*x_j"}, {"K": 0.3}), RING, parameters={"a": a.tolist()}, initial={"x": 0.7},
        transient=100, window=10, rtol=1e-11,
    )  # fmt: skip
    w = np.array(RING.rows, dtype=float) + 2 * np.eye(6)
    s = 1.0 / (a.mean() - 0.6)
    x = np.linalg.solve(a.mean() * np.eye(6) - 0.3 * w, -(a - a.mean()) * s)
    np.testing.assert_allclose(mismatch(scene).deviation, [np.sqrt(np.mean(x**2))], rtol=1e-8)


def test_an_unstable_mode_has_no_bound() -> None:
    scene = Scene(
        "rossler", "x->x", topology("chain", 2), parameters={"a": [0.2, 0.201], "sigma": 0.02}, transient=100,
        window=50,
    )  # fmt: skip
    assert np.all(np.isinf(mismatch(scene).deviation))


@pytest.mark.filterwarnings("ignore:topology|coupling")
def test_what_is_refused() -> None:
    def scene(graph=RING, coupling="x->v", **parameters) -> Scene:
        return Scene(DRIVEN, coupling, graph, parameters=parameters or {"k": [1, 1, 1, 1, 1, 2]})

    for wrong, message in (
        (scene(k=1.0), "found no parameters that differ from node to node"),
        (scene(from_matrix([[-1, 1], [2, -2]]), k=[1, 2]), "expected a connected undirected graph"),
        (scene(from_matrix([[-1, 1, 0, 0], [1, -1, 0, 0], [0, 0, -1, 1], [0, 0, 1, -1]]), k=[1, 2, 1, 2]), "2 parts"),
        (scene(coupling=Rates({"v": "q*k_i*W*x_j"}, {"q": 0.1})), "a link between equal states contains k"),
        (
            scene(coupling=Rates({"v": "q*W*(x_j - x_i)"}, {"q": 0.1}), k=[1, 2] * 3, q=[0.1, 0.2] * 3),
            "found links that differ in q",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            mismatch(wrong)

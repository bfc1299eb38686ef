"""The errors of exponents hold what the steps are wrong by, whatever the tolerance."""

from __future__ import annotations

import numpy as np
import pytest

import synchain as sc
from synchain.runtime.stability.averages import error_of_steps
from synchain.runtime.stability.variational_integrator import VariationalIntegrator

SCENES = {
    "periodic": (sc.Scene("duffing"), {}),
    "smoothed": (sc.Scene("friction"), {"omega": 1.4, "kappa": 50.0}),
    "drive of another frequency": (sc.Scene("van_der_pol"), {"u": 0.1, "omega": 1.9}),
}
ALPHA = [0.0, 0.1, 0.3]


@pytest.mark.parametrize("what", ["periodic", "smoothed", "drive of another frequency"])
def test_a_loose_tolerance_is_in_the_error(what: str) -> None:
    scene, values = SCENES[what]
    options = {"periods": 3000, "precision": 0.0, "starts": 1, "parameters": values}
    exact = sc.exponents(scene, ALPHA, rtol=1e-11, **options)
    for rtol in (1e-2, 1e-4):
        result = sc.exponents(scene, ALPHA, rtol=rtol, **options)
        apart = np.abs(result.exponent - exact.exponent)
        assert np.all(apart <= 2.0 * result.stderr), rtol
        assert np.all(result.stderr <= 1e-3 + 30.0 * rtol), rtol


def test_a_whole_spectrum_knows_the_error_of_its_steps() -> None:
    """All exponents of an oscillator without damping are zero."""
    scene = sc.Scene("harmonic", topology=sc.graphs.chain(2), integrator="taylor")
    result = sc.lyapunov_spectrum(scene, rtol=1e-5, periods=50, precision=0.0)
    assert np.abs(result.exponent).max() > 1e-9
    assert np.all(np.abs(result.exponent) <= 2.0 * result.stderr)


def test_cluster_exponents_know_the_error_of_their_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = sc.Scene("harmonic", topology=sc.graphs.chain(3), parameters={"sigma": 0.1})
    options = {"periods": 64, "transient": 0, "precision": 0.0}
    collected, errors = [], []
    measured = VariationalIntegrator.error_of_steps

    def error_of_steps(self: VariationalIntegrator, length: float) -> np.ndarray:
        errors.append(measured(self, length))
        return errors[-1] + len(errors)

    monkeypatch.setattr(VariationalIntegrator, "error_of_steps", error_of_steps)
    for rtol in (1e-9, 1e-3):
        collected.append(sc.cluster_exponents(scene, (0, 1, 0), rtol=rtol, **options))
    assert np.all(errors[1] > 100.0 * errors[0])
    assert np.all(collected[0].stderr > 1.0)
    assert np.all(collected[1].stderr > 2.0)


def test_the_error_is_that_of_the_mean_change() -> None:
    """Changes 1 and 3 over blocks of length 2: mean 2, whose standard error is 1/sqrt(2)."""
    error = error_of_steps([np.array([0.0, -np.inf])] * 2, [np.array([1.0, 0.0]), np.array([3.0, 0.0])], 2.0)
    np.testing.assert_allclose(error, [np.sqrt(4.0 + 0.5) / 2.0, 0.0])

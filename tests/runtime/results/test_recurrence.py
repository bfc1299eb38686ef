"""Chains with published or exact motions: normal modes of the linear chain, and the recurrence of Fermi, Pasta and Ulam."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from benchmarks.energy import CASES
from synchain import Scene, load_scene, run
from synchain.runtime.results.energy_of_states import energy_function


def test_the_linear_chain_moves_in_its_normal_modes() -> None:
    """Frequencies sqrt(1 - sigma gamma_k), gamma_k of the exact spectrum: after 20 periods, at the tolerance of the run."""
    scene = CASES[1].scene.replace(integrator="taylor", rtol=1e-11, window=40 * np.pi)
    result = run(scene, workers=1, show_progress=False, reduce=False)
    gamma, modes = np.linalg.eigh(np.array(scene.topology.matrix.tolist(), dtype=float))
    exact = sorted(float(e.exact) for e in scene.spectrum.eigenvalues)
    assert np.allclose(gamma, exact, rtol=0, atol=1e-14)
    frequency, t = np.sqrt(1 - scene.parameters["sigma"] * gamma), result.time.values[:, None]
    share = np.array(scene.y0[:4]) @ modes
    x, v = (share * np.cos(frequency * t)) @ modes.T, (-share * frequency * np.sin(frequency * t)) @ modes.T
    assert np.abs(result.states("trajectory") - np.hstack([x, v])).max() < 2e-8


K = np.arange(1, 32)
FREQUENCY = 2 * np.sin(np.pi * K / 64)


def first_mode(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Energy of mode 1 over that at the start, of the displacements and velocities (samples, 31) between the walls."""
    sine = np.sqrt(2 / 32) * np.sin(np.pi * K / 32)
    energy = (v @ sine) ** 2 + (FREQUENCY[0] * (x @ sine)) ** 2
    return energy / energy[0]


def recurrence(t: np.ndarray, share: np.ndarray) -> tuple[float, float]:
    """Time, in periods of mode 1, and height of the largest return of its energy after 100 periods."""
    periods = t * FREQUENCY[0] / (2 * np.pi)
    assert share[periods < 100].min() < 0.1, "nearly all of the energy has left mode 1"
    best = np.argmax(np.where(periods > 100, share, 0.0))
    return float(periods[best]), float(share[best])


def leapfrog(scene: Scene, step: float, count: int, every: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and states by the method of the report of 1955, on the derived right-hand side."""
    equations, n = scene.equations, scene.n
    symbols = sp.symbols((*equations.state[:n], *equations.parameters), real=True)
    force = sp.lambdify([symbols], equations.rhs()[n:], cse=True)
    values = [scene.parameters[name] for name in equations.parameters]
    x, v = np.array(scene.y0[:n]), np.array(scene.y0[n:])
    states, pull = [np.concatenate([x, v])], np.array(force([*x, *values]))
    for k in range(count):
        v = v + step / 2 * pull
        x = x + step * v
        pull = np.array(force([*x, *values]))
        v = v + step / 2 * pull
        if (k + 1) % every == 0:
            states.append(np.concatenate([x, v]))
    return step * every * np.arange(len(states)), np.array(states)


@pytest.mark.long
def test_the_energy_of_the_fput_chain_returns_to_its_first_mode() -> None:
    """alpha = 1/4, 32 springs.  Published: after 157 periods of mode 1, 29 000 steps of length 1/sqrt(8) in 1955.

    Ford, Phys. Rep. 213, 271 (1992).  That is the answer of these steps; without their error it is 146.5 periods, where the
    leapfrog method leads as well when its step goes to 0 (error of second order in the step).
    """
    scene = load_scene("fput_recurrence")
    result = run(scene, workers=1, show_progress=False)
    assert result.success
    states, t = result.states("trajectory")[:-1], result.time.values[:-1]
    assert np.abs(states[:, [0, 32, 64, 96]]).max() < 1e-10, "the walls rest"
    energies = energy_function(scene)(states)
    assert np.abs(energies / energies[0] - 1).max() < 1e-8
    ours, height = recurrence(t, first_mode(states[:, 1:32], states[:, 65:96]))
    published, _ = recurrence(*_shares(leapfrog(scene, 8**-0.5, 29_700, 10)))
    finer, _ = recurrence(*_shares(leapfrog(scene, 32**-0.5, 59_400, 20)))
    assert height > 0.98
    assert published == pytest.approx(157, abs=0.5)
    assert ours == pytest.approx(146.5, abs=0.3)
    assert ours == pytest.approx((4 * finer - published) / 3, abs=0.3), "both at step 0"


def _shares(run_of: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    t, states = run_of
    return t, first_mode(states[:, 1:32], states[:, 65:96])

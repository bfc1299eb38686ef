"""Values that a reader meets in the first minutes print as one short line."""

from __future__ import annotations

import numpy as np

from synchain import Scene, kernel
from synchain.graphs import chain, ring
from synchain.results import PeriodicOrbit
from synchain.runtime.bifurcation.kinds import BifurcationKind
from synchain.runtime.bifurcation.results import Bifurcation
from synchain.runtime.prediction.synchronisability import verdict, windows


def test_parts_of_a_scene_show_their_parameters() -> None:
    scene = Scene("duffing", "spring", chain(2))
    assert repr(scene.oscillator) == "Oscillator('duffing', states x, v; delta = 0.1, beta = 1, u = 0.3, omega = 1)"
    assert repr(scene.coupling) == "LagrangianCoupling('spring'; sigma = 0)"
    assert repr(Scene().friction) == "FrictionLaw('exponential'; mu_s = 0.3, mu_k = 0.15, a = 2.5)"


def test_windows_and_eigenvalues_show_what_they_are() -> None:
    graph = ring(4)
    assert repr(graph.spectrum.eigenvalues[1]) == "Eigenvalue(-2, multiplicity 2)"
    (window,) = windows(((0.1, 0.5),), chain(2))
    assert repr(window) == f"Window(sigma {window.text()})"
    assert repr(window.low_mode) == "NetworkMode(1, gamma = -2)"
    assert repr(verdict(((0.1, 0.5),), chain(2))).startswith("Verdict(yes")


def test_kernels_and_bifurcations_hide_their_insides() -> None:
    scene = Scene("duffing", "spring", chain(2), integrator="dop853")
    assert repr(kernel(scene)).startswith("Kernel(2 nodes, dop853, driver of sweeps, ")
    orbit = PeriodicOrbit(scene, 1, np.zeros(2), np.zeros(2), 0.0, 1)
    found = Bifurcation(1.2256, BifurcationKind.PERIOD_DOUBLING, 1e-9, orbit)
    assert found.text == "period doubling at 1.2256"

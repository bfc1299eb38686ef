"""Orbits are those of one oscillator: a lone one keeps its start, and a network is not taken for its node without a word."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import sympy as sp

import synchain as sc

WELL = sc.Field({"x": "v", "v": "x - x**3 - (3/10 + x/5)*v + cos(t)/1000"})
PAIR_OF_WELLS = sc.Scene(WELL, "x->v", sc.graphs.chain(2), initial={"x": -1, "v": 0})


def lagrangian() -> sc.Lagrangian:
    t = sp.Symbol("t")
    x = sp.Function("x")(t)
    v = x.diff(t)
    return sc.Lagrangian(
        T=v**2 / 2, V=-(x**2) / 2 + x**4 / 4, Q={x: -(sp.Rational(3, 10) + x / 5) * v + sp.cos(t) / 1000}
    )


@pytest.mark.parametrize("start", [-1, [-1]])
@pytest.mark.parametrize("oscillator", [lagrangian(), WELL])
def test_a_lone_oscillator_keeps_its_start(oscillator: sc.Lagrangian | sc.Field, start: object) -> None:
    lone = sc.Scene(oscillator, initial={"x": start, "v": 0})
    assert sc.periodic_orbit(lone).state[0] == pytest.approx(-0.9990, abs=1e-4)
    damping = 0.3 - 0.2  # at x = -1
    options = {"starts": 1, "periods": 60, "transient": 40}
    assert sc.exponents(lone, [0.0], **options).exponent[0] == pytest.approx(-damping / 2, abs=1e-4)
    assert sc.msf(lone, [0.0, 0.1], **options).exponent[0] == pytest.approx(-damping / 2, abs=1e-4)


def test_a_network_is_not_called_stable_for_its_node() -> None:
    orbit = sc.periodic_orbit(PAIR_OF_WELLS)
    assert "of one oscillator" in dict(orbit.summary)["orbit"]
    assert dict(orbit.summary)["multipliers"].endswith(": stable for one oscillator")


def test_different_starts_of_nodes_are_warned_of() -> None:
    apart = PAIR_OF_WELLS.replace(initial={"x": [-1, 1], "v": 0})
    with pytest.warns(RuntimeWarning, match="periodic_orbit: found different initial x of 2 nodes; .*one oscillator"):
        taken = sc.periodic_orbit(apart).state
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(sc.periodic_orbit(PAIR_OF_WELLS).state, taken)
        sc.periodic_orbit(apart, 1, [-1.0, 0.0])  # a start of one oscillator
        sc.periodic_orbit(PAIR_OF_WELLS.replace(initial=None))

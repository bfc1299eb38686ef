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
    assert dict(orbit.summary)["verdict"].startswith("synchronous; along itself stable; across it ")
    assert sc.periodic_orbit(PAIR_OF_WELLS.lone).verdict == "one oscillator: stable"


def test_nodes_with_different_starts_are_followed_as_they_move() -> None:
    """Each stays in its well: the whole network is one orbit."""
    apart = PAIR_OF_WELLS.replace(initial={"x": [-1, 1], "v": 0}, sigma=0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        orbit = sc.periodic_orbit(apart)
    assert orbit.classes == (0, 1)
    assert np.sign(orbit.state[:2]).tolist() == [-1.0, 1.0]
    assert len(orbit.multipliers) == 4

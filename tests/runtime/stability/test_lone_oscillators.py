"""What a lone oscillator that its coupling cannot join has: its own exponents and orbits, and no transversal modes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import synchain as sc

LONE = sc.Scene("fitzhugh_nagumo")
PAIR = sc.Scene("fitzhugh_nagumo", "x->x", sc.graphs.chain(2), initial={"x": 0.3})


def test_strength_zero_needs_no_link() -> None:
    result = sc.exponents(LONE, [0.0])
    assert result.attractors[0].kind == "periodic"
    np.testing.assert_allclose(result.exponent, sc.exponents(PAIR, [0.0]).exponent, atol=1e-7)


def test_a_periodic_orbit_needs_no_link() -> None:
    alone, among = sc.periodic_orbit(LONE), sc.periodic_orbit(PAIR)
    assert alone.scene.n == 1
    assert alone.period == pytest.approx(among.period, rel=1e-12)
    np.testing.assert_allclose(alone.multipliers, among.multipliers, atol=1e-12)
    np.testing.assert_allclose(alone.transversal_multipliers(0.0), among.multipliers, atol=1e-12)


@pytest.mark.parametrize(
    "asked",
    [
        lambda: sc.exponents(LONE, [0.0, 0.1]),
        lambda: sc.msf(LONE, [0.0, 0.1]),
        lambda: sc.periodic_orbit(LONE).transversal_multipliers(0.1),
    ],
)
def test_other_strengths_say_which_link_is_missing(asked: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"need a link to a partner: .*'x->x'; strength 0 needs none"):
        asked()

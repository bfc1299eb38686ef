"""Accelerations of textbook Lagrangians against `sympy.physics.mechanics.LagrangesMethod`, at random points."""

from __future__ import annotations

import pytest
from lagrangians import SYSTEMS, difference

QUICK = (
    "bead on a rotating hoop", "cart and pole", "double pendulum", "elastic pendulum", "Foucault's pendulum",
    "heavy symmetric top", "pendulum of a driven support", "spherical pendulum",
)  # fmt: skip


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in QUICK else pytest.mark.long) for n in SYSTEMS])
def test_accelerations_of_a_textbook_system(name: str) -> None:
    assert difference(name) < 1e-10

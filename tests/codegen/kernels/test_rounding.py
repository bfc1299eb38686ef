"""The size of the terms of an expression bounds its rounding."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp

from synchain.codegen.kernels.rounding import magnitude
from synchain.models.dynamics.observable import NodeMaximum, NodeMean, NodeMinimum

a, b, c = sp.symbols("a b c", real=True)
CANCELLING = [
    10 * a - 10 * b, a**2 + c**2 - b**2 - c**2, sp.exp(a) * sp.exp(-b) - 1, sp.sin(a) ** 2 + sp.cos(a) ** 2 - 1,
    sp.sqrt(((a - c) ** 2 + (b - c) ** 2) / 2), sp.sin(a - b), sp.tanh(a * c) - sp.tanh(b * c), sp.atan2(a, c) - sp.atan2(b, c),
    sp.log(a / b), sp.Abs(a - b) - sp.Max(a - b, b - a), sp.cosh(a) ** 2 - sp.sinh(a) ** 2 - 1, (a - b) / c, 1 / a - 1 / b,
]  # fmt: skip


@pytest.mark.parametrize("e", CANCELLING, ids=str)
def test_rounding_is_a_small_part_of_the_size(e: sp.Expr) -> None:
    value, exact = (sp.lambdify((a, b, c), e, module) for module in ("math", "mpmath"))
    size = sp.lambdify((a, b, c), magnitude(e), "math")
    rng, worst = np.random.default_rng(1), 0.0
    with mpmath.workdps(40):
        for _ in range(300):
            x, z = map(float, rng.uniform(0.1, 3.0, 2))
            y = x * (1.0 + float(rng.integers(-3, 4)) * 2.0**-52)
            off = abs(mpmath.mpf(value(x, y, z)) - exact(*map(mpmath.mpf, (x, y, z))))
            worst = max(worst, float(off) / size(x, y, z))
    assert worst < 8 * 2.0**-53


def test_sizes_of_single_terms_are_their_own() -> None:
    for e in (a, a * b, -3 * a, a**2, sp.sign(a), sp.Abs(a * b)):
        assert sp.simplify(magnitude(e) - sp.Abs(e)) == 0


def test_sizes_go_through_reductions() -> None:
    assert magnitude(NodeMean(a - b)) == NodeMean(sp.Abs(a) + sp.Abs(b))
    assert magnitude(NodeMinimum(a - 1)) == NodeMaximum(sp.Abs(a) + 1)
    assert magnitude(sp.Min(a, b) - sp.pi) == sp.Max(sp.Abs(a), sp.Abs(b)) + sp.pi
    assert float(magnitude(sp.log(a)).xreplace({a: sp.Float(1e10)})) == pytest.approx(math.log(1e10) + 1)

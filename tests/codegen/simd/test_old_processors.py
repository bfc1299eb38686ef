"""Processors without fused multiply-add: no function of the C library, and nearly the accuracy of the others."""

from __future__ import annotations

import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from test_elementary import at, error, spread

from synchain.codegen.simd import lanes
from synchain.codegen.simd.lanes import fma, load, store

WITHIN = {"exp": (-700.0, 700.0), "expm1": (-1.0, 1.0), "log": (1e-3, 1e3), "atan": (-4.0, 4.0), "sin": (-1e5, 1e5),
          "cos": (-7.0, 7.0), "tanh": (-3.0, 3.0)}  # fmt: skip


def test_sums_and_products_call_no_function(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lanes, "has_fma", lambda: False)

    @njit(error_model="numpy")
    def computed(a: np.ndarray, out: np.ndarray) -> None:
        for i in range(a.size // 12):
            x, y, z = load(a, 3 * i, 4), load(a, 3 * i + 1, 4), load(a, 3 * i + 2, 4)
            store(out, 3 * i, x * y + z)
            store(out, 3 * i + 1, fma(x, y, z))
            store(out, 3 * i + 2, fma(x, y, -(x * y)))

    a = np.random.default_rng(3).normal(size=1200)
    out = np.zeros_like(a)
    computed(a, out)
    assert "fma" not in computed.inspect_llvm(computed.signatures[0])
    (x, y, z), (plain, fused, zeros) = a.reshape(-1, 3, 4).swapaxes(0, 1), out.reshape(-1, 3, 4).swapaxes(0, 1)
    np.testing.assert_array_equal(plain, x * y + z)
    exact = [Fraction(p) * Fraction(q) + Fraction(r) for p, q, r in zip(x.flat, y.flat, z.flat, strict=True)]
    assert (
        max(abs(Fraction(v) - e) / Fraction(np.spacing(abs(v))) for v, e in zip(fused.flat, exact, strict=True)) < 0.51
    )
    missed = [Fraction(p) * Fraction(q) - Fraction(p * q) for p, q in zip(x.flat, y.flat, strict=True)]
    assert [*map(Fraction, zeros.flat)] == missed
    large = np.array([1e300, 2.0, -1e300, 1e200, 1e200, 0.0] * 4).reshape(2, 4, 3).swapaxes(1, 2).reshape(-1).copy()
    out = np.zeros_like(large)
    computed(large, out)
    assert out[4:8].tolist() == [1e300, np.inf, 1e300, np.inf]


def measured() -> None:
    """Print the largest errors of elementary functions, in units of the last place."""
    for name, bounds in WITHIN.items():
        x = spread(*bounds)[:20_000]
        print(name, error(name, x), bool(np.isfinite(at(x)[name]).all()))


def test_elementary_functions_keep_their_accuracy() -> None:
    here = Path(__file__)
    program = f"import sys; sys.path.insert(0, {str(here.parent)!r}); import test_old_processors as t; t.measured()"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"NUMBA_CPU_NAME": "generic"}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    errors = {
        name: float(ratio) for name, ratio, finite in map(str.split, done.stdout.splitlines()) if finite == "True"
    }
    assert errors.keys() == WITHIN.keys()
    assert max(errors.values()) < 2.0, errors

"""The roofline's table is what its columns say."""

from __future__ import annotations

import pytest

from benchmarks import roofline
from synchain.codegen.simd import lanes


def test_table_of_one_oscillator():
    (row,) = roofline.measure(quick=True)
    n, width, flops, nanoseconds, rate, peak, share = row
    assert len(row) == len(roofline.COLUMNS)
    assert (n, width) == (1, lanes.native_width())
    assert rate == pytest.approx(flops * width / nanoseconds, rel=1.0)
    assert 0 < share < 1
    assert rate < peak

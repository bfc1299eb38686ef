"""The benchmark of streamed sweeps: its rows are what its columns say, and memory does not grow
with the sweep.
"""

from __future__ import annotations

import pytest

from benchmarks import scale


@pytest.mark.long
def test_rows_and_sizes(monkeypatch):
    asked = []
    monkeypatch.setattr(scale, "apart", lambda function, side: asked.append(side) or scale.row(4))
    rows = scale.measure(quick=True)
    assert asked == [10, 32]
    assert all(len(row) == len(scale.COLUMNS) for row in rows)
    cells, periods, threads, seconds, rate, steps, memory, size, each = rows[0]
    assert (cells, periods, threads) == (16, 120, 2)
    assert rate == pytest.approx(cells / seconds)
    assert size * 1e6 == pytest.approx(each * cells)
    assert steps > 1000
    assert memory != memory or memory > 10
    asked.clear()
    scale.measure_long()
    assert [side * side for side in asked][-1] == 1_000_000
    assert len(scale.draw(rows).axes) == 2

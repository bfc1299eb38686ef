"""The benchmark of basins: all starts synchronise, and both programs integrate the same starts."""

from __future__ import annotations

from benchmarks import basins


def test_all_starts_synchronise_in_both_programs() -> None:
    of_basin, of_run = basins.measure(quick=True)
    assert len(of_basin) == len(of_run) == len(basins.COLUMNS)
    assert of_basin[:4] == ("basin", 10, 3, 8)
    assert of_basin[4] == of_run[4] == 1.0
    assert 0.6 < float(str(of_basin[5])) < 1.0
    assert of_basin[6] == 0.0
    assert float(str(of_run[6])) < 0.05

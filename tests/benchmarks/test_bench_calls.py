"""The benchmark of calls: a row for each way, and errors that the tolerance allows."""

from __future__ import annotations

from benchmarks import calls


def test_each_way_finds_the_same_angles() -> None:
    rows = calls.measure(quick=True)
    assert [row[:2] for row in rows] == [
        ("run", 1),
        ("compiled run", 1),
        ("compiled run, and the derivative", 1),
        ("compiled run", 64),
        ("SciPy, DOP853", 1),
        ("SciPy, DOP853, difference quotient", 1),
    ]
    errors = [row[-1] for row in rows]
    assert max(errors[:5]) < 1e-6
    assert errors[0] == errors[1] == errors[3]
    assert 10 * errors[2] < errors[5]

"""The benchmark of Lyapunov spectra: exact sums and exponents, and the same average for each program."""

from __future__ import annotations

import numpy as np
import pytest

import benchmarks
from benchmarks import lyapunov


@pytest.mark.parametrize("case", lyapunov.CASES, ids=lambda case: case.name)
def test_the_sum_of_each_case_is_its_divergence(case: lyapunov.Case) -> None:
    growth, seconds = lyapunov.own(case, 1e-8, 4)
    assert growth.sum() / (4 * case.block) == pytest.approx(case.total, abs=1e-6)
    assert seconds > 0.0
    if case.exact is not None:
        assert case.exact.sum() == pytest.approx(case.total, abs=1e-12)
        np.testing.assert_allclose(np.sort(growth / (4 * case.block))[::-1], case.exact, atol=1e-6)


def test_the_table_names_each_case_and_program(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def stub(case: lyapunov.Case, rtol: float, blocks: int) -> tuple[np.ndarray, float]:
        calls.append((case.name, rtol, blocks))
        return np.full(case.count, case.total * blocks * case.block / case.count), 2.0

    module = benchmarks.load("lyapunov")
    monkeypatch.setattr(module, "own", stub)
    monkeypatch.setattr(module, "of_peer", stub)
    monkeypatch.setattr(module.peers, "present", lambda names: names)
    rows = module.measure(True)
    assert [row[:2] for row in rows] == [(c.name, p) for c in module.CASES for p in ("synchain", "JiTCODE dop853")]
    assert all(len(row) == len(module.COLUMNS) and row[7] < 1e-12 for row in rows)
    assert rows[0][5] == pytest.approx(2e6 / (200 * 0.5))
    assert len(module.measure(False)) == 3 * len(rows)
    assert calls[-1] == (module.CASES[-1].name, 1e-10, 200)

"""Both friction laws on the same axes: each is measured against its own solution, and the exact one
needs fewer steps.
"""

from __future__ import annotations

import numpy as np
import pytest

from synchain.runtime.bench import laws
from synchain.runtime.bench.kit.cases import read_case


@pytest.fixture(scope="module")
def rows() -> list[tuple[object, ...]]:
    return laws.measure(quick=True)


def test_rows_of_both_laws(rows: list[tuple[object, ...]]) -> None:
    found = [dict(zip(laws.COLUMNS, row, strict=True)) for row in rows]
    assert {row["method"] for row in found} == {"rodas5p", "dop853, set-valued"}
    for row in found:
        assert row["error"] < 10 * row["rtol"], row
        assert row["microseconds per period"] > 0
    fine = {row["method"]: row["steps per period"] for row in found if row["rtol"] == 1e-10 and row["lanes"] == 1}
    assert fine["dop853, set-valued"] < 0.2 * fine["rodas5p"]


def test_the_set_valued_case_is_another_problem_near_the_smoothed_one() -> None:
    smooth = read_case("friction, n = 1")
    case = laws.exact(smooth)
    assert "kappa" not in case.scene.parameters
    assert case.states.shape == (len(case.times), 3)
    gap = np.abs(case.states[:, :2] - smooth.states).max()
    assert 1e-6 < gap < 0.1
    assert set(case.states[:, 2]) <= {-1.0, 0.0, 1.0}


def test_the_table_and_the_figure_name_both_laws(rows: list[tuple[object, ...]]) -> None:
    assert "| friction, n = 1 | dop853, set-valued | 1 |" in laws.summary(rows)
    (panel, _) = laws.draw(rows).axes[:2]
    assert len(panel.lines) == 4

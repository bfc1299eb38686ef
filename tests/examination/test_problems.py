"""DETEST and the stiff classics by default settings, against published ends or SciPy at 1e-13."""

from __future__ import annotations

import pytest
from problems import PROBLEMS, digits

DIGITS = 4.0
QUICK = ("A2", "A5", "B1", "B5", "D3", "E1", "E3", "OREGO", "VDPOL")
DEFECTS: dict[str, str] = {}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name,
            marks=[
                *([] if name in QUICK else [pytest.mark.long]),
                *([pytest.mark.xfail(strict=True, reason=DEFECTS[name])] if name in DEFECTS else []),
            ],
        )
        for name in PROBLEMS
    ],
)
def test_the_end_of_a_problem(name: str) -> None:
    assert digits(PROBLEMS[name]) > DIGITS

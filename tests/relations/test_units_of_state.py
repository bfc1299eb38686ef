"""Other units of time and state: t -> k t, x -> c + s x, each component by its own s and c, over all functions that compute.

`DEFECTS` lists what is wrong today, by the defect that explains it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from questions import ASKED, Units, ask, expect_equal, plain_answer

TIME = {f"k = {k:g}": Units(k=k) for k in (1e-6, 1e-3, 70.0, 1e3, 1e6)}
STATE = {
    **{f"s = {s:g}": Units(scale=(s, s)) for s in (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9)},
    "s = 1e-9, 1e9": Units(scale=(1e-9, 1e9)),
    "s = 1e6, 1e-3": Units(scale=(1e6, 1e-3)),
    "c = 1, -2": Units(offset=(1.0, -2.0)),
    "c = 1000, -300": Units(offset=(1e3, -300.0)),
    "s = 1e-4, c = 1": Units(scale=(1e-4, 1e-4), offset=(1.0, 1.0)),
}
UNITS = TIME | STATE
QUICK = ("k = 0.001", "k = 70", "s = 0.001", "s = 1e-9, 1e9", "c = 1, -2")

DEFECTS: dict[str, dict[str, tuple[str, ...]]] = {}
"""Defect -> function -> units in which it is wrong today."""
KNOWN = {(name, units): defect for defect, rows in DEFECTS.items() for name, wrong in rows.items() for units in wrong}

SECONDS = 10.0
"""Most processor time of an answer; one in units of 1 takes less than a second, without compilation."""


def cases() -> Iterator[object]:
    for name in ASKED:
        for units in UNITS:
            marks = [] if units in QUICK else [pytest.mark.long]
            if (name, units) in KNOWN:
                marks.append(pytest.mark.xfail(strict=True, reason=KNOWN[name, units]))
            yield pytest.param(name, units, marks=marks, id=f"{name}-{units}")


def rounding(units: Units) -> float:
    """How much larger the states are than the motion: relative tolerances are those of the states."""
    return max(1.0 + abs(offset) / scale for scale, offset in zip(units.scale, units.offset, strict=True))


@pytest.mark.parametrize(("name", "units"), list(cases()))
def test_an_answer_does_not_depend_on_units(
    name: str, units: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    expected = plain_answer(name, tmp_path_factory.getbasetemp())
    answer = ask(name, tmp_path, UNITS[units], seconds=SECONDS)
    expect_equal(name, answer, expected, times=rounding(UNITS[units]) if name in ("run", "stream") else 1.0)

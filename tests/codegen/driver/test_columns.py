"""The columns by name are those that the text of the kernels uses."""

from __future__ import annotations

import pytest

from synchain.codegen.driver import clock_slots as text
from synchain.codegen.driver.columns import Control, Count, SumColumn


@pytest.mark.parametrize(("columns", "prefixes"), [(Control, ("",)), (SumColumn, ("",)), (Count, ("", "N_"))])
def test_columns_are_those_of_the_kernel_text(columns: type, prefixes: tuple[str, ...]) -> None:
    for column in (
        column for column in columns if column != Count.BY_METHOD or columns is not Count
    ):  # that is no kernel's
        names = [name for prefix in prefixes if hasattr(text, name := prefix + column.name)]
        assert names, column
        assert getattr(text, names[-1]) == column
    assert sorted(columns) == list(range(len(columns)))

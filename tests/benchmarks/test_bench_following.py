"""The benchmark of branches: our values are the expected ones, wrong and missing values of a peer are counted."""

from __future__ import annotations

import math

import pytest

import benchmarks
from benchmarks import following
from benchmarks.peers import followers


@pytest.mark.parametrize("case", following.CASES, ids=lambda case: case.name)
def test_our_branches_have_the_expected_values(case: following.Case) -> None:
    found, error = following.row(case, "synchain", case.own, 1)[2:4]
    count = sum(map(len, case.expected.values()))
    assert found == f"{count} of {count}"
    assert isinstance(error, float)
    assert error < (case.near if "basin" in case.name else 1e-9)


def test_a_wrong_kind_and_a_far_value_are_not_found() -> None:
    case = following.Case("two folds", {"fold": (1.0, -2.0), "Hopf": (3.0,)}, dict)
    row = following.row(case, "a program", lambda: {"fold": [-2.0, 1.002], "branch point": [3.0]}, 1)
    assert row[2:4] == ("1 of 3", 0.0)
    row = following.row(case, "a program", lambda: {"fold": [1.0001, 7.0], "Hopf": [3.0]}, 1)
    assert row[2] == "2 of 3"
    assert row[3] == pytest.approx(1e-4)
    missing = following.row(case, "a program", dict, 1)
    assert missing[2] == "0 of 3"
    assert math.isnan(float(str(missing[3])))


def test_the_table_has_peers_that_are_present(monkeypatch: pytest.MonkeyPatch) -> None:
    module = benchmarks.load("following")
    monkeypatch.setattr(module, "CASES", (module.Case("a case", {"fold": (1.0,)}, lambda: {"fold": [1.0]}),))
    present = followers.Follower("present", "a package", ("math",), {"a case": lambda: {"fold": [1.0005]}})
    absent = followers.Follower("absent", "a package", ("no_such_module",), present.cases)
    monkeypatch.setattr(followers, "FOLLOWERS", (present, absent))
    assert module.notes() == ["skipped: absent (No module named 'no_such_module'; install a package)"]
    rows = module.measure()
    assert [row[:3] for row in rows] == [("a case", "synchain", "1 of 1"), ("a case", "present", "1 of 1")]
    assert all(len(row) == len(module.COLUMNS) and row[4] >= 0.0 for row in rows)
    assert [row[1] for row in module.measure(quick=True)] == ["synchain"]


def test_each_program_has_cases_of_the_benchmark() -> None:
    names = {case.name for case in following.CASES}
    for each in followers.FOLLOWERS:
        assert each.cases
        assert set(each.cases) <= names

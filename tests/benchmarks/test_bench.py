"""Benchmarks cannot rot: each runs, and its table has what its columns say."""

from __future__ import annotations

import csv
import types

import numpy as np
import pytest

import benchmarks
from benchmarks import precision, sensitivity
from benchmarks.__main__ import main
from benchmarks.kit.cases import read_case
from synchain.runtime.commands import doctor
from synchain.runtime.plots.style import new_figure


def test_unknown_benchmarks_are_refused():
    with pytest.raises(ValueError, match=r"known: .*precision"):
        benchmarks.load("speed")


def test_markdown_has_one_line_a_row():
    text = benchmarks.markdown(("a", "b"), [(1, 0.25), ("x", 1e-9)])
    assert text.splitlines() == ["| a | b |", "|---|---|", "| 1 | 0.25 |", "| x | 1e-09 |"]


def plain(**more):
    """A benchmark module with nothing optional, or with what is given."""
    return types.SimpleNamespace(COLUMNS=("a", "b"), measure=lambda quick: [(1, 0.1 + 0.2)], **more)


def test_csv_keeps_every_digit_and_leaves_missing_numbers_empty():
    text = benchmarks.csv_text(("a", "b, c"), [(1, 0.1 + 0.2), ("x", float("nan"))])
    assert list(csv.reader(text.splitlines())) == [["a", "b, c"], ["1", repr(0.1 + 0.2)], ["x", ""]]


def test_a_plain_benchmark_writes_a_table_in_two_forms(tmp_path):
    module = plain()
    paths = benchmarks.write("speed", module, module.measure(True), tmp_path)
    assert [path.name for path in paths] == ["speed.csv", "speed.md"]
    assert sorted(tmp_path.iterdir()) == paths
    assert "| 1 | 0.3 |" in paths[1].read_text()


def test_summary_notes_and_figure_are_written_where_there_are_some(tmp_path):
    module = plain(
        summary=lambda rows: f"{len(rows)} row", notes=lambda: ["skipped: x"], draw=lambda rows: new_figure((1, 1))
    )
    paths = benchmarks.write("speed", module, module.measure(True), tmp_path)
    assert [path.name for path in paths] == ["speed.csv", "speed.md", "speed.png", "speed.svg"]
    page = paths[1].read_text()
    assert page.index("| 1 |") < page.index("1 row") < page.index("skipped: x")
    assert paths[2].read_bytes().startswith(b"\x89PNG")


def test_the_command_prints_a_table_of_each(monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(precision, "measure", lambda quick: asked.append(quick) or [(2, "scalar", 0.25)])
    assert main(["--quick", "precision"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "Numba" in lines[0]
    assert lines[2] == "precision"
    assert lines[-1] == "| 2 | scalar | 0.25 |"
    assert asked == [True]


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("nope", "unknown benchmark 'nope'; known: agreement, "),
        ("precision --long", "benchmark 'precision' has no long form"),
        ("precision --out a.csv", "the name of a file; expected a folder"),
    ],
)
def test_wrong_use_is_code_2(command, expected, capsys):
    with pytest.raises(SystemExit, match=r"^2$"):
        main(command.split())
    assert expected in capsys.readouterr().err


def test_the_doctor_keeps_the_digits_of_the_reference():
    case = read_case("friction, n = 1")
    periods = case.times / case.period
    ends = np.abs(periods - np.round(periods)) < 1e-9
    assert dict(case.scene.parameters) == doctor.TRIAL
    assert np.array_equal(case.states[ends][: len(doctor.DRIVE_PERIODS)], doctor.DRIVE_PERIODS)


def test_the_command_writes_to_the_folder_and_says_so(monkeypatch, tmp_path, capsys):
    module = plain(notes=lambda: ["skipped: x"])
    monkeypatch.setattr(benchmarks, "load", lambda name: module)
    assert main(["speed", "--out", str(tmp_path / "new")]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-2:] == [str(tmp_path / "new" / f"speed.{kind}") for kind in ("csv", "md")]
    assert "skipped: x" in captured.err


@pytest.mark.long
def test_sensitivity_brackets_the_published_end(monkeypatch):
    """A short run of the first case: every choice finds one range, and its end lies near the
    exponent's.
    """
    changes = (("short", {"transient": 200.0, "window": 20.0, "starts": 1}),)
    monkeypatch.setattr(sensitivity, "CHANGES", changes)
    rows = sensitivity.measure(quick=True)
    assert [row[2] for row in rows] == ["short", "sign of the transversal exponent"]
    assert all(len(row) == len(sensitivity.COLUMNS) and row[5] == 1 and row[3] == 0.0 for row in rows)
    direct, exponent = (float(row[4]) for row in rows)
    assert exponent == pytest.approx(0.2327, abs=2e-3)
    assert exponent - 0.02 < direct < exponent  # a finite transient leaves the slowest decay undecided

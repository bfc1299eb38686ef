"""What a sweep says while it runs: to a hook, on a terminal, in a notebook, in a pipe."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
import tqdm.auto  # noqa: F401  (chooses its bars once; this process is no notebook)

from synchain.runtime.cells.layout import Layout, block_size
from synchain.runtime.support.progress import Progress, Reporter, duration
from synchain.runtime.support.status import CODES, Status


def counts(**named: int) -> np.ndarray:
    found = np.zeros(CODES, dtype=np.int64)
    for name, number in named.items():
        found[Status[name]] = number
    return found


class Terminal:
    def __init__(self, is_terminal: bool) -> None:
        self.is_terminal, self.text = is_terminal, ""

    def isatty(self) -> bool:
        return self.is_terminal

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        """Nothing is kept back."""


def test_rate_and_time_left_count_this_sitting_alone():
    now = Progress(1000, 400, 300, {Status.FINISHED: 390, Status.DIVERGED: 10}, 5.0, 50.0)
    assert now.rate == 2.0
    assert now.left == 300.0
    assert now.failures == "10 diverged"
    assert str(now) == "400 of 1000 cells (40 %), 2 cells/s, 5 min left; 10 diverged"
    assert Progress(10, 3, 3, {}, 1.0, 1.0).left == float("inf")
    assert str(Progress(3, 3, 3, {}, 0.0, 1.0)) == "3 of 3 cells (100 %), 0 cells/s, 0 s left"


@pytest.mark.parametrize(
    ("seconds", "text"), [(12.3, "12 s"), (600, "10 min"), (9000, "2.5 h"), (float("inf"), "unknown time")]
)
def test_durations(seconds, text):
    assert duration(seconds) == text


def test_the_hook_hears_of_every_block_and_of_kept_cells():
    heard: list[Progress] = []
    reporter = Reporter(30, show=False, hook=heard.append)
    reporter.start(counts(FINISHED=10))
    reporter.add(counts(FINISHED=8, STEP_BUDGET=2))
    reporter.add(counts(FINISHED=10))
    assert [p.done for p in heard] == [10, 20, 30]
    assert {p.kept for p in heard} == {10}
    assert heard[-1].statuses == {Status.FINISHED: 28, Status.STEP_BUDGET: 2}
    assert heard[-1].failures == "2 step budget"
    assert heard[-1].compiling >= 0.0


def test_a_terminal_has_a_bar_with_the_failures(monkeypatch):
    shown = Terminal(True)
    monkeypatch.setattr(sys, "stderr", shown)
    reporter = Reporter(20)
    reporter.start(counts(FINISHED=5))
    reporter.add(counts(FINISHED=9, DIVERGED=1))
    reporter.close()
    assert "15/20" in shown.text
    assert "cell/s" in shown.text
    assert "1 diverged" in shown.text


@pytest.mark.parametrize(("config", "has_bar"), [({"IPKernelApp": {}}, True), ({}, False)])
def test_a_notebook_has_a_bar_that_says_the_time_of_compilation(monkeypatch, config, has_bar):
    """A kernel of Jupyter's, whose stderr is no terminal; IPython in a pipe is none."""
    shell = SimpleNamespace(config=config)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    shown = Terminal(False)
    monkeypatch.setattr(sys, "stderr", shown)
    reporter = Reporter(20)
    reporter.start(counts(FINISHED=5), compiling=3.4)
    reporter.close()
    assert ("compiled in 3 s" in shown.text, "5/20" in shown.text) == (has_bar, has_bar)


def test_periods_and_values_are_counted_without_a_status(monkeypatch):
    shown, heard = Terminal(True), []
    monkeypatch.setattr(sys, "stderr", shown)
    with Reporter(10, hook=heard.append, unit="period") as reporter:
        reporter.advance(0.25)
        assert list(reporter.each("ab")) == ["a", "b"]
        assert [p.done for p in heard] == [0, 0.25, 1.25, 2.25]
        assert str(heard[-1]).startswith("2.25 of 10 periods (22 %), ")
    assert (heard[-1].done, heard[-1].total, heard[-1].share) == (2.25, 2.25, 1.0)  # no more was needed
    assert "2.25/2.25" in shown.text
    assert "period/s" in shown.text
    assert (heard[-1].statuses, heard[-1].kept, heard[-1].unit) == ({}, 0, "period")
    with pytest.raises(KeyError), Reporter(10, show=False, hook=heard.append, unit="period") as broken:
        raise KeyError
    assert (broken.done, broken.total) == (0, 10)
    with Reporter(10, show=False, hook=heard.append):
        pass
    assert str(heard[-1]).startswith("0 of 0 cells (100 %), ")
    stopped = Reporter(3, show=False, hook=heard.append, unit="value")
    next(values := stopped.each("ab"))
    values.close()
    assert stopped.done == 0  # a branch that ends at a value has not got beyond it


def test_a_pipe_has_a_line_now_and_then_and_nothing_in_a_short_run(monkeypatch):
    shown = Terminal(False)
    monkeypatch.setattr(sys, "stderr", shown)
    reporter = Reporter(20)
    reporter.start(counts())
    reporter.add(counts(FINISHED=5))
    assert shown.text == ""
    reporter.every = 0.0
    reporter.add(counts(FINISHED=5))
    reporter.close()
    assert shown.text.startswith("10 of 20 cells (50 %), ")
    assert shown.text.count("\n") == 1
    quiet = Reporter(20, show=False)
    quiet.start(counts())
    quiet.add(counts(FINISHED=5))
    assert shown.text.count("\n") == 1


@pytest.mark.parametrize(
    "layout", [Layout(29, 8), Layout(8, 8), Layout(1, 8), Layout(30, 2, 6), Layout(30, 2, 6, True)]
)
def test_blocks_hold_every_cell_once_and_follow_each_other(layout):
    rows = [layout.rows(block) for block in range(layout.blocks)]
    assert sorted(np.concatenate(rows).tolist()) == list(range(layout.cells))
    assert all(0 < len(r) <= layout.size for r in rows)
    for block in range(layout.blocks):
        after = layout.after(block)
        if after is None:
            continue
        assert layout.before(after) == block
        np.testing.assert_array_equal(rows[after], rows[block] + (-1 if layout.falling else 1))
    ends = sum(layout.after(block) is None for block in range(layout.blocks))
    assert ends == (layout.blocks // layout.columns if layout.columns else layout.blocks)


def test_blocks_are_whole_lanes_and_small_where_cells_are_long():
    from streams import MAP

    assert block_size(MAP, 8, 1) == 56
    assert block_size(MAP, 8, 100) == 8
    many = MAP.replace(axes={"sigma": [0.001 * k for k in range(1000)], "omega": [1.0 + 0.001 * k for k in range(100)]})
    assert block_size(many, 8, 2) == 128
    assert block_size(many.replace(transient=1e5), 8, 2) == 48
    assert block_size(many.replace(transient=1e8), 8, 2) == 8

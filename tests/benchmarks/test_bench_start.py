"""The stages of a first use are timed in processes that are what their row says."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from benchmarks import start


@pytest.mark.long
def test_a_row_for_each_stage():
    rows = start.measure(quick=True)
    seconds = {name: spent for name, _, spent in rows}
    assert seconds["compile, nothing in the cache"] > seconds["compile, the driver in the cache"]
    names = [row[0] for row in rows]
    assert names[:8] == [
        "import Numba alone",
        "import the models",
        "derive",
        "import the runtime",
        "emit",
        "compile, nothing in the cache",
        "compile, the driver in the cache",
        "load from the cache",
    ]
    assert len(names) - 8 == len(start.COMPILING) - len(start.notes())
    assert all(len(row) == len(start.COLUMNS) and row[2] > 0 for row in rows)


def test_a_cache_that_is_not_what_it_should_be_is_no_measurement(tmp_path, monkeypatch):
    def answer(from_cache):
        output = json.dumps([[1.0] * 6, from_cache])
        monkeypatch.setattr(start.subprocess, "run", lambda *_, **options: SimpleNamespace(returncode=0, stdout=output))

    answer(True)
    assert start.stages(2, str(tmp_path), cached=True) == [1.0] * 6
    with pytest.raises(RuntimeError, match="came from the cache: True; expected False"):
        start.stages(2, str(tmp_path), cached=False)
    answer(None)
    for cached in (False, True):
        with pytest.raises(RuntimeError, match="came from the cache: in part"):
            start.stages(2, str(tmp_path), cached=cached)


def test_a_failing_process_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(start, "CHILD", "1/0")
    with pytest.raises(RuntimeError, match=r"(?s)to be timed failed: .*ZeroDivisionError"):
        start.stages(2, str(tmp_path), cached=False)

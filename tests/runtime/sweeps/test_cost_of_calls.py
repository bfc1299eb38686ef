"""What a call of `run` costs besides its steps."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import sympy as sp
import xarray as xr
from effort import effort

import synchain as sc
from synchain import run
from synchain.runtime.engines import choice
from synchain.runtime.engines.choice import at_start


def one_pendulum() -> sc.Scene:
    return sc.Scene("pendulum", None, time_unit="time", transient=0.0, window=10.0)


def pushed() -> sc.Scene:
    """An oscillator whose load is switched off at t = 3."""
    t = sp.Symbol("t")
    x = sp.Function("x")(t)
    load = sp.Piecewise((1, t < 3), (0, True))
    node = sc.Lagrangian(T=x.diff(t) ** 2 / 2, V=x**2 / 2, Q={x: load - x.diff(t) / 10})
    return sc.Scene(node, initial={"x": 1.0, "v": 0.0}, time_unit="time", transient=0.0, window=10.0)


@pytest.mark.parametrize("scene", [one_pendulum, pushed])
def test_a_warm_call_takes_few_calls_of_functions(scene):
    """2 400 and 2 900 calls take 1.5 and 2 ms; labels of the data alone would take as many more."""
    network = scene()
    run(network, show_progress=False)
    result, calls = effort(lambda: run(network, show_progress=False))
    assert calls < 3_500
    assert result.success


def test_data_are_labelled_when_they_are_read(monkeypatch):
    datasets = []
    built = xr.Dataset.__init__
    monkeypatch.setattr(
        xr.Dataset,
        "__init__",
        lambda self, *arguments, **more: (datasets.append(self), built(self, *arguments, **more))[1],
    )
    result = run(one_pendulum(), show_progress=False)
    assert not datasets
    assert result.data is result.data
    assert result.end.dims == ("component", "node")
    assert datasets


@pytest.mark.parametrize("through", [lambda r: pickle.loads(pickle.dumps(r)), copy.copy, copy.deepcopy])
def test_results_that_nobody_has_read_travel(through):
    result = through(run(one_pendulum(), show_progress=False))
    again = run(one_pendulum(), show_progress=False)
    np.testing.assert_array_equal(result.end.values, again.end.values)
    assert result.data.attrs == again.data.attrs
    with pytest.raises(AttributeError, match="this result has no 'nothing'; it has: "):
        result.nothing  # noqa: B018


def test_results_do_not_follow_later_runs():
    scene = one_pendulum()
    first, expected = (run(scene, show_progress=False) for _ in range(2))
    expected = expected.end.values
    run(scene.replace(window=3.0), show_progress=False)
    np.testing.assert_array_equal(first.end.values, expected)


def test_the_only_cell_of_a_scene_is_asked_once_how_it_begins(monkeypatch):
    cells = []

    def counted(templates, rows):
        cells.append(len(rows))
        return at_start(templates, rows)

    monkeypatch.setattr(choice, "at_start", counted)
    run(one_pendulum(), show_progress=False)
    assert cells == [1]

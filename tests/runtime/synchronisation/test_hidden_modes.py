"""Starts that have no part in a mode of a linear network."""

from __future__ import annotations

import pytest

from synchain import Criterion, Field, Scene, thresholds
from synchain.graphs import chain, complete, grid, one_way_ring, ring, star
from synchain.runtime.synchronisation.hidden_modes import hidden_modes

PAIR = Field({"x": "-x", "y": "-y"})
"""Links across both states make a mode grow at sigma |gamma| - 1."""


@pytest.mark.parametrize(
    ("graph", "hidden"),
    [
        (chain(2), ""),
        (chain(3), "gamma = -3:"),
        (chain(4), "gamma = -2:"),
        (chain(5), "gamma = -1.382, -3.618:"),
        (grid(9), "gamma = -2, -3, -4, …:"),
        (ring(6), ""),
        (star(5), ""),
        (complete(4), ""),
        (one_way_ring(4), ""),
    ],
)
def test_modes_without_a_part_in_the_default_start_are_named(graph, hidden):
    modes = hidden_modes(Scene(PAIR, "x->y, y->x", graph, time_unit="time"))
    assert [hidden in mode_text for mode_text in modes] == [True] * bool(hidden)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(PAIR, "x->y, y->x", chain(3), initial={"x": [0.3, 0.28, 0.25]}),
        Scene(PAIR, "x->y, y->x", chain(3), initial={"y": [0.0, 0.1, 0.0]}),
        Scene(PAIR, "x->y, y->x", chain(3), initial={"x": 0.3}),
        Scene("harmonic", "cubic_spring", chain(3)),
        Scene("duffing", "spring", chain(3)),
        Scene("friction", "spring", chain(3)),
        Scene("friction", "spring", chain(3), contact="set-valued"),
    ],
)
def test_other_starts_and_networks_that_are_not_linear_hide_nothing(scene):
    assert hidden_modes(scene) == ()


def test_thresholds_warn_where_the_start_hides_the_mode_that_grows_first():
    """The true end is sigma = 1/3, of gamma = -3; the default start of a chain of three misses it."""
    asked = {"sigma": [0.0, 0.25, 0.5, 0.75], "criterion": Criterion(transient=50, window=5, starts=2)}
    ends = []
    for initial in (None, {"x": [0.3, 0.28, 0.25]}):
        scene = Scene(PAIR, "x->y, y->x", chain(3), time_unit="time", initial=initial)
        result = thresholds(scene, resolution=0.01, workers=1, show_progress=False, **asked)
        ends.append(result.direct.intervals[0][1])
        assert ("no part in the modes of gamma = -3" in " ".join(result.warnings)) == (initial is None)
    assert ends[0] > 0.5
    assert ends[1] == pytest.approx(1 / 3, abs=0.02)

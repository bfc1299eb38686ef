"""Probe, projection and direct simulation against each other and against what is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.models import Scene, chain, complete, from_matrix, star
from synchain.runtime import thresholds
from synchain.runtime.exponent import exponents
from synchain.runtime.threshold import Criterion, critical_ratio, probe, project, simulate, wu_chua

PARTS = from_matrix([[-1, 1, 0, 0], [1, -1, 0, 0], [0, 0, -1, 1], [0, 0, 1, -1]])
SHORT = Criterion(transient=100, window=20, starts=2, tolerance=1e-3)


def test_projection_is_the_intersection_over_all_modes():
    spectrum = chain(3).spectrum  # 0, -1, -3
    for ranges, expected in (
        ([(0.3, 1.2)], [(0.3, 0.4)]),
        ([(0.3, 0.8)], []),
        ([(0.0, 0.9)], [(0.0, 0.3)]),
        ([(0.0, 0.1), (0.33, 1.2)], [(0.0, 0.1 / 3), (0.33, 0.4)]),
    ):
        found = project(ranges, spectrum)
        assert np.shape(found) == np.shape(expected)
        np.testing.assert_allclose(np.ravel(found), np.ravel(expected), rtol=1e-14)
    assert critical_ratio(spectrum) == pytest.approx(3)
    assert critical_ratio(complete(7).spectrum) == 1.0


def test_parts_of_a_network_synchronise_only_where_uncoupled_oscillators_do():
    spectrum = PARTS.spectrum  # 0, 0, -2, -2
    assert project([(0.3, 1.2)], spectrum) == []
    assert project([(0.0, 0.9)], spectrum) == [(0.0, 0.45)]


def test_network_in_parts_is_allowed_and_said():
    found = thresholds(
        Scene(topology=PARTS), omega=1.15, sigma=np.linspace(0, 0.3, 7), criterion=SHORT, resolution=0.05
    )
    assert any("no complete synchronisation" in words for words in found.warnings)


def test_wu_chua_keeps_the_product_of_coupling_and_eigenvalue():
    assert wu_chua(0.233, chain(2).spectrum, chain(3).spectrum) == pytest.approx(0.233 * 2 / 3)


def test_probe_of_the_periodic_case_meets_the_published_range():
    found = probe(
        Scene(topology=chain(2)), np.linspace(0, 0.8, 9), criterion=Criterion(transient=400, window=20, starts=1)
    )
    ((low, high),) = found.intervals
    assert low == 0.0
    assert high == pytest.approx(2 * 0.233, abs=0.015)  # 400 periods leave about 0.01 in alpha undecided
    assert found.share.min() == 0.0
    assert found.error[0] < 1e-3 < found.error[-1]


def test_direct_range_of_a_star_lies_where_the_probe_says():
    found = thresholds(
        Scene(topology=star(4)), omega=1.15, sigma=np.linspace(0, 0.3, 13), criterion=SHORT, resolution=2e-3
    )
    assert found.predicted[0][1] == pytest.approx(found.probe.intervals[0][1] / 4, abs=1e-9)
    assert found.direct.intervals[0][1] == pytest.approx(found.predicted[0][1], abs=0.01)
    numbers = found.as_dict()
    assert set(numbers) == {"intervals", "probe", "predicted", "warnings"}
    assert numbers["intervals"][0][1] == found.direct.intervals[0][1]


def test_failed_cells_never_count_as_synchronous():
    stopped = Scene(topology=chain(2), max_steps=50)
    assert simulate(stopped, [0.0, 0.1], criterion=SHORT).intervals == ()


@pytest.mark.parametrize(
    ("graph", "words"),
    [
        (chain(1), "at least two"),
        (from_matrix([[-1, 1, 0], [0, -1, 1], [1, 0, -1]]), "complex"),
        (from_matrix([[2, -1, -1], [-1, 2, -1], [-1, -1, 2]]), "negate it"),
    ],
)
def test_networks_that_the_probe_cannot_judge_are_refused(graph, words):
    with pytest.raises(ValueError, match=words):
        thresholds(Scene(topology=graph), omega=1.15)


@pytest.mark.parametrize("bad", [{"tolerance": 0}, {"starts": 0}, {"transient": float("nan")}, {"window": -1}])
def test_senseless_criteria_are_refused(bad):
    with pytest.raises(ValueError, match="criterion"):
        Criterion(**bad)


def test_exponent_changes_sign_where_the_probe_does():
    found = exponents(Scene(topology=chain(2)), np.linspace(0.40, 0.54, 8), starts=1)
    assert found.intervals[0][1] == pytest.approx(0.4653, abs=2e-3)
    assert np.all(np.diff(found.exponent) > 0)
    assert np.all(found.stderr < 2e-3)

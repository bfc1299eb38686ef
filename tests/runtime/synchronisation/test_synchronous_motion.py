"""Results of synchronisation do not depend on units, numbering or the sign that a matrix is written with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synchain import Criterion, Field, Rates, Scene, basin, ends, thresholds, universal_probe
from synchain.graphs import chain, from_matrix
from synchain.runtime.support.execution import Execution
from synchain.runtime.synchronisation.agreement import agreement
from synchain.runtime.synchronisation.criterion import AppliedCriterion
from synchain.runtime.synchronisation.threshold import fitted, simulate

QUIET = Execution(1, show_progress=False)
VDP = Field(
    {"x": "pace*s/r*v", "v": "pace*((1 - ((x - c)/s)**2)*v - r/s*(x - c))"},
    parameters={"s": 1.0, "r": 1.0, "c": 0.0, "pace": 1.0},
)
HERE = ends(VDP)[0]
DAMPER = Rates({HERE.v: "k*W*(v_j - v_i)"}, {"k": 0.2})
UNITS = [(1e-9, 1e-9, 0.0, 1.0), (1e9, 1e-9, 0.0, 1e6), (1e-5, 1e9, 0.0, 1e-5), (1e-3, 1e-3, 7.0, 1.0)]
"""Of position, velocity, offset of the position, and pace."""


def pair(s: float = 1.0, r: float = 1.0, c: float = 0.0, pace: float = 1.0, graph: Any = None, **more: Any) -> Scene:
    """Van der Pol oscillators, whose exponents at alpha = 0, 0.3, 1 are 0, -0.1376, -0.5914, in any units."""
    graph = chain(2) if graph is None else graph
    n = graph.n
    start = {"x": (c + s * np.linspace(1.0, -1.0, n)).tolist(), "v": [0.1 * r] * n}
    values = {"s": s, "r": r, "c": c, "pace": pace}
    return Scene(VDP, DAMPER, graph, parameters=values, initial=start, **more)


def used(scene: Scene, criterion: Criterion | None = None) -> AppliedCriterion:
    return fitted(scene, np.array([0.0, 0.2]), criterion or Criterion(), QUIET)


def test_the_motion_of_van_der_pol_is_measured() -> None:
    """A limit cycle of the amplitudes 2.009 and 2.672 with the period 6.663 (mu = 1)."""
    criterion = used(pair())
    np.testing.assert_allclose(criterion.extent, [2 * 2.009, 2 * 2.672], rtol=0.06)
    assert criterion.transient == pytest.approx(1000 * 6.663 / (2 * np.pi), rel=0.15)
    assert criterion.tolerance == pytest.approx(1e-3 * np.hypot(*criterion.extent))
    assert criterion.reach == pytest.approx(0.5 * criterion.extent[0])


@pytest.mark.parametrize("units", UNITS)
def test_a_criterion_follows_the_units(units: tuple[float, float, float, float]) -> None:
    s, r, _, pace = units
    plain, criterion = used(pair()), used(pair(*units))
    np.testing.assert_allclose(np.array(criterion.extent) / [s, r], plain.extent, rtol=1e-3)
    assert criterion.transient * pace == pytest.approx(plain.transient, rel=1e-3)
    assert criterion.window * pace == pytest.approx(plain.window, rel=1e-3)


@pytest.mark.parametrize("units", UNITS)
def test_verdicts_do_not_depend_on_units(units: tuple[float, float, float, float]) -> None:
    few = Criterion(starts=3)
    s, r, c, pace = units
    assert simulate(pair(*units), pace * np.array([-0.05, 0.1, 0.5]), few, 1.0, QUIET).share.tolist() == [0.0, 1.0, 1.0]
    result = universal_probe(
        pair(*units), [-0.1 * pace, 0.4 * pace], [0.0, 0.1 * pace], criterion=few, show_progress=False
    )
    assert result.share.tolist() == [0.0, 1.0]
    box = {"x": (c - s, c + s), "v": (-r, r)}
    quick = basin(pair(*units), samples=8, ranges=box, show_progress=False, k=0.2 * pace)
    assert quick.shares.sel(attractor="synchronous") == 1.0
    assert quick.criterion is not None
    assert quick.criterion.tolerance == pytest.approx(quick.criterion.size / 1000)


def test_an_invisible_component_is_seen() -> None:
    """x stays in one of two wells, v and w synchronise: with x in tiny units the error is that of v alone."""
    node = Field({"x": "(x/s - (x/s)**3)*s", "v": "w", "w": "(1 - v**2)*w - v"}, parameters={"s": 1e-9})
    start = {"x": [1e-9, -1e-9], "v": [1, 0.5], "w": 0}
    scene = Scene(node, "w->w", chain(2), parameters={"s": 1e-9}, initial=start)
    sweep = simulate(scene, [0.3], Criterion(starts=1), 1.0, QUIET)
    assert sweep.share.tolist() == [0.0]
    given = simulate(scene, [0.3], Criterion(starts=1, tolerance=1e-3), 1.0, QUIET)
    assert given.share.tolist() == [1.0]  # a tolerance that was given is that of the mean error


def test_a_tolerance_that_was_given_stays() -> None:
    criterion = used(pair(1e-3, 1e-3), Criterion(tolerance=0.5, reach=0.1, transient=20.0, window=10.0))
    assert (criterion.tolerance, criterion.reach, criterion.transient, criterion.window) == (0.5, 0.1, 20.0, 10.0)
    assert criterion.relative is False


def test_the_sign_of_a_matrix_and_the_numbers_of_nodes_are_conventions() -> None:
    """-sigma and -G are the same links; nodes may be numbered in another order."""
    matrix, order = np.array([[-1, 1, 0], [1, -2, 1], [0, 1, -1]]), [2, 0, 1]
    few = Criterion(starts=2, transient=200.0, window=5.0)
    plain, turned = (
        simulate(pair(graph=from_matrix(sign * matrix)), np.sort(sign * np.array([-0.1, 0.1, 0.3])), few, 1.0, QUIET)
        for sign in (1, -1)
    )
    assert plain.share.tolist() == turned.share[::-1].tolist() == [0.0, 1.0, 1.0]
    np.testing.assert_allclose(plain.error[:1], turned.error[-1:], rtol=1e-3)
    scene = pair(graph=from_matrix(matrix[np.ix_(order, order)]))
    scene = scene.replace(initial={n: [values[k] for k in order] for n, values in pair(graph=chain(3)).initial.items()})
    assert simulate(scene, [-0.1, 0.1, 0.3], few, 1.0, QUIET).share.tolist() == plain.share.tolist()


def test_copies_that_nothing_joins_synchronise_where_lone_oscillators_do() -> None:
    copies = from_matrix(np.kron(np.eye(2), [[-1, 1], [1, -1]]))
    few = Criterion(starts=1, transient=100.0, window=10.0)
    joined, apart = (simulate(pair(graph=graph), [0.2], few, 1.0, QUIET) for graph in (chain(2), copies))
    assert (joined.share.tolist(), apart.share.tolist()) == (
        [1.0],
        [0.0],
    )  # a limit cycle has the exponent 0 at alpha = 0
    result = thresholds(
        pair(graph=copies), sigma=[0.1, 0.3], criterion=few, resolution=0.1, periods=50, show_progress=False
    )
    assert result.direct.intervals == result.predicted == ()


def test_a_start_near_rest_is_no_extent() -> None:
    """Two damped oscillators come to rest: errors are compared with where they came from."""
    scene = Scene(Field({"x": "v", "v": "-x - v/2"}), "v->v", chain(2), initial={"x": [3e-6, 1e-6], "v": 0})
    criterion = used(scene)
    np.testing.assert_allclose(criterion.extent[0], 3e-6, rtol=0.3)
    assert simulate(scene, [0.0, 0.5], Criterion(starts=1), 1.0, QUIET).share.tolist() == [1.0, 1.0]


def test_a_rotation_has_no_extent_of_its_window() -> None:
    """Phases that run on for ever are compared with how far apart they began, not with the angle that they turned."""
    scene = Scene(Field({"q": "w"}, parameters={"w": 40.0}), Rates({"q": "k*W*sin(q_j - q_i)"}, {"k": 0.1}), chain(2),
                  initial={"q": [0.0, 0.5]})  # fmt: skip
    assert used(scene).extent == pytest.approx((0.5,))


def test_agreement_follows_the_units() -> None:
    cells = [
        agreement(pair(s, s), [0.1, 0.3], criterion=Criterion(starts=1), show_progress=False).criterion.tolerance / s
        for s in (1.0, 1e-3)
    ]
    assert cells[0] == pytest.approx(cells[1], rel=1e-3)

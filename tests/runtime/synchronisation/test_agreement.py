"""Exponents beside direct simulation: known ends, every cause of a disagreement, and the benchmark's table."""

from __future__ import annotations

import numpy as np
import pytest

import benchmarks
from synchain import Criterion, Scene, exponents, run
from synchain.graphs import from_matrix, topology
from synchain.results import Exponents
from synchain.runtime.synchronisation.agreement import CAUSES, OUTCOMES, Cell, _cause, _outcome, agreement, strengths

pytestmark = pytest.mark.long

PAIR = topology("chain", 2)
SHORT = Criterion(transient=300, window=20, starts=2)


def friction(omega: float = 1.15, **more: object) -> Scene:
    return Scene(topology=PAIR, parameters={"omega": omega}, **more)


def line(*alpha: float) -> Exponents:
    return exponents(friction(), alpha, starts=1)


def test_both_change_their_minds_at_the_published_end() -> None:
    """omega = 1.15: synchronous up to alpha = 0.466, sigma = 0.233 of two oscillators (Marszal et al. (2016))."""
    result = agreement(friction(), [0.05, 0.15, 0.22, 0.25, 0.3], line=line(0.5, 0.1, 0.3, 0.44, 0.6), criterion=SHORT)
    assert [cell.outcome for cell in result.cells] == ["both yes"] * 3 + ["both no"] * 2
    assert result.counts == {"both yes": 3, "both no": 2, **dict.fromkeys(OUTCOMES[2:], 0)}
    assert result.causes == {}
    assert result.as_dict()["cells"][0]["share"] == 1.0


def test_the_fastest_growing_mode_decides() -> None:
    """Three in a chain see alpha = sigma and 3 sigma; at sigma = 0.2 only the second is unstable."""
    scene = friction().replace(topology=topology("chain", 3))
    result = agreement(scene, [0.2], criterion=Criterion(transient=100, window=20, starts=1))
    (cell,) = result.cells
    assert cell.outcome == "both no"
    assert cell.exponent == pytest.approx(line(0.6).exponent[0], abs=1e-6)


def test_a_short_transient_is_found_out() -> None:
    """alpha = 0.444: the error falls by e^-3.5 in 100 periods, by e^-14 in 400."""
    criterion = Criterion(transient=100, window=20, starts=1, tolerance=1e-6)
    (cell,) = agreement(friction(), [0.222], line=line(0.444), criterion=criterion).cells
    assert (cell.outcome, cell.cause) == ("exponent yes, simulation no", "transient too short")


def test_equal_oscillators_are_a_merger() -> None:
    """alpha = 0.6 is unstable, but bit-equal oscillators stay equal."""
    (cell,) = agreement(friction(initial={"x": 0.3}), [0.3], line=line(0.6), criterion=SHORT).cells
    assert (cell.outcome, cell.cause) == ("exponent no, simulation yes", "round-off merger")
    assert cell.error == 0.0


def test_two_copies_of_an_orbit_shifted_by_a_period_of_the_drive_coexist() -> None:
    """The orbit has two drive periods: the other copy attracts as well while the coupling is weak."""
    lone = Scene(parameters={"omega": 1.15}, record=())
    phases = [run(lone.replace(transient=0.0, window=periods)).states("end") for periods in (600.0, 601.0)]
    initial = {name: [float(state[k]) for state in phases] for k, name in enumerate(("x", "v"))}
    criterion = Criterion(transient=300, window=20, starts=1)
    (cell,) = agreement(friction(initial=initial), [0.005], line=line(0.01), criterion=criterion).cells
    assert abs(initial["x"][0] - initial["x"][1]) > 1e-3
    assert (cell.outcome, cell.cause) == ("exponent yes, simulation no", "coexisting attractor")


@pytest.mark.parametrize(
    ("outcome", "exponent", "share", "error", "longer", "near", "split", "cause"),
    [
        (OUTCOMES[2], -0.1, 0.0, 0.5, 1.0, 1.0, False, "transient too short"),
        (OUTCOMES[2], -0.004, 0.25, 0.5, 0.25, 1.0, False, "intermittency"),
        (OUTCOMES[2], -0.1, 0.25, 0.5, 0.25, 1.0, False, "coexisting attractor"),
        (OUTCOMES[2], -0.1, 0.0, 0.5, 0.0, 1.0, False, "coexisting attractor"),
        (OUTCOMES[2], -0.1, 0.0, 0.5, 0.0, 0.0, True, "coexisting attractor"),
        (OUTCOMES[2], -0.1, 0.0, 0.5, 0.0, 0.0, False, "unexplained"),
        (OUTCOMES[3], 0.1, 1.0, 1e-15, 1.0, 1.0, False, "round-off merger"),
        (OUTCOMES[3], 0.1, 1.0, 1e-13, 1.0, 1.0, False, "unexplained"),
        (OUTCOMES[3], 0.1, 1.0, 1e-5, 0.0, 0.0, False, "transient too short"),
        (OUTCOMES[3], 0.004, 0.75, 1e-5, 0.75, 0.0, False, "intermittency"),
        (OUTCOMES[3], 0.1, 0.75, 1e-5, 0.75, 0.0, False, "coexisting attractor"),
        (OUTCOMES[3], 0.1, 1.0, 1e-5, 1.0, 1.0, False, "unexplained"),
    ],
)
def test_causes(
    outcome: str, exponent: float, share: float, error: float, longer: float, near: float, split: bool, cause: str
) -> None:
    cell = Cell(0.1, exponent, 0.001, share, error, outcome)
    assert cause in CAUSES
    assert _cause(cell, error < 1e-14, longer, near, split) == cause


def test_a_verdict_needs_two_standard_errors() -> None:
    def verdicts(*exponent: float) -> list[str]:
        return [_outcome(np.array(exponent), np.full(len(exponent), 0.01), simulated) for simulated in (True, False)]

    assert verdicts(-0.03, -0.5) == ["both yes", "exponent yes, simulation no"]
    assert verdicts(-0.03, 0.03) == ["exponent no, simulation yes", "both no"]
    assert verdicts(-0.015, -0.5) == ["undecided", "undecided"]
    assert verdicts(-0.5, 0.015) == ["undecided", "undecided"]


def test_strengths_are_those_of_all_modes() -> None:
    np.testing.assert_allclose(
        np.sort(strengths(topology("chain", 4), [1.0, 0.5]), axis=1)[:, ::2],
        [[2 - np.sqrt(2), 2 + np.sqrt(2)], [1 - np.sqrt(0.5), 1 + np.sqrt(0.5)]],
    )
    parts = from_matrix([[-1, 1, 0, 0], [1, -1, 0, 0], [0, 0, -1, 1], [0, 0, 1, -1]])
    assert strengths(parts, [0.5]).min() == 0.0
    assert strengths(topology("star", 6), [0.0, 1.0]).shape == (2, 2)


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match=r"found no exponent at alpha = .*0\.4"):
        agreement(friction(), [0.1, 0.2], line=line(0.2, 0.3))
    for bad in ([0.2, 0.1], [np.nan], [-0.1]):
        with pytest.raises(ValueError, match="sigma: expected finite numbers from 0 up that increase"):
            agreement(friction(), bad)
    with pytest.raises(ValueError, match="has no links"):
        agreement(Scene(), [0.1])


def test_the_benchmark_has_a_row_for_each_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    module = benchmarks.load("agreement")
    monkeypatch.setattr(module, "POINTS", 10)
    rows = module.measure(quick=True)
    assert [row[:3] for row in rows] == [("chain(3)", 1.15, 2), ("star(4)", 1.15, 2)]
    assert all(len(row) == len(module.COLUMNS) and sum(row[3:8]) == row[2] for row in rows)
    assert all(row[4] >= 1 for row in rows)  # at alpha = 1.2 nothing synchronises
    assert module.summary(rows).startswith("Both say the same for ")

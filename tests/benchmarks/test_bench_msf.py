"""The benchmark of the master stability function: its rows, its error bars, its differences and its
ratios.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from statistics import fmean

import numpy as np
import pytest

from benchmarks import msf
from benchmarks.peers import PEERS, jitcode_transversal
from synchain import Scene
from synchain.graphs import topology
from synchain.runtime.stability import march

ABSENT = replace(PEERS[msf.PEER], modules=("a_peer_that_nobody_has",))

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def rows() -> list[dict[str, object]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PEERS, msf.PEER, ABSENT)
        found = msf.measure(quick=True)
    return [dict(zip(msf.COLUMNS, row, strict=True)) for row in found]


def test_without_the_peer_its_rows_are_left_out_and_it_is_named(rows, monkeypatch) -> None:
    assert {row["program"] for row in rows} == {"synchain"}
    monkeypatch.setitem(PEERS, msf.PEER, ABSENT)
    (line,) = msf.notes()
    assert line.startswith("skipped: JiTCODE LSODA (No module named 'a_peer_that_nobody_has'")
    assert line.endswith("install jitcode and a C compiler)")


def test_costs_are_beside_the_orbit_alone(rows) -> None:
    for system in msf.LAWS.values():
        along = [row for row in rows if row["what"] == "one orbit" and row["system"] == system]
        assert [row["strengths"] for row in along] == [0, 1, 100]
        assert [row["integrated"] for row in along][:2] == [0, 1]
        assert 1 < along[2]["integrated"] < 100
        for row in along:
            cost = row["microseconds per period"] / along[0]["microseconds per period"]
            assert row["times the orbit alone"] == pytest.approx(cost, rel=1e-12)
        assert along[1]["times the orbit alone"] > 1.0


@pytest.mark.parametrize("contact", msf.LAWS)
def test_modes_run_along_the_stretch_that_the_orbit_alone_does(contact: str) -> None:
    """Once more from the settled state: as many steps as before, and the same end but for rounding."""
    moved, state = msf._ready(contact, msf.OMEGAS[contact][1], np.array([0.5]), 8)
    msf._along(moved, state, 8)  # the first Taylor step of all finds its scale
    first = msf._along(moved, state, 8), moved.integrator.state.copy()
    assert first[0] == msf._along(moved, state, 8)
    np.testing.assert_allclose(first[1], moved.integrator.state, rtol=1e-13)
    np.testing.assert_allclose(moved.integrator.state, state, atol=1e-5)  # two periods of the drive, four times
    assert 0 < msf._alone(moved, state, 8)() < 2 * first[0]


def test_interpolated_exponents_differ_little_and_a_coarse_polynomial_shows(rows, monkeypatch) -> None:
    assert all(
        row["median difference"] <= row["largest difference"] < 1e-6
        for row in rows
        if row["what"] == "one orbit" and row["strengths"]
    )
    values = msf.strengths(100)
    assert 0.0 < msf.difference("atan", values, 8)[0] < 1e-6
    monkeypatch.setattr(march, "NODES", (5,))
    monkeypatch.setattr(march, "PARTS", (1,))
    monkeypatch.setattr(march, "ALLOWED", math.inf)
    assert min(msf.difference("atan", values, 8)) > 1e-4


def test_every_row_to_an_error_bar_reaches_it(rows) -> None:
    reached = [row for row in rows if row["what"] == "to an error bar"]
    assert [row["strengths"] for row in reached] == [1, 1, 1, 1000]
    assert [row["alpha"] for row in reached] == ["0.2", "0.5", "1", "0 … 1.2"]
    assert all(0.0 < row["standard error"] <= msf.LOOSE and row["periods"] >= 64 for row in reached)
    assert reached[1]["exponent"] < 0.0 < reached[2]["exponent"]
    assert math.isnan(reached[3]["exponent"])


@pytest.mark.parametrize("bar", [0.02, 0.005])
def test_the_peers_average_ends_at_the_error_bar(bar: float) -> None:
    """White noise of deviation 1 in each block of 4 periods, after a transient that would spoil the
    mean.
    """
    case = msf.CASES[0]
    asked = []

    def growths(alpha: float, start: np.ndarray, block: float, skipped: int):
        asked.append((alpha, start.tolist(), block, skipped))
        noise = np.random.default_rng(0)
        return (float(x) for x in iter(lambda: noise.normal(-0.3 * block, 1.0), None))

    batches = msf._averaged(growths, case, case.scene, 0.5, bar)
    unit = batches.unit
    assert unit == pytest.approx(2 * math.pi / 1.4)
    assert asked == [(0.5, [0.3, 0.0], 4 * unit, 75)]
    assert batches.error()[0] <= bar
    assert batches.mean()[0, 0] == pytest.approx(-0.3, abs=4 * bar)
    needed = (1.0 / (4 * unit * bar)) ** 2  # blocks, from the deviation of a mean
    assert max(32, 0.8 * needed) <= batches.blocks <= max(32, 2.5 * needed)  # 128 periods at least


def row(program: str, alpha: str, count: int, seconds: float) -> tuple[object, ...]:
    settings = {"what": "to an error bar", "system": "s", "program": program, "alpha": alpha, "strengths": count}
    return tuple({**settings, "seconds": seconds}.get(name, math.nan) for name in msf.COLUMNS)


def test_ratios_are_those_of_the_same_strength_and_of_a_share_of_the_thousand() -> None:
    ours = [row("synchain", "0.2", 1, 0.5), row("synchain", "1", 1, 0.25), row("synchain", "0 … 6", 1000, 4.0)]
    peer = [row("JiTCODE lsoda", "1", 1, 3.0), row("JiTCODE lsoda", "0.2", 1, 2.0)]
    lines = [line.strip("| ").split(" | ") for line in msf.summary([*ours, *peer]).splitlines()[2:]]
    assert lines == [["s", "1", "3", "0.25", "12", "4", "750"], ["s", "0.2", "2", "0.5", "4", "4", "500"]]
    assert msf.summary(ours) == "No peer to compare with."


def test_the_peer_has_the_exponent_of_a_linear_oscillator_in_closed_form() -> None:
    """x'' = -x - alpha v: growth -alpha/2 on average, whatever the direction of the deviation."""
    pytest.importorskip("jitcode")
    scene = Scene(oscillator="harmonic", coupling="damper", topology=topology("chain", 2), record=())
    growths = jitcode_transversal.prepare(scene, "dopri5", 1e-8)
    for alpha in (0.2, 0.6):
        turn = math.pi / math.sqrt(1 - alpha**2 / 4)  # after which every direction is back
        rates = list(itertools.islice(growths(alpha, np.array([1.0, 0.0]), turn, 2), 10))
        assert fmean(rates) / turn == pytest.approx(-alpha / 2, abs=1e-6)


def test_the_peer_takes_two_oscillators() -> None:
    with pytest.raises(ValueError, match="found 3 oscillators; expected two"):
        jitcode_transversal.prepare(Scene(topology=topology("chain", 3), record=()), "lsoda", 1e-6)

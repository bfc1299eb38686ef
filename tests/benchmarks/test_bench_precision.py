"""Work and precision: right references, cases and peers that run, and times at equal error that are
read off correctly.
"""

from __future__ import annotations

import ctypes
import math
import sys
import types

import numpy as np
import pytest

import benchmarks
from benchmarks import dense, precision
from benchmarks.kit import computed
from benchmarks.kit.cases import CASES, normal_modes, read_case
from benchmarks.kit.clock import LONGEST, QUICK, TIMED, curve, timed_periods
from benchmarks.kit.compare import table, time_at
from benchmarks.peers import PEERS, Peer, numbalsoda_solvers
from benchmarks.peers.problem import Problem
from synchain.codegen.simd.lane_types import native_width

SMOOTH, STIFF = "smooth, n = 2", "friction, n = 2"


@pytest.mark.parametrize("name", CASES)
def test_references_agree_with_a_tight_integration(name):
    case = read_case(name)
    states, counts = precision.prepare(case, "rodas5p", native_width())(1e-11, 1e-12, case.times)
    assert np.abs(states - case.states).max() < 1e-10
    assert (counts[:, 0] == 1).all()


@pytest.mark.parametrize("name", CASES)
def test_half_of_the_times_are_period_boundaries(name):
    case = read_case(name)
    periods = case.times / case.period
    assert len(periods) >= 40
    assert (np.diff(periods) > 0).all()
    assert 2 * np.count_nonzero(np.abs(periods - np.round(periods)) < 1e-12) == len(periods)


def test_unknown_cases_are_refused():
    with pytest.raises(ValueError, match="unknown case 'rough'; known: friction"):
        read_case("rough")


def test_a_case_can_be_shortened():
    part = read_case("linear, driven, n = 4").within(3)
    assert part.periods == 3
    assert part.states.shape == (6, 8)


@pytest.mark.parametrize("omega", [1.15, 1.0, math.sqrt(1.2)])
def test_normal_modes_solve_the_equations(omega):
    """x' = v and v' = rhs by central differences: off resonance, on it, and at the frequency of an
    undriven mode.
    """
    scene = read_case("linear, driven, n = 4").scene.replace(
        omega=omega, initial={"x": (0.3, -0.1, 0.2, 0.7), "v": (0.4, -0.2, 0.1, 0.3)}
    )
    rhs, _ = Problem(scene).compiled()
    times, h, out = np.linspace(0.0, 40.0, 9), 1e-5, np.empty(8)
    states = normal_modes(scene, times)
    rates = (normal_modes(scene, times + h) - normal_modes(scene, times - h)) / (2.0 * h)
    assert np.abs(states[0] - scene.y0).max() < 1e-15
    for t, y, rate in zip(times, states, rates, strict=True):
        rhs(t, y, out)
        assert np.abs(out - rate).max() < 1e-8


@pytest.mark.long
def test_the_exact_law_is_another_problem_near_the_smoothed_one():
    smooth = read_case("friction, n = 1")
    case = precision.case_of("exact law, n = 1")
    assert "kappa" not in case.scene.parameters
    assert case.states.shape == (len(case.times), 3)
    gap = np.abs(case.states[:, :2] - smooth.states).max()
    assert 1e-6 < gap < 0.1
    assert set(case.states[:, 2]) <= {-1.0, 0.0, 1.0}


@pytest.mark.long
def test_the_exact_law_needs_fewer_steps_and_is_as_right_as_its_tolerance():
    smooth, exact = precision.case_of("friction, n = 1"), precision.case_of("exact law, n = 1")
    steps = {}
    for case, integrator in ((smooth, "rodas5p"), (exact, "taylor"), (exact, "dop853")):
        states, counts = precision.prepare(case, integrator, 1)(1e-10, 1e-11, case.times)
        assert np.abs(states - case.states).max() < 1e-9, integrator
        steps[integrator] = counts[-1, 1]
    assert steps["taylor"] < steps["dop853"] < 0.2 * steps["rodas5p"]


def test_methods_are_left_out_where_they_are_not_to_the_point():
    taylor, rodas5p = (precision.Method(name, True, precision.TOLERANCES) for name in ("taylor", "rodas5p"))
    friction, pendulum = read_case("friction, n = 2"), computed.computed_case("pendulum, n = 2")
    assert (taylor.suits(friction), rodas5p.suits(friction)) == (False, True)
    assert (taylor.suits(pendulum), rodas5p.suits(pendulum)) == (True, False)


def test_peers_read_at_times_that_increase():
    lengths = [length for *_, length in computed.SMOOTH.values()]
    assert min(lengths) == 1
    assert all(0.0 < middle < end == length for length in lengths for middle, end in [computed.reading_times(length)])


def test_timed_runs_are_equally_long_but_for_slow_methods():
    assert timed_periods(cost=1e-9, least=20, quick=True) == timed_periods(cost=1e-4, least=20, quick=True) == TIMED
    assert timed_periods(cost=LONGEST / 50, least=20, quick=False) == 50
    assert timed_periods(cost=LONGEST / 50, least=2, quick=True) == 50 // QUICK
    assert timed_periods(cost=1.0, least=20, quick=False) == 20


@pytest.mark.long
def test_dense_rows_are_right_at_every_reading():
    case = dense.case_of("pendulum, n = 2", periods=4)
    assert case.states.shape == (80, 4)
    for point in dense.own_points(case, quick=True):
        assert point.error < 100 * point.rtol, point


def test_normal_modes_need_a_scene_without_friction():
    case = read_case(STIFF)
    with pytest.raises(ValueError, match=r"mu_s = mu_k = 0, found 0\.3 and 0\.15"):
        normal_modes(case.scene, case.times)


@pytest.mark.parametrize("name", [STIFF, "friction, n = 4"])
def test_the_printed_jacobian_is_the_derivative_of_the_printed_right_hand_side(name):
    problem = Problem(read_case(name).scene.replace(kappa=50.0))
    size = len(problem.y0)
    y = problem.y0 + np.linspace(-0.02, 0.03, size)
    rhs, jacobian = problem.compiled()
    exact, high, low = np.empty((size, size)), np.empty(size), np.empty(size)
    jacobian(0.7, y, exact)
    for column, step in enumerate(1e-6 * np.eye(size)):
        rhs(0.7, y + step, high)
        rhs(0.7, y - step, low)
        assert np.abs((high - low) / 2e-6 - exact[:, column]).max() < 1e-5


@pytest.mark.long
def test_the_paper_method_is_held_back_by_stability():
    """Cash-Karp at 1e-15/1e-12 needs 15 thousand steps a period, more than a hundred times those of
    a stiff method.
    """
    case = read_case(STIFF)
    end = np.array([10 * case.period])
    _, slow = precision.prepare(case, "cash_karp", 1)(*precision.PAPER, end)
    _, fast = precision.prepare(case, "rodas5p", 1)(1e-6, 1e-7, end)
    assert slow[0, 1] > 100 * fast[0, 1]


def marked(peer):
    """A peer that a compiler of C++ builds takes ten times as long as the others."""
    return pytest.param(peer, marks=[pytest.mark.long] if peer.startswith("boost") else [])


@pytest.mark.parametrize("peer", [marked(peer) for peer in PEERS])
def test_peers_solve_the_smooth_case(peer):
    solver = PEERS[peer]
    if why := solver.absence():
        pytest.skip(f"{solver.name}: {why}")
    case = read_case(SMOOTH).within(6)
    states = solver.prepare(Problem(case.scene))(*solver.tolerances[len(solver.tolerances) // 2], case.times)
    assert states.shape == case.states.shape
    assert np.abs(states - case.states).max() < 1e-6


def test_the_callback_of_numbalsoda_is_the_right_hand_side(monkeypatch):
    """Through its C address, as the solvers call it; the signature is that of the package, which
    need not be there.
    """
    numba = pytest.importorskip("numba")
    pointer = numba.types.CPointer(numba.float64)
    fake = types.SimpleNamespace(lsoda_sig=numba.types.void(numba.float64, pointer, pointer, pointer))
    monkeypatch.setitem(sys.modules, "numbalsoda", fake)
    problem = Problem(read_case(STIFF).scene)
    rhs, _ = problem.compiled()
    expected, out, unused = np.empty(4), np.empty(4), np.zeros(1)
    rhs(0.7, problem.y0, expected)
    callback = numbalsoda_solvers.compiled(problem)
    place = ctypes.POINTER(ctypes.c_double)
    function = ctypes.CFUNCTYPE(None, ctypes.c_double, place, place, place)(callback.address)
    function(0.7, *(a.ctypes.data_as(place) for a in (problem.y0, out, unused)))
    np.testing.assert_allclose(out, expected, rtol=1e-14)
    assert np.abs(expected).max() > 0.1


@pytest.mark.parametrize("peer", PEERS.values(), ids=PEERS)
def test_tolerances_of_peers_are_tried_loose_first(peer):
    assert list(peer.tolerances) == sorted(peer.tolerances, reverse=True)
    assert all(rtol > atol > 0.0 for rtol, atol in peer.tolerances)


def test_missing_peers_are_named_with_the_remedy(monkeypatch):
    monkeypatch.setitem(PEERS, "x", Peer("Solver X", "solver-x", None, (), modules=("no_such_module_x",)))
    monkeypatch.setitem(PEERS, "y", Peer("Solver Y", "y-tools", None, (), programs=("no-such-program-y",)))
    monkeypatch.setitem(PEERS, "z", Peer("Solver Z", "z-lib", None, (), fault=lambda: "no z.h"))
    assert set(precision.notes()) >= {
        "skipped: Solver X (No module named 'no_such_module_x'; install solver-x)",
        "skipped: Solver Y (no program 'no-such-program-y' on the path; install y-tools)",
        "skipped: Solver Z (no z.h; install z-lib)",
    }


def exact(error, gives_up=lambda rtol: False, cells=1):
    """A peer that knows the smooth case, off by `error` times rtol."""
    case = read_case(SMOOTH)

    def solve(rtol, atol, times):
        if gives_up(rtol):
            raise RuntimeError("too many\nsteps")
        rows = [case.states[min(np.searchsorted(case.times, t - 1e-9), len(case.times) - 1)] for t in times]
        return np.array(rows) + error * rtol

    tolerances = ((1e-4, 1e-5), (1e-6, 1e-7))
    return Peer("X", "x", lambda problem: solve, tolerances, cells=cells)


def test_a_curve_has_a_point_a_tolerance_with_its_error():
    loose, tight = curve(exact(3.0), read_case(SMOOTH), quick=False)
    assert [p.error for p in (loose, tight)] == pytest.approx([3e-4, 3e-6], rel=1e-6)
    assert loose.periods == 100
    assert (loose.remark, loose.lanes) == ("", 1)
    assert loose.seconds > 0.0


def test_a_peer_that_gives_up_is_a_row_with_the_reason_and_the_next_is_tried():
    loose, tight = curve(exact(1.0, gives_up=lambda rtol: rtol > 1e-5), read_case(SMOOTH), quick=False)
    assert math.isnan(loose.error)
    assert math.isnan(loose.seconds)
    assert loose.remark == "failed: too many steps"
    assert tight.error == pytest.approx(1e-6, rel=1e-6)


def test_states_that_are_not_finite_are_a_failure():
    (point, *_) = curve(exact(math.nan), read_case(SMOOTH), quick=True)
    assert "not all finite" in point.remark


def test_a_peer_that_cannot_be_prepared_is_one_row():
    def prepare(problem):
        raise OSError("no compiler")

    peer = Peer("X", "x", prepare, ((1e-4, 1e-5), (1e-6, 1e-7)))
    (point,) = curve(peer, read_case(SMOOTH), quick=False)
    assert point.remark == "failed: no compiler"


def test_times_are_interpolated_in_logarithms_and_never_extrapolated():
    points = [(1e-4, 10.0), (1e-8, 1000.0)]
    assert time_at(points, 1e-6) == pytest.approx(100.0)
    assert time_at(points, 1e-2) == 10.0
    assert time_at(points, 1e-8) == 1000.0
    assert math.isnan(time_at(points, 1e-9))
    assert math.isnan(time_at([], 1e-6))


def test_a_tighter_tolerance_that_is_faster_counts():
    """CVODE at a loose tolerance is slower than at a tight one on the friction cases."""
    assert time_at([(1e-1, 100.0), (1e-9, 3.0)], 1e-2) == 3.0


def test_ratios_are_to_the_fastest_own_method_with_full_lanes():
    def row(method, lanes, error, cost):
        return {"case": "c", "method": method, "lanes": lanes, "error": error, "microseconds per period": cost}

    rows = [
        row("ours", 1, 1e-12, 8.0),
        row("ours", 8, 1e-12, 2.0),
        row("other", 8, 1e-12, 4.0),
        row("theirs", 8, 1e-7, 1.0),
        row("theirs", 8, math.nan, math.nan),
    ]
    lines = table(rows, own={"ours", "other"}).splitlines()[4:]
    assert lines[0] == "| c | ours | 1 | 8 | 4 | 8 | 4 | 8 | 4 | 8 | 4 |"
    assert lines[1] == "| c | ours | 8 | 2 | 1 | 2 | 1 | 2 | 1 | 2 | 1 |"
    assert lines[2] == "| c | other | 8 | 4 | 2 | 4 | 2 | 4 | 2 | 4 | 2 |"
    assert lines[3] == "| c | theirs | 8 | 1 | 0.5 | – | – | – | – | – | – |"
    assert table([], own=set()) == ""


@pytest.mark.long
def test_every_case_runs_and_its_table_and_figure_are_written(monkeypatch, tmp_path):
    methods = (precision.Method("rodas5p", True, ((1e-5, 1e-6), (1e-6, 1e-7)), longest=10),)
    monkeypatch.setattr(precision, "METHODS", methods)
    for peer in set(PEERS) - {"scipy_lsoda"}:
        monkeypatch.delitem(PEERS, peer)
    rows = precision.measure(quick=True)
    assert {row[0] for row in rows} == {*CASES, *computed.SMOOTH}
    assert {row[1] for row in rows} == {"rodas5p", "SciPy LSODA (odeint)"}
    assert all(len(row) == len(precision.COLUMNS) for row in rows)
    ours = [row for row in rows if row[1] == "rodas5p"]
    assert all(row[5] < 1e-3 and row[6] > 0.0 and row[7] > 1.0 for row in ours)
    files = benchmarks.write("precision", precision, rows, tmp_path)
    assert [path.suffix for path in files] == [".csv", ".md", ".png", ".svg"]
    lines = files[0].read_text().splitlines()
    assert len(lines) == 1 + len(rows)
    assert "at the same error" in files[1].read_text()


def test_lanes_that_follow_the_tolerance_are_one_curve_in_its_order():
    def row(lanes, error, cost):
        return {"case": "c", "method": "ours", "lanes": lanes, "error": error, "microseconds per period": cost}

    rows = [row(8, 1e-5, 1.0), row(16, 1e-7, 4.0), row(8, 1e-13, 64.0), row(1, 1e-12, 90.0)]
    first, alone = table(rows, own={"ours"}).splitlines()[4:]
    assert first == "| c | ours | 8, 16 | 2 | 1 | 6.35 | 1 | 16 | 1 | 40.3 | 1 |"
    assert alone.startswith("| c | ours | 1 | 90 | 45 |")

"""How long a peer takes and how far off it is: one row for each of its tolerances."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..peers.peer import Peer
from ..peers.problem import Problem, Solve
from .cases import Case

SHORTEST = 0.2
"""A timed run lasts at least this many seconds of CPU time, by repetition."""
LONGEST = 1.0
"""A slower run than this is shortened to fewer periods, down to FEWEST, and not repeated."""
QUICK = 10
"""Quick runs are this many times shorter."""
FEWEST = 5
TIMED = 200
"""Periods of a timed run of methods that are fast enough.

A motion asks for other steps at its beginning than later.
"""
GIVE_UP = 2.0
"""A peer that needs more seconds of CPU time for one period is not tried at tighter tolerances."""


@dataclass(frozen=True, slots=True)
class Point:
    """One method at one tolerance: error (largest over times and components), seconds per period
    and core.

    `periods` is how much of the case was run, `compile` the seconds of preparation, `remark` why
    numbers are NaN or few.
    """

    method: str
    lanes: int
    rtol: float
    atol: float
    error: float
    seconds: float
    periods: int
    compile: float
    steps: float = float("nan")
    remark: str = ""


def best_time(run: Callable[[], object], quick: bool) -> float:
    """CPU seconds of one call: the best of three groups of repetitions of at least SHORTEST seconds
    each, or one call where that takes LONGEST or more; QUICK times shorter with `quick`.
    """
    parts = QUICK if quick else 1
    first = _seconds(run, 1)
    if first >= LONGEST / parts:
        return first
    repetitions = max(1, int(np.ceil(SHORTEST / parts / max(first, 1e-9))))
    return min(first, *(_seconds(run, repetitions) for _ in range(3)))


def timed_periods(cost: float, least: int, quick: bool) -> int:
    """Return the length of a timed run: TIMED periods, or as many as LONGEST seconds allow."""
    longest = LONGEST / QUICK if quick else LONGEST
    return max(least, min(TIMED, int(longest / max(cost, 1e-9))))


def _seconds(run: Callable[[], object], repetitions: int) -> float:
    begin = time.process_time()
    for _ in range(repetitions):
        run()
    return (time.process_time() - begin) / repetitions


def curve(peer: Peer, case: Case, quick: bool, read_all: bool = False) -> Iterator[Point]:
    """Yield a point for each tolerance of a peer, loose first; a failure is a point with NaN and a
    remark.  The timed run has one end, or with `read_all` all times of the case.
    """
    tolerances = peer.tolerances[:: max(2, len(peer.tolerances) // 2)] if quick else peer.tolerances
    begin = time.perf_counter()
    try:
        solve = peer.prepare(Problem(case.scene))
    except Exception as problem:  # a peer may fail in any way; the table says how
        yield _failed(peer.name, peer.cells, tolerances[0], time.perf_counter() - begin, problem)
        return
    prepared = time.perf_counter() - begin
    for rtol, atol in tolerances:
        begin = time.perf_counter()
        try:
            cost = _pilot(solve, rtol, atol, case.period)
            compiled = prepared + max(0.0, time.perf_counter() - begin - 2.0 * cost)
            periods, error, seconds = _measure(solve, rtol, atol, case, cost, quick, read_all)
        except Exception as problem:
            yield _failed(peer.name, peer.cells, (rtol, atol), prepared, problem)
            continue
        remark = "" if periods == case.periods else f"{periods} of {case.periods} periods"
        yield Point(peer.name, peer.cells, rtol, atol, error, seconds / peer.cells, periods, compiled, remark=remark)
        if cost > (0.05 * GIVE_UP if quick else GIVE_UP):
            return


def _pilot(solve: Solve, rtol: float, atol: float, period: float) -> float:
    """CPU seconds of one period, the second time."""
    one = np.array([period])
    solve(rtol, atol, one)
    return _seconds(lambda: solve(rtol, atol, one), 1)


def _measure(
    solve: Solve, rtol: float, atol: float, case: Case, cost: float, quick: bool, read_all: bool
) -> tuple[int, float, float]:
    """Periods compared, error and CPU seconds a period; a timed run with one end is like the pilot,
    for which JAX compiled, and goes on beyond the reference if that is short.
    """
    longest = LONGEST / QUICK if quick else LONGEST
    fewest = max(
        2 if quick else FEWEST, int(np.ceil(case.times[1] / case.period * (1.0 - 1e-12)))
    )  # two times at least
    periods = min(case.periods, max(fewest, int(longest / max(cost, 1e-9))))
    part = case.within(periods)
    states = solve(rtol, atol, part.times)
    if states.shape != part.states.shape or not np.isfinite(states).all():
        raise RuntimeError(f"states {states.shape} that are not all finite; expected {part.states.shape}")
    length = periods if read_all else timed_periods(cost, periods, quick)
    ends = part.times if read_all else np.array([length * case.period])
    seconds = best_time(lambda: solve(rtol, atol, ends), quick)
    return periods, float(np.abs(states - part.states).max()), seconds / length


def _failed(name: str, lanes: int, tolerances: tuple[float, float], compiled: float, problem: Exception) -> Point:
    words = " ".join(str(problem).split()) or type(problem).__name__
    nan = float("nan")
    return Point(name, lanes, *tolerances, nan, nan, 0, compiled, remark=f"failed: {words[:120]}")

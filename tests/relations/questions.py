"""What each function that computes is asked, in any units, and its answer without units.

A `Units` changes the unit of time and, for each component, scale and origin.  Rates, strengths, starts, ranges, times and
precisions are those of the same motion in other units; counts of periods and relative tolerances have none.  So each
answer, divided by its units, is the same number.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import synchain as sc

Answer = dict[str, np.ndarray]


@dataclass(frozen=True)
class Units:
    """Rates are `k` times as fast; a state z is offset + scale times what it is in units of 1."""

    k: float = 1.0
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def parameters(self) -> dict[str, float]:
        return dict(zip(("k", "p", "q", "c", "d"), (self.k, *self.scale, *self.offset), strict=True))

    def put(self, x: ArrayLike, v: ArrayLike) -> dict[str, list[float]]:
        """States in these units."""
        columns = zip((x, v), self.scale, self.offset, strict=True)
        return dict(zip("xv", (np.atleast_1d(o + s * np.asarray(z)).tolist() for z, s, o in columns), strict=True))

    def take(self, states: ArrayLike) -> np.ndarray:
        """States (2, nodes) in units of 1."""
        return (np.asarray(states, float) - np.c_[list(self.offset)]) / np.c_[list(self.scale)]


PLAIN = Units()
X, V = "((x - c)/p)", "((v - d)/q)"
Change = Callable[[sc.Scene], sc.Scene]


def field(second: str, **parameters: float) -> sc.Field:
    """x'' = second(x, x', t) in the units p, q of the states, with the origin (c, d) and k times as fast."""
    rates = {"x": f"k*p*{V}", "v": f"k*q*({second.replace('X', X).replace('V', V)})"}
    return sc.Field(rates, parameters={**PLAIN.parameters, **parameters})


PULL = sc.Rates({"v": "g*W*(v_j - v_i)"}, {"g": 0.2})
CYCLE = field("(1 - X**2)*V - X")
"""Van der Pol's oscillator: one attractor, a period of 6.6633, exponents 0, -0.1376, -0.5914 at g = 0, 0.3, 1."""
DRIVEN = field("-X - X**3 - V/5 + u*cos(w*k*t)", u=0.3, w=1.2)
REST = field("h - X - X**3 - V", h=0.7)


def pair(
    units: Units = PLAIN, node: sc.Field = CYCLE, x: ArrayLike = (1.0, -0.5), v: ArrayLike = (0.1, 0.4)
) -> sc.Scene:
    """Two nodes, each with a start of its own, coupled through their velocities."""
    return sc.Scene(
        node,
        PULL,
        sc.graphs.chain(2),
        parameters={**units.parameters, "g": 0.2 * units.k},
        initial=units.put(x, v),
        transient=0.0,
        window=20.0 / units.k,
        time_unit="time",
    )


def driven(units: Units = PLAIN) -> sc.Scene:
    """One node with a drive."""
    return sc.Scene(DRIVEN, None, parameters=units.parameters, initial=units.put(0.5, 0.1), transient=20.0, window=5.0)


QUIET: dict[str, Any] = {"show_progress": False}
SHORT: dict[str, Any] = {"periods": 40, "transient": 20, **QUIET}
FEW = {"starts": 2, "transient": 120.0, "window": 10.0}
STRENGTHS = np.array([0.0, 0.3, 1.0])


def criterion(units: Units) -> sc.Criterion:
    return sc.Criterion(**(FEW | {"transient": FEW["transient"] / units.k, "window": FEW["window"] / units.k}))


def edges(intervals: Any) -> np.ndarray:
    """All ends of some ranges in one row."""
    return np.array([end for interval in intervals for end in interval], float)


def of_run(units: Units, change: Change, path: Path) -> Answer:
    return {"end": units.take(sc.run(change(pair(units)), **QUIET).end.values)}


def of_stream(units: Units, change: Change, path: Path) -> Answer:
    target = path / "cells.nc"
    target.unlink(missing_ok=True)
    written = sc.stream(change(pair(units)), target, **QUIET)
    return {"end": units.take(sc.open_result(written.path).end.values)}


def of_basin(units: Units, change: Change, path: Path) -> Answer:
    scene = change(pair(units))
    box = dict(zip(scene.components, map(tuple, units.put([-2, 2], [-2, 2]).values()), strict=True))
    times = {"transient": 36.0 / units.k, "window": 4.0 / units.k}
    result = sc.basin(scene, samples=8, ranges=box, **times, **QUIET)
    return {"share": result.shares.sel(attractor="synchronous").values}


def of_thresholds(units: Units, change: Change, path: Path) -> Answer:
    result = sc.thresholds(
        change(pair(units)),
        sigma=units.k * np.array([0.02, 0.3, 0.6]),
        resolution=0.1 * units.k,
        precision=3e-3 * units.k,
        periods=40,
        criterion=criterion(units),
        **QUIET,
    )
    return {
        "exponents": edges(result.exponents.intervals) / units.k,
        "probe": edges(result.probe.intervals) / units.k,
        "direct": edges(result.direct.intervals) / units.k,
    }


def of_probe(units: Units, change: Change, path: Path) -> Answer:
    strengths = units.k * np.array([-0.3, 0.3, 1.0])
    result = sc.universal_probe(change(pair(units)), strengths, 0.0, criterion=criterion(units), **QUIET)
    return {"synchronous": np.asarray(result.synchronous, float)}


def of_exponents(units: Units, change: Change, path: Path) -> Answer:
    result = sc.exponents(change(pair(units)), units.k * STRENGTHS, precision=3e-3 * units.k, **SHORT)
    return {"exponent": result.exponent / units.k}


def of_msf(units: Units, change: Change, path: Path) -> Answer:
    result = sc.msf(change(pair(units)), units.k * np.array([-0.3, 0.3, 1.0]), precision=3e-3 * units.k, **SHORT)
    return {"exponent": result.exponent / units.k, "open": np.array(len(result.intervals), float)}


def of_plane(units: Units, change: Change, path: Path) -> Answer:
    grid = units.k * np.array([0.3, 1.0])
    result = sc.plane(change(pair(units)), grid, units.k * np.array([0.0, 0.5]), precision=3e-3 * units.k, **SHORT)
    return {"exponent": result.exponent / units.k}


def of_clusters(units: Units, change: Change, path: Path) -> Answer:
    result = sc.cluster_exponents(change(pair(units)), [0, 0], precision=3e-3 * units.k, **SHORT)
    return {"exponent": np.sort(np.ravel(result.exponent)) / units.k}


def of_spectrum(units: Units, change: Change, path: Path) -> Answer:
    result = sc.lyapunov_spectrum(change(pair(units)), precision=3e-3 * units.k, **SHORT)
    return {"exponent": result.exponent / units.k}


def of_equilibrium(units: Units, change: Change, path: Path) -> Answer:
    scene = pair(units, REST, (0.5, 0.2), (0.1, 0.0))
    result = sc.equilibrium(change(scene))
    return {
        "state": units.take(np.reshape(result.state, (2, -1))),
        "real": np.sort(result.eigenvalues.real) / units.k,
        "imaginary": np.sort(result.eigenvalues.imag) / units.k,
    }


def of_orbit(units: Units, change: Change, path: Path) -> Answer:
    scene = pair(units, x=(1.0, 1.0), v=(0.1, 0.1)).replace(transient=60.0)  # mean return times
    orbit = sc.periodic_orbit(change(scene))
    return {"period": np.array(orbit.period * units.k), "multipliers": np.sort(np.abs(orbit.multipliers))}


def _orbit_of_drive(units: Units, change: Change) -> tuple[sc.Scene, sc.results.PeriodicOrbit]:
    scene = change(driven(units))
    return scene, sc.periodic_orbit(scene)


def _at_values(branch: sc.results.Branch) -> np.ndarray:
    """Return the states at the values that were asked for; the steps between them may depend on the units."""
    states = [orbit.state for value, orbit in zip(branch.values, branch.orbits, strict=True) if value in (1.2, 1.25)]
    assert len(states) == 2
    return np.array(states)


def of_follow(units: Units, change: Change, path: Path) -> Answer:
    _, first = _orbit_of_drive(units, change)
    branch = sc.follow(first, "w", values=[1.2, 1.25])
    return {"states": units.take(_at_values(branch).T)}


def of_skeleton(units: Units, change: Change, path: Path) -> Answer:
    result = sc.skeleton(change(driven(units)), "w", [1.2, 1.25], (1,), 1, **QUIET)
    states = np.vstack([_at_values(branch) for branch in result])
    return {"branches": np.array(len(result), float), "states": units.take(states.T)}


ASKED: dict[str, Callable[[Units, Change, Path], Answer]] = {
    "run": of_run,
    "stream": of_stream,
    "basin": of_basin,
    "thresholds": of_thresholds,
    "universal_probe": of_probe,
    "exponents": of_exponents,
    "msf": of_msf,
    "plane": of_plane,
    "cluster_exponents": of_clusters,
    "lyapunov_spectrum": of_spectrum,
    "equilibrium": of_equilibrium,
    "periodic_orbit": of_orbit,
    "follow": of_follow,
    "skeleton": of_skeleton,
}
"""Every function that computes, as `TAKEN` of tests/test_keywords.py lists them."""

SIMULATED = {"run": 1e-6, "stream": 1e-6}
EXACT = {"equilibrium": 1e-8, "periodic_orbit": 1e-5, "follow": 1e-6, "skeleton": 1e-6}
TOLERANCE = {name: (SIMULATED | EXACT).get(name, 0.02) for name in ASKED}
"""How far two answers may lie apart: exponents by their error, edges by what a resolution of 0.1 allows."""
RESOLUTION = {"probe": 0.2, "direct": 0.1, "exponents": 0.1}


def same_scene(scene: sc.Scene) -> sc.Scene:
    return scene


@contextmanager
def bounded(seconds: float) -> Iterator[None]:
    """End in an error what takes more than some seconds of the processor."""

    def end(*_: object) -> None:
        raise TimeoutError(f"more than {seconds} s of processor time")

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


SLOWEST = 1e5
"""Factors of time from which a function that counts periods in a unit of its own may never end, nor listen to signals."""


def ask(name: str, path: Path, units: Units = PLAIN, change: Change = same_scene, seconds: float = 60.0) -> Answer:
    """The answer of a function, without its warnings."""
    if units.k > SLOWEST and change is same_scene:
        return _of_process(name, path, units, seconds)
    return _answer(name, path, units, change, seconds)


def _of_process(name: str, path: Path, units: Units, seconds: float) -> Answer:
    """The answer by a process that can be ended, by its time on the processor."""
    text = f"import questions, pathlib; questions._answer({name!r}, pathlib.Path({str(path)!r}), questions.{units!r}, save=True)"
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
    most = int(seconds) + 10
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_CPU, ({most}, {most + 2})); "
    command = [sys.executable, "-W", "ignore", "-c", limit + text]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60.0 * seconds, check=False)
    if done.returncode:
        raise RuntimeError((done.stderr or f"more than {seconds} s of processor time").strip().splitlines()[-1])
    with np.load(path / "answer.npz") as held:
        return dict(held)


def _answer(
    name: str, path: Path, units: Units, change: Change = same_scene, seconds: float = 60.0, save: bool = False
) -> Answer:
    with warnings.catch_warnings(), bounded(seconds):
        warnings.simplefilter("ignore")
        answer = ASKED[name](units, change, path)
    if save:
        np.savez(path / "answer.npz", **answer)
    return answer


@cache
def plain_answer(name: str, path: Path) -> Answer:
    """The answer in units of 1, once for all tests."""
    return ask(name, path)


def expect_equal(name: str, answer: Answer, expected: Answer, times: float = 1.0) -> None:
    """Compare two answers within the tolerance of the function; same shapes, and no NaN."""
    assert answer.keys() == expected.keys()
    for what, value in expected.items():
        allowed = times * RESOLUTION.get(what, 0.0) if name == "thresholds" else times * TOLERANCE[name]
        assert answer[what].shape == value.shape, f"{name}: {what} is {answer[what]}; expected {value}"
        np.testing.assert_allclose(answer[what], value, rtol=0.0, atol=allowed, err_msg=f"{name}: {what}")


__all__ = ["ASKED", "PLAIN", "TOLERANCE", "Units", "ask", "expect_equal", "pair", "plain_answer", "replace"]

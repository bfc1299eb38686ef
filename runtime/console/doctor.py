"""Is this installation sound?  Versions, cache, processor, elementary functions, and answers that are known."""

from __future__ import annotations

import importlib.metadata
import math
import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

__all__ = ["CHECKS", "Check", "examine"]

FINE, DOUBTFUL, WRONG = "fine", "doubtful", "wrong"
LANE_ERROR = 1.5
"""Largest error of an elementary function, in units of the last place."""
EDGES: dict[str, tuple[float, ...]] = {
    "exp": (0.0, -0.0, 1e-300, 0.5 * math.log(2.0), 1.0, -1.0, 709.78, -708.3, -744.0),
    "expm1": (1e-300, -1e-16, 0.34, 0.35, -0.3, 1.0, 700.0, -40.0),
    "log": (1.0, 1.0 - 2.0**-53, 1.0 + 2.0**-52, 5e-324, 2.2250738585072014e-308, math.sqrt(0.5), 2.0, 1.7e308),
    "atan": (0.0, 5e-324, -1e-8, 0.4375, 1.0, -1.0, 2.4142135623730951, 1e5, -1e16, 1.7e308),
    "sin": (0.0, 1e-300, math.pi / 4, math.pi / 2, math.pi, -22.0, 355.0, 1e5, 1e9),
    "cos": (0.0, 1e-300, math.pi / 4, math.pi / 2, math.pi, -22.0, 355.0, 1e5, 1e9),
    "tanh": (0.0, 1e-300, 0.625, -0.55, 1.0, 18.9, 22.0, -800.0),
}
"""Function -> arguments beside its seams, zeros, and the ends of the range of double precision."""
TRAJECTORY_ERROR = 1e-9


@dataclass(frozen=True, slots=True)
class Check:
    """What was looked at, how it is ("fine", "doubtful" or "wrong"), what was found, and what helps."""

    name: str
    outcome: str
    found: str
    remedy: str = ""

    def as_dict(self) -> dict[str, str]:
        """The check in JSON types."""
        return {"name": self.name, "outcome": self.outcome, "found": self.found, "remedy": self.remedy}


def examine() -> Iterator[Check]:
    """Yield the checks one after the other; one that cannot be made is wrong and says why."""
    for name, look in CHECKS.items():
        try:
            outcome, found, remedy = look()
        except Exception as problem:  # a broken installation may raise anything anywhere
            reason = " ".join(str(problem).split()) or "no reason given"
            outcome, found, remedy = WRONG, f"{type(problem).__name__}: {reason}", "install synchain anew"
        yield Check(name, outcome, found, remedy)


Answer = tuple[str, str, str]
"""Outcome, what was found, what helps."""


def _packages() -> Answer:
    from packaging.requirements import Requirement

    found, missing = [f"Python {platform.python_version()}"], []
    for line in importlib.metadata.requires("synchain") or ():
        need = Requirement(line)
        if need.marker is not None and not need.marker.evaluate({"extra": ""}):
            continue
        try:
            version = importlib.metadata.version(need.name)
        except importlib.metadata.PackageNotFoundError:
            missing.append(f"{need.name} is missing, expected {need.name}{need.specifier}")
            continue
        found.append(f"{need.name} {version}")
        if not need.specifier.contains(version, prereleases=True):
            missing.append(f"{need.name} is {version}, expected {need.name}{need.specifier}")
    if missing:
        return WRONG, "; ".join(missing), "python -m pip install --upgrade synchain"
    return FINE, f"synchain {importlib.metadata.version('synchain')}, {', '.join(found)}", ""


def _cache() -> Answer:
    from synchain.codegen.kernels.cache import cache_folder, describe, open_folder

    try:
        with open_folder(cache_folder()) as opened:
            opened.write(probe := f"probe-{os.getpid()}", b"0" * 4096)
            opened.delete(probe)
            folder = opened.path
    except (OSError, RuntimeError) as problem:  # RuntimeError: no home folder
        words = " ".join(str(problem).split())
        return DOUBTFUL, f"every process compiles its kernels: {words}", "set SYNCHAIN_CACHE to a folder of yours"
    mode = f", mode {folder.stat().st_mode & 0o777:o}" if os.name == "posix" else ""
    return FINE, f"{folder}, {describe()['kernels']} kernels{mode}", ""


def _processor() -> Answer:
    import llvmlite.binding as llvm

    from synchain.codegen.simd.lane_types import native_width

    from ..support.threads import worker_count

    width, threads = native_width(), worker_count(None)
    words = f"{llvm.get_host_cpu_name()}, {width} lanes of double precision, {threads} threads"
    if width < 4 and platform.machine().lower() in ("x86_64", "amd64"):
        return DOUBTFUL, words, "without AVX sweeps take several times as long; unset SYNCHAIN_WIDTH if it is set"
    return FINE, words, ""


def _elementary_functions() -> Answer:
    from synchain.codegen.simd.lane_types import native_width

    width = native_width()
    worst = max((_lane_error(name, width), name) for name in EDGES)
    words = f"largest error {worst[0]:.2f} units of the last place, in {worst[1]}, {width} lanes"
    if not worst[0] <= LANE_ERROR:
        return WRONG, f"{words}; expected at most {LANE_ERROR}", "report this with the lines above"
    return FINE, words, ""


def _lane_error(name: str, width: int) -> float:
    """The largest error at the edges, in units of the last place of the result."""
    import mpmath

    points = np.array(EDGES[name])
    found = _evaluate(name, points, width)
    if not np.isfinite(found).all():
        return math.inf
    with mpmath.workdps(60):
        exact = [getattr(mpmath, name)(mpmath.mpf(float(x))) for x in points]
        gaps = [abs(mpmath.mpf(float(y)) - e) for y, e in zip(found, exact, strict=True)]
        units = np.spacing(np.maximum(np.abs([float(e) for e in exact]), np.finfo(float).tiny))
        return float(max(gap / mpmath.mpf(float(unit)) for gap, unit in zip(gaps, units, strict=True)))


def _evaluate(name: str, points: np.ndarray, width: int) -> np.ndarray:
    """The values (m,) of an elementary function of lanes at the points (m,)."""
    from numba import njit

    from synchain.codegen.simd import elementary
    from synchain.codegen.simd.lanes import load, store

    function = getattr(elementary, name)

    @njit(error_model="numpy")
    def loop(a: np.ndarray, out: np.ndarray) -> None:
        for i in range(a.size // width):
            store(out, i, function(load(a, i, width)))

    padded = np.concatenate([points, np.ones(-len(points) % width)])
    out = np.empty_like(padded)
    loop(padded, out)
    return out[: len(points)]


def _spectrum() -> Answer:
    import sympy as sp

    from synchain.models.graphs.families import topology

    found = [(e.exact, e.multiplicity) for e in topology("chain", 4).spectrum.eigenvalues]
    root = sp.sqrt(2)
    if dict(found) != {sp.S.Zero: 1, root - 2: 1, sp.Integer(-2): 1, -root - 2: 1}:
        return WRONG, f"the chain of 4 has {found}", "install sympy and python-flint anew"
    return FINE, "the chain of 4 has 0, -2+√2, -2, -2-√2, exactly", ""


def _trajectory() -> Answer:
    from ..bench.kit.cases import read_case
    from ..bench.kit.own_program import prepare

    case = read_case("friction, n = 1").within(5)
    states, counts = prepare(case, "rodas5p", 1)(1e-11, 1e-12, case.times)
    error = float(np.abs(states - case.states).max())
    words = f"stick-slip over 5 periods: error {error:.1e} in {int(counts[-1, 1])} steps"
    if not error <= TRAJECTORY_ERROR:
        return WRONG, f"{words}; expected at most {TRAJECTORY_ERROR:g}", "run: synchain cache clear"
    return FINE, words, ""


CHECKS: dict[str, Callable[[], Answer]] = {
    "packages": _packages,
    "cache": _cache,
    "processor": _processor,
    "elementary functions": _elementary_functions,
    "spectrum": _spectrum,
    "trajectory": _trajectory,
}
"""Name -> look."""

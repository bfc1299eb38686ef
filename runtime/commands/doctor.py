"""`synchain doctor`: check the installation: versions, cache, processor, an exact spectrum, a trial kernel."""

from __future__ import annotations

import os
import sys
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..console.outcome import FAILED, FINE, print_json

if TYPE_CHECKING:
    import sympy as sp

SUMMARY = "check the installation, the cache, the processor and known answers"
EXAMPLES = ("synchain doctor", "synchain doctor --json")

SOUND, DOUBTFUL, WRONG = "fine", "doubtful", "wrong"

TRAJECTORY_ERROR = 1e-9  # largest error of a state of the trial kernel

# Position and velocity of TRIAL at the ends of five drive periods, from quadruple precision.
DRIVE_PERIODS = (
    (0.49651127615228413, -0.0057670521276488),
    (0.18501018103435476, 0.09999773701994646),
    (0.728198814423405, 0.09237293284448857),
    (0.004262807240396986, 0.10000256031741263),
    (0.5505620170579013, 0.09997575781703481),
)

# Parameters of the friction oscillator that is integrated, from rest at x = 0.3.
TRIAL = {"omega": 1.15, "u": 0.1, "theta_b": 0.1, "epsilon": 2.0, "mu_s": 0.3, "mu_k": 0.15, "a": 2.5, "kappa": 1e5}


NO_FMA = "kernels take up to twice the time and round otherwise; unset NUMBA_CPU_NAME and NUMBA_CPU_FEATURES if set"

Answer = tuple[str, str, str]  # outcome, what was found, what helps


def configure(parser: ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="one JSON value on stdout")


def execute(arguments: Namespace) -> int:
    """Print one line for each check; exit code 1 where something is wrong."""
    checks = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # that kernels are not kept on disk is a line of its own
        for check in examine():
            checks.append(check)
            if not arguments.json:
                remedy = f"\n{'':32}{check.remedy}" if check.remedy else ""
                print(f"{check.outcome:<9} {check.name:<21} {check.found}{remedy}", flush=True)
    wrong = [check.name for check in checks if check.outcome == WRONG]
    if arguments.json:
        print_json({"sound": not wrong, "checks": [check.as_dict() for check in checks]})
    if wrong:
        print(f"synchain doctor: wrong: {', '.join(wrong)}", file=sys.stderr)
    return FAILED if wrong else FINE


@dataclass(frozen=True, slots=True)
class Check:
    name: str  # what was checked
    outcome: str  # "fine", "doubtful" or "wrong"
    found: str  # what the check saw
    remedy: str = ""  # what the user can do; empty if the outcome is fine

    def as_dict(self) -> dict[str, str]:
        return {"name": self.name, "outcome": self.outcome, "found": self.found, "remedy": self.remedy}


def examine(checks: Mapping[str, Callable[[], Answer]] | None = None) -> Iterator[Check]:
    for name, check in (CHECKS if checks is None else checks).items():
        try:
            outcome, found, remedy = check()
        except Exception as problem:  # a broken installation may raise anything anywhere
            reason = " ".join(str(problem).split()) or "no reason given"
            outcome, found, remedy = WRONG, f"{type(problem).__name__}: {reason}", "install synchain anew"
        yield Check(name, outcome, found, remedy)


def _packages() -> Answer:
    import importlib.metadata
    import platform

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
    return SOUND, f"synchain {importlib.metadata.version('synchain')}, {', '.join(found)}", ""


def _cache() -> Answer:
    from synchain.codegen.machine_code.code_cache import cache_folder, describe, open_folder

    try:
        with open_folder(cache_folder()) as opened:
            opened.write(probe := f"probe-{os.getpid()}", b"0" * 4096)
            opened.delete(probe)
            folder = opened.path
    except (OSError, RuntimeError) as problem:  # RuntimeError: no home folder
        reason = " ".join(str(problem).split())
        return DOUBTFUL, f"every process compiles its kernels: {reason}", "set SYNCHAIN_CACHE to a folder of yours"
    mode = f", mode {folder.stat().st_mode & 0o777:o}" if os.name == "posix" else ""
    return SOUND, f"{folder}, {describe()['kernels']} kernels{mode}", ""


def _processor() -> Answer:
    import platform

    import llvmlite.binding as llvm

    from synchain.codegen.simd.lane_types import has_fma, native_width

    from ..support.threads import worker_count

    width, threads = native_width(), worker_count(None)
    words = f"{llvm.get_host_cpu_name()}, {width} lanes of double precision, {threads} threads"
    if width < 4 and platform.machine().lower() in ("x86_64", "amd64"):
        return DOUBTFUL, words, "without AVX sweeps take several times as long; unset SYNCHAIN_WIDTH if it is set"
    if not has_fma():
        return DOUBTFUL, f"{words}, no fused multiply-add", NO_FMA
    return SOUND, words, ""


def _spectrum() -> Answer:
    from synchain.models.graphs.families import topology

    return judge_spectrum({e.exact: e.multiplicity for e in topology("chain", 4).spectrum.eigenvalues})


def judge_spectrum(eigenvalues: Mapping[sp.Expr, int]) -> Answer:
    """Compare exact eigenvalues and their multiplicities with those of the chain of four nodes."""
    import sympy as sp

    root = sp.sqrt(2)
    if dict(eigenvalues) != {sp.S.Zero: 1, root - 2: 1, sp.Integer(-2): 1, -root - 2: 1}:
        return WRONG, f"the chain of 4 has {dict(eigenvalues)}", "install sympy and python-flint anew"
    return SOUND, "the chain of 4 has 0, -2+√2, -2, -2-√2, exactly", ""


def _trajectory() -> Answer:
    import numpy as np

    from synchain.models.graphs.families import topology
    from synchain.models.scenes.scene import Scene

    from ..sweeps.run import run

    periods = len(DRIVE_PERIODS)
    scene = Scene(
        topology=topology("chain", 1),
        parameters=TRIAL,
        initial={"x": 0.3, "v": 0.0},
        transient=0,
        window=periods,
        record=("trajectory",),
        samples=periods + 1,
        integrator="rodas5p",
        rtol=1e-11,
        atol=1e-12,
    )
    result = run(scene, width=1, workers=1, show_progress=False)
    states = result.trajectory.values.reshape(periods + 1, 2)[1:]  # at the ends of the periods
    return judge_trajectory(float(np.abs(states - DRIVE_PERIODS).max()), int(result.steps))


def judge_trajectory(error: float, steps: int) -> Answer:
    """Judge the largest error of a state over five drive periods; NaN is wrong."""
    text = f"stick-slip over 5 periods: error {error:.1e} in {steps} steps"
    if not error <= TRAJECTORY_ERROR:
        return WRONG, f"{text}; expected at most {TRAJECTORY_ERROR:g}", "run: synchain cache clear"
    return SOUND, text, ""


# Checks by name.
CHECKS: Mapping[str, Callable[[], Answer]] = {
    "packages": _packages,
    "cache": _cache,
    "processor": _processor,
    "spectrum": _spectrum,
    "trajectory": _trajectory,
}

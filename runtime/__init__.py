"""From a scene to results: runs, exponents, thresholds, equilibria, periodic orbits and the command line.

    run, stream                                        trajectories and records of all cells of a scene
    exponents, msf, plane, cluster_exponents,
    lyapunov_spectrum                                  stability of synchronous, clustered and other motion
    thresholds, universal_probe, basin                 strengths and starts that synchronise
    equilibrium, periodic_orbit, follow, skeleton      states at rest, orbits, their branches and bifurcations

Names are loaded on first use, so that the command line starts fast.

Glossary
--------
cell          One point of the axes of a scene: one initial-value problem with one status.
row           The input of a kernel for one cell: parameter values, initial states, span.
span          Of one cell: the ends of its window, its period, and the error of a synchronous cell.
block         Cells that are run, stored and resumed as one piece.
lane          One of the numbers in a SIMD register; each lane integrates another cell.
transient     Time that is integrated before anything is recorded; the window follows it.
strength      α = -σγ, real or complex, of an eigenvalue γ of the network and the coupling σ.
mode          A deviation from synchrony along an eigenvector of the network.
interval      A range of strengths with negative exponent.
window        Of a run: the time that is recorded. Of σ: a range in which every mode dies out.
verdict       Whether and where a network synchronises, decided from the intervals and the spectrum.
probe         Two or three oscillators whose simulation stands for a mode of any network.
certificate   Exponents and verdict of the synchronous state of each cell of a sweep.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from synchain.models.inputs.keywords import public

if TYPE_CHECKING:
    from .bifurcation.branches import follow
    from .bifurcation.equilibrium import Equilibrium, equilibrium
    from .bifurcation.periodic import PeriodicOrbit, periodic_orbit
    from .bifurcation.results import Bifurcation, Branch
    from .bifurcation.skeleton import Skeleton, skeleton
    from .engines.scene_kernels import kernel
    from .results.open import open_result
    from .results.result import Result
    from .stability.cluster_exponents import ClusterExponents, cluster_exponents
    from .stability.exponents import Exponents, exponents
    from .stability.lyapunov import Lyapunov, lyapunov_spectrum
    from .stability.msf import MSF, Plane, msf, plane
    from .support.progress import Progress
    from .support.status import Status
    from .sweeps.errors import SweepFailed, SweepInterrupted
    from .sweeps.merge import merge
    from .sweeps.run import run
    from .sweeps.stream import Streamed, stream
    from .synchronisation.basin import Basin, basin
    from .synchronisation.criterion import Criterion
    from .synchronisation.exponent_windows import ExponentWindows
    from .synchronisation.probe import Probe, universal_probe
    from .synchronisation.threshold import Thresholds, thresholds
    from .synchronisation.transition import Transition, TransitionCheck, transition

__all__ = [
    "MSF",
    "Basin",
    "Bifurcation",
    "Branch",
    "ClusterExponents",
    "Criterion",
    "Equilibrium",
    "ExponentWindows",
    "Exponents",
    "Lyapunov",
    "PeriodicOrbit",
    "Plane",
    "Probe",
    "Progress",
    "Result",
    "Skeleton",
    "Status",
    "Streamed",
    "SweepFailed",
    "SweepInterrupted",
    "Thresholds",
    "Transition",
    "TransitionCheck",
    "basin",
    "cluster_exponents",
    "equilibrium",
    "exponents",
    "follow",
    "kernel",
    "lyapunov_spectrum",
    "merge",
    "msf",
    "open_result",
    "periodic_orbit",
    "plane",
    "run",
    "skeleton",
    "stream",
    "thresholds",
    "transition",
    "universal_probe",
]

_HOMES = {
    "Basin": "synchronisation.basin",
    "Bifurcation": "bifurcation.results",
    "Branch": "bifurcation.results",
    "ClusterExponents": "stability.cluster_exponents",
    "Criterion": "synchronisation.criterion",
    "Equilibrium": "bifurcation.equilibrium",
    "ExponentWindows": "synchronisation.exponent_windows",
    "Exponents": "stability.exponents",
    "Lyapunov": "stability.lyapunov",
    "MSF": "stability.msf",
    "PeriodicOrbit": "bifurcation.periodic",
    "Plane": "stability.msf",
    "Probe": "synchronisation.probe",
    "Progress": "support.progress",
    "Result": "results.result",
    "Skeleton": "bifurcation.skeleton",
    "Status": "support.status",
    "Streamed": "sweeps.stream",
    "SweepFailed": "sweeps.errors",
    "SweepInterrupted": "sweeps.errors",
    "Thresholds": "synchronisation.threshold",
    "Transition": "synchronisation.transition",
    "TransitionCheck": "synchronisation.transition",
    "basin": "synchronisation.basin",
    "cluster_exponents": "stability.cluster_exponents",
    "equilibrium": "bifurcation.equilibrium",
    "exponents": "stability.exponents",
    "follow": "bifurcation.branches",
    "kernel": "engines.scene_kernels",
    "lyapunov_spectrum": "stability.lyapunov",
    "merge": "sweeps.merge",
    "msf": "stability.msf",
    "open_result": "results.open",
    "periodic_orbit": "bifurcation.periodic",
    "plane": "stability.msf",
    "run": "sweeps.run",
    "skeleton": "bifurcation.skeleton",
    "stream": "sweeps.stream",
    "thresholds": "synchronisation.threshold",
    "transition": "synchronisation.transition",
    "universal_probe": "synchronisation.probe",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return public(getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name), __name__)


def __dir__() -> list[str]:
    return sorted(__all__)

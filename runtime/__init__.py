"""Running scenes: sweeps, thresholds, exponents, figures, benchmarks and the command line."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .bifurcation.branches import Branch, follow
    from .bifurcation.periodic import PeriodicOrbit, periodic_orbit
    from .bifurcation.skeleton import skeleton
    from .cells.kernels import kernel
    from .results.open import open_result
    from .results.result import Result
    from .stability.clusters import ClusterExponents, cluster_exponents
    from .stability.lyapunov import Lyapunov, lyapunov_spectrum
    from .stability.msf import MSF, Plane, msf, plane
    from .stability.transversal import Exponents, exponents
    from .support.status import Status
    from .sweeps.errors import SweepFailed, SweepInterrupted
    from .sweeps.progress import Progress
    from .sweeps.run import run
    from .sweeps.stream import Streamed, stream
    from .synchronisation.basin import Basin, basin
    from .synchronisation.probe import Probe, universal_probe
    from .synchronisation.threshold import Thresholds, thresholds

__all__ = [
    "MSF",
    "Basin",
    "Branch",
    "ClusterExponents",
    "Exponents",
    "Lyapunov",
    "PeriodicOrbit",
    "Plane",
    "Probe",
    "Progress",
    "Result",
    "Status",
    "Streamed",
    "SweepFailed",
    "SweepInterrupted",
    "Thresholds",
    "basin",
    "cluster_exponents",
    "exponents",
    "follow",
    "kernel",
    "lyapunov_spectrum",
    "msf",
    "open_result",
    "periodic_orbit",
    "plane",
    "run",
    "skeleton",
    "stream",
    "thresholds",
    "universal_probe",
]

_HOME = {
    "Basin": "synchronisation.basin",
    "Branch": "bifurcation.branches",
    "ClusterExponents": "stability.clusters",
    "Exponents": "stability.transversal",
    "Lyapunov": "stability.lyapunov",
    "MSF": "stability.msf",
    "PeriodicOrbit": "bifurcation.periodic",
    "Plane": "stability.msf",
    "Probe": "synchronisation.probe",
    "Progress": "sweeps.progress",
    "Result": "results.result",
    "Status": "support.status",
    "Streamed": "sweeps.stream",
    "SweepFailed": "sweeps.errors",
    "SweepInterrupted": "sweeps.errors",
    "Thresholds": "synchronisation.threshold",
    "basin": "synchronisation.basin",
    "cluster_exponents": "stability.clusters",
    "exponents": "stability.transversal",
    "follow": "bifurcation.branches",
    "kernel": "cells.kernels",
    "lyapunov_spectrum": "stability.lyapunov",
    "msf": "stability.msf",
    "open_result": "results.open",
    "periodic_orbit": "bifurcation.periodic",
    "plane": "stability.msf",
    "run": "sweeps.run",
    "skeleton": "bifurcation.skeleton",
    "stream": "sweeps.stream",
    "thresholds": "synchronisation.threshold",
    "universal_probe": "synchronisation.probe",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)

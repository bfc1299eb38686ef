"""Running scenes: sweeps, thresholds, exponents, figures, benchmarks and the command line."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .basin import Basin, basin
    from .branches import Branch, follow
    from .cluster_states import ClusterExponents, cluster_exponents
    from .exponent import Exponents, exponents
    from .lyapunov import Lyapunov, lyapunov_spectrum
    from .msf import MSF, Plane, msf, plane
    from .periodic import PeriodicOrbit, periodic_orbit
    from .probe import Probe, universal_probe
    from .progress import Progress
    from .result import Result, open_result
    from .sitting import SweepFailed, SweepInterrupted
    from .skeletons import skeleton
    from .status import Status
    from .streaming import Streamed, stream
    from .sweep import kernel, run
    from .threshold import Thresholds, thresholds

__all__ = [
    "MSF", "Basin", "Branch", "ClusterExponents", "Exponents", "Lyapunov", "PeriodicOrbit", "Plane", "Probe",
    "Progress", "Result", "Status", "Streamed", "SweepFailed", "SweepInterrupted", "Thresholds", "basin",
    "cluster_exponents", "exponents", "follow", "kernel", "lyapunov_spectrum", "msf", "open_result", "periodic_orbit",
    "plane", "run", "skeleton", "stream", "thresholds", "universal_probe",
]  # fmt: skip

_HOME = {
    "ClusterExponents": "cluster_states", "cluster_exponents": "cluster_states", "PeriodicOrbit": "periodic",
    "periodic_orbit": "periodic", "Branch": "branches", "follow": "branches", "skeleton": "skeletons",
    "Lyapunov": "lyapunov", "lyapunov_spectrum": "lyapunov", "Basin": "basin", "basin": "basin",
    "Exponents": "exponent", "exponents": "exponent", "MSF": "msf", "Plane": "msf", "msf": "msf", "plane": "msf",
    "Probe": "probe", "universal_probe": "probe", "Result": "result", "open_result": "result",
    "SweepInterrupted": "sitting", "SweepFailed": "sitting", "Progress": "progress", "Streamed": "streaming",
    "stream": "streaming", "kernel": "sweep", "run": "sweep", "Status": "status", "Thresholds": "threshold",
    "thresholds": "threshold",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """A package in which a public function goes before the module of the same name that it lives in."""

    def __setattr__(self, name: str, value: Any) -> None:
        if isinstance(value, ModuleType) and _HOME.get(name) == name:  # the import system has just loaded it
            value = getattr(value, name)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

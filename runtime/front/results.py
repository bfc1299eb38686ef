"""Classes of results, for annotations and ; functions return them."""

from __future__ import annotations

from .offers import offer

HOMES = {
    "Basin": "runtime.synchronisation.basin",
    "Bifurcation": "runtime.bifurcation.results",
    "Branch": "runtime.bifurcation.results",
    "ClusterExponents": "runtime.stability.cluster_exponents",
    "CompiledResult": "runtime.sweeps.compiled",
    "CompiledRun": "runtime.sweeps.compiled",
    "Critical": "runtime.synchronisation.critical",
    "Curve": "runtime.bifurcation.results",
    "Diagram": "runtime.bifurcation.results",
    "Equilibrium": "runtime.bifurcation.equilibrium",
    "ExponentWindows": "runtime.synchronisation.exponent_windows",
    "Exponents": "runtime.stability.exponents",
    "Lyapunov": "runtime.stability.lyapunov",
    "Mismatch": "runtime.synchronisation.mismatch",
    "MSF": "runtime.stability.msf",
    "PeriodicOrbit": "runtime.bifurcation.periodic_result",
    "Plane": "runtime.stability.exponent_plane",
    "Probe": "runtime.synchronisation.probe",
    "Progress": "runtime.support.progress",
    "Reproduction": "runtime.results.reproduction",
    "Result": "runtime.results.result",
    "Status": "runtime.support.status",
    "Streamed": "runtime.sweeps.stream",
    "SweepFailed": "runtime.sweeps.errors",
    "SweepInterrupted": "runtime.sweeps.errors",
    "Thresholds": "runtime.synchronisation.threshold",
    "Transition": "runtime.synchronisation.transition",
    "TransitionCheck": "runtime.synchronisation.transition",
    "WorkPrecision": "runtime.sweeps.work_precision",
}

__all__ = list(HOMES)
__getattr__, __dir__ = offer(__name__, HOMES)

"""From a Lagrangian and a graph to exact equations, exact spectra, fast simulation and stability.

    Lagrangian, Field, friction_law                  one node
    Friction, Stop, Reset                            its contacts, stops and jumps
    link_energy, Potential, Rates, ends              one link
    graphs                                           a graph; `topology.spectrum` holds its exact eigenvalues
    Scene, load_scene, Axis, Section                 a network with its numbers, starts and records
    run, stream, merge, kernel                       trajectories and records of all cells of a scene
    compile                                          a scene as a fast function of its parameters, with derivatives
    work_precision                                   time against error of a scene, for each integrator
    msf, plane, exponents, cluster_exponents,
    lyapunov_spectrum                                stability of synchronous, clustered and other motion
    thresholds, critical, transition,
    universal_probe, basin                           strengths and starts that synchronise
    mismatch                                         errors of nearly equal nodes
    equilibrium, equilibria, periodic_orbit, follow,
    diagram, skeleton                                states at rest, orbits, their branches and bifurcations

The modules `graphs`, `observe`, `draw`, `export`, `plugins` and `results` hold the other names.  Each name is loaded
when it is first used; editors read the names in the stubs beside this file.
"""

from __future__ import annotations

from typing import Any

from .offers import offer

MODULES = ("draw", "export", "graphs", "observe", "plugins", "results")

HOMES = {
    **dict.fromkeys(MODULES, ""),
    "Axis": "models.sweeps.axis",
    "Criterion": "runtime.synchronisation.criterion",
    "Field": "models.definitions.inline",
    "Friction": "models.mechanics.impacts",
    "Lagrangian": "models.definitions.inline",
    "Parameter": "models.mechanics.parameter",
    "Potential": "models.interactions.interaction",
    "Rates": "models.interactions.interaction",
    "Reset": "models.mechanics.impacts",
    "Scene": "models.scenes.scene",
    "Section": "models.scenes.section",
    "Stop": "models.mechanics.impacts",
    "basin": "runtime.synchronisation.basin",
    "cluster_exponents": "runtime.stability.cluster_exponents",
    "compile": "runtime.sweeps.compiled",
    "critical": "runtime.synchronisation.critical",
    "diagram": "runtime.bifurcation.results",
    "ends": "models.interactions.ends",
    "energy_terms": "models.scenes.energy",
    "energy_function": "runtime.results.energy_of_states",
    "equilibria": "runtime.bifurcation.deflation",
    "equilibrium": "runtime.bifurcation.equilibrium",
    "exponents": "runtime.stability.exponents",
    "exprel": "models.inputs.expression_text",
    "follow": "runtime.bifurcation.branches",
    "friction": "models.mechanics.oscillator",
    "friction_law": "models.definitions.inline",
    "kernel": "runtime.engines.scene_kernels",
    "link_energy": "models.definitions.inline",
    "load_oscillator": "models.definitions.loader",
    "load_scene": "models.scenes.file",
    "lyapunov_spectrum": "runtime.stability.lyapunov",
    "merge": "runtime.sweeps.merge_parts",
    "mismatch": "runtime.synchronisation.mismatch",
    "msf": "runtime.stability.msf",
    "open_result": "runtime.results.open",
    "periodic_orbit": "runtime.bifurcation.periodic",
    "plane": "runtime.stability.exponent_plane",
    "run": "runtime.sweeps.run",
    "scene_names": "models.scenes.file",
    "skeleton": "runtime.bifurcation.skeleton",
    "stream": "runtime.sweeps.stream",
    "thresholds": "runtime.synchronisation.threshold",
    "transition": "runtime.synchronisation.transition",
    "universal_probe": "runtime.synchronisation.probe",
    "work_precision": "runtime.sweeps.work_precision",
}

__all__ = list(HOMES)
_load, __dir__ = offer(__name__, HOMES)


def __getattr__(name: str) -> Any:
    if name != "__version__":
        return _load(name)
    from importlib.metadata import version

    return version("synchain")

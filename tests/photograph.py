"""The photograph: scenes, and what is seen of each, to the last bit.  It guards moves of code that must change no result.

`SCENES` is the catalogue: a name and a function that returns quantities, as texts, numbers, arrays or bytes.  `take` runs
one of them and writes it in JSON types: numbers as hexadecimal floats, long texts and bytes as SHA-256.  `compare` says what
differs between two pictures, and `camera` on which machine a picture is taken.

Kernels take seconds to compile, so that scenes share them where they can: a kernel is shared by scenes of the same
equations, records, integrator and width, whatever their numbers.  Integrators and widths are named, never "auto".

``python tests/photograph.py NAME ...`` prints scenes with their whole texts, to be compared by `diff` with those of another
state of the code; without a name it lists the catalogue.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import family_sizes
import llvmlite.binding as llvm
import numba
import numpy as np
import sympy as sp
from scipy.io import netcdf_file

import synchain
from synchain import Scene, graphs
from synchain.graphs import chain, complete, ring, star
from synchain.models.graphs.readers import from_edges
from synchain.models.graphs.symbolic import from_symbols
from synchain.models.graphs.topology import from_matrix
from synchain.models.scenes.file import load_scene
from synchain.runtime.bifurcation.branches import follow
from synchain.runtime.bifurcation.periodic import periodic_orbit
from synchain.runtime.bifurcation.skeleton import skeleton
from synchain.runtime.results.open import open_result
from synchain.runtime.stability.cluster_exponents import cluster_exponents
from synchain.runtime.stability.exponent_plane import plane
from synchain.runtime.stability.exponents import exponents
from synchain.runtime.stability.lyapunov import lyapunov_spectrum
from synchain.runtime.stability.msf import msf
from synchain.runtime.sweeps.run import run
from synchain.runtime.sweeps.stream import stream
from synchain.runtime.synchronisation.basin import basin
from synchain.runtime.synchronisation.probe import universal_probe
from synchain.runtime.synchronisation.threshold import thresholds

# What has no name in the two packages above.  A move of files changes these lines, and no others in this file.
from synchain.models.graphs.closed_forms import closed_form  # isort: skip
from synchain.models.graphs.closed_forms import formulas

from synchain.models.symmetries.clusters import clusters  # isort: skip
from synchain.models.symmetries.clusters import orbital_partitions

from synchain.models.scenes.energy import energy_terms  # isort: skip
from synchain.codegen.export.c import to_c  # isort: skip
from synchain.codegen.export.numba import to_numba
from synchain.codegen.export.python import to_python

from synchain.models.inputs.plugin_files import load  # isort: skip
from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from synchain.models.graphs.families import TOPOLOGY
from synchain.models.inputs.plugin_files import names

from synchain.models.presentation.equations_text import latex  # isort: skip
from synchain.models.presentation.equations_text import text

from synchain.runtime.cli import main  # isort: skip
from synchain.runtime.results.energy_of_states import energy_function  # isort: skip
from synchain.runtime.cells.reduce import as_reduction, explain  # isort: skip
from synchain.runtime.synchronisation.criterion import PAPER  # isort: skip

__all__ = ["SCENES", "Picture", "camera", "compare", "take"]

WIDTH = 4
"""Lanes of every sweep; tests/runtime/cells/test_determinism.py has the kernel of the friction pair too."""

ELSE_WIDTH = 8
"""Lanes of all else: how many strengths of a mode are looked at follows from it, and the last digits of exponents with it."""

ALL = ("sync_error", "section", "trajectory")
LONGEST = 200
"""Longer texts are kept as their SHA-256."""

ELSEWHERE = 1e-12
"""How far numbers may be apart, relative to the largest of their quantity or to 1, where the machine is another one."""

Quantities = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Counts:
    """Whole numbers that rounding can change, such as counts of steps: compared on the same machine alone."""

    values: np.ndarray


@dataclass(frozen=True, slots=True)
class Picture:
    """A scene of the catalogue: its name, what is seen of it, and whether that takes minutes."""

    name: str
    see: Callable[[], Quantities]
    long: bool = False


SCENES: dict[str, Picture] = {}


def scene(name: str, *, long: bool = False) -> Callable[[Callable[[], Quantities]], Callable[[], Quantities]]:
    """Put a function of no arguments that returns quantities into the catalogue."""

    def enter(see: Callable[[], Quantities]) -> Callable[[], Quantities]:
        if name in SCENES:
            raise ValueError(f"photograph: the scene {name!r} is there twice")
        SCENES[name] = Picture(name, see, long)
        return see

    return enter


# -- the camera ----------------------------------------------------------------------------------------------


def camera() -> dict[str, str]:
    """The machine and the versions: where they are the same, results are the same to the last bit."""
    features = llvm.get_host_cpu_features()
    return {
        "machine": platform.machine(),
        "processor": numba.config.CPU_NAME or llvm.get_host_cpu_name(),
        "avx512": str(bool(features.get("avx512f"))),
        "fma": str(bool(features.get("fma"))),
        "versions": ", ".join(f"{m.__name__} {m.__version__}" for m in (numba, np, sp)),
    }


def take(name: str, whole: bool = False) -> dict[str, Any]:
    """Return the quantities of a scene in JSON types; `whole` keeps long texts as they are."""
    with patch.dict(os.environ, SYNCHAIN_WIDTH=str(ELSE_WIDTH)):
        return {quantity: _encoded(value, whole) for quantity, value in sorted(SCENES[name].see().items())}


def _encoded(value: Any, whole: bool) -> Any:
    """A text, counts, numbers as a shape with hexadecimal floats, or the SHA-256 of a long text or of bytes."""
    if isinstance(value, str):
        if whole or len(value) <= LONGEST:
            return value
        return {"sha256": hashlib.sha256(value.encode()).hexdigest(), "lines": value.count("\n") + 1}
    if isinstance(value, bytes):
        return {"bits": hashlib.sha256(value).hexdigest()}
    if isinstance(value, Counts):
        return {"counts": " ".join(str(int(x)) for x in value.values.reshape(-1))}
    numbers = np.asarray(value)
    if np.iscomplexobj(numbers):
        numbers = np.stack([numbers.real, numbers.imag], axis=-1)
    if not np.issubdtype(numbers.dtype, np.number) and numbers.dtype != bool:
        raise TypeError(f"photograph: found {type(value).__name__}; expected text, bytes or numbers")
    return {
        "shape": " ".join(map(str, numbers.shape)),
        "numbers": " ".join(float(x).hex() for x in numbers.reshape(-1)),
    }


def compare(old: Mapping[str, Any], new: Mapping[str, Any], same_camera: bool) -> list[str]:
    """Say in one line each which quantities of a scene differ.

    With `same_camera` numbers have to agree to the last bit.  Else they may differ by ELSEWHERE, and counts and bytes, which
    come of numbers, are not compared; texts have to agree in any case.
    """
    found = []
    for quantity in sorted({*old, *new}):
        if quantity not in old or quantity not in new:
            found.append(f"{quantity}: found {'none' if quantity in old else 'a new quantity'}")
        elif (words := _difference(old[quantity], new[quantity], same_camera)) is not None:
            found.append(f"{quantity}: {words}")
    return found


def _difference(old: Any, new: Any, same_camera: bool) -> str | None:
    """How one quantity differs, None where it does not."""
    if old == new:
        return None
    if isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        if "numbers" in old and old["shape"] == new["shape"]:
            return _apart(old, new, same_camera)
        if ("bits" in old or "counts" in old) and not same_camera:
            return None
    return f"was {_words(old)}; is {_words(new)}"


def _apart(old: Mapping[str, Any], new: Mapping[str, Any], same_camera: bool) -> str | None:
    """The number that differs most, with its place."""
    before, after = (np.array([float.fromhex(x) for x in found["numbers"].split()]) for found in (old, new))
    usual = np.isfinite(before) & np.isfinite(after)
    strange = ~usual & ~((before == after) | (np.isnan(before) & np.isnan(after)))
    scale = max(1.0, np.abs(before[usual]).max(initial=0.0))
    gap = np.where(usual, np.abs(np.subtract(after, before, where=usual, out=np.zeros_like(before))), 0.0)
    gap[strange] = np.inf
    differ = np.flatnonzero([x != y for x, y in zip(old["numbers"].split(), new["numbers"].split(), strict=True)])
    if not same_camera and gap.max(initial=0.0) <= ELSEWHERE * scale:
        return None
    worst = int(differ[np.argmax(gap[differ])])
    place = [int(k) for k in np.unravel_index(worst, [int(size) for size in old["shape"].split()])]
    was, now = float(before[worst]), float(after[worst])
    values = f"was {was!r} ({was.hex()}); is {now!r} ({now.hex()})"
    return f"{len(differ)} of {len(before)} numbers differ; at {place} {values}; apart by {gap[worst]:.1e}"


def _words(value: Any) -> str:
    """A quantity in a line."""
    if isinstance(value, dict):
        return " ".join(f"{key} {str(x)[:80]}" for key, x in value.items())
    return repr(value)


# -- what is seen of a scene -----------------------------------------------------------------------------------


def simulated(given: Scene, **options: Any) -> Quantities:
    """A sweep: what it found, what it left out, and the texts of its equations."""
    found = run(given, width=WIDTH, workers=1, show_progress=False, **options)
    seen: Quantities = {"message": found.message, "left out": found.data.attrs["skipped"], "parts": _parts(found.scene)}
    counts = ("steps", "rejected", "periods_skipped")
    for name, values in found.data.data_vars.items():
        rows = found.states(str(name)) if "component" in values.dims else values.values
        seen[str(name)] = Counts(rows) if name in counts else rows
    times = {"time": "trajectory_time", "section_time": "section_time", "end_time": "end_time"}
    seen |= {old: found.data[name].values for name, old in times.items() if name in found.data.coords}
    return seen | written(found.scene, options.get("reduce", True))


def _parts(given: Scene) -> str:
    """What a scene is made of, as "kind name" between commas."""
    kinds = [(given.oscillator, given.friction), *((group.oscillator, group.friction) for group in given.nodes)]
    named = [("integrator", given.integrator), ("topology", given.topology.name), ("contact", given.contact)]
    named += [("oscillator", oscillator) for oscillator, _ in kinds] + [("friction", law) for _, law in kinds]
    named += [("coupling", str(given.coupling or "").partition(" on ")[0])] if given.topology.links else []
    return ", ".join(f"{kind} {name}" for kind, name in dict.fromkeys(named) if name)


def written(given: Scene, reduce: Any = True) -> Quantities:
    """Texts of a scene: file, equations, exports, reductions, warnings."""
    equations = given.equations
    seen: Quantities = {
        "scene": json.dumps(given.as_dict(), sort_keys=True),
        "equations": text(equations),
        "latex": latex(equations),
        "explain": explain(as_reduction(given, reduce)),
        "warnings": "\n".join(given.warnings),
    }
    for language, export in (("python", to_python), ("numba", to_numba), ("c", to_c)):
        seen[f"export {language}"] = _or_refused(lambda: export(equations, given.parameters))  # noqa: B023
    return seen


def _or_refused(make: Callable[[], str]) -> str:
    """A text, or the kind of error that says that there is none."""
    try:
        return make()
    except (ValueError, TypeError) as problem:
        return f"refused: {type(problem).__name__}"


def exact(graph: Any) -> str:
    """The exact spectrum of a graph, with Jordan blocks and whether it is proved."""
    found = graph.spectrum
    rows = [f"{e.text}: {e.multiplicity} {e.blocks}" for e in found.eigenvalues]
    return "\n".join(
        [repr(graph), found.text(1000), *rows, f"verified {found.verified}, chance {found.error_probability}"]
    )


def printed(*words: str) -> str:
    """What the command line prints."""
    with redirect_stdout(io.StringIO()) as output:
        code = main(list(words))
    return f"{output.getvalue()}exit code {code}"


# -- sweeps: final states, section points, trajectories, synchronisation errors ---------------------------------

SHORT: dict[str, Any] = {"transient": 1.0, "window": 3.0, "integrator": "rodas5p"}
"""Periods of the drive, or units of time where there is none."""


def pair(**given: Any) -> Scene:
    """Two friction oscillators with all records: scenes that share one kernel."""
    return Scene(topology=chain(2), record=ALL, samples=5, **{**SHORT, **given})


@scene("friction pair, grid of sigma and omega")
def _() -> Quantities:
    return simulated(pair(), sigma=[0.05, 0.2, 0.45], omega=[1.15, 1.4])


@scene("friction pair, zipped axes")
def _() -> Quantities:
    return simulated(pair(zipped=True, axes={"sigma": [0.1, 0.3], "x_1": [0.2, -0.1]}))


@scene("friction pair, continued upwards")
def _() -> Quantities:
    return simulated(pair(continuation="up", axes={"sigma": [0.05, 0.1, 0.2]}, parameters={"omega": 1.55}))


@scene("friction pair, continued downwards")
def _() -> Quantities:
    return simulated(pair(continuation="down", axes={"omega": [1.3, 1.35, 1.4]}, parameters={"sigma": 0.12}))


@scene("friction pair without drive, as it stands")
def _() -> Quantities:
    return simulated(pair(parameters={"u": 0, "sigma": 0.1}), reduce=False)


@scene("friction pair, too few steps")
def _() -> Quantities:
    return simulated(pair(max_steps=40), sigma=[0.1, 0.2])


@scene("friction pair, random starts")
def _() -> Quantities:
    return simulated(pair(initial={"x": {"low": -0.4, "high": 0.4, "rng": 7}, "v": [0.1, -0.1]}), sigma=[0.1, 0.2])


@scene("friction pair, folded drive and coupling", long=True)
def _() -> Quantities:
    return simulated(Scene(topology=chain(2), parameters={"u": 0, "sigma": 0}, **SHORT))


@scene("friction pair, certified")
def _() -> Quantities:
    return simulated(pair(transient=20.0), sigma=[0.02, 0.3], certified=True)


@scene("friction, ring of six that moves as two", long=True)
def _() -> Quantities:
    start = {"x": [0.3, 0.1] * 3, "v": 0.0}
    return simulated(Scene(topology=ring(6), initial=start, record=("sync_error",), **SHORT), sigma=[0.1, 0.3])


@scene("friction, complete graph that moves as one")
def _() -> Quantities:
    start = {"x": 0.3, "v": 0.0}
    return simulated(Scene(topology=complete(4), initial=start, record=("sync_error",), **SHORT), sigma=[0.1, 0.3])


@scene("friction, looped chain of twelve", long=True)
def _() -> Quantities:
    return simulated(Scene(topology=chain(12), record=("sync_error",), **SHORT), sigma=[0.1, 0.4])


@scene("Stribeck chain of three", long=True)
def _() -> Quantities:
    numbers = {"c": 0.05, "epsilon": [1.9, 2.0, 2.1]}
    return simulated(Scene(friction="stribeck", topology=chain(3), parameters=numbers, **SHORT), sigma=[0.1, 0.3])


@scene("hyperbolic star of four, rodas4", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas4", "record": ("section",), "section": "x_2 rising 0.1"}
    return simulated(Scene(friction="hyperbolic", topology=star(4), **given), sigma=[0.1, 0.3])


@scene("set-valued Coulomb pair, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "record": ALL, "samples": 5}
    return simulated(Scene(friction="coulomb", contact="set-valued", topology=chain(2), **given), sigma=[0.1, 0.3])


@scene("set-valued static friction, cash_karp", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "cash_karp", "record": ("trajectory",), "samples": 9}
    return simulated(Scene(friction="coulomb_static", contact="set-valued", **given), omega=[1.15, 1.4])


@scene("set-valued ring of three, per-node friction, dop853", long=True)
def _() -> Quantities:
    own = {"mu_k": [0.14, 0.15, 0.16]}
    given = SHORT | {"integrator": "dop853"}
    return simulated(Scene(contact="set-valued", topology=ring(3), parameters=own, **given), sigma=[0.1, 0.3])


@scene("Froude pendulums, torsion, rodas6p", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas6p"}
    network = {"oscillator": "froude", "friction": "viscous", "coupling": "torsion", "topology": complete(3)}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.3])


@scene("Burridge-Knopoff chain, ros34pw2", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "ros34pw2"}
    network = {"oscillator": "spring_block", "friction": "hyperbolic", "topology": chain(3)}
    return simulated(Scene(**network, **given), sigma=[1.0, 4.0])


@scene("Duffing grid, own frequencies, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "time_unit": "time"}
    own = {"delta": [0.1, 0.2, 0.3, 0.4], "omega": [1, 1.5, 2, 2.5]}
    return simulated(
        Scene(oscillator="duffing", topology=synchain.graphs.grid(4), parameters=own, **given), sigma=[0.1, 0.5]
    )


@scene("Duffing with inerters on a one-way graph, cash_karp")
def _() -> Quantities:
    graph = from_matrix([[-1, "2/3", "1/3"], [0, -1, 1], ["1/2", 0, "-1/2"]])
    given = SHORT | {"integrator": "cash_karp", "parameters": {"delta": [0.1, 0.2, 0.3]}}
    return simulated(Scene(oscillator="duffing", coupling="inerter", topology=graph, **given), sigma=[0.1, 0.5])


@scene("Duffing with inerters, looped chain of nine", long=True)
def _() -> Quantities:
    return simulated(Scene(oscillator="duffing", coupling="inerter", topology=chain(9), **SHORT), sigma=[0.1, 0.5])


@scene("Huygens' clocks on a beam")
def _() -> Quantities:
    given = load_scene("huygens").replace(transient=0, window=5, samples=5, integrator="rodas5p")
    return simulated(given, mass=[10, 12])


@scene("pendulum pair, taylor")
def _() -> Quantities:
    given = SHORT | {"integrator": "taylor", "record": ALL, "samples": 5, "time_unit": "time"}
    return simulated(Scene(oscillator="pendulum", topology=chain(2), **given), sigma=[0.1, 0.3])


@scene("set-valued pair, taylor")
def _() -> Quantities:
    given = SHORT | {"integrator": "taylor", "record": ALL, "samples": 5}
    return simulated(Scene(contact="set-valued", topology=chain(2), **given), sigma=[0.1, 0.3])


@scene("Duffing, looped ring of ten, taylor", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "taylor", "rtol": 1e-12}
    return simulated(Scene(oscillator="duffing", topology=ring(10), **given), sigma=[0.1, 0.3])


@scene("van der Pol and Lorenz in a ring, dop853")
def _() -> Quantities:
    others = [{"oscillator": "lorenz", "at": [2, 3]}]
    given = SHORT | {"integrator": "dop853", "time_unit": "time", "parameters": {"b": [1, 2]}}
    network = {"oscillator": "van_der_pol", "nodes": others, "topology": ring(4), "coupling": "x->x"}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.5])


@scene("Duffing and van der Pol, looped ring of ten", long=True)
def _() -> Quantities:
    others = [{"oscillator": "van_der_pol", "at": [3, 4, 7, 8]}]
    given = SHORT | {"time_unit": "time"}
    return simulated(Scene(oscillator="duffing", nodes=others, topology=ring(10), **given), sigma=[0.1, 0.5])


@scene("van der Pol with dampers, looped small world, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "time_unit": "time"}
    graph = synchain.graphs.small_world(12)
    return simulated(Scene(oscillator="van_der_pol", coupling="damper", topology=graph, **given), sigma=[0.1, 0.5])


@scene("Rössler in a feed-forward chain, rodas6p", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas6p", "initial": {"x": [1.0, 1.1, 1.2], "y": 0, "z": 0}}
    network = {"oscillator": "rossler", "coupling": "y->y", "topology": synchain.graphs.feed_forward(3)}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.5])


@scene("Lorenz on a bipartite graph, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "transient": 0.2, "window": 1.0}
    graph = synchain.graphs.complete_bipartite(3)
    return simulated(Scene(oscillator="lorenz", coupling="x->x", topology=graph, **given), sigma=[1.0, 3.0])


@scene("Chua in a one-way ring, rodas4", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas4", "initial": {"x": [0.7 + 0.02, 0.7, 0.7 - 0.02]}}
    graph = synchain.graphs.one_way_ring(3)
    return simulated(Scene(oscillator="chua", coupling="x->x", topology=graph, **given), sigma=[1.0, 3.0])


@scene("FitzHugh-Nagumo, coupled across components, ros34pw2", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "ros34pw2"}
    network = {"oscillator": "fitzhugh_nagumo", "coupling": "x->x, -1/2 y->x", "topology": ring(3)}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.3])


@scene("double pendulums, spring on one angle, rodas6p", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas6p"}
    network = {"oscillator": "double_pendulum", "coupling": "spring on phi", "topology": chain(2)}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.3])


@scene("double pendulum on a belt, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "record": ("section",), "parameters": {"kappa": 100.0}}
    return simulated(Scene(oscillator="belt_double_pendulum", friction="coulomb", **given), theta_b=[0.1, 0.2])


@scene("pendulums with friction dampers on a tree, cash_karp", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "cash_karp", "parameters": {"delta": 0.1, "torque": 0.2}}
    network = {"oscillator": "pendulum", "coupling": "friction_damper", "topology": synchain.graphs.tree(3)}
    return simulated(Scene(**network, **given), sigma=[0.1, 0.3])


@scene("rotors with torsion on a wheel, cash_karp", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "cash_karp", "parameters": {"power": [1.0, -1.0, 0.5, -0.5]}}
    network = {"oscillator": "rotor", "coupling": "torsion", "topology": synchain.graphs.wheel(4)}
    return simulated(Scene(**network, **given), sigma=[0.5, 1.0])


@scene("Fermi-Pasta-Ulam-Tsingou chain, dop853", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "dop853", "record": ("trajectory",), "samples": 5}
    network = Scene(oscillator="mass", coupling="fput", topology=chain(4), **given)
    return simulated(network, fput_alpha=[0.25, 0.5]) | balance(network)


@scene("harmonic hypercube with cubic springs, rodas6p", long=True)
def _() -> Quantities:
    given = SHORT | {"integrator": "rodas6p", "record": ("trajectory",), "samples": 5}
    network = Scene(oscillator="harmonic", coupling="cubic_spring", topology=synchain.graphs.hypercube(4), **given)
    return simulated(network, sigma=[0.1, 0.5]) | balance(network.replace(sigma=0.1))


def balance(given: Scene) -> Quantities:
    """The energy of a network: its formulas, and numbers at a state made of multiples of 1/8."""
    found, power = energy_terms(given).whole()
    states = np.arange(1, len(given.y0) + 1)[None] * np.array([[0.125], [-0.25]])
    function = energy_function(given)
    return {
        "energy": sp.sstr(found),
        "power": sp.sstr(power),
        "energy at states": function(states, 0.5),
        "power at states": function.power(states, 0.5),
    }


# -- results on disk -------------------------------------------------------------------------------------------


@scene("friction pair, streamed to a file")
def _() -> Quantities:
    with tempfile.TemporaryDirectory() as folder:
        path, again = Path(folder) / "streamed.nc", Path(folder) / "saved.nc"
        stream(pair(), path, width=WIDTH, workers=1, show_progress=False, sigma=[0.1, 0.2, 0.3], omega=[1.15, 1.4])
        open_result(path).save(again)
        whole = path.read_bytes()
        with netcdf_file(io.BytesIO(whole), mmap=False) as file:
            heads = [f"{name} {v.typecode()} {v.dimensions} {v._attributes}" for name, v in file.variables.items()]
            sizes = [-(-v.data.nbytes // 4) * 4 for v in file.variables.values()]
            ambient = ("versions", "kernel", "processor", "digest")
            own = {name: value for name, value in file._attributes.items() if name not in ambient}
        return {
            "variables": "\n".join(heads),
            "attributes": "\n".join(f"{name} = {value}" for name, value in own.items()),
            "all attributes": " ".join(file._attributes),
            "numbers": whole[-sum(sizes) :],
            "the same bytes as saved": str(whole == again.read_bytes()),
        }


# -- stability: exponents, modes, periodic orbits, spectra of Lyapunov exponents, clusters ----------------------

AVERAGED: dict[str, Any] = {"periods": 8, "transient": 2, "workers": 1}
ALPHA = [0.0, 0.1, 0.5, 1.0]


def _seen(found: Any, *quantities: str) -> Quantities:
    """Properties of a result by name."""
    return {name: getattr(found, name) for name in quantities}


def graded(given: Scene, **options: Any) -> Quantities:
    """Transversal exponents at a few strengths, start by start."""
    found = exponents(given, ALPHA, starts=2, **{**AVERAGED, **options})
    kinds = ", ".join(attractor.kind for attractor in found.attractors)
    return {**_seen(found, "exponent", "stderr", "by_start", "time"), "attractors": kinds}


@scene("exponents of friction")
def _() -> Quantities:
    return graded(Scene(topology=chain(2)), omega=1.4)


@scene("exponents of set-valued friction")
def _() -> Quantities:
    return graded(Scene(topology=chain(2), contact="set-valued"), omega=1.4)


@scene("exponents of set-valued friction with their errors")
def _() -> Quantities:
    return graded(Scene(topology=chain(2), contact="set-valued"), omega=1.4, periods=64)


@scene("exponents of Lorenz", long=True)
def _() -> Quantities:
    return graded(Scene(oscillator="lorenz", coupling="x->x", topology=chain(2)), periods=2, transient=0)


@scene("exponents of Duffing with inerters")
def _() -> Quantities:
    return graded(Scene(oscillator="duffing", coupling="inerter", topology=chain(2)))


@scene("master stability function of friction and windows of a chain")
def _() -> Quantities:
    found = msf(Scene(topology=chain(4)), ALPHA, omega=1.15, starts=1, **AVERAGED)
    windows = np.array([[w.low, w.high, w.low_error, w.high_error] for w in found.windows])
    return {
        **_seen(found, "exponent", "stderr", "kind"),
        "intervals": np.array(found.intervals),
        "uncertainties": np.array(found.uncertainties),
        "windows": windows,
    }


@scene("master stability function of Duffing in the plane", long=True)
def _() -> Quantities:
    found = plane(
        Scene(oscillator="duffing", topology=chain(2)), [0.0, 0.5, 1.0], [-0.5, 0.0, 0.5], starts=1, **AVERAGED
    )
    return _seen(found, "exponent", "stderr", "time") | {"attractors": ", ".join(found.motion)}


def orbit_of(found: Any) -> Quantities:
    """A periodic orbit."""
    return {
        **_seen(found, "periods", "state", "multipliers", "residual", "steps", "points", "least"),
        "transversal": found.transversal_multipliers(0.3),
        "stable": str(found.stable),
        "phases": "none" if found.phases is None else found.phases.words,
    }


@scene("periodic orbit of friction and its branch")
def _() -> Quantities:
    found = periodic_orbit(Scene(transient=60.0), 2, omega=1.15)
    branch = follow(found, "omega", values=[1.15, 1.155, 1.16])
    return orbit_of(found) | {
        "branch": np.array([orbit.state for orbit in branch.orbits]),
        "branch multipliers": np.array([orbit.multipliers for orbit in branch.orbits]),
        "bifurcations": repr([str(each.kind) for each in branch.bifurcations]),
    }


@scene("periodic orbit of set-valued friction")
def _() -> Quantities:
    return orbit_of(periodic_orbit(Scene(contact="set-valued", transient=60.0), 2, omega=1.15))


@scene("periodic orbit of Duffing", long=True)
def _() -> Quantities:
    return orbit_of(periodic_orbit(Scene(oscillator="duffing", transient=60.0, integrator="dop853"), 1, omega=1.3))


@scene("skeleton of a bifurcation diagram")
def _() -> Quantities:
    found = skeleton(Scene(), "omega", [1.15, 1.16, 1.17], periods=(2,), looks=1)
    values = {f"values {k}": branch.values for k, branch in enumerate(found)}
    states = {f"states {k}": np.array([orbit.state for orbit in branch.orbits]) for k, branch in enumerate(found)}
    return values | states | {"branches": len(found)}


def spectrum_of_motion(given: Scene, **options: Any) -> Quantities:
    """Lyapunov exponents."""
    found = lyapunov_spectrum(given, **{"periods": 8, "transient": 2, **options})
    return _seen(found, "exponent", "stderr", "resolved", "divergence", "divergence_error", "time", "dimension")


@scene("Lyapunov spectrum of a Duffing pair")
def _() -> Quantities:
    return spectrum_of_motion(Scene(oscillator="duffing", topology=chain(2)), sigma=0.2)


@scene("Lyapunov spectrum of Lorenz", long=True)
def _() -> Quantities:
    return spectrum_of_motion(Scene(oscillator="lorenz"), periods=2, transient=0)


@scene("Lyapunov spectrum of set-valued friction", long=True)
def _() -> Quantities:
    return spectrum_of_motion(Scene(contact="set-valued"), omega=1.4)


@scene("cluster exponents of van der Pol on a star", long=True)
def _() -> Quantities:
    network = Scene(oscillator="van_der_pol", topology=star(5), parameters={"u": 0.4, "omega": 1.3, "sigma": 0.1})
    found = cluster_exponents(network, [0, 1, 1, 2, 2], periods=8, transient=2)
    return _seen(found, "exponent", "stderr", "motion", "motion_error", "separation", "time")


# -- synchronisation of networks ---------------------------------------------------------------------------------

TINY = replace(PAPER, transient=20, window=5, starts=2, tolerance=1e-2)


@scene("thresholds of a friction pair", long=True)
def _() -> Quantities:
    grid = np.linspace(0, 0.6, 7)
    given = Scene(topology=chain(2), integrator="rodas5p")
    found = thresholds(given, sigma=grid, resolution=0.02, criterion=TINY, workers=1, show_progress=False, omega=1.15)
    seen: Quantities = {"predicted": np.array(found.predicted), "warnings": "\n".join(found.warnings)}
    for name, sweep in (("probe", found.probe), ("direct", found.direct)):
        seen |= {
            f"{name} {key}": np.array(value) for key, value in _seen(sweep, "x", "share", "intervals", "error").items()
        }
    return seen


@scene("basin of a friction pair", long=True)
def _() -> Quantities:
    given = Scene(topology=chain(2), integrator="rodas5p")
    found = basin(given, sigma=0.1, samples=12, transient=5, window=2, workers=1, show_progress=False)
    return _seen(found, "start", "error", "fate", "status", "exponent")


@scene("three-oscillator probe of friction", long=True)
def _() -> Quantities:
    given = Scene(topology=chain(2), integrator="rodas5p")
    found = universal_probe(given, [0.1, 0.6], [0.0, 0.1], criterion=TINY, workers=1, show_progress=False)
    return _seen(found, "alpha", "beta", "error", "share", "status")


# -- exact: spectra, cluster states, equations, energies ---------------------------------------------------------

FAMILIES: dict[str, dict[str, Any]] = {
    "circulant": {"offsets": (1, 3)},
    "grid": {"shape": (2, 2, 2)},
    "torus": {"shape": (3, 4)},
    "complete_bipartite": {"left": 3},
    "erdos_renyi": {"p": "1/3", "seed": 2},
    "random_regular": {"degree": 3, "seed": 1},
    "small_world": {"p": "1/5", "seed": 3},
}
"""Options of families besides their defaults."""


@scene("spectra of all families")
def _() -> Quantities:
    seen: Quantities = {}
    for name in names(TOPOLOGY):
        make = getattr(graphs, name)
        seen |= {f"{name} {n}": exact(make(n)) for n in (family_sizes.size(name, n) for n in (5, 8, 12))}
        if name in FAMILIES:
            size = math.prod(FAMILIES[name].get("shape", (10,)))
            seen[f"{name} with options"] = exact(make(size, **FAMILIES[name]))
    return seen


@scene("closed forms of all families")
def _() -> Quantities:
    return {name: closed_form(name).text for name in formulas()}


@scene("spectra of large graphs")
def _() -> Quantities:
    return {"chain": exact(chain(300)), "ring": exact(ring(1001)), "cube": exact(synchain.graphs.hypercube(512))}


@scene("spectra of matrices")
def _() -> Quantities:
    matrices = {
        "weak link": [["-3/2", 1, "1/2"], [1, -2, 1], ["1/2", 1, "-3/2"]],
        "one-way": [[-1, "2/3", "1/3"], [0, -1, 1], [2, 0, -2]],
        "Jordan block": [[0, 0, 0, 0], [1, -1, 0, 0], [0, 1, -1, 0], [0, 0, 1, -1]],
        "two Jordan blocks": [[0, 0, 0, 0, 0], [1, -1, 0, 0, 0], [0, 1, -1, 0, 0], [1, 0, 0, -1, 0], [0, 0, 0, 1, -1]],
        "repelling": [[-1, 2, -1], [2, -3, 1], [-1, 1, 0]],
        "cubic": [[-1, 1, 0, 0], [1, -3, 2, 0], [0, 2, -5, 3], [0, 0, 3, -3]],
        "quintic": [[-3, 1, 2, 0, 0], [0, -1, 1, 0, 0], [0, 3, -4, 1, 0], [5, 0, 0, -6, 1], [0, 0, 1, 1, -2]],
    }
    return {name: exact(from_matrix(rows)) for name, rows in matrices.items()}


@scene("spectra of operations and of edges")
def _() -> Quantities:
    one_way = from_edges([(0, 1), (1, 2, 0.5), (2, 0), (2, 3)], directed=True)
    return {
        "cartesian": exact(synchain.graphs.cartesian(ring(5), star(4))),
        "kronecker": exact(synchain.graphs.kronecker(chain(3), complete(4))),
        "union": exact(synchain.graphs.union(ring(3), chain(4))),
        "complement": exact(synchain.graphs.complement(ring(7))),
        "weighted": exact(synchain.graphs.weighted(chain(4), "1/3")),
        "edges": exact(one_way),
    }


@scene("spectra of symbolic weights")
def _() -> Quantities:
    rows = {
        "two": [["-a", "a"], ["b", "-b"]],
        "three": [["-a", "a", 0], ["b", "-b-1", 1], [0, "1/c", "-1/c"]],
        "one-way ring": [["-a", "a", 0], [0, "-a", "a"], ["a", 0, "-a"]],
    }
    graphs = {name: from_symbols(matrix) for name, matrix in rows.items()}
    seen = {name: graph.spectrum.text for name, graph in graphs.items()}
    return seen | {"two at numbers": exact(graphs["two"].at(a="1/2", b=3))}


@scene("cluster states of small graphs")
def _() -> Quantities:
    seen: Quantities = {}
    for name, graph in (("star", star(5)), ("ring", ring(6)), ("ladder", synchain.graphs.ladder(6))):
        seen[name] = "\n".join(f"{c.classes} {c.quotients[0].links} {c.blocks}" for c in orbital_partitions(graph))
    seen["bipartite"] = str(clusters(synchain.graphs.complete_bipartite(5), [0, 0, 1, 1, 1]).blocks)
    return seen


@scene("equations of every oscillator")
def _() -> Quantities:
    seen: Quantities = {}
    for name in names(OSCILLATOR):
        seen |= {f"{name} {key}": value for key, value in written(Scene(oscillator=name)).items()}
    return seen


@scene("equations of every friction law and contact")
def _() -> Quantities:
    seen: Quantities = {}
    for law in names(FRICTION_LAW):
        for contact in ("atan", "sign", "set-valued"):
            try:
                given = Scene(friction=law, contact=contact, topology=chain(2))
            except ValueError:
                seen[f"{law} {contact}"] = "refused"
                continue
            seen |= {f"{law} {contact} {key}": value for key, value in written(given).items()}
    return seen


@scene("equations of every coupling")
def _() -> Quantities:
    seen: Quantities = {}
    for name in names(COUPLING):
        graph = star(3) if load(COUPLING, name).between else chain(3)
        beam = [{"oscillator": "beam", "at": [1]}] if graph.name == "star" else None
        own = "clock" if beam else "duffing"
        given = Scene(oscillator=own, nodes=beam, coupling=name, topology=graph)
        found, power = energy_terms(given).whole()
        seen |= {f"{name} {key}": value for key, value in written(given).items()}
        seen |= {f"{name} energy": sp.sstr(found), f"{name} power": sp.sstr(power)}
    return seen


@scene("equations on every topology")
def _() -> Quantities:
    seen: Quantities = {}
    for name in names(TOPOLOGY):
        for n in (family_sizes.size(name, n) for n in (6, 12)):
            given = Scene(oscillator="harmonic", topology=getattr(graphs, name)(n))
            seen |= {f"{name} {n} {key}": value for key, value in written(given).items()}
    return seen


@scene("equations of the shipped scenes")
def _() -> Quantities:
    seen: Quantities = {}
    for name in synchain.scene_names():
        seen |= {f"{name} {key}": value for key, value in written(load_scene(name)).items()}
    return seen


@scene("energies of a damped network")
def _() -> Quantities:
    return balance(Scene(oscillator="duffing", coupling="damper", topology=ring(3), parameters={"sigma": 0.5}))


@scene("command line")
def _() -> Quantities:
    lines = (
        "spectrum star 6",
        "spectrum chain 7 --json",
        "spectrum chain --symbolic",
        "spectrum cartesian(chain(3),ring(4))",
        "equations figure_4a",
        "equations duffing_chain --latex",
        "equations double_pendulum --json",
        "equations figure_7 --c",
        "equations huygens --python",
        "equations figure_1b --numba",
    )
    lists = {"topologies": printed("list", "graphs"), "scenes": printed("list", "scenes")}
    return {line: printed(*line.split()) for line in lines} | lists


# -- by hand ---------------------------------------------------------------------------------------------------


def _lines(name: str) -> Iterator[str]:
    for quantity, value in take(name, whole=True).items():
        yield f"== {name} == {quantity}"
        if isinstance(value, dict) and "numbers" in value:
            yield f"shape {value['shape'] or 'of a number'}"
            yield from (f"{float.fromhex(x)!r}  {x}" for x in value["numbers"].split())
        else:
            yield str(value)


def show(chosen: list[str]) -> None:
    """Print the scenes of these names, or the names of all."""
    for name in chosen:
        if name not in SCENES:
            raise SystemExit(
                f"photograph: found no scene {name!r}; expected one of those that are listed without a name"
            )
    print("\n".join(line for name in chosen for line in _lines(name)) if chosen else "\n".join(SCENES))


if __name__ == "__main__":
    show(sys.argv[1:])

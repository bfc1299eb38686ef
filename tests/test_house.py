"""The rooms and their doors: which room may import which, that every room is installed, what a
start costs.
"""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[1]
PACKAGES = ("models", "codegen", "runtime")

ARROWS = {
    "models.inputs": "",
    "models.algebra": "",
    "models.mechanics": "inputs",
    "models.interactions": "mechanics inputs",
    "models.definitions": "interactions mechanics inputs",
    "models.spectra": "algebra inputs",
    "models.graphs": "spectra algebra inputs",
    "models.symmetries": "graphs spectra algebra inputs",
    "models.dynamics": "symmetries graphs definitions interactions mechanics inputs",
    "models.claims": "graphs spectra algebra inputs",
    "models.presentation": "dynamics interactions mechanics inputs",
    "models.networks": "dynamics graphs definitions interactions mechanics inputs",
    "models.sweeps": "networks dynamics graphs inputs",
    "models.scenes": "sweeps networks dynamics graphs spectra definitions interactions mechanics inputs",
    "models.scenes.library": "",
    "models.topologies": "graphs spectra algebra inputs",
    "models.oscillators": "definitions mechanics",
    "models.frictions": "definitions mechanics",
    "models.couplings": "definitions mechanics",
    "codegen.front_end": "",
    "codegen.simd": "front_end",
    "codegen.integrators": "models",
    "codegen.driver": "simd",
    "codegen.recorders": "driver simd",
    "codegen.program": "",
    "codegen.steps": "program integrators simd models",
    "codegen.taylor": "steps program integrators simd models",
    "codegen.kernels": "taylor steps program driver integrators simd models",
    "codegen.machine_code": "kernels driver steps front_end simd models",
    "codegen.export": "driver program integrators models",
    "runtime.support": "models.inputs",
    "runtime.cells": "support codegen models",
    "runtime.prediction": "support models",
    "runtime.engines": "cells support codegen models",
    "runtime.stability": "results engines cells prediction support codegen models",
    "runtime.results": "engines cells support codegen models",
    "runtime.sweeps": "stability results engines prediction cells support codegen models",
    "runtime.synchronisation": "sweeps stability results engines prediction cells support codegen models",
    "runtime.bifurcation": "sweeps stability results engines cells support codegen models",
    "runtime.plots": "bifurcation synchronisation sweeps stability results prediction support models",
    "runtime.reports": "plots sweeps stability results engines models",
    "runtime.paper": "plots bifurcation synchronisation sweeps stability results prediction support models",
    "runtime.console": "plots bifurcation synchronisation sweeps stability results prediction cells "
    "support codegen models",
    "runtime.front": "models",
    "runtime.papers": "front support",
    "runtime.commands": "console reports plots paper papers bifurcation synchronisation sweeps stability results engines "
    "prediction cells support codegen models",
}
"""The rooms that a room may import, beside itself; names without a package are rooms of the same
package, a package stands for all of its rooms.
"""

DOORS = {("models/inputs/display.py", "runtime.plots"), ("models/inputs/display.py", "runtime.reports")}
"""Files that call a room above them, inside a method: values draw and show themselves by what stands at the top."""

FRONT = {"models", "codegen", "runtime"}
"""The packages themselves offer names of their rooms, and the command line is the top of the house.
"""


def sources() -> list[Path]:
    return sorted(p for package in PACKAGES for p in (PROJECT / package).rglob("*.py") if "__pycache__" not in p.parts)


def rooms() -> set[str]:
    """Every folder with sources, as a dotted name."""
    return {".".join(path.relative_to(PROJECT).parts[:-1]) for path in sources()}


@cache
def imported(path: Path, text: str) -> tuple[tuple[int, str], ...]:
    """(Line, absolute dotted name) of every import in the text of a file, at any depth, those for type
    checks too.
    """
    package = ("synchain", *path.relative_to(PROJECT).parts[:-1])
    collected: list[tuple[int, str]] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            collected += ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = list(package[: len(package) - node.level + 1]) if node.level else []
            name = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            collected += ((node.lineno, f"{name}.{alias.name}") for alias in node.names)
    return tuple(collected)


def room_of(name: str) -> str:
    """The room that holds an absolute dotted name of a module or of something in it; `runtime/front` is `synchain`."""
    parts = name.split(".")[1:]
    if not parts or parts[0] not in PACKAGES:
        return "runtime.front"
    while parts and ".".join(parts) not in KNOWN:
        parts.pop()
    return ".".join(parts)


KNOWN = rooms()


def allowed(room: str) -> set[str]:
    """All rooms that a room may import."""
    package = room.partition(".")[0]
    names = {word if word.partition(".")[0] in PACKAGES else f"{package}.{word}" for word in ARROWS[room].split()}
    packages = {name for name in names if name in PACKAGES}
    return names | {other for other in KNOWN if other.partition(".")[0] in packages} | {room}


def wrong_imports(path: Path, text: str) -> list[str]:
    room = ".".join(path.relative_to(PROJECT).parts[:-1])
    collected = []
    for line, name in imported(path, text):
        top = name.partition(".")[0]
        door = (path.relative_to(PROJECT).as_posix(), room_of(name)) in DOORS
        if top == "synchain" and room not in FRONT and room_of(name) not in allowed(room) and not door:
            collected.append(f"{path.relative_to(PROJECT)}:{line} imports {name} of {room_of(name)}")
        if top == "benchmarks":
            collected.append(f"{path.relative_to(PROJECT)}:{line} imports {name}")
        if room.startswith("models") and top not in sys.stdlib_module_names | {"synchain", "sympy", "flint"}:
            collected.append(f"{path.relative_to(PROJECT)}:{line} imports {name}")
    return collected


def test_every_room_has_a_row_in_the_table_of_arrows() -> None:
    assert rooms() - FRONT == set(ARROWS)


def test_a_room_imports_only_the_rooms_of_its_row() -> None:
    assert [line for path in sources() for line in wrong_imports(path, path.read_text("utf-8"))] == []


def test_the_table_of_arrows_has_no_circle() -> None:
    reach = {room: allowed(room) - {room} for room in ARROWS}
    left = set(ARROWS)
    while ground := {room for room in left if not reach[room] & left}:
        left -= ground
    assert left == set()


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(PROJECT).with_suffix("").parts).removesuffix(".__init__")


def in_circles(texts: dict[Path, str]) -> set[str]:
    """The modules that import each other, directly or through others, at any depth and for type checks too."""
    modules = {module_name(path) for path in texts}
    reach: dict[str, set[str]] = {}
    for path, text in texts.items():
        reached = reach[module_name(path)] = set()
        for _, name in imported(path, text):
            parts = name.split(".")[1:] if name.startswith("synchain.") else []
            while parts and ".".join(parts) not in modules:
                parts.pop()
            if (path.relative_to(PROJECT).as_posix(), room_of(name)) not in DOORS:
                reached.add(".".join(parts))
        reached -= {module_name(path), ""}
    left = set(reach)
    while ground := {module for module in left if not reach[module] & left}:
        left -= ground
    return {module for module in left if any(module in reach[other] for other in left)}


def test_no_modules_import_each_other() -> None:
    texts = {path: path.read_text("utf-8") for path in sources()}
    assert in_circles(texts) == set()
    planted = PROJECT / "models" / "graphs" / "links.py"
    texts[planted] += "\n\ndef f():\n    from .graph_products import union"
    assert {"models.graphs.links", "models.graphs.topology", "models.graphs.graph_products"} <= in_circles(texts)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("models/graphs", "from ..dynamics.equations import Equations"),
        ("models/algebra", "if TYPE_CHECKING:\n    from ..graphs.topology import Topology"),
        ("models/scenes", "from ...codegen import kernels"),
        ("models/scenes", "from ... import codegen"),
        ("models/inputs", "def f():\n    import synchain.runtime.sweeps.run"),
        ("models/inputs", "import numpy as np"),
        ("models/graphs", "def f():\n    from scipy import linalg"),
        ("codegen/front_end", "from ..simd import lanes"),
        ("codegen/steps", "from ..machine_code.cache import x"),
        ("codegen/kernels", "from ..machine_code.compile import load"),
        ("codegen/kernels", "from ...runtime.sweeps.run import run"),
        ("codegen/kernels", "from synchain import runtime"),
        ("runtime/cells", "from ..engines import choice"),
        ("runtime/prediction", "from ...codegen.machine_code import compile"),
        ("runtime/plots", "from ..paper import published"),
        ("runtime/plots", "import synchain as sc"),
        ("runtime/papers", "from ..stability.msf import msf"),
        ("runtime/commands", "from benchmarks import names"),
    ],
)
def test_a_wrong_import_is_seen(path: str, text: str) -> None:
    assert wrong_imports(PROJECT / path / "planted.py", text) != []


def test_every_room_says_what_it_may_know() -> None:
    silent = [
        room
        for room in KNOWN
        if not ast.get_docstring(ast.parse((PROJECT / room.replace(".", "/") / "__init__.py").read_text("utf-8")))
    ]
    assert silent == []


def test_every_room_is_installed() -> None:
    listed = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]["packages"]
    folders = {path.parent for package in PACKAGES for path in (PROJECT / package).rglob("*.py")}
    names = {".".join(("synchain", *path.relative_to(PROJECT).parts)) for path in folders}
    assert sorted(listed) == sorted({"synchain", *names} - {"synchain.runtime.front"})  # the front is `synchain` itself


def test_values_of_the_models_cannot_be_changed() -> None:
    collected = []
    for path in sorted((PROJECT / "models").rglob("*.py")):
        dotted = ".".join(("synchain", *path.relative_to(PROJECT).with_suffix("").parts)).removesuffix(".__init__")
        module = importlib.import_module(dotted)
        kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and is_dataclass(kind)]
        collected += [kind for kind in kinds if kind.__module__ == dotted]
    assert len(collected) > 20
    public = [kind for kind in collected if not kind.__name__.startswith("_")]
    assert [kind for kind in public if "__slots__" not in vars(kind)] == []
    assert [kind for kind in public if not kind.__dataclass_params__.frozen] == []  # type: ignore[attr-defined]


def test_every_package_that_is_imported_is_declared() -> None:
    """The extras `dask`, `completion` and `files` aside, which may be missing."""
    names_found = {name.partition(".")[0] for path in sources() for _, name in imported(path, path.read_text("utf-8"))}
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = {re.match("[a-z-]+", line).group().removeprefix("python-") for line in project["dependencies"]}
    assert (
        names_found - sys.stdlib_module_names - {"synchain", "distributed", "shtab", "h5netcdf", "h5py", "zarr"}
        == declared
    )


def loaded_by(statement: str) -> set[str]:
    """The top-level modules in a fresh interpreter after a statement."""
    code = f"{statement}\nimport sys\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import synchain", {"sympy", "flint", "numpy", "numba", "matplotlib"}),
        ("from synchain.graphs import chain; chain(4)", {"sympy", "flint", "numpy", "numba", "matplotlib"}),
        (
            "from synchain.graphs import chain, from_matrix, star; import synchain.models.spectra.solve;"
            "[str(graph.spectrum) for graph in (star(6), chain(7), from_matrix([[-1, 1], [1, -1]]))]",
            {"numpy", "numba", "matplotlib", "scipy"},
        ),
        (
            "from synchain import load_scene; load_scene('figure_4a').equations",
            {"numpy", "numba", "matplotlib", "scipy"},
        ),
    ],
)
def test_start_loads_only_what_it_needs(statement: str, absent: set[str]) -> None:
    assert loaded_by(statement) & absent == set()


def test_the_frame_of_the_source_can_be_counted() -> None:
    """The report at the end of `.ci/run` sees public and private names."""
    command = [sys.executable, str(PROJECT / "tools" / "frame.py")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    numbers = {line[:40].strip(): float(line[40:]) for line in printed.splitlines()}
    assert numbers["docstrings, public"] > 1000
    assert numbers["docstrings, private"] > 1000

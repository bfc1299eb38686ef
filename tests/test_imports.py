"""The rooms and their doors: which package may import which, and what a start costs."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path

import pytest

import synchain.models

ROOT = Path(next(iter(synchain.models.__path__))).resolve().parent
ROOMS = ("models", "codegen", "runtime")
FORBIDDEN = {"models": {"codegen", "runtime"}, "codegen": {"runtime"}, "runtime": set()}
OURS = {"synchain"}
THIRD_PARTY_OF_MODELS = {"sympy", "flint"}


def sources(room: str) -> list[Path]:
    return sorted(path for path in (ROOT / room).rglob("*.py") if "__pycache__" not in path.parts)


def imported(path: Path, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield (line, absolute dotted name) of every import in a file, at any depth."""
    package = ("synchain", *path.relative_to(ROOT).parts[:-1])
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = list(package[: len(package) - node.level + 1]) if node.level else []
            name = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            yield node.lineno, name
            yield from ((node.lineno, f"{name}.{alias.name}") for alias in node.names)


def wrong_imports(room: str, path: Path, text: str) -> list[str]:
    found = []
    for line, name in imported(path, ast.parse(text)):
        parts = name.split(".")
        if parts[0] == "synchain" and len(parts) > 1 and parts[1] in FORBIDDEN[room]:
            found.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
        foreign = parts[0] not in sys.stdlib_module_names | OURS | THIRD_PARTY_OF_MODELS
        if room == "models" and foreign:
            found.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_imports_point_one_way(room: str) -> None:
    assert sources(room), f"no sources in {room}"
    found = [line for path in sources(room) for line in wrong_imports(room, path, path.read_text("utf-8"))]
    assert found == []


@pytest.mark.parametrize(
    ("room", "text"),
    [
        ("models", "from ..codegen import emit"),
        ("models", "from .. import codegen"),
        ("models", "import synchain.runtime.run"),
        ("models", "def f():\n    from synchain.codegen.emit import x"),
        ("models", "import numpy as np"),
        ("models", "def f():\n    from scipy import linalg"),
        ("codegen", "from ..runtime.sweep import Sweep"),
        ("codegen", "from synchain import runtime"),
    ],
)
def test_a_wrong_import_is_seen(room: str, text: str) -> None:
    assert wrong_imports(room, ROOT / room / "planted.py", text) != []


def test_values_of_the_models_cannot_be_changed() -> None:
    found = []
    for path in sources("models"):
        dotted = ".".join(("synchain", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")
        module = importlib.import_module(dotted)
        kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and is_dataclass(kind)]
        found += [kind for kind in kinds if kind.__module__ == dotted]
    assert len(found) > 20
    own = [kind for kind in found if not kind.__name__.startswith("_")]
    assert [kind for kind in own if "__slots__" not in vars(kind)] == []
    assert [kind for kind in own if not kind.__dataclass_params__.frozen] == []  # type: ignore[attr-defined]


def test_no_file_is_called_utils() -> None:
    assert [path for room in ROOMS for path in sources(room) if "util" in path.stem] == []


def loaded_by(statement: str) -> set[str]:
    """The top-level modules in a fresh interpreter after a statement."""
    code = f"{statement}\nimport sys\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import synchain.models", {"sympy", "flint", "numpy", "numba", "matplotlib"}),
        ("from synchain.models import chain; chain(4)", {"sympy", "flint", "numpy", "numba", "matplotlib"}),
        ("import synchain.models.spectrum", {"numpy", "numba", "matplotlib", "scipy"}),
        ("from synchain.models import star; star(6).spectrum", {"numpy", "numba", "matplotlib", "scipy"}),
        (
            "from synchain.models import load_scene; load_scene('figure_4a').equations",
            {"numpy", "numba", "matplotlib", "scipy"},
        ),
    ],
)
def test_start_loads_only_what_it_needs(statement: str, absent: set[str]) -> None:
    assert loaded_by(statement) & absent == set()


def test_every_package_that_is_imported_is_declared() -> None:
    """Peers of the benchmark and the extra `dask` aside, which may be missing."""
    found = {
        name.partition(".")[0]
        for room in ROOMS
        for path in sources(room)
        if path.parent.name != "peers"
        for _, name in imported(path, ast.parse(path.read_text("utf-8")))
    }
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    declared = {re.match("[a-z-]+", line).group().removeprefix("python-") for line in project["dependencies"]}
    assert found - sys.stdlib_module_names - OURS - {"distributed"} == declared


def test_the_package_offers_its_names_on_first_use() -> None:
    for name in synchain.models.__all__:
        assert getattr(synchain.models, name).__name__ == name
    families = {path.stem for path in (ROOT / "models" / "topologies").glob("*.py")} - {"__init__"}
    assert families
    assert families | set(synchain.models.__all__) <= set(dir(synchain.models))
    for name in families:
        assert getattr(synchain.models, name)(6).name == name
    with pytest.raises(AttributeError, match="no attribute 'chian'"):
        _ = synchain.models.chian


def test_a_star_import_and_a_submodule_both_work() -> None:
    code = "from synchain.models import *; from synchain.models import topology; print(topology)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert "module 'synchain.models.topology'" in done.stdout

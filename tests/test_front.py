"""The front door: what `import synchain` offers, what it costs, and what its stubs tell to editors."""

from __future__ import annotations

import doctest
import importlib
import inspect
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

import pytest

import synchain
from synchain import graphs
from synchain.models.graphs import families

ROOT = Path(__file__).resolve().parents[1]
CONTRACT = [
    *(
        "Scene",
        "Lagrangian",
        "Field",
        "Potential",
        "Rates",
        "ends",
        "Parameter",
        "friction",
        "friction_law",
        "load_scene",
    ),
    *("run", "stream", "msf", "thresholds", "open_result", "kernel"),
]
WIDE = 120
"""Longest line of code."""

TYPES = {"tuple[int, ...]": "Iterable[int]", "str": "float | str"}
"""What options accept beside what they are stored as; every option that is kept as text is a probability."""


def files() -> list[str]:
    folder = ROOT / "models" / "topologies"
    return sorted(path.stem for path in folder.glob("*.py") if path.stem != "__init__")


def shipped() -> list[str]:
    """The names of all families, those of networkx among them."""
    return sorted({*files(), *families.TOPOLOGY.also})


def written(default: object) -> str:
    return f'"{default}"' if isinstance(default, str) else repr(default)


def accepted(annotation: str) -> str:
    return " | ".join(TYPES.get(part, part) for part in annotation.split(" | "))


def arguments(family: families.Family) -> tuple[str, ...]:
    """What a family takes."""
    parameters = inspect.signature(family.edges).parameters.values()
    options = [
        f"{p.name}: {accepted(p.annotation)} = {written(p.default)}"
        for p in parameters
        if p.kind is inspect.Parameter.KEYWORD_ONLY
    ]
    return "n: int", *(["*"] if options else []), *options


def head(name: str, parts: Iterable[str]) -> str:
    """The first line of a function, or as many as the formatter makes of it."""
    line = f"def {name}({', '.join(parts)}) -> Topology:"
    if len(line) + len(" ...") <= WIDE:
        return line
    lines = [f"    {part},\n" for part in parts]
    lines = [line if len(line) <= WIDE else listed(line) for line in lines]
    return f"def {name}(\n{''.join(lines)}) -> Topology:"


def listed(line: str) -> str:
    """A line with a list in brackets, an entry a line."""
    begin, entries = line.split("[", 1)
    inner = "".join(f"        {entry},\n" for entry in entries.rstrip("],\n").split(", "))
    return f"{begin}[\n{inner}    ],\n"


def function_stub(name: str) -> str:
    """The stub of a family."""
    graph_family = families.family(name)
    return f'{head(name, arguments(graph_family))}\n    """{graph_family.summary.replace(chr(34), chr(39))}."""\n'


def topology_stub() -> str:
    """What `topology` takes, by the name of the family; the last form is for files and installed families."""
    takes: dict[tuple[str, ...], list[str]] = {}
    for name in shipped():
        takes.setdefault(arguments(families.family(name)), []).append(f'"{name}"')
    overloads = [
        "@overload\n" + head("topology", (f"name: Literal[{', '.join(names)}]", *keywords)) + " ...\n"
        for keywords, names in sorted(takes.items(), key=lambda each: each[1])
    ]
    return "".join([*overloads, "@overload\ndef topology(name: str, n: int, **options: object) -> Topology: ...\n"])


def stub(module: ModuleType) -> str:
    """The names of a module with where they are defined, as editors read them."""
    homes = sorted((home, name) for name, home in module.HOMES.items() if home and name != "topology")
    lines = [f"from synchain.{home} import {name} as {name}" for home, name in homes]
    head = "# What the module loads on first use; tests/test_front.py writes this file with --update.\n"
    if module is synchain:
        parts = "".join(f"from . import {name} as {name}\n" for name in synchain.MODULES)
        return f"{head}{parts}" + "\n".join(lines) + "\n\n__version__: str\n"
    if module is not graphs:
        return head + "\n".join(lines) + "\n"
    needed = "from collections.abc import Iterable\nfrom typing import Literal, overload\n\n"
    stubs = topology_stub() + "\n".join(map(function_stub, shipped()))
    return f"{head}{needed}" + "\n".join(lines) + "\n\n" + stubs


@pytest.mark.parametrize("name", ["__init__", *synchain.MODULES])
def test_the_stubs_name_what_the_modules_offer(name: str, request: pytest.FixtureRequest) -> None:
    text = stub(synchain if name == "__init__" else getattr(synchain, name))
    path = ROOT / "runtime" / "front" / f"{name}.pyi"
    if request.config.getoption("--update"):
        path.write_text(text, encoding="utf-8")
    assert path.read_text("utf-8") == text, f"{path} is old; run: pytest tests/test_front.py --update"


def test_every_public_name_is_offered_once_and_loads() -> None:
    modules = [synchain, *(getattr(synchain, name) for name in synchain.MODULES)]
    names = [name for module in modules for name in module.__all__]
    assert len(names) == len({*names})
    assert {*CONTRACT} <= {*synchain.__all__}
    assert {*shipped()} <= {*graphs.__all__}
    for module in modules:
        assert {*module.__all__} <= {*dir(module)}
        for name in module.__all__:
            value = getattr(module, name)
            assert getattr(value, "__name__", name).rpartition(".")[2] == name  # `nodes` and families have none
    assert synchain.__version__ == importlib.import_module("importlib.metadata").version("synchain")


@pytest.mark.parametrize(
    ("module", "name", "message"),
    [
        ("synchain", "chian", "module 'synchain' has no attribute 'chian'$"),
        ("synchain", "ring", "no attribute 'ring'; use synchain.graphs.ring$"),
        ("synchain.graphs", "mean", "no attribute 'mean'; use synchain.observe.mean$"),
        ("synchain.results", "run", "no attribute 'run'; use synchain.run$"),
    ],
)
def test_a_name_of_another_module_is_said(module: str, name: str, message: str) -> None:
    with pytest.raises(AttributeError, match=message):
        getattr(importlib.import_module(module), name)


EDITED = """
from synchain import Scene, msf, run
from synchain.graphs import chain, circulant, gnp_random, path, topology

path(4)
gnp_random(6, p="1/3", seed=2)
topology("circulant", 6, offsets=(1, 3))
topology("own.py", 6, whatever=2)
circulant(6, offset=(1, 3))  # wrong
path(4, seed=1)  # wrong
msf(Scene(), [0.0, 1.0], rng="a")  # wrong
run(Scene(), parameters={"omega": 1.2}, executer=3, workers="two")  # wrong
reveal_type(topology("grid", 6, shape=(2, 3)))
"""
"""What a user writes in an editor; lines that an editor marks are marked."""


@pytest.mark.long
def test_a_type_checker_sees_what_an_editor_completes(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    file = tmp_path / "edited.py"
    file.write_text(EDITED)
    folder_on_path = tmp_path / "known" / "synchain"
    folder_on_path.mkdir(parents=True)
    for room in ("models", "codegen", "runtime"):
        (folder_on_path / room).symlink_to(ROOT / room)
    for part in (ROOT / "runtime" / "front").iterdir():
        (folder_on_path / part.name).symlink_to(part)
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--follow-imports=silent",
        "--cache-dir",
        str(tmp_path / "mypy"),
        str(file),
    ]
    paths = {**os.environ, "MYPYPATH": str(tmp_path / "known")}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=paths, timeout=600)
    names_found = {int(line.split(":")[1]) for line in done.stdout.splitlines() if ": error:" in line}
    wrong = {k for k, line in enumerate(EDITED.splitlines(), 1) if line.endswith("# wrong")}
    assert names_found == wrong, done.stdout
    assert 'Revealed type is "synchain.models.graphs.topology.Topology"' in done.stdout


@pytest.mark.parametrize("name", shipped())
def test_a_family_tells_its_options(name: str) -> None:
    signature = inspect.signature(getattr(graphs, name))
    assert list(signature.parameters) == ["n", *getattr(graphs, name).options]
    assert {p.name: p.default for p in signature.parameters.values() if p.name != "n"} == getattr(graphs, name).options


def test_the_class_of_families_has_the_signature_of_its_constructor() -> None:
    assert "edges" in inspect.signature(families.Family).parameters


def test_import_synchain_is_light() -> None:
    code = "import synchain, sys; print(*{name.split('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    heavy = {"sympy", "numba", "numpy", "matplotlib", "xarray", "scipy", "flint", "llvmlite"}
    assert set(done.stdout.split()) & heavy == set()


def test_star_imports_go_together_and_bring_the_contract() -> None:
    """In one process, which costs as much as all modules together."""
    code = f"""
from synchain import *; from synchain.graphs import *; from synchain.observe import *; print(msf, chain(3).n)
for name in {{*globals()}}:
    if not name.startswith("__"): del globals()[name]
from synchain import *; print(*[n for n in {CONTRACT!r} if n not in globals()]); print(graphs.chain(3).n)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    together, *contract = done.stdout.splitlines()
    assert together.startswith("<function msf")
    assert contract == ["", "3"]


def homes() -> list[str]:
    """The modules that define public names."""
    modules = [synchain, *(getattr(synchain, name) for name in synchain.MODULES)]
    return sorted({home for module in modules for home in module.HOMES.values() if home})


@pytest.mark.parametrize("name", homes())
def test_examples_of_docstrings_run(name: str) -> None:
    assert doctest.testmod(importlib.import_module(f"synchain.{name}")).failed == 0


def test_public_names_have_an_example_and_further_names() -> None:
    """Results are shown by the functions that return them; the values of `observe` and errors need no call."""
    for module in (synchain, *(getattr(synchain, name) for name in synchain.MODULES if name != "results")):
        for name in module.HOMES:
            text = inspect.getdoc(getattr(module, name)) or ""
            assert "\nSee Also\n" in text or name in ("energy", "nodes", *synchain.MODULES), name
            assert ">>> " in text or name in ("energy", "nodes", *synchain.MODULES), name


@pytest.mark.parametrize("page", ["README.md", "docs/inline.md"])
def test_the_models_of_the_docs_can_be_made(page: str) -> None:
    """All but what runs them, which other tests do."""
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text("utf-8"), re.MULTILINE | re.DOTALL)
    inline = [block for block in blocks if "sc." in block]
    namespace: dict[str, object] = {}
    for block in inline:
        lines = [
            line for line in block.splitlines() if "sc.run(" not in line and not line.startswith(("result", "plt"))
        ]
        exec("\n".join(lines), namespace)
    assert isinstance(namespace["scene"], synchain.Scene)
    assert len(inline) == (2 if page == "README.md" else 3)


@pytest.mark.long
def test_wheel_and_source_archive_hold_the_front(tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(tmp_path)]
    source = tmp_path / "source"
    tracked = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True)
    for name in tracked.stdout.splitlines():
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((ROOT / name).read_bytes())
    subprocess.run([*pip, str(source)], check=True, timeout=300)
    (wheel,) = tmp_path.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    front = {f"synchain/{path.name}" for path in (ROOT / "runtime" / "front").iterdir() if path.is_file()}
    assert front <= names
    assert not [name for name in names if "front/" in name]
    code = "import synchain; print(synchain.__file__); print(synchain.graphs.star(6).spectrum)"
    path = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(path)
    run = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(path)!r}); {code}"]
    done = subprocess.run(run, capture_output=True, text=True, check=True, timeout=60, cwd=tmp_path)
    assert str(path) in done.stdout
    assert "{0: 1, -1: 4, -6: 1}" in done.stdout

"""README, CONTRIBUTING and docs: what they name exists, and the command lines can be read."""

from __future__ import annotations

import importlib
import re
import runpy
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mutants import TESTS

import synchain
from synchain.models.graphs.families import TOPOLOGY, names
from synchain.runtime.cli import parser

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PROGRAM = ROOT / "docs" / "program.md"
RECIPES = [PROGRAM, *sorted((ROOT / "docs" / "how-to").glob("*.md"))]
EXAMPLES = sorted((ROOT / "docs" / "gallery").glob("*.py"))
MOST_LINES = 25
"""Lines of model and run of an example, without those that are empty."""
MEASURE = runpy.run_path(str(ROOT / "docs" / "measure.py"))
FILES = {path.stem for path in (ROOT / "tests").rglob("*.py")}
pages = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)


def exists(name: str) -> bool:
    """Whether a dotted name is a module or something in one."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            value: object = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for part in parts[k:]:
            if not hasattr(value, part):
                return False
            value = getattr(value, part)
        return True
    return False


def commands(text: str) -> Iterator[list[str]]:
    """The words after `synchain` of every command line without placeholders."""
    for line in re.findall(r"^    (?:\$ )?synchain (\w.*)$", text, re.MULTILINE):
        command = re.split(r"  #| \| | > ", line)[0]
        if not re.search(r"[\[…|]|\b[A-Z]{4,}\b|^\w+:| N ", command):
            yield shlex.split(command)


@pages
def test_paths_exist(page: Path) -> None:
    names = re.findall(
        r"(?<![\w/.-])(?:models|codegen|runtime|tests|docs)/[\w./-]*\w", page.read_text(encoding="utf-8")
    )
    missing = [name for name in names if not ((ROOT / name).exists() or (ROOT / f"{name}.py").exists())]
    assert not missing


@pages
def test_dotted_names_and_test_files_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    dotted = {name.rstrip(".") for name in re.findall(r"synchain\.(?:models|codegen|runtime)[\w.]*", text)}
    assert not [name for name in dotted if not exists(name)]
    assert not [name for name in re.findall(r"\btest_[a-z_0-9]+", text) if name not in FILES]


@pages
def test_imports_can_be_made(page: Path) -> None:
    lines = re.findall(r"^ *from (synchain[\w.]*) import ([\w, ]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
    names = [f"{module}.{name.strip()}" for module, names_of_line in lines for name in names_of_line.split(",")]
    assert not [name for name in names if not exists(name)]


@pages
def test_command_lines_can_be_read(page: Path) -> None:
    for command, *arguments in commands(page.read_text(encoding="utf-8")):
        parser(command).read(arguments)


@pytest.mark.parametrize("page", RECIPES, ids=lambda path: path.stem)
def test_recipes_run(page: Path) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    namespace: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), namespace)


def test_the_kernel_that_is_read_line_by_line_is_the_generated_one() -> None:
    text = PROGRAM.read_text("utf-8")
    (model,) = re.findall(r"^```python\n(import.*?)^```", text, re.MULTILINE | re.DOTALL)
    namespace: dict[str, Any] = {}
    exec(model, namespace)
    generated = namespace["sc"].kernel(namespace["scene"]).source.splitlines()
    section = text[text.index("## A kernel, line by line") : text.index("## Where things are")]
    quoted = [
        line
        for block in re.findall(r"^```\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
        for line in block.splitlines()
    ]
    assert len(quoted) > 20
    assert not [line for line in quoted if line not in generated]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_examples_have_a_short_model_a_check_and_a_figure(example: Path) -> None:
    """The site runs them, and stops if a check fails."""
    sections = MEASURE["sections"](example)
    assert list(sections) == ["Model and run", "Check", "Figure"]
    assert MEASURE["lines"](example) <= MOST_LINES
    assert re.search(r"^difference = ", sections["Check"], re.MULTILINE)
    assert re.search(r"^ *(assert|np\.testing\.assert_\w+\()", sections["Check"], re.MULTILINE)
    assert "plt.show()" in sections["Figure"]


def test_the_table_of_problems_holds_all_examples() -> None:
    table = (ROOT / "docs" / "problems.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[(.+)\]\(built/gallery/(\w+)\) \| (\d+) \|", table, re.MULTILINE)
    assert sorted(rows) == sorted((MEASURE["title"](path), path.stem, str(MEASURE["lines"](path))) for path in EXAMPLES)


@pytest.mark.parametrize("name", ["", *synchain.MODULES])
def test_the_reference_holds_all_public_names(name: str) -> None:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "reference").glob("*.rst")))
    entries = set(re.findall(r"^\.\. auto(?:class|function|exception|data):: ([\w.]+)", pages, re.MULTILINE))
    module = getattr(synchain, name) if name else synchain
    families = names() if name == "graphs" else ()
    offered = {*module.__all__} - {*synchain.MODULES, *families, *TOPOLOGY.also}
    assert not {f"{module.__name__}.{each}" for each in offered} - entries


def test_mutants_name_modules_and_tests() -> None:
    assert not [module for module in TESTS if not (ROOT / f"{module}.py").is_file()]
    assert not [name for names in TESTS.values() for name in names.split() if f"test_{name}" not in FILES]

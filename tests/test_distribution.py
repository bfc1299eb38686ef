"""What is handed out: the sdist holds the repository, the wheel the packages, and neither anything
else; the conda recipe asks for the same packages as pyproject.toml.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import HeaderParser
from pathlib import Path, PurePosixPath

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT, SETUPTOOLS = PYPROJECT["project"], PYPROJECT["tool"]["setuptools"]
FOLDERS = {folder: package for package, folder in SETUPTOOLS["package-dir"].items()}
BUILD = "from setuptools import build_meta; build_meta.build_{}({!r})"
MADE = {"PKG-INFO", "setup.cfg"}
"""What setuptools adds to an sdist, beside the folder *.egg-info."""


def tracked() -> set[str]:
    """The files of the repository, as git has them."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no checkout of the repository: what it holds is not known")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()}


def packaged(name: str) -> str | None:
    """Where the wheel holds a file of the repository by `package-dir`; None for one of no package."""
    homes = [folder for folder in FOLDERS if PurePosixPath(name).is_relative_to(folder)]
    if not homes:
        return None
    home = max(homes, key=len)
    return str(PurePosixPath(*FOLDERS[home].split("."), PurePosixPath(name).relative_to(home)))


def build(kind: str, source: Path, target: Path) -> Path:
    """Build a wheel or an sdist without a network and without an environment of its own."""
    target.mkdir()
    code = BUILD.format(kind, str(target))
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("COV_", "COVERAGE_"))}
    done = subprocess.run([sys.executable, "-c", code], cwd=source, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return next(target.iterdir())


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An sdist of the repository's files, unpacked."""
    folder = tmp_path_factory.mktemp("sdist")
    for name in tracked():
        path = folder / "source" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, path)
    with tarfile.open(build("sdist", folder / "source", folder / "dist")) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    return next((folder / "unpacked").iterdir())


@pytest.fixture(scope="module")
def wheel(sdist: Path) -> zipfile.Path:
    """The wheel that an installation builds from the sdist."""
    return zipfile.Path(build("wheel", sdist, sdist.parent.parent / "wheels"))


def names_in(archive: zipfile.Path) -> set[str]:
    return {name for name in archive.root.namelist() if not name.endswith("/")}


def test_the_sdist_holds_the_repository_and_nothing_else(sdist: Path) -> None:
    names_found = {path.relative_to(sdist).as_posix() for path in sdist.rglob("*") if path.is_file()}
    distributed = {name for name in names_found if name not in MADE and ".egg-info/" not in name}
    assert distributed == tracked()


def test_the_wheel_holds_the_packages_and_nothing_else(wheel: zipfile.Path) -> None:
    names_found = {name for name in names_in(wheel) if ".dist-info/" not in name}
    assert names_found == {path for name in tracked() if (path := packaged(name)) is not None}


@pytest.mark.parametrize(
    "name",
    [
        *(f"{package}/py.typed" for package in ("models", "codegen", "runtime")),
        "models/scenes/library/figure_4a.toml",
        "models/templates/friction.txt",
    ],
)
def test_files_that_are_no_code_are_in_the_wheel(name: str, wheel: zipfile.Path) -> None:
    assert f"synchain/{name}" in names_in(wheel)


def test_the_wheel_says_what_pyproject_says(wheel: zipfile.Path) -> None:
    (folder,) = [entry for entry in wheel.iterdir() if entry.name.endswith(".dist-info")]
    head = HeaderParser().parsestr((folder / "METADATA").read_text("utf-8"))
    needs = {Requirement(line) for line in head.get_all("Requires-Dist", []) if "extra ==" not in line}
    assert (head["Name"], head["Version"]) == (PROJECT["name"], PROJECT["version"])
    assert needs == set(map(Requirement, PROJECT["dependencies"]))
    assert set(head.get_all("Provides-Extra", [])) == set(PROJECT["optional-dependencies"])
    assert (folder / "licenses" / "LICENSE").read_text("utf-8") == (ROOT / "LICENSE").read_text("utf-8")
    assert "synchain = synchain.runtime.cli:main" in (folder / "entry_points.txt").read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("models/scenes/scene.py", "synchain/models/scenes/scene.py"),
        ("runtime/py.typed", "synchain/runtime/py.typed"),
        ("tests/conftest.py", None),
        ("README.md", None),
    ],
)
def test_places_in_the_wheel_follow_package_dir(name: str, path: str | None) -> None:
    assert packaged(name) == path


def test_the_deepest_folder_of_package_dir_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FOLDERS, "runtime/front", "synchain")
    assert packaged("runtime/front/__init__.py") == "synchain/__init__.py"
    assert packaged("runtime/frontier.py") == "synchain/runtime/frontier.py"


# -- the conda recipe --------------------------------------------------------------------------------------------

RECIPE = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text("utf-8"))
CONDA = {"matplotlib": "matplotlib-base"}
"""Names on conda-forge where they are others than on PyPI; matplotlib brings a window toolkit there."""


def conda(line: str) -> tuple[str, str]:
    """A requirement of pyproject as conda writes it: name and versions."""
    need = Requirement(line)
    return CONDA.get(need.name, need.name), ",".join(sorted(str(need.specifier).split(","), reverse=True))


def asked(lines: list[str]) -> set[tuple[str, str]]:
    """The requirements of a recipe, name and versions."""
    parted = (line.partition(" ") for line in lines)
    return {(name, ",".join(sorted(versions.split(","), reverse=True))) for name, _, versions in parted}


def test_the_recipe_asks_for_what_pyproject_asks_for() -> None:
    needs = RECIPE["requirements"]
    python = ("python", f"{PROJECT['requires-python']}")
    assert asked(needs["run"]) == {python, *map(conda, PROJECT["dependencies"])}
    assert asked(needs["host"]) == {python, ("pip", ""), *map(conda, PYPROJECT["build-system"]["requires"])}


def test_the_recipe_builds_this_version_from_the_sdist() -> None:
    context = RECIPE["context"]
    assert (RECIPE["package"]["name"], context["version"]) == (PROJECT["name"], PROJECT["version"])
    assert RECIPE["source"] == [{"path": "../dist/synchain-${{ version }}.tar.gz"}]
    assert RECIPE["build"]["python"]["entry_points"] == [f"{k} = {v}" for k, v in PROJECT["scripts"].items()]
    assert RECIPE["about"]["license"] == PROJECT["license"]

"""Papers whose printed numbers this package computes again, one script for each.

A script uses `import synchain` alone, as a user does, and leaves a `Reproduction` by the name `reproduction`.  Its
docstring is a page of the gallery: title, citation, and a word where the numbers differ.  `synchain reproduce`, the
gallery and the tests run the same scripts; discovery is a listing of the folder.
"""

from __future__ import annotations

import runpy
from pathlib import Path

from synchain.results import Reproduction

from ..support import folder

__all__ = ["names", "reproduce", "script", "title"]


def names() -> tuple[str, ...]:
    return folder.names(__path__)


def script(name: str) -> Path:
    """Return the file of a paper; raise ValueError if there is none."""
    folder.check_name("paper", name, __path__)
    return Path(__path__[0], f"{name}.py")


def title(name: str) -> str:
    """Return the title of a paper's page and the citation below."""
    lines = script(name).read_text(encoding="utf-8").splitlines()
    return f"{lines[1]}: {lines[4]}"


def reproduce(name: str) -> Reproduction:
    """Run the script of a paper and return its table; figures stay open in pyplot."""
    table = runpy.run_path(str(script(name)))["reproduction"]
    assert isinstance(table, Reproduction)
    return table

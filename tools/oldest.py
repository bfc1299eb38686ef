"""Print the oldest versions that pyproject.toml allows, one requirement a line, and what the tests need with them.

python tools/oldest.py > oldest.txt && pip install -r oldest.txt .
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from packaging.requirements import Requirement

PROJECT = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))["project"]


def oldest(line: str) -> str:
    """Return a requirement with its lower bound as its version."""
    need = Requirement(line)
    (bound,) = (part.version for part in need.specifier if part.operator == ">=")
    return f"{need.name}=={bound}"


if __name__ == "__main__":
    # Extras such as files need a newer xarray than the package itself: their tests are skipped.
    tests = [line for line in PROJECT["optional-dependencies"]["test"] if not line.startswith("synchain[")]
    print(*map(oldest, PROJECT["dependencies"]), *tests, sep="\n")

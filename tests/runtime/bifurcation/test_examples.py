"""The examples in the docstrings of functions that find equilibria, orbits and branches."""

from __future__ import annotations

import doctest
import importlib

import pytest


@pytest.mark.parametrize("name", ["equilibrium", "periodic", "branches", "skeleton"])
def test_examples_of_docstrings_run(name: str) -> None:
    results = doctest.testmod(importlib.import_module(f"synchain.runtime.bifurcation.{name}"))
    assert results.attempted > 2
    assert results.failed == 0

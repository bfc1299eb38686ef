"""Integrators of installed packages, announced as entry points."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from synchain import Field, Scene, run
from synchain.codegen import integrators
from synchain.models.scenes.defaults import integrators as names_in_scenes

BOGACKI_SHAMPINE = """
KIND, ORDER, ERROR_ORDER, DENSE_ORDER = "explicit", 3, 2, 3
SOURCE = "P. Bogacki, L. F. Shampine, Appl. Math. Lett. 2, 321 (1989); error against the midpoint rule"
B = (2 / 9, 1 / 3, 4 / 9)
A = ((), (1 / 2,), (0.0, 3 / 4), B)
C = (0.0, 1 / 2, 3 / 4, 1.0)
E = ((2 / 9, 1 / 3 - 1.0, 4 / 9),)
DENSE = ((1.0 - B[0], -B[1], -B[2], 0.0), (2.0 * B[0] - 1.0, 2.0 * B[1], 2.0 * B[2], -1.0))
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An installed package with an integrator, one whose import fails, and one without a tableau."""
    monkeypatch.syspath_prepend(tmp_path)
    record = tmp_path / "elsewhere-1.0.dist-info"
    record.mkdir()
    (record / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
    names = ("bogacki_shampine", "broken", "empty")
    entries = "\n".join(f"{name} = elsewhere_{name}" for name in names)
    (record / "entry_points.txt").write_text(f"[synchain.integrators]\n{entries}\n")
    for name, text in zip(names, (BOGACKI_SHAMPINE, "raise RuntimeError('out of order')\n", ""), strict=True):
        (tmp_path / f"elsewhere_{name}.py").write_text(text)
    yield
    for name in names:
        sys.modules.pop(f"elsewhere_{name}", None)


@pytest.mark.usefixtures("package")
def test_a_tableau_of_another_package_runs_as_the_shipped_ones() -> None:
    assert "bogacki_shampine" in integrators.names()
    assert integrators.names() == names_in_scenes()
    scene = Scene(Field({"x": "-x"}), initial={"x": 2.0}, transient=0.0, window=3.0)
    reference = 2.0 * np.exp(-3.0)
    ends = [
        float(run(scene, show_progress=False).end.values.item())
        for scene in (scene.replace(integrator="bogacki_shampine", rtol=rtol) for rtol in (1e-5, 1e-8))
    ]
    errors = np.abs(np.array(ends) - reference)
    assert errors[0] < 1e-4
    assert errors[1] < 1e-6
    assert 0 < errors[1] < errors[0]


@pytest.mark.usefixtures("package")
def test_a_module_without_a_tableau_is_refused() -> None:
    with pytest.raises(ValueError, match="integrator 'broken' of the entry point 'elsewhere_broken': out of order"):
        integrators.integrator("broken")
    with pytest.raises(ValueError, match=r"'elsewhere_empty': found no KIND, ORDER, .*; expected a module such as"):
        integrators.integrator("empty")


def test_only_installed_packages_have_entry_points() -> None:
    assert "bogacki_shampine" not in integrators.names()
    with pytest.raises(ValueError, match="integrator"):
        Scene(integrator="bogacki_shampine")

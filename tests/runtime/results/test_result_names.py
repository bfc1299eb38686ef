"""The names that results have for things of their own are the ones that nothing swept, drawn or observed may have."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from synchain import Field, Rates, Scene, follow, plane, run, skeleton
from synchain.codegen.driver.columns import SpanColumn
from synchain.draw import normal
from synchain.graphs import chain
from synchain.models.inputs.names import ATTRIBUTES, TAKEN
from synchain.results import PeriodicOrbit, Result
from synchain.runtime.bifurcation import results
from synchain.runtime.bifurcation.kinds import BifurcationKind
from synchain.runtime.bifurcation.results import Bifurcation
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.results.certificate import Certificate
from synchain.runtime.results.result import gather
from synchain.runtime.stability import exponent_plane


def own(data: xr.Dataset) -> set[str]:
    return {*map(str, data.variables), *map(str, data.dims)}


def names_of(scene: Scene) -> set[str]:
    """The names in a result of a scene, without a run."""
    cells, size = scene.cells, len(scene.y0)
    exponents = Certificate(*(np.zeros(cells) for _ in range(5)))
    buffers = Buffers.empty(cells, size, 3, scene.samples)
    return own(gather(scene, dict, np.ones((cells, len(SpanColumn))), buffers, exponents).data)


def test_no_result_of_a_run_has_other_names() -> None:
    link = Rates({"x": "k*W*(x_j - x_i)"}, {"k": 1})
    complete = Scene(
        Field({"x": "-a*x"}, parameters={"a": 1}), link, chain(3), record=("sync_error", "section", "trajectory"),
        samples=4, zipped=True, axes={"a": [1, 2], "x_1": [3, 4]}, realisations=2, draws={"k": normal(1, 0.1)},
    )  # fmt: skip
    assert names_of(complete) - TAKEN == {"a", "x_1", "k", "k_link"}


def test_no_result_has_other_attributes() -> None:
    assert {name for name in dir(Result) if not name.startswith("_")} <= ATTRIBUTES


def test_no_plane_and_no_branch_has_other_names() -> None:
    result = exponent_plane.Plane(
        Scene("duffing", "spring", chain(2)), *np.eye(2), *np.zeros((2, 2, 2)), np.full((2, 2, 1), "rest"), 1.0,
        ("b", "c"), ("-1",), np.zeros((2, 2), int),
    )  # fmt: skip
    assert (own(result.data) | {*result.as_dict()}) - TAKEN - {"b", "c"} <= exponent_plane.NAMES
    orbit = PeriodicOrbit(Scene("duffing"), 1, np.zeros(2), np.zeros(2), 0.0, 1)
    branch = results.Branch("b", np.zeros(1), (orbit,), (Bifurcation(0.0, BifurcationKind.FOLD, 0.0, orbit),),
        np.zeros(1, int), np.zeros(1),
    )  # fmt: skip
    assert own(branch.data) - TAKEN - {"b"} <= results.NAMES
    assert own(results.Diagram((branch,)).data) - TAKEN - {"b"} <= results.NAMES


def test_they_are_refused_before_anything_runs() -> None:
    scene = Scene(Field({"x": "-node*x + stable*cos(t) - mode"}, parameters={"node": 1, "stable": 1, "mode": 1}),
                  "x->x", chain(2), transient=0, window=1, record=())  # fmt: skip
    with pytest.raises(ValueError, match="axis node: found the name 'node', which results have for something else"):
        run(scene, parameters={"node": [1, 5]})
    with pytest.raises(ValueError, match="plane: found the name 'mode', which results have for something else"):
        plane(scene, [0.0, 1.0], parameters={"mode": [1, 5]})
    orbit = PeriodicOrbit(scene, 1, np.zeros(1), np.zeros(1), 0.0, 1)
    with pytest.raises(ValueError, match="branch: found the name 'stable', which results have for something else"):
        follow(orbit, "stable", values=[1.0, 2.0])
    with pytest.raises(ValueError, match="branch: found the name 'node', which results have for something else"):
        skeleton(scene, "node", [1.0, 2.0])

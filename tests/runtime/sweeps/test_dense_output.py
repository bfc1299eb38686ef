"""States between the steps of stiff scenes against the solution of Prothero and Robinson's problem (docs/accuracy.md)."""

from __future__ import annotations

import numpy as np
import pytest

from synchain import Field, Rates, Scene, run
from synchain.graphs import chain

STIFFNESS = np.array([1e2, 1e3, 1e4, 1e6, 1e9, 1e12])
RECORDS = {"record": ("sync_error", "section", "trajectory"), "section": "x_1 falling", "samples": 200}
FORCED = Field({"x": "-a*(x - cos(t))"}, parameters={"a": 1.0})
LINKED = {"coupling": Rates({"x": "K*W*(x_j - x_i)"}, {"K": 1.0}), "topology": chain(2), "initial": {"x": (0.3, 0.2)}}
"""Two nodes, whose starts are forgotten before the window: all records, as most tests of sweeps have them."""


def exact(a, t):
    """The solution after its transient."""
    return (np.cos(t) + np.sin(t) / a) / (1 + 1 / a**2)


def scene(integrator: str, rtol: float, **more) -> Scene:
    common = {**LINKED, "transient": 1, "window": 9, "time_unit": "time", "integrator": integrator}
    return Scene(FORCED, rtol=rtol, **{**common, **more})


@pytest.mark.parametrize(
    ("integrator", "rtol"), [("rodas5p", 1e-5), ("rodas5p", 1e-8), ("rodas4", 1e-6), ("auto", 1e-8)]
)
def test_samples_keep_to_the_tolerance_however_stiff_the_scene_is(integrator, rtol):
    data = run(scene(integrator, rtol, **RECORDS), width=1, a=STIFFNESS).data
    errors = np.abs(data.trajectory - exact(data.a, data.time)).max(("sample", "component", "node"))
    assert (errors < rtol).all(), errors / rtol


def test_samples_of_a_large_network_keep_to_the_tolerance():
    """Nine equal nodes in loops: the links do nothing but stand in the matrix."""
    network = scene(
        "rodas5p", 1e-8, topology=chain(9), initial={"x": 0.3}, record=("trajectory",), samples=200
    )  # fmt: skip
    data = run(network, width=1, a=STIFFNESS, reduce=False).data
    assert data.sizes["node"] == 9
    assert np.abs(data.trajectory - exact(data.a, data.time)).max() < 1e-8


def test_transits_keep_to_the_tolerance():
    data = run(scene("rodas5p", 1e-8, **RECORDS), width=1, a=STIFFNESS).data
    for a, times in zip(
        STIFFNESS, data.section_time.transpose("a", ...).values.reshape(len(STIFFNESS), -1), strict=True
    ):
        crossings = times[np.isfinite(times)]
        assert crossings.size
        turns = (crossings - np.pi / 2 - np.arctan(1 / a)) / np.pi
        assert np.abs(turns - np.round(turns)).max() < 1e-8


def test_steps_that_record_nothing_between_them_stay_as_they_are():
    """At z = 1e9 they are far longer: nothing is asked between their ends, which are exact."""
    bare = run(scene("rodas5p", 1e-8, record=()), a=1e9).data
    assert int(bare.steps) < int(run(scene("rodas5p", 1e-8, **{**RECORDS, "samples": 5}), a=1e9).data.steps) / 2

"""Realisations: what is drawn is the same for any workers and blocks, and the run is that of the drawn numbers."""

from __future__ import annotations

import statistics
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from synchain import Scene, open_result, run, stream
from synchain.draw import lorentzian, normal, uniform
from synchain.graphs import chain, ring
from synchain.models.sweeps.distribution import Draw
from synchain.observe import end, mean, nodes, rate

x = sp.Symbol("x")
SCENE = Scene(
    oscillator="rotor", coupling="torsion", topology=ring(4), integrator="dop853", rtol=1e-9, record=("sync_error",),
    transient=0.0, window=5.0, time_unit="time", observe={"frequency": mean(rate(x)), "middle": end(nodes.mean(x))},
)  # fmt: skip
FEW = SCENE.replace(topology=chain(2), parameters={"power": [0.1, 0.2], "sigma": 0.3})
"""Its kernels compile in half of the time, and are the same whether the power of each node is drawn or not."""
DRAWS = {
    "power": normal(0.1, 0.2),
    "x": uniform(-1.0, 1.0),
    "delta": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
    "v": [[0.1 * k, -0.1 * k] for k in range(6)],
}


def test_cells_are_those_of_the_drawn_numbers() -> None:
    """Each realisation on a grid is the cell that a scene with its numbers runs."""
    result = run(FEW, show_progress=False, width=4, sigma=[0.1, 0.4], realisations=6, draws=DRAWS, rng=7)
    assert result.frequency.dims == ("sigma", "realisation", "node")
    assert result.scene.shape == (2, 6)
    values = {name: result.data[name].values for name in ("delta", *(f"power_{i}" for i in (1, 2)))}
    assert values["delta"].tolist() == DRAWS["delta"]
    for k in (0, 5):
        start = {c: [float(result.data[f"{c}_{i}"][k]) for i in (1, 2)] for c in ("x", "v")}
        parameter_values = {
            "power": [float(values[f"power_{i}"][k]) for i in (1, 2)],
            "delta": DRAWS["delta"][k],
            "sigma": 0.4,
        }
        one = run(FEW.replace(parameters=parameter_values, initial=start), show_progress=False, width=4)
        np.testing.assert_array_equal(result.end.values[1, k], one.end.values)
        np.testing.assert_array_equal(result.frequency.values[1, k], one.frequency.values)
        assert float(result.sync_error[1, k]) == float(one.sync_error)


def test_what_is_drawn_depends_on_the_seed_and_the_name_alone() -> None:
    """Neither workers, lanes and blocks nor other draws change it; another seed does."""
    axes = {"realisations": 40, "rng": 3, "show_progress": False}
    result = run(FEW, draws={"power": normal(0, 1), "x_2": uniform(0, 1)}, width=4, **axes)
    assert result.data.power_1.dims == ("realisation",)
    other = run(FEW, draws={"x_2": uniform(0, 1), "power": normal(0, 1)}, width=1, workers=1, **axes)
    for name in ("end", "frequency", "sync_error", "power_1", "x_2"):
        np.testing.assert_array_equal(other.data[name], result.data[name])
    alone = FEW.replace(realisations=40, draws={"power_2": normal(0, 1)}, rng=3)
    assert {axis.name: axis.values for axis in alone.drawn}["power_2"] == tuple(result.data.power_2.values.tolist())
    assert alone.replace(rng=4).drawn != alone.drawn
    assert [axis.name for axis in alone.drawn] == ["power_2"]


def test_numbers_have_their_distribution() -> None:
    """Mean and deviation of 4 x 5000 numbers lie within four standard errors; no two streams are alike."""
    scene = SCENE.replace(realisations=5000, draws={"power": normal(0.5, 2.0), "x": uniform(-1.0, 3.0)})
    drawn = {axis.name: axis.values for axis in scene.drawn}
    power = [value for i in range(1, 5) for value in drawn[f"power_{i}"]]
    places = [value for i in range(1, 5) for value in drawn[f"x_{i}"]]
    assert len(set(power)) == len(set(places)) == 20_000
    assert statistics.mean(power) == pytest.approx(0.5, abs=4 * 2.0 / 20_000**0.5)
    assert statistics.stdev(power) == pytest.approx(2.0, abs=4 * 2.0 / 40_000**0.5)
    assert statistics.mean(places) == pytest.approx(1.0, abs=4 * (4 / 12**0.5) / 20_000**0.5)
    assert -1.0 < min(places) < -0.99
    assert 2.99 < max(places) < 3.0
    lorentz = scene.replace(draws={"power": lorentzian(0.5, 2.0)})
    wide = [value for axis in lorentz.drawn for value in axis.values]
    for chance, distance in ((0.25, -2.0), (0.5, 0.0), (0.75, 2.0)):  # half of the numbers lie within the half width
        error = 4 * (chance * (1 - chance) / 20_000) ** 0.5 * np.pi * 2.0 * (1 + (distance / 2.0) ** 2)
        assert np.quantile(wide, chance) == pytest.approx(0.5 + distance, abs=error)
    assert max(wide) > 1000
    assert abs(np.corrcoef(drawn["power_1"], drawn["power_2"])[0, 1]) < 4 / 5000**0.5


def test_files_keep_what_was_drawn(tmp_path: Path) -> None:
    scene = FEW.replace(realisations=3, draws={"power": "normal(0, 1/2)", "sigma": [0.1, 0.2, 0.3]}, rng=1)
    assert Scene.from_dict(scene.as_dict()) == scene
    result = run(scene, show_progress=False, width=4)
    result.save(tmp_path / "whole.nc")
    opened = open_result(tmp_path / "whole.nc")
    assert opened.scene == scene
    np.testing.assert_array_equal(opened.data.power_2, result.data.power_2)
    assert stream(scene, tmp_path / "streamed.nc", show_progress=False, width=4).success
    assert (tmp_path / "streamed.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


def test_one_realisation_of_a_zipped_sweep() -> None:
    """Zipped axes are one dimension, realisations another."""
    scene = FEW.replace(axes={"sigma": [0.1, 0.2], "x_1": [0.5, 0.6]}, zipped=True)
    result = run(scene, show_progress=False, width=1, realisations=3, draws={"x_2": [0.1, 0.2, 0.3]})
    assert result.middle.dims == ("cell", "realisation")
    one = run(FEW.replace(sigma=0.2), show_progress=False, width=1, x_1=0.6, x_2=0.3)
    assert float(result.middle[1, 2]) == float(one.middle)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"realisations": 3}, "found 3 realisations and 0 names to draw"),
        ({"draws": {"x": normal(0, 1)}}, "found 0 realisations and 1 names"),
        ({"realisations": 3, "draws": {"y": normal(0, 1)}}, "unknown draw 'y'"),
        ({"realisations": 3, "draws": {"x": [1.0, 2.0]}}, "or 3 entries"),
        ({"realisations": 2, "draws": {"x": [[1.0, 2.0], [1.0, 2.0]]}}, "found rows of 2 numbers; expected 1 or 4"),
        ({"realisations": 2, "draws": {"x": [[1.0, 2.0], [1.0]]}}, "rows of different lengths"),
        ({"realisations": 3, "draws": {"x": "gamma(1, 2)"}}, "draw x: found 'gamma(1, 2)'"),
        ({"realisations": 3, "draws": {"x": "normal(0, open('f'))"}}, "draw x"),
        ({"realisations": 3, "draws": {"x": "normal(0, 1"}}, "unreadable distribution 'normal(0, 1' with a ( that is not"),
        ({"realisations": 3, "draws": {"delta": uniform(-1.0, -0.5)}}, "delta"),
        ({"realisations": 3, "draws": {"x": normal(0, 1), "x_1": normal(0, 1)}}, "x_1 is drawn twice"),
        ({"realisations": 3, "draws": {"x_1": normal(0, 1)}, "axes": {"x_1": [1.0]}}, "it is an axis as well"),
        ({"realisations": 3, "draws": {"x": normal(0, 1)}, "axes": {"sigma": [1.0, 2.0]}, "continuation": "up"}, "with realis"),
        ({"realisations": 10**6, "draws": {"sigma": normal(1, 0.01)}, "axes": {"x_1": range(2000)}}, "cells; expected"),
    ],
)  # fmt: skip
def test_wrong_draws_are_refused(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=r"[a-z]") as error:
        SCENE.replace(**keywords)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_distributions_refuse_what_they_are_not() -> None:
    with pytest.raises(ValueError, match="standard deviation"):
        normal(0.0, 0.0)
    with pytest.raises(ValueError, match="rising ends"):
        uniform(1.0, 1.0)
    with pytest.raises(ValueError, match="half width"):
        lorentzian(0.0, -1.0)
    assert str(normal(0, 0.5)) == "normal(0.0, 0.5)"
    assert SCENE.replace(realisations=2, draws={"x": "lorentzian(0, 1/2)"}).draws["x"] == lorentzian(0, 0.5)
    assert isinstance(normal(0, 1), Draw)


def test_certified_runs_take_no_realisations() -> None:
    with pytest.raises(ValueError, match="realisations"):
        run(SCENE, certified=True, realisations=2, draws={"sigma": [0.1, 0.2]}, show_progress=False)


def test_graphs_without_any_link_are_realisations_too() -> None:
    settings = {"transient": 0, "window": 1, "record": (), "integrator": "dop853"}
    scene = Scene("harmonic", "spring", ring(3), **settings)
    result = run(scene, realisations=2, draws={"topology": "erdos_renyi(3, p=0)"}, show_progress=False, width=1)
    alone = run(Scene("harmonic", topology=chain(1), **settings), show_progress=False)
    assert result.end.shape[0] == 2
    np.testing.assert_allclose(result.end.values[:, 0, 0], alone.end.values[0, 0], rtol=0, atol=1e-8)

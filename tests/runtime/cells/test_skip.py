"""What a scene does not need: every skip leaves the answer as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from samples import source_of

from benchmarks import skip as bench
from synchain import Axis, Scene, kernel, run
from synchain.graphs import chain, from_matrix, ring, star
from synchain.models.dynamics import reduction as reduction_module
from synchain.results import Result, Status
from synchain.runtime.cells import reduce as skip_module
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.reduce import explain, reduce_scene
from synchain.runtime.cli import main
from synchain.runtime.engines.scene_kernels import kernel_source

RECORDS = ("sync_error", "section", "trajectory")
DUFFING = Scene(
    oscillator="duffing", topology=chain(3), parameters={"sigma": 0.3}, record=RECORDS, samples=7, transient=3, window=5,
    section="v_3 rising", rtol=1e-10,
)  # fmt: skip
FRICTION = Scene(
    topology=chain(2), parameters={"sigma": 0.1}, record=RECORDS, samples=7, transient=2, window=4, rtol=1e-10,
    integrator="rodas5p",
)  # fmt: skip
MIRRORED = DUFFING.replace(initial={"x": [0.5, 0.1, 0.5], "v": [0.0, 0.2, 0.0]})


def compare(scene: Scene, tolerance: float = 1e-9, nodes: int | None = None, **options) -> Result:
    """Run with skips and without, and hold the results against each other; returns the one with skips."""
    chosen = reduce_scene(scene, **options)
    assert chosen.skipped
    assert chosen.equations.n == (nodes or scene.n)
    fewer, full = (run(scene, reduce=skip, width=1) for skip in (chosen, False))  # scalar kernels compile fast
    assert set(fewer.data) == set(full.data)
    for name in full.data:
        assert fewer.data[name].dims == full.data[name].dims
        limit = 1e-5 if name == "sync_error_max" else tolerance  # taken at the steps, whose ends round differently
        if name not in ("steps", "rejected"):
            np.testing.assert_allclose(fewer.data[name], full.data[name], rtol=0, atol=limit, err_msg=name)
    assert fewer.success
    assert full.data.attrs["skipped"] == "nothing"
    assert fewer.data.attrs["skipped"] == "; ".join(chosen.skipped)
    return fewer


# -- each skip and its answer --------------------------------------------------------------------------------


@pytest.mark.long
def test_no_forcing():
    scene = FRICTION.replace(u=0.0)
    compare(scene.replace(axes={"sigma": [0.05, 0.1]}))
    source = kernel_source(scene, reduce=True)
    assert "omega" not in source.equations.parameters
    assert not source.equations.node.forced
    assert reduce_scene(scene).skipped == ("forcing: u = 0 in every cell, left out together with omega; no time terms",)


def test_no_forcing_where_the_frequency_is_swept():
    """The frequency leaves the equations, but the window still counts its periods."""
    result = compare(FRICTION.replace(u=0.0, axes={"omega": [1.0, 2.0]}))
    np.testing.assert_allclose(result.end_time, 6 * 2 * np.pi / np.array([1.0, 2.0]))


def test_no_coupling():
    scene = FRICTION.replace(sigma=0.0, axes={"omega": [1.15, 1.4]})
    compare(scene)
    assert reduce_scene(scene).equations.links == ()
    assert reduce_scene(scene).skipped == ("coupling: sigma = 0 in every cell, left out; no links",)


def test_coupling_that_is_zero_in_some_cells_stays():
    scene = FRICTION.replace(axes={"sigma": [0.0, 0.1]})
    assert not reduce_scene(scene).skipped
    assert reduce_scene(FRICTION.replace(axes={"sigma": [0.0, 0.0]})).equations.links == ()


def test_all_fixed_numbers_folded():
    scene = FRICTION.replace(axes={"omega": [1.15, 1.4]})
    compare(scene, fold_all=True)
    assert reduce_scene(scene, fold_all=True).equations.parameters == ("omega",)


@pytest.mark.long
def test_equal_starts_are_one_oscillator_without_synchronisation_error():
    scene = DUFFING.replace(initial={"x": 0.5, "v": 0.1}, axes={"sigma": [0.1, 0.3]})
    result = compare(scene, nodes=1)
    assert reduce_scene(scene).recording.records == ("section", "trajectory")
    assert (result.sync_error == 0).all()
    assert int(result.section_count.min()) > 2


def test_mirrored_start_of_a_chain_with_its_synchronisation_error():
    """The class of the first oscillator has two members, which the error does not count: no weights are needed."""
    result = compare(MIRRORED.replace(axes={"sigma": [0.1, 0.3], "omega": [1.0, 1.3]}), nodes=2)
    assert result.sync_error.min() > 0.01
    np.testing.assert_array_equal(
        result.trajectory.sel(component="x", node=1), result.trajectory.sel(component="x", node=3)
    )
    assert (
        np.abs(result.trajectory.sel(component="x", node=1) - result.trajectory.sel(component="x", node=2)).max() > 0.01
    )


@pytest.mark.long
def test_synchronisation_error_and_section_of_a_star():
    ends = DUFFING.replace(topology=ring(4), initial={"x": [0.5, 0.1, 0.5, 0.1]})
    assert reduce_scene(ends).recording.multiplicity == (2, 2)
    start = {"x": [0.5, 0.1, 0.1, 0.1, 0.2]}
    scene = DUFFING.replace(topology=star(5), initial=start, section="v_3 rising 0.01")
    assert reduce_scene(scene).recording.multiplicity == (1, 3, 1)
    result = compare(scene, nodes=3)
    trajectory = result.states("trajectory").reshape(scene.samples, 2, scene.n)
    distances = np.sqrt(((trajectory - trajectory[:, :, :1]) ** 2).sum(axis=1)).sum(axis=1)
    np.testing.assert_allclose(result.sync_error_end, distances[-1], rtol=1e-9)
    points = result.section.sel(component="v", node=3)[: int(result.section_count)]  # of the second class
    assert len(points) > 2
    np.testing.assert_allclose(points, 0.01, atol=1e-9)


@pytest.mark.long
def test_large_networks_with_few_different_starts_are_small():
    start = [0.5 if i % 3 else 0.1 for i in range(30)]
    scene = DUFFING.replace(topology=ring(30), initial={"x": start}, record=("trajectory",), samples=5)
    compare(scene, nodes=2)


@pytest.mark.long
def test_random_graph_with_weights_and_one_way_links():
    """Two of the nodes feel the same whole from different sources."""
    matrix = [[-3, 1, "1/2", "3/2"], [1, -2, 0, 1], [1, 1, -2, 0], [0, "1/3", "1/3", "-2/3"]]
    scene = DUFFING.replace(topology=from_matrix(matrix), initial={"x": [0.5, 0.1, 0.1, 0.3]}, record=("trajectory",))
    assert reduce_scene(scene).equations.n == 4
    matrix[2] = [1, 0, -2, 1]
    compare(scene.replace(topology=from_matrix(matrix)), nodes=3)


# -- which starts are equal ----------------------------------------------------------------------------------


def test_starts_are_equal_only_where_they_are_so_in_every_cell():
    pair = FRICTION.replace(initial={"x": 0.2})
    assert reduce_scene(pair).equations.n == 1
    assert reduce_scene(pair.replace(axes={"x_1": [0.2, 0.3]})).equations.n == 2
    assert reduce_scene(pair.replace(axes={"x_1": [0.2, 0.2]})).equations.n == 1
    both = {"x_1": [0.1, 0.3], "x_2": [0.1, 0.3]}
    assert reduce_scene(pair.replace(axes=both)).equations.n == 2
    assert reduce_scene(pair.replace(axes=both, zipped=True)).equations.n == 1
    assert reduce_scene(pair.replace(axes={**both, "x_2": [0.1, 0.4]}, zipped=True)).equations.n == 2


def test_zipped_starts_are_expanded():
    axes = {"x_1": [0.1, 0.3], "x_3": [0.1, 0.3], "sigma": [0.1, 0.2]}
    compare(MIRRORED.replace(axes=axes, zipped=True), nodes=2)


def test_continued_sweeps_stay_symmetric():
    scene = MIRRORED.replace(axes={"sigma": [0.1, 0.2, 0.3]})
    for continuation in ("up", "down"):
        result = compare(scene.replace(continuation=continuation), nodes=2, tolerance=1e-8)
    assert np.abs(result.end - run(scene, width=1).end).max() > 1e-3  # each cell started from its neighbour's end


# -- mistakes are caught -------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_wrong_partition_is_caught(monkeypatch):
    scene = DUFFING.replace(initial={"x": [0.5, 0.5, 0.1]})
    assert reduce_scene(scene).equations.n == 3
    assert "the links do not treat equal starts alike" in explain(reduce_scene(scene))
    monkeypatch.setattr(reduction_module, "coarsest_balanced", lambda n, links, colours: (0, 0, 1))
    with pytest.raises(ValueError, match="partition is not balanced: nodes 1 and 2"):
        reduce_scene(scene)
    monkeypatch.setattr(reduction_module, "class_links", lambda n, links, classes: links[:2])
    with pytest.raises(AssertionError, match="Not equal to tolerance"):
        compare(scene, nodes=2)


def test_a_wrong_way_back_is_caught(monkeypatch):
    right = skip_module.NodeMerge.expand

    def turned(self, states):
        values = right(self, states)
        return replace(values, end=values.end[:, ::-1].copy()) if self.merges else values

    monkeypatch.setattr(skip_module.NodeMerge, "expand", turned)
    with pytest.raises(AssertionError, match="end"):
        compare(MIRRORED, nodes=2)


def test_reductions_of_another_scene_are_refused():
    with pytest.raises(ValueError, match="reductions of another scene"):
        run(FRICTION, reduce=reduce_scene(FRICTION.replace(sigma=0.2)))


# -- resuming ------------------------------------------------------------------------------------------------


def unfinished(result: Result) -> Result:
    """The result as if its last cell had not been started, and with a mark in the first."""
    data = result.data.copy(deep=True)
    data.status[-1] = Status.NOT_RUN
    data.sync_error[0] = 42.0
    return Result(data, result.scene)


def test_finished_cells_of_the_whole_network_are_resumed():
    scene = MIRRORED.replace(axes={"sigma": [0.1, 0.2, 0.3]})
    full = run(scene, width=1)
    again = run(scene, width=1, resume=unfinished(full))
    assert float(again.sync_error[0]) == 42.0
    xr.testing.assert_identical(again.data.isel(sigma=[1, 2]), full.data.isel(sigma=[1, 2]))
    np.testing.assert_array_equal(again.section[0], full.section[0])


def test_resuming_with_another_skip_is_refused():
    scene = MIRRORED.replace(axes={"sigma": [0.1, 0.2]})
    with pytest.raises(ValueError, match="left out other parts"):
        run(scene, resume=run(scene, width=1), reduce=False, width=1)


def test_a_run_goes_on_with_another_skip_where_nothing_was_left_out():
    scene = DUFFING.replace(axes={"sigma": [0.1, 0.2, 0.3]})
    full = run(scene, width=1)
    assert full.data.attrs["skipped"] == "nothing"
    again = run(scene, width=1, resume=unfinished(full), reduce=False)
    assert float(again.sync_error[0]) == 42.0
    np.testing.assert_array_equal(again.states("end"), full.states("end"))


def test_cells_that_did_not_run_have_no_synchronisation_error():
    scene = DUFFING.replace(initial={"x": 0.5}, axes={"sigma": [0.1, 0.3]})
    buffers = Buffers.empty(2, 2, 3, 7)
    buffers.counts[0, 0] = Status.FINISHED
    expanded = reduce_scene(scene).expand(buffers)
    assert expanded.end.shape == (2, 6)
    assert expanded.points.shape == (2, 3, 7)
    assert expanded.samples.shape == (2, 7, 6)
    assert expanded.sums[0, :3].tolist() == [0, 0, 0]
    assert np.isnan(expanded.sums[1]).all()


# -- kernels, words, benchmark -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "scene",
    [
        FRICTION,
        FRICTION.replace(u=0.0, sigma=0.0),
        MIRRORED.replace(record=("sync_error",)),
        FRICTION.replace(record=(), axes={"sigma": [0.05, 0.1]}),
    ],
    ids=["one cell", "folded", "merged", "swept"],
)
def test_the_kernel_of_a_scene_is_the_one_that_runs(scene):
    """By default with all skips; `reduce=False` shows and runs the whole network."""
    result = run(scene)
    assert result.success
    shown = kernel(scene)
    assert (shown.digest, shown.equations.digest) == (result.data.attrs["kernel"], result.data.attrs["equations"])
    assert kernel_source(scene).text == shown.source
    source = kernel_source(scene, reduce=False)
    assert source.equations == scene.equations
    assert (source.digest == shown.digest) is not bool(reduce_scene(scene).skipped)


def test_scenes_that_differ_in_numbers_share_a_kernel():
    texts = {kernel_source(FRICTION.replace(sigma=s, u=u), reduce=True).digest for s in (0.1, 0.3) for u in (0.1, 0.2)}
    assert texts == {kernel_source(FRICTION).digest}
    assert kernel_source(FRICTION.replace(sigma=0.0), reduce=True).digest not in texts


SCENE = """
oscillator = "duffing"
record = ["sync_error"]
transient = 2
window = 2
[topology]
name = "chain"
n = 3
[initial]
x = [0.3, 0.2, 0.3]
[parameters]
u = 0
sigma = 0.1
"""


def test_explain_prints_and_does_not_run(tmp_path, capsys):
    path = tmp_path / "mirror.toml"
    path.write_text(SCENE)
    assert main(["run", str(path), "--explain"]) == 0
    out = capsys.readouterr().out
    assert out.startswith(
        "mirror: 1 cell of 3 oscillators\nleft out\n  forcing: u = 0 in every cell, left out together with"
    )
    assert "quotient: 3 oscillators with 2 different starts are stepped as 2" in out
    assert "section: not recorded" in out
    assert list(tmp_path.iterdir()) == [path]
    assert main(["run", str(path), "--explain", "--no-skip"]) == 0
    out = capsys.readouterr().out
    assert "quotient" not in out
    assert "as it stands" in out
    assert main(["run", str(path), "--explain", "--resume"]) == 2
    assert "required: --out" in capsys.readouterr().err


@pytest.mark.long
def test_explain_runs_where_there_is_a_folder_and_no_skip_runs_everything(tmp_path, capsys):
    path = tmp_path / "mirror.toml"
    path.write_text(SCENE)
    command = ["run", str(path), "--out", str(tmp_path / "out")]
    assert main([*command, "--explain"]) == 0
    assert "stepped as 2" in capsys.readouterr().out
    with xr.open_dataset(tmp_path / "out" / "mirror.nc") as data:
        assert "stepped as 2" in data.attrs["skipped"]
        assert data.sizes["component"] * data.sizes["node"] == 6
    assert main([*command, "--no-skip", "--resume"]) == 2
    assert "left out other parts of its scene: forcing: u = 0" in capsys.readouterr().err
    assert main([*command, "--no-skip", "--overwrite"]) == 0
    with xr.open_dataset(tmp_path / "out" / "mirror.nc") as data:
        assert data.attrs["skipped"] == "nothing"


def test_a_scene_without_anything_has_everything_left_out():
    scene = Scene(oscillator="harmonic", topology=chain(1))
    text = explain(reduce_scene(scene))
    for part in ("forcing", "coupling", "synchronisation error", "section", "trajectory", "dense output"):
        assert f"\n  {part}: " in text


def test_operations_are_counted_with_the_functions_they_call():
    text = "DENSE = False\ndef node(x):\n    return x*x + exp(-x)\n"
    text += "def step(y, p):\n    a = load(y, 2*3, 8)\n    b = node(a) - node(2.0)\n    store(y, 1 + 2, b/a)\n"
    text += "    if DENSE:\n        b = a*a*a\n    return b\n"
    e = bench.operations(source_of("def step(y, p):\n    return exp(y)\n"))
    assert e > 10
    assert bench.operations(source_of(text)) == 2 * (2 + e) + 2
    assert bench.operations(source_of(text.replace("DENSE = False", "DENSE = True"))) == 2 * (2 + e) + 4
    with pytest.raises(ValueError, match="unrolled"):
        bench.operations(source_of(text, looped=True))


@pytest.mark.parametrize("case", bench.CASES, ids=lambda case: case.name)
def test_every_case_of_the_benchmark_skips_something(case):
    fewer, more = bench.scenes(case, quick=True)
    assert fewer.skipped or len(fewer.recording.records) < len(more.recording.records)
    counts = [bench.operations(kernel_source(chosen.scene, reduce=chosen)) for chosen in (fewer, more)]
    assert counts[0] > 0
    assert counts[0] < counts[1] or case.fold_all


@pytest.mark.long
def test_benchmark_rows_have_what_the_columns_say(monkeypatch):
    settings = {"oscillator": "duffing", "parameters": {"sigma": 0.3}, "record": (), "initial": {"x": [0.5, 0.1, 0.5]}}
    monkeypatch.setattr(bench, "CASES", (bench.Case("mirror", 3, settings),))
    (row,) = bench.measure(quick=True)
    assert len(row) == len(bench.COLUMNS)
    assert row[:2] == ("mirror", 3)
    assert 0 < row[2] < row[3]
    assert min(row[4:7]) > 0
    assert row[7] < 1e-6


def test_benchmark_sees_a_difference():
    scene = FRICTION.replace(axes=[Axis("omega", [1.15])])
    one, other = run(scene, width=1), run(scene, width=1, x_1=0.31)
    assert bench.difference(one, one) == 0
    assert bench.difference(one, other) > 1e-3
    other.data.status[0] = Status.DIVERGED
    assert bench.difference(one, other) == float("inf")


def test_what_a_cell_may_skip_is_said_only_where_it_may():
    forced, free = FRICTION, Scene(oscillator="harmonic", topology=chain(2))
    assert "periodic:" in explain(reduce_scene(forced))
    assert "periodic:" not in explain(reduce_scene(forced, False))
    assert "periodic:" not in explain(reduce_scene(free))
    assert all("diverged:" in explain(reduce_scene(scene)) for scene in (forced, free))


def test_no_skip_integrates_every_period():
    scene = Scene(parameters={"omega": 1.15}, record=(), transient=600, window=1, rtol=1e-6)
    assert run(scene).data.periods_skipped.item() > 100
    for skip in (False, reduce_scene(scene, False)):
        assert run(scene, reduce=skip).data.periods_skipped.item() == 0

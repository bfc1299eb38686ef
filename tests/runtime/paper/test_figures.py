"""Figures: what is found, drawn and written, from pretended results and from one real run."""

from __future__ import annotations

import math
import struct
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier, Event

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_samples import TINY, Simulation, drawn, pretend, rows, words

from synchain import Scene, load_scene, run, scene_names
from synchain.results import Status
from synchain.runtime.paper import load, names, projection, sync_error
from synchain.runtime.paper import make as maker
from synchain.runtime.paper.figure_runs import FULL, QUICK, FigureRuns, Quality, thin
from synchain.runtime.paper.make import make
from synchain.runtime.plots import style
from synchain.runtime.plots.csv_table import as_csv

PAPER = (
    "figure_1b",
    "figure_3",
    "figure_4a",
    "figure_4b",
    "figure_4c",
    "figure_4d",
    "figure_4e",
    "figure_4f",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "msf",
    "msf_plane",
    "synchronisability_map",
    "thresholds",
)


@pytest.fixture
def simulation(monkeypatch: pytest.MonkeyPatch) -> Simulation:
    """Nothing is simulated, and both qualities are tiny."""
    return Simulation().install(monkeypatch)


# -- names -------------------------------------------------------------------------------------------------------


def test_all_figures_of_the_paper_are_there() -> None:
    assert names() == PAPER
    assert set(names()) < set(names(extra=True))
    assert {name for name in names() if name.startswith("figure")} == {
        name for name in scene_names() if name.startswith("figure")
    }


@pytest.mark.parametrize("name", names(extra=True))
def test_every_figure_keeps_the_contract(name: str) -> None:
    module = load(name)
    for function in ("compute", "texts", "draw"):
        assert callable(getattr(module, function))
    width, height = module.SIZE
    assert width == style.COLUMN
    assert 1.5 < height < 5.0


def test_bars_of_figures_are_those_of_all_functions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], simulation: Simulation
) -> None:
    monkeypatch.setattr(maker, "produce", lambda *arguments: [])
    for shown in (False, True):
        monkeypatch.setattr(sys.stderr, "isatty", lambda shown=shown: shown)
        make(["figure_1b", "figure_4b"], tmp_path)
        assert ("2/2" in capsys.readouterr().err) == shown


def test_an_unknown_name_is_refused_before_anything_is_done(tmp_path: Path, simulation: Simulation) -> None:
    with pytest.raises(ValueError, match=r"unknown figure 'figure_4z'; known: figure_1b, .*; did you mean 'figure_4"):
        make(["figure_1b", "figure_4z"], tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert not simulation.runs


def test_a_folder_that_cannot_be_made_is_an_error_before_anything_is_done(
    tmp_path: Path, simulation: Simulation
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"cannot make the folder .*file.*choose another folder \(--out\)"):
        make(["figure_4a"], tmp_path / "file" / "out")
    assert not simulation.runs


# -- files -------------------------------------------------------------------------------------------------------


ALIKE = {f"figure_{name}" for name in ("4b", "4c", "4e", "4f", "6", "7", "8")}
"""Figures that are drawn and written as others are, of other scenes."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name in ALIKE)) for name in (*names(), "transient")]
)
def test_a_figure_is_written_as_png_svg_and_csv(name: str, tmp_path: Path, simulation: Simulation) -> None:
    written = make([name], tmp_path / "out", quick=True)
    assert set(written) == set((tmp_path / "out").iterdir())
    more = {"thresholds": {"thresholds.md"}}
    more.update({n: {f"{n}_ranges.csv"} for n in (*projection.NAMES, "msf", "msf_plane")})
    assert {path.name for path in written} == {f"{name}.{kind}" for kind in ("png", "svg", "csv")} | more.get(
        name, set()
    )
    head = (tmp_path / "out" / f"{name}.png").read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">I", head[16:20])[0] >= 200 * style.COLUMN
    corner = plt.imread(tmp_path / "out" / f"{name}.png")[2, 2]
    assert set(corner.tolist()) == {1.0}  # white, and opaque where there is an alpha
    text = (tmp_path / "out" / f"{name}.svg").read_text()
    assert "<text" in text
    assert "date>" not in text.lower()
    assert not plt.get_fignums()


def test_all_figures_are_made_without_names(
    tmp_path: Path, simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(maker, "produce", lambda name, data, folder: [folder / name])
    assert make(None, tmp_path) == make([], tmp_path) == [tmp_path / name for name in PAPER]


@pytest.mark.parametrize(
    "name",
    [
        "figure_4a",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("figure_1b", "figure_4d", "figure_8", "msf", "thresholds")
        ),
    ],
)
def test_files_depend_on_the_numbers_alone(name: str, tmp_path: Path, simulation: Simulation) -> None:
    first = make([name], tmp_path / "a")
    with mpl.rc_context(
        {"font.size": 30, "axes.facecolor": "red", "axes.grid": True, "svg.hashsalt": "other", "svg.fonttype": "path"}
    ):
        second = make([name], tmp_path / "b")
    assert [p.name for p in first] == [p.name for p in second]
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


def test_the_users_settings_stay(tmp_path: Path, simulation: Simulation) -> None:
    with mpl.rc_context({"font.size": 31}):
        make(["figure_4a"], tmp_path)
        assert mpl.rcParams["font.size"] == 31


def test_the_bar_is_shown_when_wanted(
    tmp_path: Path, simulation: Simulation, capsys: pytest.CaptureFixture[str]
) -> None:
    make(["figure_4a"], tmp_path)
    assert capsys.readouterr().err == ""
    make(["figure_4a"], tmp_path, show_progress=True)
    assert "1/1" in capsys.readouterr().err


# -- several at a time -------------------------------------------------------------------------------------------


class Pretended:
    """A module whose data a function of its runs makes."""

    def __init__(self, compute: Callable[[FigureRuns], object]) -> None:
        self.compute = lambda name, runs: compute(runs)


def written(
    monkeypatch: pytest.MonkeyPatch,
    folder: Path,
    produce: Callable[[str, object, Path], list[Path]] = lambda name, data, folder: [],
    workers: int = 2,
    **figures: Callable[[FigureRuns], object],
) -> None:
    """Make figures whose data functions make."""
    modules = {name: Pretended(compute) for name, compute in figures.items()}
    monkeypatch.setattr(maker, "load", modules.__getitem__)
    monkeypatch.setattr(maker, "produce", produce)
    make(list(figures), folder, workers=workers, show_progress=False)


def test_two_figures_are_computed_at_a_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    both = Barrier(2, timeout=20.0)
    written(monkeypatch, tmp_path, a=lambda runs: both.wait(), b=lambda runs: both.wait())


def test_one_worker_computes_one_figure_at_a_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    running, most = [], []

    def compute(runs: FigureRuns) -> None:
        running.append(1)
        time.sleep(0.05)
        most.append(len(running))
        running.pop()

    written(monkeypatch, tmp_path, workers=1, a=compute, b=compute, c=compute)
    assert most == [1, 1, 1]


def test_an_interrupt_ends_the_figures_of_other_threads(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    begun, ended = Event(), []

    def long(runs: FigureRuns) -> None:
        begun.set()
        scene, end = Scene("van_der_pol", transient=0.0, window=1.0), time.monotonic() + 20.0
        try:
            while time.monotonic() < end:
                run(scene, **runs.options)
        except KeyboardInterrupt:
            ended.append(True)
            raise

    def interrupted(name: str, data: object, folder: Path) -> list[Path]:
        assert begun.wait(20.0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        written(monkeypatch, tmp_path, interrupted, a=lambda runs: None, b=long)
    assert ended == [True]


def test_figures_at_a_time_share_their_runs() -> None:
    runs, figures, both = FigureRuns(TINY), [], Barrier(2, timeout=20.0)

    def make_it() -> object:
        time.sleep(0.1)
        figures.append(object())
        return figures[0]

    def ask(_: int) -> object:
        both.wait()
        return runs.once("this", make_it)

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(ask, range(2))
    assert first is second is figures[0]
    assert len(figures) == 1


def test_a_table_has_rows_as_long_as_its_head() -> None:
    with pytest.raises(ValueError, match="a row of 1 entries; expected 2: a, b"):
        as_csv(("a", "b"), [(1,)])
    assert as_csv(("a", "b", "c"), [(1.0, "x", 1 / 3), (math.nan, None, math.inf)]) == "a,b,c\n1,x,0.333333333333\n,,\n"


# -- numbers -----------------------------------------------------------------------------------------------------


def test_thinning_keeps_both_ends() -> None:
    scene = load_scene("figure_5")
    few = thin(scene, 10).axes[0].values
    assert len(few) == 10
    assert (few[0], few[-1]) == (0.0, 0.4)
    assert set(few) < set(scene.axes[0].values)
    assert thin(scene, None) == scene
    assert thin(scene, 10_000) == scene


def test_full_quality_keeps_the_scenes_and_quick_is_coarser() -> None:
    for name in scene_names():
        if name.startswith("figure") and name != "figure_1b":
            scene = load_scene(name)
            assert scene.cells >= 601
            assert (scene.transient, scene.window) == (300.0, 100.0)
            assert thin(scene, FULL.points) == scene
            assert thin(scene, QUICK.points).cells < scene.cells
    assert FULL.criterion.transient >= 300
    assert FULL.criterion.window >= 100


def test_figures_share_their_runs(simulation: Simulation) -> None:
    runs = FigureRuns(TINY)
    for name in names():
        load(name).compute(name, runs)
    assert len(simulation.runs) == 4  # figure 3 and three frequencies of figure 4
    assert sorted(omega for omega, _ in simulation.probes) == [1.15, 1.4, 1.55]
    assert sorted(omega for kind, omega, _ in simulation.functions if kind == "msf") == [1.15, 1.4, 1.55]
    assert sorted(set(simulation.networks)) == sorted(simulation.networks)
    assert {(n, omega) for n, omega, _ in simulation.networks} == {
        (3, 1.15),
        (3, 1.55),
        (4, 1.15),
        (4, 1.4),
        (5, 1.4),
        (5, 1.55),
    }


def test_the_friction_law_is_that_of_the_equations() -> None:
    data = load("figure_1b").compute("figure_1b", FigureRuns(TINY))
    scene = load_scene("figure_1b")
    p = dict(scene.parameters)
    equations = scene.equations
    slope = equations.node.rhs[1]
    for k in (0, len(data.w) // 2, len(data.w) // 2 + 1, -1):
        values = {**p, "x": 0.0, "v": p["theta_b"] - data.w[k], "t": 0.0}
        force = float(slope.subs({s: values[s.name] for s in slope.free_symbols})) - p["u"]
        assert p["epsilon"] * data.smooth[k] == pytest.approx(force, abs=1e-9)
    jump = len(data.w) // 2
    assert math.isnan(data.sharp[jump])
    assert data.sharp[jump + 1] == pytest.approx(p["mu_s"], abs=1e-6)
    assert data.sharp[-1] == pytest.approx(p["mu_k"] + (p["mu_s"] - p["mu_k"]) * math.exp(-p["a"]))
    np.testing.assert_allclose(data.sharp, -data.sharp[::-1])
    np.testing.assert_allclose(data.smooth[[0, -1]], data.sharp[[0, -1]], rtol=1e-4)


def test_error_curve_and_its_numbers(simulation: Simulation, tmp_path: Path) -> None:
    simulation.failed = (4,)
    make(["figure_4b"], tmp_path)
    table = rows(tmp_path / "figure_4b.csv")
    assert list(table[0]) == ["sigma", "e_avg", "e_max", "e_end", "status"]
    assert [row["status"] for row in table] == ["finished"] * 4 + ["diverged"] + ["finished"] * 4
    axes, _ = drawn("figure_4b", FigureRuns(TINY))
    (curve,) = (line for line in axes.lines if len(line.get_xdata()) == 9)
    assert np.isnan(curve.get_ydata()).tolist() == [k == 4 for k in range(9)]
    assert "1 of 9 cells failed and are left out" in words(axes)


def test_synchronous_ranges_reach_half_a_step_beyond_their_cells() -> None:
    scene = load_scene("figure_4a").replace(axes={"sigma": (0.0, 0.1, 0.2, 0.3, 0.4)})
    result = pretend(scene)
    result.data["sync_error"].values[:] = [0.0, 5e-4, 0.5, 0.5, 0.0]
    np.testing.assert_allclose(sync_error.synchronous(result), [(0.0, 0.15), (0.35, 0.4)])
    result.data["status"].values[0] = Status.DIVERGED
    np.testing.assert_allclose(sync_error.synchronous(result), [(0.05, 0.15), (0.35, 0.4)])


@pytest.mark.parametrize(
    ("name", "states"), [("figure_3", ["x_1", "v_1"]), ("figure_4d", ["x_1", "x_2", "v_1", "v_2"])]
)
def test_bifurcation_diagram_and_its_numbers(
    name: str, states: list[str], simulation: Simulation, tmp_path: Path
) -> None:
    simulation.failed = (5,)
    make([name], tmp_path)
    table = rows(tmp_path / f"{name}.csv")
    axis = load_scene(name).axes[0].name
    assert list(table[0]) == [axis, "time", *states, "status"]
    assert len(table) == 1 + 1 + 2 + 1 + 1 + 1 + 1 + 1 + 2  # cells have 0, 1, 2, 0 … points; a row of its own for none
    assert [row["x_1"] for row in table if row["status"] == "diverged"] == [""]
    axes, _ = drawn(name, FigureRuns(TINY))
    (dots,) = (line for line in axes.lines if line.get_marker() == ".")
    np.testing.assert_allclose(dots.get_ydata(), [0.1, 0.2, 0.2, 0.4, 0.7, 0.8, 0.8])
    assert "1 of 9 cells failed and are left out" in words(axes)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_diagrams_can_be_continued(direction: str, simulation: Simulation) -> None:
    runs = FigureRuns(TINY)
    load("figure_4e").compute("figure_4e", runs)
    load(f"figure_4e_{direction}").compute(f"figure_4e_{direction}", runs)
    assert [scene.continuation for scene in simulation.runs] == ["none", direction]
    assert f"figure_4e_{direction}" not in names()


# -- the real thing ----------------------------------------------------------------------------------------------


def test_a_tiny_figure_from_a_real_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maker, "QUICK", Quality(points=4))
    make(["figure_4a", "figure_4d"], tmp_path, quick=True, workers=1)
    table = rows(tmp_path / "figure_4a.csv")
    assert [row["sigma"] for row in table] == ["0", "0.2", "0.4", "0.6"]
    assert all(row["status"] == "finished" for row in table)
    errors = [float(row["e_avg"]) for row in table]
    assert max(errors[:2]) < 1e-3 < 0.02 < min(errors[2:])
    points = rows(tmp_path / "figure_4d.csv")
    assert max(abs(float(row["v_1"])) for row in points) < 1e-6
    assert len({round(float(row["x_1"]), 4) for row in points if row["sigma"] == "0.2"}) == 1

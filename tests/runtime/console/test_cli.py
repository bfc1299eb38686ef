"""The command line: what it prints, where, and with which exit code."""

from __future__ import annotations

import functools
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp

from synchain import Scene, load_scene, open_result, scene_names
from synchain.graphs import chain
from synchain.models.graphs.families import names as families
from synchain.models.scenes.schema import schema
from synchain.results import ExponentWindows
from synchain.runtime import commands
from synchain.runtime.cli import main
from synchain.runtime.console.outcome import print_json
from synchain.runtime.engines import job, scene_kernels
from synchain.runtime.sweeps import stream
from synchain.runtime.synchronisation import threshold
from synchain.runtime.synchronisation.criterion import PAPER

SCENE = """
title = "short"
record = ["sync_error"]
transient = 2
window = 2
[topology]
name = "chain"
n = 2
[sweep]
sigma = {from = 0, to = 0.5, count = 20}
"""

SEPARATE = "-1 1 0 0\n1 -1 0 0\n0 0 -1 1\n0 0 1 -1\n"


@pytest.fixture
def scene(tmp_path: Path) -> str:
    path = tmp_path / "short.toml"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture
def compiled(scene: str) -> None:
    """The kernel of a sweep of the scene is there, so that a command has no line to say about it."""
    scene_kernels.kernel(load_scene(scene).replace(axes={"sigma": [0.0, 0.25, 0.5]}))


def matrix(folder: Path, text: str) -> str:
    path = folder / "G.txt"
    path.write_text(text)
    return str(path)


BUFFERED = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
"""The environment of a user, whose output waits in a buffer until the end."""


def synchain(command_line: str, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "synchain.runtime", *command_line.split()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **options)


def test_help_names_every_command_and_is_fast_because_nothing_heavy_is_loaded(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert {"paper", "spectrum", "equations", "kernel", "run", "thresholds", "cache"} <= set(commands.names())
    assert all(f"\n  {name} " in out for name in commands.names())
    assert not loaded_after()["--help"] & {"sympy", "numpy", "numba", "matplotlib", "flint", "scipy", "tqdm"}


@pytest.mark.parametrize("name", commands.names())
def test_every_command_has_a_help_with_an_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    captured = capsys.readouterr()
    assert f"usage: synchain {name}" in captured.out
    examples = captured.out.partition("example")[2].splitlines()[1:]
    assert examples
    assert all(line.startswith(f"  synchain {name}") for line in examples)
    assert captured.err == ""


LOADS = {
    "--version": {"sympy", "numpy", "numba", "matplotlib", "argparse.py"},
    "list scenes": {"sympy", "numpy", "numba", "matplotlib"},
    "list graphs": {"sympy", "numpy", "numba", "matplotlib"},
    "schema": {"numpy", "numba", "matplotlib", "scipy", "xarray"},
    "spectrum star 6 --json": {"numpy", "numba", "matplotlib", "scipy", "xarray"},
    "equations figure_4a": {"numpy", "numba", "matplotlib", "scipy", "xarray"},
}
"""Commands, the lightest first, and what none of them needs; a later one may find what an earlier one has loaded."""


@functools.cache
def loaded_after() -> dict[str, set[str]]:
    """Top-level modules of one fresh interpreter after each of the commands."""
    code = (
        "import sys\nfrom synchain.runtime.cli import main\n"
        f"for words in {['--help', *LOADS]!r}:\n"
        "    assert main(words.split()) == 0\n"
        "    print(*{n.split('.')[0] for n in sys.modules}, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    return dict(zip(["--help", *LOADS], map(set, map(str.split, done.stderr.splitlines())), strict=True))


@pytest.mark.parametrize("text", LOADS)
def test_a_command_loads_only_what_it_needs(text: str) -> None:
    loaded = loaded_after()[text]
    assert "argparse" in loaded
    assert not loaded & LOADS[text]


def test_spectrum_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "--json", "chain", "4"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["n"] == 4
    assert answer["verified"] is True
    exact = [sp.sympify(e["exact"]) for e in answer["eigenvalues"]]
    assert exact == [0, -2 + sp.sqrt(2), -2, -2 - sp.sqrt(2)]
    assert [e["value"] for e in answer["eigenvalues"]] == [float(e) for e in exact]
    assert [e["multiplicity"] for e in answer["eigenvalues"]] == [1, 1, 1, 1]


def test_spectrum_of_one_way_links_is_complex(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "--json", "--matrix", matrix(tmp_path, "-1 1 0\n0 -1 1\n1 0 -1")]) == 0
    values = [e["value"] for e in json.loads(capsys.readouterr().out)["eigenvalues"]]
    assert values == [0.0, [-1.5, pytest.approx(-(0.75**0.5))], [-1.5, pytest.approx(0.75**0.5)]]


def test_a_large_closed_form_is_proved_as_well(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "star", "300", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verified"] is True


def test_spectrum_of_separate_parts_is_allowed_but_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = matrix(tmp_path, SEPARATE)
    assert main(["spectrum", "--matrix", path]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[1].split() == ["0", "0", "2"]
    assert captured.err.startswith("warning: zero is an eigenvalue of multiplicity 2")
    assert "never synchronises it completely" in captured.err
    assert main(["spectrum", "--matrix", matrix(tmp_path, "-1 1\n1 -1")]) == 0
    assert capsys.readouterr().err == ""


def test_long_tables_are_abbreviated_unless_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "chain", "30000"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 203
    assert lines[101] == "… (29800 more)"
    assert lines[-1].startswith("30000 eigenvalues, 30000 distinct;")
    assert main(["spectrum", "chain", "201", "--all"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 203
    assert main(["spectrum", "chain", "201", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["eigenvalues"]) == 201


def test_several_parts_are_said_with_negative_weights_as_well(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = matrix(tmp_path, "1 -1 0 0\n-1 1 0 0\n0 0 -1 1\n0 0 1 -1")
    assert main(["spectrum", "--matrix", path]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[1].split() == ["2", "2", "1"]
    assert captured.err.startswith("warning: zero is an eigenvalue of multiplicity 2: the graph falls into 2 parts")


def test_scenes_and_graphs_list_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "scenes"]) == 0
    listed = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert set(listed) == set(scene_names())
    assert load_scene("figure_4b").title in listed["figure_4b"]
    assert main(["list", "graphs"]) == 0
    listed = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert {"chain", "complete", "ring", "star"} <= set(listed)
    assert "3 or more" in listed["ring"]


def test_the_schema_is_printed_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    from importlib.metadata import version

    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"synchain {version('synchain')}\n"


def test_equations_in_three_forms(capsys: pytest.CaptureFixture[str]) -> None:
    from synchain.models.presentation import equations_text as present

    equations = load_scene("two_oscillators").equations
    for option, expected in (([], present.text(equations)), (["--latex"], present.latex(equations))):
        assert main(["equations", "two_oscillators", *option]) == 0
        assert capsys.readouterr().out == expected + "\n"
    assert main(["equations", "two_oscillators", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(present.as_dict(equations)))


def test_kernel_prints_the_source_without_compiling(
    scene: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(scene_kernels, "load")
    assert main(["kernel", scene]) == 0
    out = capsys.readouterr().out
    source = scene_kernels.kernel_source(load_scene(scene))
    assert out == source.text
    compile(out, "kernel", "exec")
    assert main(["kernel", scene, "--driver"]) == 0
    out = capsys.readouterr().out
    assert out == source.driver.text
    compile(out, "driver", "exec")


@pytest.mark.usefixtures("compiled")
def test_run_writes_a_result_and_a_figure(scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "folder"
    assert main(["run", scene, "--out", str(out), "--rtol", "1e-6", "--set", "omega=1.4", "sigma=0:0.5:3"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    rows = [re.split(r"\s{2,}", row.strip(), maxsplit=1) for row in captured.out.splitlines()]
    assert rows[0] == ["Streamed"]
    assert rows[1] == ["scene", "short, changed: omega, sigma"]
    assert rows[2][1].startswith("3 cells of 2 oscillators in ")
    assert rows[3:] == [
        ["ended", "3 cells: reached the end of the window"],
        ["file", str(out / "short.nc")],
        [str(out / "short.png")],
    ]
    assert sorted(path.name for path in out.iterdir()) == ["short.nc", "short.png"]
    assert (out / "short.png").read_bytes().startswith(b"\x89PNG")
    result = open_result(out / "short.nc")
    assert result.scene.rtol == 1e-6
    assert result.scene.parameters["omega"] == 1.4
    assert result.data.sigma.values.tolist() == [0.0, 0.25, 0.5]
    assert float(result.states()[0, 0]) != float(result.states()[1, 0])


@pytest.mark.usefixtures("compiled")
def test_a_figure_that_fails_says_that_the_result_is_complete(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "short.png").mkdir()
    assert main(["run", scene, "--out", str(tmp_path), "--set", "sigma=0:0.5:3"]) == 1
    (message,) = capsys.readouterr().err.splitlines()
    assert message.startswith(
        f"synchain run: the result is complete: {tmp_path / 'short.nc'}; its figure was not drawn: "
    )
    assert message.endswith("; the same command again draws it")
    assert open_result(tmp_path / "short.nc").success
    (tmp_path / "short.png").rmdir()
    assert main(["run", scene, "--out", str(tmp_path), "--set", "sigma=0:0.5:3"]) == 0
    assert (tmp_path / "short.png").is_file()
    (tmp_path / "short.png").write_text("not drawn again")
    assert main(["run", scene, "--out", str(tmp_path), "--set", "sigma=0:0.5:3"]) == 0
    assert (tmp_path / "short.png").read_text() == "not drawn again"
    assert "nothing was run" in capsys.readouterr().out


def test_a_numba_that_does_not_compile_is_no_bug(scene: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "synchain.runtime", "run", scene, "--out", str(tmp_path)]
    surroundings = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=surroundings)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("unset NUMBA_DISABLE_JIT")
    assert "bug" not in done.stderr


def test_settings_reach_the_scene(scene: str, tmp_path: Path) -> None:
    settings = ["--set", "sigma=0.1", "--set", "x_1=0.1,0.2", "window=3", "max_steps=5000"]
    assert main(["run", scene, "--out", str(tmp_path), *settings]) == 0
    changed = open_result(tmp_path / "short.nc").scene
    assert [(axis.name, axis.values) for axis in changed.axes] == [("x_1", (0.1, 0.2))]
    assert (changed.parameters["sigma"], changed.window, changed.max_steps) == (0.1, 3.0, 5000)


def test_cells_that_fail_are_said_and_the_file_is_still_written(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", scene, "--out", str(tmp_path), "--set", "max_steps=10"]) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("synchain run: 20 cells: used up max_steps")
    assert "reached" not in captured.out
    assert (open_result(tmp_path / "short.nc").status == 2).all()


def interrupt_after(monkeypatch: pytest.MonkeyPatch, chunks: int) -> list[int]:
    """Press Ctrl-C when so many chunks of cells have run; the list counts the cells that were
    driven.
    """
    real, driven = job.SweepJob.run, []

    def run(self: job.SweepJob, cells: np.ndarray, *more: Any) -> Any:
        if len(driven) == chunks:
            raise KeyboardInterrupt
        driven.append(len(cells))
        return real(self, cells, *more)

    monkeypatch.setattr(job.SweepJob, "run", run)
    return driven


def test_an_interrupted_run_is_kept_and_resumed(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["run", scene, "--out", str(tmp_path / "cut"), "--workers", "1"]
    with monkeypatch.context() as patch:
        driven = interrupt_after(patch, 1)
        assert main(command) == 1
    err = capsys.readouterr().err
    done = driven[0]
    assert 0 < done < 20
    assert f"interrupted with {done} of 20 cells finished" in err
    assert [path.name for path in (tmp_path / "cut").iterdir()] == ["short.partial"]
    again = err.rpartition("continue with: synchain ")[2].split()
    assert again == [*command, "--resume"]
    with monkeypatch.context() as patch:
        driven = interrupt_after(patch, -1)
        assert main(again) == 0
    assert sum(driven) == 20 - done
    assert sorted(path.name for path in (tmp_path / "cut").iterdir()) == ["short.nc", "short.png"]
    assert main(["run", scene, "--out", str(tmp_path / "whole")]) == 0
    uncut, resumed = (open_result(tmp_path / name / "short.nc") for name in ("whole", "cut"))
    np.testing.assert_array_equal(uncut.end, resumed.end)
    np.testing.assert_array_equal(uncut.sync_error, resumed.sync_error)


def test_an_interrupt_before_the_first_cell_writes_nothing(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_after(monkeypatch, 0)
    assert main(["run", scene, "--out", str(tmp_path / "out")]) == 1
    assert "nothing was written" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


def test_resume_refuses_another_scene_and_a_missing_file(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["run", scene, "--out", str(tmp_path / "out")]
    assert main([*command, "--resume"]) == 2
    assert "nothing to resume" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main(command) == 0
    assert main([*command, "--resume", "--rtol", "1e-7"]) == 2
    assert "another scene" in capsys.readouterr().err
    (tmp_path / "out" / "short.nc").write_bytes(b"no netCDF")
    assert main([*command, "--resume"]) == 2
    assert "short.nc" in capsys.readouterr().err


def fake_thresholds(found: list[dict[str, Any]]) -> Any:
    """In place of minutes of simulation: ranges with open and closed ends, and a record of what was
    asked for.
    """

    def thresholds(scene: Any, *, criterion: Any, **options: Any) -> threshold.Thresholds:
        found.append({"scene": scene, "criterion": criterion, **options})
        x = np.linspace(0.0, 0.6, 3)
        nothing = np.zeros(3)
        pair = threshold.Sweep(2 * x, nothing, nothing, ((0.0, 0.466), (0.9, 1.2)))
        direct = threshold.Sweep(x, nothing, nothing, ((0.0, 0.15), (0.3, 0.6)))
        windows = ExponentWindows(((0.0, 0.1551), (0.3, 0.4)), ((0.0, 2e-4), (math.inf, math.inf)))
        if scene.topology.name == "ring":
            windows = ExponentWindows(absent="a contact without a jump")
        ranges = ((0.0, 0.155), (0.3, 0.4))
        return threshold.Thresholds(scene, pair, ranges, direct, PAPER, windows, ("a warning",))

    return thresholds


def printed(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """The rows of the summary on stdout."""
    return dict(re.split(r"\s{2,}", row.strip(), maxsplit=1) for row in capsys.readouterr().out.splitlines()[1:])


def test_thresholds_below_zero_end_with_the_grid_at_zero() -> None:
    """A range from 0 up begins where couplings do; one from below up to 0 may go on."""
    nothing = np.zeros(2)
    below = [np.array([low, 0.0]) for low in (-0.4, -1.2)]
    pair, direct = (threshold.Sweep(x, nothing, nothing, ((x[0], -0.1), (-0.05, 0.0))) for x in below)
    windows = ExponentWindows(((-0.2, 0.0),), ((0.001, 0.0),))
    result = threshold.Thresholds(Scene(topology=chain(3)), pair, ((-0.02, 0.0),), direct, PAPER, windows)
    rows = dict(result.summary)
    assert rows["sigma, negative exponents"] == "-0.2000 ± 0.0010 … 0.0000..."
    assert rows["sigma, simulated"] == "-1.2000... … -0.1000; -0.0500 … 0.0000..."
    assert rows["sigma, predicted by the probe"] == "-0.0200 … 0.0000..."
    assert rows["alpha = sigma |gamma|, probe"] == "-0.4000... … -0.1000; -0.0500 … 0.0000..."


def test_thresholds_as_json_and_as_a_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(threshold, "thresholds", fake_thresholds(asked))
    command = ["thresholds", "--n", "3", "--omega", "1.15", "--sigma", "0:0.4:5", "--workers", "2"]
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "intervals": [[0.0, 0.15], [0.3, 0.6]],
        "probe": [[0.0, 0.466], [0.9, 1.2]],
        "predicted": [[0.0, 0.155], [0.3, 0.4]],
        "exponents": [[0.0, 0.1551], [0.3, 0.4]],
        "exponent_errors": [[0.0, 2e-4], [None, None]],
        "no_exponents": None,
        "warnings": ["a warning"],
    }
    assert main(command) == 0
    output = printed(capsys)
    assert output["scene"] == "Scene(friction/exponential/spring, chain(3)), omega = 1.15"
    assert output["sigma, negative exponents"] == "0.0000 … 0.15510 ± 0.00020; 0.3000 ± unknown … 0.4000..."
    assert output["sigma, simulated"] == "0.0000 … 0.1500; 0.3000 … 0.6000..."
    assert output["sigma, predicted by the probe"] == "0.0000 … 0.1550; 0.3000 … 0.4000..."  # it ends at 1.2 / 3
    assert output["sigma, Wu-Chua conjecture"] == "0.0000 … 0.1553"  # 0.466 / 3
    assert output["alpha = sigma |gamma|, probe"] == "0.0000 … 0.4660; 0.9000 … 1.2000..."
    assert "over 100 drive periods after 1000" in output["simulated and probe"]
    assert output["simulated and probe"].endswith("at least half of 8 starts")
    assert output["..."] == "the grid ends here, the range may go on"
    assert output["warning"] == "a warning"
    assert main([*command, "--topology", "ring"]) == 0
    assert printed(capsys)["sigma, negative exponents"] == "not computed: a contact without a jump"
    assert asked[0]["sigma"] == (0.0, 0.1, 0.2, 0.3, 0.4)
    assert asked[0]["workers"] == 2
    assert asked[0]["scene"].topology == chain(3)
    assert asked[0]["scene"].parameters["omega"] == 1.15


def test_thresholds_of_a_scene_of_a_matrix_and_of_other_graphs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(threshold, "thresholds", fake_thresholds(asked))
    path = matrix(tmp_path, "-2 2\n2 -2")
    (tmp_path / "ring.toml").write_text('topology = {name = "ring", n = 3}')
    for command in (
        "figure_6 --transient 50 --starts 3",
        "figure_6 --n 4 --topology ring --omega 1.2",
        f"--matrix {path} --omega 1.15",
        "harmonic_chain",
        f"{tmp_path}/ring.toml --n 5",
        "figure_6 --topology ring",
    ):
        assert main(["thresholds", *command.split(), "--json"]) == 0
    graphs = [(a["scene"].topology.name, a["scene"].n, a["scene"].angular_frequency) for a in asked]
    assert graphs == [
        ("chain", 3, 1.55),
        ("ring", 4, 1.2),
        ("G.txt", 2, 1.15),
        ("chain", 5, None),
        ("ring", 5, 1.15),
        ("ring", 3, 1.55),
    ]
    assert (asked[0]["criterion"].transient, asked[0]["criterion"].starts) == (50.0, 3)
    assert asked[3]["scene"].parameters["sigma"] == 0.5


def test_thresholds_in_a_hurry(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(threshold, "thresholds", fake_thresholds(asked))
    for options in ("", "--quick", "--quick --starts 2 --sigma 0:1:3"):
        assert main(["thresholds", "--n", "2", "--omega", "1.15", *options.split()]) == 0
    full, quick, set_by_user = (a["criterion"] for a in asked)
    assert full == threshold.Criterion()
    assert (quick.starts, quick.transient) == (5, 400.0)
    assert (set_by_user.starts, set_by_user.transient) == (2, 400.0)
    assert [len(a["sigma"]) for a in asked] == [241, 121, 3]
    assert [a["resolution"] for a in asked] == [None, 2e-3, 2e-3]


def test_thresholds_really_simulates(capsys: pytest.CaptureFixture[str]) -> None:
    text = "thresholds --n 2 --omega 1.15 --sigma 0.1:0.15:2 --transient 5 --starts 1 --workers 1 --json"
    assert main(text.split()) == 0
    answer = json.loads(capsys.readouterr().out)
    kinds = {"intervals", "probe", "predicted", "exponents", "exponent_errors", "no_exponents", "warnings"}
    assert set(answer) == kinds
    assert answer["exponents"] == [[0.1, 0.15]]  # the exponent at rest is negative all over this grid
    assert all(0.2 <= low <= high <= 0.3 for low, high in answer["probe"])


def test_figures_are_made_by_their_names(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from synchain.runtime.paper import make

    asked: list[Any] = []
    monkeypatch.setattr(
        make, "written", lambda *arguments: asked.append(arguments) or [tmp_path / "out" / "figure_4b.png"]
    )
    assert main(["paper", "--quick", "4b", "--out", str(tmp_path / "out"), "thresholds", "--workers", "1"]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'out' / 'figure_4b.png'}\n"
    assert asked == [(["figure_4b", "thresholds"], tmp_path / "out", True, 1, None)]


def test_interrupted_figures_print_the_files_that_are_whole(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from synchain.runtime.paper import make

    def written(*arguments: object) -> Iterator[Path]:
        yield tmp_path / "figure_4a.png"
        raise KeyboardInterrupt

    monkeypatch.setattr(make, "written", written)
    assert main(["paper", "4a", "4b", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr() == (f"{tmp_path / 'figure_4a.png'}\n", "synchain paper: interrupted\n")


def test_the_cache_is_described_and_emptied(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "cache"
    monkeypatch.setenv("SYNCHAIN_CACHE", str(folder))
    assert main(["cache", "info"]) == 0
    assert "kernels  0" in capsys.readouterr().out
    folder.mkdir()
    (folder / "kernel_1.py").write_text("x" * 2000)
    (folder / "driver_1.py").write_text("x" * 1000)
    (folder / "driver_2.py").write_text("x" * 1000)
    (folder / "note.txt").write_text("not a kernel")
    assert main(["cache", "info"]) == 0
    assert capsys.readouterr().out.splitlines() == [f"folder   {folder}", "kernels  1", "drivers  2", "size     4 kB"]
    assert main(["cache", "clear"]) == 0
    assert capsys.readouterr().out == f"deleted 1 kernel and 2 drivers from {folder}\n"
    assert [path.name for path in folder.iterdir()] == ["note.txt"]


WRONG = [
    ("", "expected a command"),
    ("spectum chain 4", "did you mean 'spectrum'?"),
    ("--quick", "unknown option --quick"),
    ("spectrum chain", "expected TOPOLOGY and N"),
    ("spectrum chain 0", "n = 0; expected at least 1"),
    ("spectrum chain -3", "n = -3; expected at least 1"),
    ("spectrum ring 2", "n = 2; expected at least 3"),
    ("spectrum rnig 4", "unknown topology 'rnig'; known: cayley_abelian, cayley_dihedral, chain"),
    ("spectrum chain 4.0", "expected a whole number"),
    ("spectrum chain 1_000", "expected a whole number"),
    ("spectrum chain 99999999999", "expected at most 100000"),
    ("spectrum chain 4 5", "unrecognized arguments: 5"),
    ("spectrum chain 4 --js", "unrecognized arguments: --js"),
    ("spectrum chain 4 --matrix {own}", "expected one of them"),
    ("spectrum --matrix {folder}/none.txt", "does not exist"),
    ("spectrum --matrix {folder}", "is a folder"),
    ("kernel nope", "unknown scene 'nope'; known: burridge_knopoff"),
    ("equations {folder}/none.toml", "no such file"),
    ("equations figure_4a --latex --json", "not allowed with"),
    ("run {scene}", "the following arguments are required: --out"),
    ("run --out {folder}", "the following arguments are required: SCENE"),
    ("run {scene} --out {folder}/o --rtol -1e-8", "above 0"),
    ("run {scene} --out {folder}/o --rtol 0", "above 0"),
    ("run {scene} --out {folder}/o --rtol 0.11", "at most 0.1"),
    ("run {scene} --out {folder}/o --rtol nan", "expected a finite number"),
    ("run {scene} --out {folder}/o --rtol 1e-30", "rtol"),
    ("run {scene} --out {folder}/o --workers 0", "expected at least 1"),
    ("run {scene} --out {folder}/o --set omega", "expected name=value"),
    ("run {scene} --out {folder}/o --set omega=inf", "expected a finite number"),
    ("run {scene} --out {folder}/o --set omega=1e101", "found '1e101'; expected a finite number of at most 1e+100"),
    ("run {scene} --out {folder}/o --set omega=0", "omega"),
    ("run {scene} --out {folder}/o --set omga=1", "did you mean 'omega'?"),
    ("run {scene} --out {folder}/o --set x_3=1", "unknown initial state 'x_3'"),
    ("run {scene} --out {folder}/o --set rtol=1e-7 --rtol 1e-8", "found --rtol beside --set rtol"),
    ("run {scene} --out {folder}/o --set rtol=0", "rtol"),
    ("run {scene} --out {folder}/o --set window=1,2", "can be swept"),
    ("run {scene} --out {folder}/o --set max_steps=1.5", "whole number"),
    ("run {scene} --out {folder}/o --set omega=1 omega=2", "omega twice"),
    ("run {scene} --out {folder}/o --set omega=2:1:5", "LO below HI"),
    ("run figure_3 --out {folder}/o --set sigma=1", "no links: there is nothing to couple"),
    ("run {scene} --out {scene}/o", "cannot make the folder"),
    ("thresholds", "expected a network"),
    ("thresholds --n 4", "expected a frequency of the drive"),
    ("thresholds --n 0 --omega 1.15", "n = 0"),
    ("thresholds --n 1 --omega 1.15", "no links"),
    ("thresholds --n 4 --omega 0", "above 0"),
    ("thresholds --n 4 --omega nan", "finite number"),
    ("thresholds --n 4 --omega 1.15 --sigma 0:0.5", "expected LO:HI:N"),
    ("thresholds --n 4 --omega 1.15 --sigma=-1:0.5:4", "at least 0"),
    ("thresholds --n 2 --matrix {own} --omega 1.15", "the matrix alone"),
    ("thresholds figure_3", "--omega"),
    ("thresholds harmonic_chain --omega 1", "not driven"),
    ("paper nope", "unknown figure 'nope'"),
    ("paper 4b --out {scene}", "the name of a file; expected a folder"),
    ("cache empty", "invalid choice"),
]


@pytest.mark.parametrize(("text", "expected"), WRONG)
def test_wrong_use_is_one_or_two_lines_on_stderr_and_code_2(
    text: str, expected: str, scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = matrix(tmp_path, "-1 1\n1 -1\n")
    before = sorted(tmp_path.rglob("*"))
    assert main(text.format(scene=scene, folder=tmp_path, own=path).split()) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert expected in captured.err
    assert captured.err.startswith("synchain")
    assert captured.err.count("\n") <= 2
    assert sorted(tmp_path.rglob("*")) == before


def test_an_empty_folder_name_is_refused(scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["run", scene, "--out", ""], ["paper", "4b", "--out", " "]):
        assert main(command) == 2
        assert "expected a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-1 1\n", "square"),
        ("-1 1\n1 0\n", "row 2 sums to 1; expected 0"),
        ("nan 1\n1 -1\n", "nan"),
        ("", "G.txt"),
        ("__import__('os')\n", "G.txt"),
    ],
)
def test_matrices_that_are_none(text: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = matrix(tmp_path, text)
    for command in (["spectrum", "--matrix", path], ["thresholds", "--matrix", path, "--omega", "1.15"]):
        assert main(command) == 2
        assert expected in capsys.readouterr().err


def test_a_scene_in_separate_parts_is_allowed_but_said(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*arguments: Any, **options: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(stream, "stream", stop)
    matrix(tmp_path, SEPARATE)
    Path(scene).write_text(SCENE.replace('name = "chain"\nn = 2', 'file = "G.txt"'))
    assert main(["run", scene, "--out", str(tmp_path / "out")]) == 1
    err = capsys.readouterr().err
    assert err.startswith("warning: topology G.txt(4) is not connected (2 parts)")
    assert err.endswith("synchain run: interrupted\n")


class Planted(ModuleType):
    SUMMARY, EXAMPLES = "planted", ("synchain cache",)
    problem: BaseException = TypeError("planted")

    @staticmethod
    def configure(parser: Any) -> None:
        """No arguments."""

    def execute(self, arguments: Any) -> int:
        raise self.problem


def behind_ctrl_c() -> RuntimeError:
    """The error of a lock whose end a second Ctrl-C has cut short."""
    problem = RuntimeError("cannot release un-acquired lock")
    problem.__context__ = ValueError("between")
    problem.__context__.__context__ = KeyboardInterrupt()
    return problem


@pytest.mark.parametrize(
    ("problem", "code", "expected"),
    [
        (behind_ctrl_c(), 1, "synchain cache: interrupted"),
        (TypeError("planted"), 1, "internal error, a bug in synchain: TypeError: planted"),
        (ValueError("planted"), 1, "a bug in synchain"),
        (OSError(28, "No space left on device", "file.nc"), 1, "file.nc: No space left on device"),
        (MemoryError(), 1, "not enough memory"),
        (KeyboardInterrupt(), 1, "interrupted"),
        (ModuleNotFoundError("no", name="xarray.core"), 1, "python -m pip install xarray"),
    ],
)
def test_errors_of_ours_and_of_the_system_are_no_tracebacks(
    problem: BaseException,
    code: int,
    expected: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    planted = Planted("planted")
    planted.problem = problem
    monkeypatch.setattr("synchain.runtime.cli.command", lambda name: planted)
    monkeypatch.delenv("SYNCHAIN_DEBUG", raising=False)
    assert main(["cache"]) == code
    err = capsys.readouterr().err
    assert expected in err
    assert "Traceback" not in err
    assert err.count("\n") <= 2
    monkeypatch.setenv("SYNCHAIN_DEBUG", "1")
    assert main(["cache"]) == code
    assert "Traceback" in capsys.readouterr().err


def test_json_never_holds_nan() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        print_json({"value": float("nan")})


def test_warnings_are_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    import warnings

    class Warns(Planted):
        def execute(self, arguments: Any) -> int:
            warnings.warn("the cache\nis read-only", RuntimeWarning, stacklevel=1)
            return 0

    monkeypatch.setattr("synchain.runtime.cli.command", lambda name: Warns("warns"))
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main(["cache"]) == 0
    assert capsys.readouterr().err == "warning: the cache is read-only\n"


@pytest.mark.parametrize(
    "text",
    [
        *(pytest.param(text, marks=pytest.mark.long) for text in
          ("list graphs", "kernel two_oscillators", "equations figure_4a")),
        "spectrum chain 40", "spectrum chain 200",
    ],
)  # fmt: skip
def test_a_reader_that_leaves_early_ends_it_quietly(text: str) -> None:
    """Output that is written at the end, and more than a buffer holds."""
    command = f"'{sys.executable}' -m synchain.runtime {text} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60, env=BUFFERED)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_output_that_cannot_be_written_is_a_failure() -> None:
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "synchain.runtime", "list", "scenes"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, env=BUFFERED)
    assert done.returncode == 1
    assert done.stderr == "synchain list: No space left on device\n"


def test_exit_codes_and_streams_of_the_real_program() -> None:
    done = synchain("spectrum rnig 4")
    assert (done.returncode, done.stdout) == (2, "")
    assert (
        done.stderr
        == f"synchain spectrum: unknown topology 'rnig'; known: {', '.join(families())}; did you mean 'ring'?\n"
    )
    done = synchain("equations two_oscillators", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert "cos(\\u03c9" in done.stdout  # the escape of an omega

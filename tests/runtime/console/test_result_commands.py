"""Commands over files of results and over the public functions, lists, and scene files to start from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synchain import Scene, load_scene, msf, open_result, run
from synchain.graphs import chain
from synchain.models.graphs.families import names as families
from synchain.results import PeriodicOrbit, Result
from synchain.runtime.cli import main
from synchain.runtime.commands import names as commands
from synchain.runtime.commands.list import LISTS

PNG, SHORT = b"\x89PNG", {"starts": 1, "transient": 2, "periods": 2, "show_progress": False}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, a result and a master stability function of it."""
    found = tmp_path_factory.mktemp("files")
    scene = Scene(
        "duffing", "spring", chain(2), parameters={"omega": 1.3}, record=("sync_error", "trajectory"), samples=50,
        transient=10, window=2,
    )  # fmt: skip
    scene.save(found / "pair.toml")
    run(scene, sigma=[0.1, 0.2, 0.3], show_progress=False).save(found / "pair.nc")
    msf(scene, [0.0, 0.1, 0.2], **SHORT).save(found / "msf.nc")
    return found


def printed(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main([str(word) for word in words]) == 0
    captured = capsys.readouterr()
    return captured.out


def refused(capsys: pytest.CaptureFixture[str], *words: object, code: int = 2) -> str:
    assert main([str(word) for word in words]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    return captured.err


@pytest.mark.parametrize("name", ["pair", "msf"])
def test_show_prints_what_python_prints(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    value = open_result(folder / f"{name}.nc")
    assert printed(capsys, "show", folder / f"{name}.nc") == f"{value!r}\n"
    found = json.loads(printed(capsys, "show", folder / f"{name}.nc", "--json"))
    assert found == json.loads(json.dumps(value.as_dict()))


@pytest.mark.parametrize(("name", "kind"), [("pair", None), ("pair", "phase"), ("pair", "network"), ("msf", None)])
def test_plot_draws_any_result(
    name: str, kind: str | None, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["plot", folder / f"{name}.nc", "-o", tmp_path / "a.png", *(("--kind", kind) if kind else ())]
    assert printed(capsys, *words) == f"  {tmp_path / 'a.png'}\n"
    assert (tmp_path / "a.png").read_bytes().startswith(PNG)
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_plot_stands_beside_its_file_unless_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed(capsys, "plot", folder / "pair.nc")
    assert (folder / "pair.png").read_bytes().startswith(PNG)
    printed(capsys, "plot", folder / "pair.nc", "--out", folder / "pair.svg")
    assert "<svg" in (folder / "pair.svg").read_text("utf-8")


def test_wrong_files_and_kinds_are_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "pair.toml" in refused(capsys, "show", folder / "pair.toml")
    assert "does not exist" in refused(capsys, "show", folder / "nothing.nc")
    assert "unknown kind of plot 'phas'" in refused(capsys, "plot", folder / "pair.nc", "--kind", "phas")
    assert "has no numbers for the plot 'section'" in refused(capsys, "plot", folder / "pair.nc", "--kind", "section")
    assert "holds a MSF, which has one kind" in refused(capsys, "plot", folder / "msf.nc", "--kind", "error")
    assert "found the ending '.xyz'" in refused(capsys, "plot", folder / "pair.nc", "-o", folder / "a.xyz")


@pytest.mark.parametrize("kind", LISTS)
def test_lists_have_a_line_for_each_name(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    rows = json.loads(printed(capsys, "list", kind, "--json"))
    lines = printed(capsys, "list", kind).splitlines()
    assert [line.split()[0] for line in lines] == [row["name"] for row in rows]
    assert all(row["summary"] in line for row, line in zip(rows, lines, strict=True))
    if kind == "graphs":
        assert {row["name"] for row in rows} == set(families())
    if kind in ("oscillators", "frictions", "couplings"):
        assert all(row["summary"] and isinstance(row["parameters"], dict) for row in rows)


def test_init_writes_a_scene_that_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert printed(capsys, "init", "my_scene") == "my_scene.toml\n  synchain run my_scene.toml --out results\n"
    text = Path("my_scene.toml").read_text("utf-8")
    assert text.startswith("# my_scene: ")
    assert "NAME" not in text
    scene = load_scene("my_scene.toml")
    assert scene.axes[0].name == "sigma"
    result = run(scene, sigma=[0.0, 0.3], show_progress=False)
    assert result.success
    assert result.sync_error[0] > 10 * result.sync_error[1]
    assert "my_scene.toml exists" in refused(capsys, "init", "my_scene")
    assert "expected letters, digits" in refused(capsys, "init", "../up")


def test_basin_lyapunov_and_orbit_are_the_public_functions(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = folder / "pair.toml"
    options = ["--samples", 5, "--window", 1, "--set", "sigma=0.3,0.5", "rng=2", "--range", "x=0:0.5", "v=-0.1:0.1"]
    options += ["--attractor", "moving=mean(v_1**2) > 0.001", "together=synchronous", "--bound", 10, "--json"]
    found = json.loads(printed(capsys, "basin", scene, *options))
    assert np.shape(found["fate"]) == (2, 5)
    assert found["attractor"][:2] == ["moving", "together"]
    assert np.max(found["initial"]) <= 0.5
    each = json.loads(printed(capsys, "basin", scene, "--samples", 2, "--nodes", "each", "--window", 1, "--json"))
    assert np.shape(each["fate"]) == (2, 2)
    spectrum = json.loads(printed(capsys, "lyapunov", scene, "--periods", 4, "--count", 2, "--json"))
    assert len(spectrum["exponent"]) == 2
    out = printed(capsys, "orbit", scene, "--set", "omega=1.35", "-o", folder / "orbit.nc")
    assert out.splitlines()[0] == "PeriodicOrbit"
    assert out.splitlines()[-1] == f"  {folder / 'orbit.nc'}"
    orbit = open_result(folder / "orbit.nc")
    assert isinstance(orbit, PeriodicOrbit)
    assert orbit.scene.parameters["omega"] == 1.35
    assert "orbit.nc exists" in refused(capsys, "orbit", scene, "-o", folder / "orbit.nc")
    branch = json.loads(printed(capsys, "orbit", scene, "--follow", "omega=1.3:1.34:3", "--json"))
    assert {1.3, 1.32, 1.34} <= set(branch["omega"])  # and the steps between them
    assert (min(branch["omega"]), max(branch["omega"])) == (1.3, 1.34)


def test_wrong_uses_of_functions_are_said_in_a_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = folder / "pair.toml"
    for words, message in (
        (("lyapunov", scene, "--set", "sigma=0:1:3"), "found axes of sigma"),
        (("lyapunov", scene, "--set", "rtol=1e-3"), "expected at most 1e-05"),
        (("lyapunov", scene, "--count", 9), "count = 9; expected 1 … 4"),
        (("orbit", scene, "--follow", "nothing=1:2:3"), "expected a parameter and its values"),
        (("basin", scene, "--set", "nothing=1"), "unknown parameter 'nothing'"),
        (("basin", scene, "--range", "x=1"), "--range: found 'x=1'; expected COMPONENT=LOW:HIGH"),
        (("basin", scene, "--attractor", "rest"), "--attractor: found 'rest'; expected NAME=CONDITION"),
    ):
        assert message in refused(capsys, *words)


@pytest.mark.parametrize("name", sorted(set(commands())))
def test_set_is_an_option_wherever_a_scene_is(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, name, "--help")
    takes_scene = " SCENE" in text.partition("options:")[0].partition("example")[0]
    assert ("--set" in text) == takes_scene


def test_settings_change_equations_and_kernels(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene: Any = folder / "pair.toml"
    source = printed(capsys, "equations", scene, "--python", "--set", "omega=1.75")
    assert "1.75" in source
    assert printed(capsys, "kernel", scene, "--set", "sigma=0.2") != ""
    assert isinstance(open_result(folder / "pair.nc"), Result)


def test_a_run_prints_json_when_it_ran_and_when_it_was_there(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", folder / "pair.toml", "--out", tmp_path, "--set", "sigma=0.1,0.2", "--json"]
    first, again = (json.loads(printed(capsys, *words)) for _ in range(2))
    assert first == again
    assert first == {
        "file": str(tmp_path / "pair.nc"), "figure": str(tmp_path / "pair.png"), "statuses": {"finished": 2},
    }  # fmt: skip
    failed = [*words, "max_steps=3", "--overwrite"]
    failed.remove("--json")
    assert main([*map(str, failed), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["statuses"] == {"step_budget": 2}
    assert "found --json with --explain" in refused(capsys, *words, "--explain")

"""`synchain msf`: what it prints, writes and refuses; functions stand in for the integration except
in the last tests.
"""

from __future__ import annotations

import importlib
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_samples import rows

from synchain import Scene
from synchain.graphs import Topology, chain, complete, read_matrix
from synchain.plugins import allow_code
from synchain.results import MSF, Exponents, Plane
from synchain.runtime.cli import main
from synchain.runtime.prediction.synchronisability import Answer
from synchain.runtime.stability import orbits
from synchain.runtime.stability.attractor import Attractor, Motion

ONE_WAY = "-1 1 0\n0 -1 1\n1 0 -1\n"
LOW, HIGH = 0.1, 0.6
"""Where the stand-in changes its sign."""


def line(alpha: np.ndarray, low: float = LOW, high: float = HIGH, error: float = 1e-3) -> Exponents:
    value = (alpha - low) * (alpha - high)
    kinds = (Attractor(Motion.APERIODIC, 0.0), Attractor(Motion.PERIODIC, 1.0), Attractor(Motion.APERIODIC, 0.0))
    return Exponents(alpha, value, np.full(len(alpha), error), 500.0, 3, value[None], kinds)


def function(scene: Scene, low: float = LOW, high: float = HIGH, end: float = 1.2, error: float = 1e-3) -> MSF:
    alpha = np.linspace(0.0, end, 241)
    return MSF(scene, alpha, line(alpha, low, high, error))


def disc(scene: Scene, alpha: np.ndarray, beta: np.ndarray) -> Plane:
    """Negative inside a circle round 0.35 of radius 0.25."""
    value = np.add.outer((alpha - LOW) * (alpha - HIGH), beta**2)
    return Plane(scene, alpha, beta, value, np.full(value.shape, 1e-3), np.array([[["aperiodic"]]]), 500.0)


def mapped(scene: Scene, alpha: Any, parameters: dict[str, tuple[float, ...]]) -> Plane:
    """Negative where the first axis is below the second; between two modes over two parameters."""
    axes = {**({} if alpha is None else {"alpha": alpha}), **parameters}
    across, up = (np.array(values) for values in axes.values())
    value = np.subtract.outer(across, up)
    modes = {} if alpha is not None else {"modes": ("(-1)", "(-3)"), "mode": np.where(value < 0, 0, 1)}
    kinds = np.array([[["aperiodic"], ["aperiodic"], ["periodic"]]])
    return Plane(scene, across, up, value, np.full(value.shape, 1e-3), kinds, 500.0, tuple(axes), **modes)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What the stand-ins for msf and plane were asked for."""
    collected: list[dict[str, Any]] = []
    module = importlib.import_module("synchain.runtime.stability.msf")

    def msf(scene: Scene, alpha: np.ndarray, **options: Any) -> MSF:
        collected.append({"scene": scene, "alpha": alpha, **options})
        return MSF(scene, alpha, line(alpha))

    def plane(scene: Scene, alpha: Any = None, beta: Any = None, parameters: Any = None, **options: Any) -> Plane:
        keywords = {"alpha": alpha, "beta": beta, "parameters": parameters, **options}
        collected.append({"scene": scene, **{name: value for name, value in keywords.items() if value is not None}})
        return (
            disc(scene, np.asarray(alpha), np.asarray(beta)) if parameters is None else mapped(scene, alpha, parameters)
        )

    monkeypatch.setattr(module, "msf", msf)
    monkeypatch.setattr(importlib.import_module("synchain.runtime.stability.exponent_plane"), "plane", plane)
    return collected


def matrix(folder: Path, text: str = ONE_WAY) -> str:
    path = folder / "G.txt"
    path.write_text(text)
    return str(path)


def value(text: str, name: str) -> str:
    """The words behind a name in a report."""
    return next(row.strip()[len(name) :].strip() for row in text.splitlines() if row.strip().startswith(name))


# -- a line of strengths
# -----------------------------------------------------------------------------------------


def test_report_of_a_chain(asked: list[dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msf", "figure_8"]) == 0
    text = capsys.readouterr().out
    assert value(text, "scene") == "Scene(friction/exponential/spring, chain(4)), omega = 1.4"
    assert value(text, "strength") == "alpha = -sigma gamma (coupling: spring), from 0 to 1.2"
    assert value(text, "class") == "bounded interval (Γ2)"
    assert value(text, "negative for alpha") == "0.1000 ± 0.0020 … 0.6000 ± 0.0020"  # 0.001 over the slope 0.5
    assert value(text, "attractor") == "aperiodic (2 of 3 starts); periodic (1 of 3 starts)"
    assert "500 units of time (111 drive periods) for each start" in value(text, "average")  # 500 * 1.4 / 2 pi
    low, high = LOW / (2 - math.sqrt(2)), HIGH / (2 + math.sqrt(2))
    sigma = value(text, "sigma")
    assert sigma.startswith(f"{low:.4f} ± 0.0034 … {high:.5f} ± 0.00060; ")  # 0.002 over |gamma|
    assert "lost below: gamma = -2 + sqrt(2); lost above: gamma = -2 - sqrt(2)" in sigma
    assert value(text, "possible").startswith(
        "yes (largest over smallest |gamma|: 2*sqrt(2) + 3 = 5.82843; allowed: 6)"
    )
    assert len(asked[0]["alpha"]) == 241
    assert (asked[0]["alpha"][0], asked[0]["alpha"][-1]) == (0.0, 1.2)
    assert {"precision", "periods", "starts"}.isdisjoint(asked[0])


@pytest.mark.parametrize("precision", [0.0, 0.01])
def test_json_of_a_star_and_what_was_asked_for(
    asked: list[dict[str, Any]], capsys: pytest.CaptureFixture[str], precision: float
) -> None:
    effort = f"--precision {precision} --periods 99 --starts 2 --workers 1"
    assert main(f"msf --omega 1.4 --topology star --n 5 --json --alpha 0:1.2:25 {effort}".split()) == 0
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert captured.err == ""
    assert len(answer["alpha"]) == len(answer["exponent"]) == len(answer["stderr"]) == 25
    assert answer["class"] == "bounded interval"
    np.testing.assert_allclose(answer["intervals"], [[LOW, HIGH]], atol=1e-12)
    (window,) = answer["windows"]
    assert (window["low"], window["high"]) == pytest.approx((0.1, 0.12))
    assert (window["low_mode"], window["high_mode"]) == ("-1", "-5")
    assert answer["verdict"] == {
        "answer": "yes",
        "ratio": "5",
        "ratio_value": 5.0,
        "allowed": pytest.approx(6.0),
        "slowest": "-1",
        "fastest": "-5",
    }
    assert {k: asked[0][k] for k in ("precision", "periods", "starts", "workers")} == {
        "precision": precision,
        "periods": 99.0,
        "starts": 2,
        "workers": 1,
    }
    assert asked[0]["scene"].parameters["omega"] == 1.4


@pytest.mark.parametrize(
    ("command", "network", "omega"),
    [
        ("figure_8", chain(4), 1.4),
        ("figure_8 --omega 1.2 --n 3", chain(3), 1.2),
        ("figure_8 --topology complete", complete(4), 1.4),
        ("figure_3 --omega 1.15", None, 1.15),
        ("figure_3 --omega 1.15 --topology complete --n 3", complete(3), 1.15),
        ("--omega 1.15", None, 1.15),
        ("--omega 1.15 --n 5", chain(5), 1.15),
        ("harmonic_chain", chain(5), None),
    ],
)
def test_oscillator_and_network_are_those_asked_for(
    command: str,
    network: Topology | None,
    omega: float | None,
    asked: list[dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["msf", *command.split(), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert asked[0]["scene"].angular_frequency == omega
    assert asked[0]["scene"].axes == ()
    assert (answer["windows"] is None) == (network is None)
    assert (answer["verdict"] is None) == (network is None)
    if network is not None:
        assert asked[0]["scene"].topology == network


def own_drive(folder: Path, wave: str) -> Path:
    """A scene file with a driven oscillator of its own, whose parameter omega is no frequency of
    the drive.
    """
    code = folder / "own.py"
    names = ("omega", "Omega") if "Omega" in wave else ("omega",)
    code.write_text(
        "from synchain import Lagrangian\n"
        f"OSCILLATOR = Lagrangian('v**2/2', 'omega**2*x**2/2 - x*{wave}', {{'x': '-v'}}, coordinates={{'x': 'v'}},\n"
        f"    parameters={dict.fromkeys(names, 1.0)})\n"
    )
    allow_code(code)
    file = folder / "own.toml"
    file.write_text(f'oscillator = "{code}"\ntopology = {{name = "chain", n = 2}}\n')
    return file


def test_the_option_omega_sets_the_frequency_of_the_drive_whatever_its_name(
    asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = own_drive(tmp_path, "cos(Omega*t)")
    assert main(["msf", str(file), "--omega", "1.4"]) == 0
    assert asked[0]["scene"].parameters == {"omega": 1.0, "Omega": 1.4, "sigma": asked[0]["scene"].parameters["sigma"]}
    assert value(capsys.readouterr().out, "scene").endswith("spring, chain(2)), Omega = 1.4")
    file.write_text(file.read_text() + "[sweep]\nomega = [1.0, 2.0]\n")
    assert main(["msf", str(file)]) == 2
    assert "sweeps omega; expected a scene without these axes" in capsys.readouterr().err
    file.write_text(file.read_text().replace("omega = [", "Omega = ["))
    assert main(["msf", str(file)]) == 2
    assert "sweeps Omega; expected one frequency" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wave", "message", "drive"),
    [("cos(2 * Omega*t)", "2*Omega", ", 2*Omega = 2"), ("cos(2*t)", "the frequency 2;", ", drive frequency 2")],
)
def test_a_frequency_that_is_no_parameter_is_told_but_cannot_be_set(
    wave: str, message: str, drive: str, asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = own_drive(tmp_path, wave)
    assert main(["msf", str(file), "--omega", "1.4"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "expected one that is a parameter" in error
    assert main(["msf", str(file)]) == 0
    assert value(capsys.readouterr().out, "scene").endswith(drive)


def test_where_the_grid_ends_no_mode_is_lost_and_no_is_not_said() -> None:
    scene = Scene(topology=chain(4))
    cut = function(scene, end=0.4)
    assert cut.verdict.answer == Answer.GRID_ENDS
    assert cut.windows == ()
    assert dict(cut.summary)["negative for alpha"] == "0.1000 ± 0.0020 … 0.4000..."
    pair = function(Scene(topology=chain(2)), end=0.4)
    assert pair.verdict.answer == "yes"
    (window,) = pair.windows
    assert window.low_mode is not None
    assert window.high_mode is None
    assert dict(pair.summary)["sigma"] == "0.0500 ± 0.0010 … 0.2000...; lost below: gamma = -2"
    assert function(scene).verdict.answer == "yes"
    assert function(scene, high=0.3).verdict.answer == "no"
    assert function(scene, low=-0.1).windows[0].low == 0.0


def test_windows_in_python_are_those_of_the_command() -> None:
    for end, error in ((0.4, 1e-3), (1.2, math.inf)):
        result = function(Scene(topology=chain(2)), end=end, error=error)
        (window,) = result.windows
        (window_as_dict,) = result.as_dict()["windows"]
        assert window.low_mode is not None
        assert window_as_dict["low_mode"] == window.low_mode.eigenvalue.text
        assert (window.high_mode is None) == (window_as_dict["high_mode"] is None) == (end < HIGH)
        assert (window_as_dict["low"], window_as_dict["high"]) == (window.low, window.high)


def test_a_ratio_within_the_error_is_undecided() -> None:
    scene = Scene(topology=chain(4))
    high = LOW * (3 + 2 * math.sqrt(2)) + 1e-4
    assert function(scene, high=high, error=1e-3).verdict.answer == "undecided within the error"


def test_numbers_that_are_not_finite_are_null_in_json() -> None:
    result = function(Scene(topology=chain(3)), error=math.inf)
    result.fine.exponent[60] = -math.inf
    answer = result.as_dict()
    assert answer["exponent"][60] is None
    assert set(answer["stderr"]) == {None}
    json.dumps(answer, allow_nan=False)
    assert "too short for an error: raise periods" in dict(result.summary)["average"]
    assert len(answer["windows"]) == 1


def test_a_network_without_stable_range_is_said_to_have_none() -> None:
    text = repr(function(Scene(topology=chain(3)), low=2.0, high=3.0))
    assert value(text, "negative for alpha") == "none"
    assert value(text, "sigma") == "none"
    assert value(text, "possible").startswith("no")


def test_complex_eigenvalues_need_beta(
    asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["msf", "--omega", "1.4", "--matrix", matrix(tmp_path), "--json"]) == 0
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert answer["windows"] is None
    assert answer["verdict"] is None
    assert captured.err.startswith("warning: ")
    assert "complex eigenvalues" in captured.err
    assert "add --beta, e.g. --beta 0:0.69:61" in captured.err  # 1.2 / sqrt(3)


# -- a plane of strengths
# ----------------------------------------------------------------------------------------


def test_report_of_a_plane(asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["msf", "--omega", "1.4", "--matrix", matrix(tmp_path), "--alpha", "0:1.2:241", "--beta", "0:0.7:141"]
    assert main(command) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert value(captured.out, "zero contour") == "alpha 0.1000 … 0.6000, beta 0.0000 … 0.2500"
    a, b = np.meshgrid(np.linspace(0.0, 1.2, 241), np.linspace(0.0, 0.7, 141))
    inside = np.count_nonzero((a - 0.35) ** 2 + b**2 < 0.25**2 - 1e-12)
    assert abs(int(value(captured.out, "negative").split()[1]) - inside) <= 4  # points on the circle round either way
    # the ray 3/2 + i sqrt(3)/2 crosses the circle where 3 s^2 - 1.05 s + 0.06 = 0
    root = math.sqrt(1.05**2 - 12 * 0.06)
    ends = [(1.05 - root) / 6, (1.05 + root) / 6]
    assert value(captured.out, "sigma").startswith(
        f"{ends[0]:.4f} … {ends[1]:.4f}; lost below: gamma = -3/2 - sqrt(3)*I/2"
    )
    assert main([*command, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (len(answer["exponent"]), len(answer["exponent"][0])) == (241, 141)
    assert (answer["windows"][0]["low"], answer["windows"][0]["high"]) == pytest.approx(ends, abs=2e-4)
    assert answer["contours"]
    assert asked[1]["beta"][-1] == 0.7


def test_windows_in_the_plane_are_those_of_the_line_for_real_eigenvalues() -> None:
    scene = Scene(topology=chain(4))
    alpha, beta = np.linspace(0.0, 1.2, 241), np.linspace(-0.1, 0.3, 9)
    (window,) = disc(scene, alpha, beta).windows
    (expected,) = function(scene).windows
    assert (window.low, window.high) == pytest.approx((expected.low, expected.high), abs=1e-4)
    assert window.high_mode is not None
    assert window.high_mode.eigenvalue.value == expected.high_mode.eigenvalue.value


def test_a_mode_that_leaves_the_plane_ends_the_search_and_not_the_window(tmp_path: Path) -> None:
    scene = Scene(topology=read_matrix(matrix(tmp_path)))
    alpha, wide, low = np.linspace(0.0, 1.2, 121), np.linspace(0.0, 0.7, 71), np.linspace(0.0, 0.1, 11)
    (window,) = disc(scene, alpha, wide).windows
    (cut,) = disc(scene, alpha, low).windows
    assert cut.low == pytest.approx(window.low, abs=1e-4)
    assert cut.high == pytest.approx(0.1 / (math.sqrt(3) / 2))
    assert window.high > cut.high
    assert cut.high_mode is None
    assert window.high_mode is not None
    mirrored = disc(scene, alpha, -wide[::-1]).windows
    assert (mirrored[0].low, mirrored[0].high) == pytest.approx((window.low, window.high), abs=1e-6)


# -- maps over parameters
# ----------------------------------------------------------------------------------------


def test_report_of_a_map_over_alpha_and_a_parameter(
    asked: list[dict[str, Any]], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    content = f"msf figure_8 --alpha 0:2:5 --set omega=0.5:1.5:3 kappa=1e4 --starts 1 --out {tmp_path}"
    assert main(content.split()) == 0
    text = capsys.readouterr().out
    assert value(text, "exponents") == "alpha = -sigma gamma (coupling: spring)"
    assert value(text, "grid") == "5 alpha from 0 to 2, 3 omega from 0.5 to 1.5"
    assert value(text, "zero contour") == "alpha 0.5000 … 1.5000, omega 0.5000 … 1.5000"
    assert value(text, "negative") == "at 6 of 15 points, 40.0%"
    assert value(text, "attractor") == "aperiodic (2 of 3 starts); periodic (1 of 3 starts)"
    assert "drive" not in text  # omega is an axis
    assert "sigma  " not in text
    (call,) = asked
    assert call["parameters"] == {"omega": (0.5, 1.0, 1.5)}
    assert call["alpha"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert call["starts"] == 1
    assert call["scene"].parameters["kappa"] == 1e4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plane.csv", "plane.png"]
    assert list(rows(tmp_path / "plane.csv")[0]) == ["alpha", "omega", "exponent", "stderr"]
    assert main(["msf", "figure_8", "--set", "omega=1,1.5"]) == 0
    assert (len(asked[1]["alpha"]), asked[1]["alpha"][0], asked[1]["alpha"][-1]) == (241, 0.0, 1.2)


def test_report_of_a_map_over_two_parameters(asked: list[dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> None:
    content = "msf figure_8 --set sigma=0:2:5 kappa=0.5,1,1.5 --set a=2 --topology star --n 5"
    assert main(content.split()) == 0
    text, said = capsys.readouterr()
    assert "figure_8 lists initial x of 4 oscillators; 5 start by default" in said
    assert value(text, "scene") == "Scene(friction/exponential/spring, star(5)), omega = 1.4"
    assert value(text, "exponents") == "the largest of 2 transversal modes of 5 nodes"
    assert [row.split("  ")[-1] for row in text.splitlines() if "largest for" in row] == [
        "gamma = -3, at 9 of 15 points",
        "gamma = -1, at 6 of 15 points",
    ]
    assert "500 units of time (111 drive periods)" in text
    (call,) = asked
    assert "alpha" not in call
    assert call["parameters"] == {"sigma": (0.0, 0.5, 1.0, 1.5, 2.0), "kappa": (0.5, 1.0, 1.5)}
    assert call["scene"].parameters["a"] == 2.0
    assert call["scene"].topology.name == "star"
    assert main([*content.split(), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["modes"] == ["(-1)", "(-3)"]
    assert np.shape(answer["mode"]) == np.shape(answer["exponent"]) == (5, 3)
    assert answer["windows"] is None


def test_a_number_is_set_and_an_axis_of_the_scene_with_it(
    asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "swept.toml"
    scene.write_text(
        "topology.name = 'chain'\ntopology.n = 2\nsweep = {kappa = [1e4, 1e5], omega = [1.1, 1.2], sigma = [0, 1]}\n"
    )
    assert main(f"msf {scene} --set kappa=2e4 omega=1.5".split()) == 0
    assert "omega = 1.5" in capsys.readouterr().out
    assert (asked[0]["scene"].parameters["kappa"], asked[0]["scene"].axes) == (2e4, ())
    assert main(f"msf {scene} --set omega=1,2 kappa=1e4,1e5".split()) == 0
    assert asked[1]["scene"].axes == ()
    assert main(["msf", "--set", "omega=1.4"]) == 0


def test_the_real_map_over_the_strengths_of_two_layers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """x' = -x with links k on a ring of 4, gamma = -2 and -4, and g between all, gamma = -4: the exponent is -1 - 2k - 4g."""
    scene = tmp_path / "layers.toml"
    scene.write_text(
        'oscillator = {rates = {x = "-x"}}\ntime_unit = "time"\n'
        'links = [{coupling = {rates = {x = "k*W*(x_j - x_i)"}, parameters = {k = 1}}, topology = {name = "ring", n = 4}}, '
        '{coupling = {rates = {x = "g*W*(x_j - x_i)"}, parameters = {g = 1}}, topology = {name = "complete", n = 4}}]\n'
    )
    assert main(f"msf {scene} --set k=0,1 g=0,0.5,1 --starts 1 --json".split()) == 0
    answer = json.loads(capsys.readouterr().out)
    k, g = np.meshgrid(answer["k"], answer["g"], indexing="ij")
    np.testing.assert_allclose(answer["exponent"], -1 - 2 * k - 4 * g, atol=1e-6)
    assert answer["modes"] == ["(-2, -4)", "(-4, -4)"]


# -- files, errors, names
# ----------------------------------------------------------------------------------------


def test_files_are_written_and_said(
    asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "folder"
    assert main(["msf", "figure_8", "--alpha", "0:1:5", "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == [f"  {out / 'msf.csv'}", f"  {out / 'msf.png'}"]
    table = rows(out / "msf.csv")
    assert list(table[0]) == ["alpha", "exponent", "stderr"]
    assert [row["alpha"] for row in table] == ["0", "0.25", "0.5", "0.75", "1"]
    assert float(table[2]["exponent"]) == pytest.approx(0.4 * -0.1)
    assert main(["msf", "figure_8", "--alpha", "0:1:5", "--beta", "0:1:3", "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [str(out / "plane.csv"), str(out / "plane.png")]
    assert len(rows(out / "plane.csv")) == 15
    assert sorted(path.name for path in out.iterdir()) == ["msf.csv", "msf.png", "plane.csv", "plane.png"]
    assert all((out / f"{name}.png").read_bytes().startswith(b"\x89PNG") for name in ("msf", "plane"))


WRONG = [
    ("", "expected a frequency of the drive, e.g. --omega 1.4, or a SCENE"),
    ("figure_3", "sweeps omega; expected one frequency"),
    ("figure_33", "did you mean 'figure_3'?"),
    ("harmonic_chain --omega 1", "not driven"),
    ("figure_8 --alpha 1:0:5", "LO below HI"),
    ("figure_8 --alpha 0:1:1", "at least 2 values"),
    ("figure_8 --alpha 0:nan:5", "finite number"),
    ("figure_8 --alpha 0:1", "expected LO:HI:N"),
    ("figure_8 --beta 1:1:5", "LO below HI"),
    ("figure_8 --alpha 0:1:2000 --beta 0:1:2000", "coarser grids"),
    ("figure_8 --omega nan", "finite number"),
    ("figure_8 --precision -1e-3", "found -1e-3; expected a number of at least 0"),
    ("figure_8 --periods -1", "above 0"),
    ("figure_8 --periods 1.5", "argument --periods: found 1.5; expected a whole number of periods"),
    ("figure_8 --starts 0", "at least 1"),
    ("figure_8 --n 1", "no links"),
    ("--omega 1.4 --topology star", "expected its number of oscillators too"),
    ("--omega 1.4 --topology strar --n 4", "unknown topology 'strar'"),
    ("--omega 1.4 --n 3 --matrix {own}", "the matrix alone"),
    ("--omega 1.4 --matrix {laplacian}", "negate it"),
    ("--omega 1.4 --matrix {own}.missing", "missing"),
    ("figure_8 --out {own}", "the name of a file; expected a folder"),
    ("{alone}", "the scene has no coupling, by which modes differ"),
    ("{swept}", "sweeps kappa, x_1; expected a scene without these axes"),
    ("{layers}", "found 2 layers of links in the scene; expected one; their strengths can be the axes of a map"),
    ("{layers} --set g=1,2", "found 2 layers of links in the scene; expected one"),
    ("{layers} --set g=1,2 sigma=1,2 --n 3", "found 2 layers of links in the scene; expected one"),
    ("{alone} --set omega=1,2", "the scene has no coupling"),
    ("figure_8 --set sgima=0:1:3", "--set: unknown parameter 'sgima'; known: theta_b, epsilon, "),
    ("figure_8 --set a=1 a=2", "--set gives a twice"),
    ("figure_8 --set a=1,2 u=1,2 kappa=1,2", "--set: found the axes a, u, kappa; expected at most two"),
    ("figure_8 --set a=1,2 --beta 0:1:3", "found --beta beside the axes a of --set"),
    ("figure_8 --set a=1,2 u=1,2 --alpha 0:1:3", "found --alpha beside the axes a, u of --set"),
    ("figure_8 --omega 1.2 --set omega=1,2", "found --omega beside --set omega; expected one of them"),
    ("figure_8 --set a=0:1:2000 u=0:1:2000", "coarser grids"),
    ("figure_8 --set a=0:1:20000", "coarser grids"),
    ("figure_8 --set x_1=0", "--set: unknown parameter 'x_1'"),
]


@pytest.mark.parametrize(("text", "expected"), WRONG)
def test_wrong_use_is_said_before_anything_is_computed(
    text: str, expected: str, asked: list[dict[str, Any]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = matrix(tmp_path)
    (tmp_path / "laplacian.txt").write_text("1 -1\n-1 1\n")
    (tmp_path / "alone.toml").write_text(
        'coupling = "none"\ntopology = {name = "chain", n = 1}\nparameters = {omega = 1.4}\n'
    )
    (tmp_path / "swept.toml").write_text(
        "topology.name = 'chain'\ntopology.n = 2\nsweep = {kappa = [1e4, 1e5], x_1 = [0, 1]}\n"
    )
    (tmp_path / "layers.toml").write_text(
        'links = [{coupling = "spring", topology = {name = "ring", n = 4}}, '
        '{coupling = {rates = {v = "g*W*v_j"}, parameters = {g = 1}}, topology = {name = "star", n = 4}}]\n'
    )
    places = {name: tmp_path / f"{name}.toml" for name in ("alone", "swept", "layers")}
    places |= {"own": path, "laplacian": tmp_path / "laplacian.txt"}
    assert main(["msf", *text.format(**places).split()]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("synchain msf: ")
    assert expected in captured.err
    assert captured.err.count("\n") <= 2
    assert asked == []


def test_equations_without_modes_are_refused_before_anything_is_computed(
    asked: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def mode(equations: Any, plane: bool = False, **_: Any) -> Any:
        raise ValueError(f"no synchronous state, plane {plane}")

    monkeypatch.setattr(orbits, "mode", mode)
    orbits._variation.cache_clear()
    for options, plane in (("", False), ("--beta 0:1:3", True)):
        assert main(["msf", "figure_8", *options.split()]) == 2
        assert f"no synchronous state, plane {plane}" in capsys.readouterr().err
    assert asked == []


def test_an_orbit_that_cannot_be_integrated_is_a_failed_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def msf(*arguments: Any, **options: Any) -> MSF:
        raise FloatingPointError("the orbit cannot be integrated")

    monkeypatch.setattr(importlib.import_module("synchain.runtime.stability.msf"), "msf", msf)
    assert main(["msf", "figure_8"]) == 1
    assert capsys.readouterr().err == "synchain msf: the orbit cannot be integrated\n"


def test_public_names_are_offered_and_go_before_modules_of_the_same_name() -> None:
    code = (
        "import synchain.runtime.stability.msf, synchain.runtime.synchronisation.basin\n"
        "from synchain import basin, msf\n"
        "print(type(msf).__name__, type(basin).__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["function", "function"]


def test_the_real_function_of_linear_oscillators(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """x'' + x + alpha x' = 0: the exponent is -alpha/2 up to alpha = 2."""
    scene = tmp_path / "damped.toml"
    scene.write_text('oscillator = "harmonic"\ncoupling = "damper"\ntopology = {name = "ring", n = 4}\n')
    assert main(["msf", str(scene), "--alpha", "0.5:1.5:3", "--periods", "8", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(answer["exponent"], [-0.25, -0.5, -0.75], atol=1e-9)
    assert answer["windows"][0]["high_mode"] is None  # the grid ends at sigma = 1.5 / 4
    assert answer["windows"][0]["high"] == pytest.approx(1.5 / 4)


def test_the_real_function_of_the_friction_oscillator(capsys: pytest.CaptureFixture[str]) -> None:
    text = "msf --omega 1.15 --alpha 0.4:0.5:3 --starts 1 --workers 1 --n 4 --json"
    assert main(text.split()) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["attractors"] == ["periodic, 2 drive periods"]
    assert answer["exponent"][0] < answer["exponent"][1] < 0 < answer["exponent"][2]
    assert answer["intervals"][0][1] == pytest.approx(
        2 * 0.233, abs=2e-3
    )  # Marszal et al. 2016: sigma = 0.233 of a pair

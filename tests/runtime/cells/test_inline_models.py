"""Models without a file cost nothing: the kernels and the bits of the plug-in files, results that open without code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import synchain as sc
from synchain import Scene
from synchain.models.definitions.loader import load_oscillator
from synchain.plugins import Oscillator
from synchain.runtime.cli import main
from synchain.runtime.engines.scene_kernels import kernel_source

t = dynamicsymbols._t
x = dynamicsymbols("x")
v = x.diff(t)
u, omega, N, belt, w = sp.symbols("u omega epsilon theta_b w")
LAW = "(mu_k + (mu_s - mu_k)*exp(-a*abs(w)))*sign(w)"
SHORT = {"transient": 2.0, "window": 3.0}


def defaults(name: str) -> dict[str, float]:
    """The parameters of a plug-in file as plain numbers."""
    return {name: p.default for name, p in load_oscillator(name).parameters.items()}


def rubbing(contact: str) -> Oscillator:
    """The friction oscillator of the source paper, already in its own units."""
    return sc.Lagrangian(
        v**2 / 2,
        (x - u * sp.cos(omega * t)) ** 2 / 2,
        {x: N * sc.friction(belt - v)},
        friction=sc.friction_law(LAW, {"mu_s": 0.3, "mu_k": 0.15, "a": 2.5}),
        contact=contact,
        parameters=defaults("friction"),
    )


def duffing() -> Oscillator:
    beta, delta = sp.symbols("beta delta")
    potential = x**2 / 2 + beta * x**4 / 4 - u * x * sp.cos(omega * t)
    return sc.Lagrangian(v**2 / 2, potential, {x: -delta * v}, parameters=defaults("duffing"))


def double_pendulum() -> Oscillator:
    lower = "w_phi**2 + length_ratio**2*w_psi**2 + 2*length_ratio*w_phi*w_psi*cos(phi - psi)"
    return sc.Lagrangian(
        f"w_phi**2/2 + mass_ratio*({lower})/2",
        "-(1 + mass_ratio)*cos(phi) - mass_ratio*length_ratio*cos(psi)",
        R="delta*(w_phi**2 + (w_psi - w_phi)**2)/2",
        coordinates={"phi": "w_phi", "psi": "w_psi"},
        parameters=defaults("double_pendulum"),
    )


def lorenz() -> Oscillator:
    rates = {"x": "prandtl*(y - x)", "y": "x*(rayleigh - z) - y", "z": "x*y - b*z"}
    return sc.Field(rates, parameters=defaults("lorenz"), initial={"x": 1, "y": 1, "z": 20})


PAIRS = {
    "friction": (Scene(rubbing("atan"), topology=sc.graphs.chain(2)), Scene(topology=sc.graphs.chain(2))),
    "set-valued": (
        Scene(rubbing("set-valued"), topology=sc.graphs.chain(2), record=["section"], **SHORT),
        Scene(contact="set-valued", topology=sc.graphs.chain(2), record=["section"], **SHORT),
    ),
    "duffing": (
        Scene(duffing(), "spring", sc.graphs.chain(3), **SHORT),
        Scene("duffing", "spring", sc.graphs.chain(3), **SHORT),
    ),
    "double pendulum": (
        Scene(double_pendulum(), "spring on phi", sc.graphs.chain(2)),
        Scene("double_pendulum", "spring on phi", sc.graphs.chain(2)),
    ),
    "lorenz": (Scene(lorenz(), "x->x", sc.graphs.ring(4)), Scene("lorenz", "x->x", sc.graphs.ring(4))),
}


@pytest.mark.parametrize("name", PAIRS)
def test_an_inline_model_has_the_kernel_of_the_plug_in_file(name: str) -> None:
    mine, shipped = PAIRS[name]
    assert mine != shipped
    assert mine.equations.digest == shipped.equations.digest
    assert kernel_source(mine).text == kernel_source(shipped).text
    assert kernel_source(mine).digest == kernel_source(shipped).digest
    assert mine.initial == shipped.initial


@pytest.mark.parametrize("name", [pytest.param("set-valued", marks=pytest.mark.long), "duffing"])
def test_an_inline_model_has_the_bits_of_the_plug_in_file(name: str) -> None:
    mine, shipped = (sc.run(scene, sigma=[0.1, 0.2]).data for scene in PAIRS[name])
    assert set(mine.data_vars) == set(shipped.data_vars)
    for variable in mine.data_vars:
        np.testing.assert_array_equal(mine[variable].values, shipped[variable].values)


def test_a_result_carries_its_expressions(tmp_path: Path) -> None:
    scene = PAIRS["duffing"][0].replace(axes={"sigma": [0.1, 0.2]})  # the kernel of the test above
    sc.run(scene).save(tmp_path / "a.nc")
    result = sc.open_result(tmp_path / "a.nc")
    assert result.scene == scene
    assert result.scene.oscillator.model == scene.oscillator.model
    assert result.belongs_to(scene)
    other = sc.Lagrangian(v**2 / 2, x**2 / 2 + x**4, parameters={}, name="oscillator")
    assert not result.belongs_to(scene.replace(oscillator=other, parameters={}))


def test_a_cell_that_is_run_again_after_an_edit_does_what_it_says() -> None:
    scenes = [Scene(sc.Lagrangian("v**2/2", f"{stiffness}*x**2/2", coordinates=["x"])) for stiffness in (1, 4, 1)]
    assert [scene.equations.node.rhs[1].coeff(sp.Symbol("x", real=True)) for scene in scenes] == [-1, -4, -1]
    assert scenes[0] == scenes[2] != scenes[1]
    assert len({scene.equations.digest for scene in scenes}) == 2


FILE = """
coupling = "spring"
transient = 1
window = 2
[oscillator]
coordinates = ["x"]
kinetic = "v**2/2"
potential = "x**2/2 + beta*x**4/4 - u*x*cos(omega*t)"
forces = {x = "-delta*v"}
parameters = {delta = 0.1, beta = 1, u = {default = "3/10", minimum = 0}, omega = 1}
[topology]
name = "chain"
n = 3
[sweep]
sigma = [0.1, 0.2]
"""


def test_a_scene_file_says_a_model_and_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "own.toml").write_text(FILE)
    scene = sc.load_scene(tmp_path / "own.toml")
    assert kernel_source(scene).text == kernel_source(PAIRS["duffing"][1].replace(axes={"sigma": [0.1, 0.2]})).text
    assert main(["run", str(tmp_path / "own.toml"), "--out", str(tmp_path)]) == 0
    (path,) = tmp_path.glob("*.nc")
    assert sc.open_result(path).scene == scene
    assert "2 cells" in capsys.readouterr().out

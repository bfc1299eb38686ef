"""Starting files pass the tests of their kind; files from outside run only when allowed, and say where they fail."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import sympy as sp
import test_frictions
import test_lagrangian
import test_network
import test_topologies

from synchain.models import Scene, chain, plugins
from synchain.models.frictions import CONTACTS
from synchain.models.topology import names, topology
from synchain.runtime.cli import main

KINDS = ("topology", "friction", "oscillator", "coupling")
NAME = "my_own_part"


@pytest.fixture
def placed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """All four starting files, as if they lay in the folders of the package."""
    for kind in KINDS:
        home = f"synchain.models.{'topologies' if kind == 'topology' else f'{kind}s'}"
        assert main(["new", kind, NAME, "--dir", str(tmp_path / kind)]) == 0
        package = importlib.import_module(home)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path / kind)])
    yield NAME
    for name in [name for name in sys.modules if name.endswith(f".{NAME}")]:
        del sys.modules[name]


def test_the_starting_files_conform(placed: str) -> None:
    test_frictions.test_declarations(placed)
    test_frictions.test_parameters_have_no_name_of_an_oscillator_or_coupling(placed)
    test_frictions.test_odd(placed)
    test_frictions.test_drags_along_and_never_drives(placed)
    test_frictions.test_jump_is_finite_and_numbers_are_exact(placed)
    for contact in CONTACTS[:2]:
        test_frictions.test_units_cancel(placed, contact)
    for form in (test_lagrangian.physical, test_lagrangian.nondimensional):
        test_lagrangian.test_energy_balance_of_every_oscillator(placed, form)
    test_network.test_couplings_are_symmetric_and_called_sigma(placed)
    test_network.test_connectivity_of_one_way_links_is_the_jacobian_of_the_forces(placed)
    test_topologies.test_every_family_says_what_it_is_and_where_it_comes_from(placed)
    for n in (3, 4, 9):
        test_topologies.test_every_family_gives_a_connected_graph_with_zero_row_sums(placed, n)


def test_the_starting_files_work_together(placed: str) -> None:
    graph = topology(placed, 5)
    assert placed in names()
    assert graph.spectrum.verified
    driven = Scene(oscillator=placed, coupling=placed, topology=graph)
    assert driven.equations.edge is not None
    assert driven.equations.edge.diffusive
    rubbed = Scene(friction=placed, topology=graph)
    assert "mu_0" in rubbed.equations.parameters


def test_the_pendulum_is_a_pendulum(placed: str) -> None:
    x, v, t, delta, u, omega = sp.symbols("x v t delta u omega", real=True)
    _, rate = Scene(oscillator=placed).equations.node.rhs
    assert sp.expand(rate - (-sp.sin(x) + u * sp.cos(omega * t) - delta * v)) == 0


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_overwritten(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, NAME, "--dir", str(tmp_path)]) == 0
    path = tmp_path / f"{NAME}.py"
    assert str(path) in capsys.readouterr().out
    assert "NAME" not in path.read_text("utf-8")
    path.write_text("mine")
    assert main(["new", kind, NAME, "--dir", str(tmp_path)]) == 2
    assert path.read_text() == "mine"
    assert "exists" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("kind", "name", "words"),
    [
        ("friction", "../x", "small letters"), ("friction", "lambda", "no word of Python"), ("friction", "X", "small"),
        ("friction", "_x", "small letters"), ("friction", "x.py", "small letters"), ("friction", "a" * 41, "at most 40"),
        ("friction", "none", "neither"), ("friction", "coulomb", "exists already"), ("topology", "chain", "exists already"),
        ("oscillator", "lorenz", "exists already"), ("coupling", "spring", "exists already"), ("graph", "x", "invalid"),
    ],
)  # fmt: skip
def test_wrong_names(kind: str, name: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, name, "--dir", str(tmp_path)]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


# -- files from outside -------------------------------------------------------------------------------------


@pytest.fixture
def law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(plugins, "_allowed", set())
    assert main(["new", "friction", "my_law", "--dir", str(tmp_path)]) == 0
    return tmp_path / "my_law.py"


def test_a_path_is_run_only_where_it_is_allowed(law: Path) -> None:
    law.write_text("raise SystemExit('ran')\n" + law.read_text("utf-8"))
    with pytest.raises(ValueError, match="not run unasked"):
        Scene(friction=str(law))


def test_an_allowed_path_is_a_name(law: Path) -> None:
    plugins.allow_code(law)
    scene = Scene(friction=str(law), topology=chain(2))
    assert scene.parameters["mu_0"] == 0.3
    assert Scene.from_dict(scene.as_dict()) == scene
    with pytest.raises(ValueError, match="no file that ends in"):
        plugins.allow_code("none.py")


def test_a_scene_file_runs_code_only_with_the_option(law: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = law.parent / "own.toml"
    scene.write_text(f'friction = "{law.as_posix()}"\n')
    assert main(["equations", str(scene)]) == 2
    assert "--allow-code" in capsys.readouterr().err
    assert main(["equations", str(scene), "--allow-code", str(law)]) == 0
    assert "ε f(ϑ_b - χ')\nf(w) = 2 μ_0 atan(κ w)/(π (1 + |w|/w_0))\n" in capsys.readouterr().out
    assert main(["equations", str(scene), "--allow-code", str(law.parent)]) == 2


TROUBLE = ("1 +", "1/0", "return sp.nothing * mu_0 * sp.sign(w) / (1 + sp.Abs(w) / w_0)")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("import sympy as sp", "import sympy as sp\n1 +", "line 4: SyntaxError"),
        ("import sympy as sp", "import sympy as sp\n1/0", "line 4: ZeroDivisionError"),
        ("return mu_0", "return sp.nothing * mu_0", "line 25: AttributeError"),
        ("return mu_0", "return sp.Integer('deep in SymPy') * mu_0", "line 25: ValueError"),
        ("def force", "def strength", "no force"),
        ("def force(w: sp.Expr", "def force(z: sp.Expr", "asks for 'z'"),
    ],
)
def test_an_error_names_file_and_line(law: Path, old: str, new: str, words: str) -> None:
    law.write_text(law.read_text("utf-8").replace(old, new), encoding="utf-8")
    plugins.allow_code(law)
    line = next((k for k, text in enumerate(law.read_text("utf-8").splitlines(), 1) if text.strip() in TROUBLE), None)
    assert line is None or f"line {line}" in words
    with pytest.raises(ValueError, match=words) as caught:
        _ = Scene(friction=str(law)).equations
    assert "my_law" in str(caught.value)


def test_a_name_that_no_file_can_declare_is_not_asked_for_as_a_parameter() -> None:
    def potential(x_i: Any, sigma: Any) -> Any:
        return sigma * x_i

    known = {"q_i": 1, "q_j": 2, "weight": 3}
    with pytest.raises(ValueError, match=r"asks for 'x_i'; .*; the ends of a link are q_i, q_j .*; use these names$"):
        plugins.call(potential, {**known, "sigma": 4})
    with pytest.raises(ValueError, match=r"asks for 'sigma'; .*; correct the name or declare it as a parameter$"):
        plugins.call(potential, {**known, "x_i": 1})


def test_entry_points_are_plug_ins(law: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plugins.allow_code(law)
    module = plugins.load("friction", str(law))

    def broken() -> Any:
        raise RuntimeError("out of order")

    entries = {
        "from_elsewhere": SimpleNamespace(value="elsewhere:law", load=lambda: module),
        "broken": SimpleNamespace(value="elsewhere:broken", load=broken),
        "empty": SimpleNamespace(value="elsewhere:empty", load=lambda: SimpleNamespace()),
    }
    monkeypatch.setattr(plugins, "_entry_points", lambda kind: entries if kind == "friction" else {})
    assert "from_elsewhere" in plugins.names("friction")
    assert plugins.load("friction", "from_elsewhere") is module
    with pytest.raises(ValueError, match=r"elsewhere:broken.*test_new.py, line \d+: RuntimeError: out of order"):
        plugins.load("friction", "broken")
    with pytest.raises(ValueError, match="found no module"):
        plugins.load("friction", "empty")
    with pytest.raises(ValueError, match="unknown friction 'nope'; known: broken, coulomb"):
        plugins.load("friction", "nope")


def test_topologies_from_outside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By a path that was allowed, in a scene and on the command line; errors name file and line."""
    monkeypatch.setattr(plugins, "_allowed", set())
    assert main(["new", "topology", "my_graph", "--dir", str(tmp_path)]) == 0
    assert "plugins.allow_code" in capsys.readouterr().out
    path = tmp_path / "my_graph.py"
    with pytest.raises(ValueError, match="not run unasked"):
        topology(str(path), 5)
    assert main(["spectrum", str(path), "5"]) == 2
    assert main(["spectrum", str(path), "5", "--allow-code", str(path)]) == 0
    assert "5 eigenvalues" in capsys.readouterr().out
    graph = topology(str(path), 5)
    assert [(i, j) for i, j, _ in graph.links if i < j] == [(0, 1), (0, 2), (1, 2), (1, 3), (2, 3), (2, 4), (3, 4)]
    scene = Scene(topology=graph)
    assert Scene.from_dict(scene.as_dict()).topology == graph
    wrong = tmp_path / "wrong.py"
    wrong.write_text('SUMMARY, MINIMUM = "", 1\n\n\ndef edges(n):\n    yield 0, 1, 1 / (n - n)\n', encoding="utf-8")
    plugins.allow_code(wrong)
    with pytest.raises(ValueError, match=r"wrong.py, line 5: ZeroDivisionError"):
        _ = topology(str(wrong), 3).links
    wrong.with_name("none.py").write_text("MINIMUM = 1\n", encoding="utf-8")
    plugins.allow_code(wrong.with_name("none.py"))
    with pytest.raises(ValueError, match="found no SUMMARY, no edges; expected a topology file"):
        topology(str(wrong.with_name("none.py")), 3)


def test_topologies_of_entry_points_have_options_and_closed_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    from synchain.models.topologies import circulant

    entries = {"elsewhere": SimpleNamespace(value="elsewhere:ring", load=lambda: circulant)}
    monkeypatch.setattr(plugins, "_entry_points", lambda kind: entries if kind == "topology" else {})
    assert "elsewhere" in names()
    graph = topology("elsewhere", 10, offsets=(1, 3))
    assert graph.links == topology("circulant", 10, offsets=(1, 3)).links
    assert graph.spectrum.exact == topology("circulant", 10, offsets=(1, 3)).spectrum.exact
    assert Scene.from_dict(Scene(topology=graph).as_dict()).topology == graph


def test_the_groups_of_entry_points_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.metadata

    asked = []
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: asked.append(group) or [])
    plugins._entry_points.cache_clear()
    plugins.names("oscillator")
    plugins.names("topology")
    plugins._entry_points.cache_clear()
    assert asked == ["synchain.oscillators", "synchain.topologies"]

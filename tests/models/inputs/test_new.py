"""Starting files pass the tests of their kind; files from outside run only when allowed, and say where they fail."""

from __future__ import annotations

import importlib
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp
import test_frictions
import test_lagrangian
import test_network
import test_topologies
from parts import node

from synchain.graphs import chain
from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from synchain.models.graphs.families import TOPOLOGY, names, topology
from synchain.models.inputs import plugin_files
from synchain.models.mechanics.contact import ContactModel
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.runtime.cli import main

KINDS = {kind.name: kind for kind in (TOPOLOGY, FRICTION_LAW, OSCILLATOR, COUPLING)}
NAME = "my_own_part"


@pytest.fixture
def placed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """All four starting files, as if they lay in the folders of the package."""
    for name, kind in KINDS.items():
        assert main(["new", name, NAME, "--dir", str(tmp_path / name)]) == 0
        package = importlib.import_module(f"synchain.models.{kind.folder}")
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path / name)])
    yield NAME
    for name in [name for name in sys.modules if name.endswith(f".{NAME}")]:
        del sys.modules[name]


def test_the_starting_files_conform(placed: str) -> None:
    test_frictions.test_declarations(placed)
    test_frictions.test_parameters_have_no_name_of_an_oscillator_or_coupling(placed)
    test_frictions.test_odd(placed)
    test_frictions.test_drags_along_and_never_drives(placed)
    test_frictions.test_jump_is_finite_and_numbers_are_exact(placed)
    for contact in list(ContactModel)[:2]:
        test_frictions.test_units_cancel(placed, contact)
    for form in (test_lagrangian.physical, test_lagrangian.nondimensional):
        test_lagrangian.test_energy_balance_of_every_oscillator(placed, form)
    test_network.test_couplings_are_symmetric_and_called_sigma(placed)
    test_network.test_connectivity_of_one_way_links_is_the_jacobian_of_the_forces(placed)
    test_topologies.test_every_family_says_what_it_is_and_where_it_comes_from(placed)
    for n in (3, 4, 9):
        test_topologies.test_every_family_gives_a_connected_graph_with_zero_row_sums(placed, n)


def test_a_file_of_ones_own_comes_before_the_other_name_of_another(placed: str) -> None:
    kind = replace(TOPOLOGY, also={placed: "ring", "loop": "ring", "elsewhere": placed})
    assert plugin_files.named(kind, placed) == placed
    assert plugin_files.named(kind, "loop") == "ring"
    assert plugin_files.load(kind, "elsewhere") is plugin_files.load(TOPOLOGY, placed)


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
    ("kind", "name", "message"),
    [
        ("friction", "../x", "small letters"),
        ("friction", "lambda", "no word of Python"),
        ("friction", "X", "small"),
        ("friction", "_x", "small letters"),
        ("friction", "x.py", "small letters"),
        ("friction", "a" * 41, "at most 40"),
        ("friction", "none", "neither"),
        ("friction", "coulomb", "exists already"),
        ("topology", "chain", "exists already"),
        ("topology", "path", "exists already"),
        ("oscillator", "lorenz", "exists already"),
        ("coupling", "spring", "exists already"),
        ("graph", "x", "invalid"),
    ],
)
def test_wrong_names(kind: str, name: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, name, "--dir", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


# -- files from outside -------------------------------------------------------------------------------------


@pytest.fixture
def law(tmp_path: Path) -> Path:
    assert main(["new", "friction", "my_law", "--dir", str(tmp_path)]) == 0
    return tmp_path / "my_law.py"


def test_a_path_is_run_only_where_it_is_allowed(law: Path) -> None:
    law.write_text("raise SystemExit('ran')\n" + law.read_text("utf-8"))
    with pytest.raises(ValueError, match="not run unasked"):
        Scene(friction=str(law))


def test_an_allowed_path_is_a_name(law: Path) -> None:
    plugin_files.allow_code(law)
    scene = Scene(friction=str(law), topology=chain(2))
    assert scene.parameters["mu_0"] == 0.3
    assert Scene.from_dict(scene.as_dict()) == scene
    with pytest.raises(ValueError, match="no file that ends in"):
        plugin_files.allow_code("none.py")


def test_a_scene_file_runs_code_only_with_the_option(law: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = law.parent / "own.toml"
    scene.write_text(f'friction = "{law.as_posix()}"\n')
    assert main(["equations", str(scene)]) == 2
    assert "--allow-code" in capsys.readouterr().err
    assert main(["equations", str(scene), "--allow-code", str(law)]) == 0
    assert "ε f(ϑ_b - χ')\nf(w) = 2 μ_0 atan(κ w)/(π (1 + |w|/w_0))\n" in capsys.readouterr().out
    assert main(["equations", str(scene), "--allow-code", str(law.parent)]) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("from synchain", "1 +\nfrom synchain", "line 6: SyntaxError"),
        ("from synchain", "1/0\nfrom synchain", "line 6: ZeroDivisionError"),
        (
            "mu_0*sign",
            "nothing*mu_0*sign",
            "line 10: ValueError: friction law 'law': force: undeclared symbol 'nothing'",
        ),
        (
            "FRICTION = ",
            "LAW = ",
            r"found no FRICTION; expected FRICTION = friction_law\(…\); see: synchain new friction",
        ),
        (
            "    source=",
            "    strength=1,\n    source=",
            "line 10: TypeError: unknown keyword 'strength' of friction_law",
        ),
        ("sign(w)", "sign(z)", "undeclared symbol 'z'"),
    ],
)
def test_an_error_names_file_and_line(law: Path, old: str, new: str, message: str) -> None:
    law.write_text(law.read_text("utf-8").replace(old, new), encoding="utf-8")
    plugin_files.allow_code(law)
    with pytest.raises(ValueError, match=message) as caught:
        _ = Scene(friction=str(law)).equations
    assert "my_law" in str(caught.value)


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[dict[str, str], str], None]]:
    """A function that installs a package: its modules by name, and its entry points."""
    path = tmp_path / "site"
    monkeypatch.syspath_prepend(path)
    added = []

    def install(modules: dict[str, str], entries: str) -> None:
        record = path / "elsewhere-1.0.dist-info"
        record.mkdir(parents=True)
        (record / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
        (record / "entry_points.txt").write_text(entries)
        for name, text in modules.items():
            (path / f"{name}.py").write_text(text, encoding="utf-8")
            added.append(name)

    yield install
    for name in added:
        sys.modules.pop(name, None)


def test_entry_points_are_plug_ins(law: Path, installed: Callable[[dict[str, str], str], None]) -> None:
    modules = {
        "elsewhere_law": law.read_text("utf-8"),
        "elsewhere_broken": 'raise RuntimeError("out of order")\n',
        "elsewhere_empty": "part = 3\n",
    }
    entries = "from_elsewhere = elsewhere_law\nbroken = elsewhere_broken\nempty = elsewhere_empty:part\n"
    installed(modules, f"[synchain.frictions]\n{entries}")
    assert "from_elsewhere" in plugin_files.names(FRICTION_LAW)
    assert plugin_files.load(FRICTION_LAW, "from_elsewhere") == replace(
        sys.modules["elsewhere_law"].FRICTION, name="from_elsewhere"
    )
    with pytest.raises(ValueError, match=r"elsewhere_broken.*elsewhere_broken.py, line 1: RuntimeError: out of order"):
        plugin_files.load(FRICTION_LAW, "broken")
    with pytest.raises(ValueError, match="found no module"):
        plugin_files.load(FRICTION_LAW, "empty")
    with pytest.raises(ValueError, match="unknown friction 'nope'; known: broken, coulomb"):
        plugin_files.load(FRICTION_LAW, "nope")


def test_topologies_from_outside(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By a path that was allowed, in a scene and on the command line; errors name file and line."""
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
    wrong.write_text(
        "from synchain.plugins import Family\ndef edges(n):\n    yield 0, 1, 1 / (n - n)\nTOPOLOGY = Family(edges, 1)\n"
    )
    plugin_files.allow_code(wrong)
    with pytest.raises(ValueError, match=r"wrong.py, line 3: ZeroDivisionError"):
        _ = topology(str(wrong), 3).links
    wrong.with_name("none.py").write_text("MINIMUM = 1\n", encoding="utf-8")
    plugin_files.allow_code(wrong.with_name("none.py"))
    with pytest.raises(
        ValueError, match=r"none.py: found no TOPOLOGY; expected TOPOLOGY = Family\(edges, minimum=…\);"
    ):
        topology(str(wrong.with_name("none.py")), 3)


def test_topologies_of_entry_points_have_options_and_closed_forms(
    installed: Callable[[dict[str, str], str], None],
) -> None:
    installed({}, "[synchain.topologies]\nelsewhere = synchain.models.topologies.circulant\n")
    assert "elsewhere" in names()
    graph = topology("elsewhere", 10, offsets=(1, 3))
    assert graph.links == topology("circulant", 10, offsets=(1, 3)).links
    assert graph.spectrum.exact == topology("circulant", 10, offsets=(1, 3)).spectrum.exact
    assert Scene.from_dict(Scene(topology=graph).as_dict()).topology == graph


def test_the_groups_of_entry_points_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib.metadata

    asked = []
    monkeypatch.setattr(importlib.metadata, "entry_points", lambda group: asked.append(group) or [])
    monkeypatch.syspath_prepend("another place")
    plugin_files.names(OSCILLATOR)
    plugin_files.names(TOPOLOGY)
    assert asked == ["synchain.oscillators", "synchain.topologies"]


# -- a file is its text ---------------------------------------------------------------------------------------

HEAD = "from synchain import Field, Lagrangian, Parameter, friction_law, link_energy; from synchain.plugins import Family\n"
WELL = 'OSCILLATOR = Lagrangian("v**2/2", "x**2/2", coordinates={"x": "v"})\n'
PULL = 'COUPLING = link_energy("sigma*W*(q_i - q_j)**2/2", parameters={"sigma": Parameter(0.1, "N/m", "stiffness")})\n'
RUB = 'FRICTION = friction_law("c*w", {"c": Parameter(0.3, "s/m", "growth")})\n'
X = sp.Symbol("x", real=True)


def written(path: Path, text: str) -> str:
    """The path of a file with this text, allowed to run."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(HEAD + text, encoding="utf-8")
    plugin_files.allow_code(path)
    return str(path)


def test_an_edited_file_is_another_model_and_a_scene_keeps_its_own(tmp_path: Path) -> None:
    """Also where neither the length of the file nor its time tells of the change."""
    path = written(tmp_path / "well.py", WELL)
    stamp = os.stat(path).st_mtime
    first = Scene(oscillator=path)
    assert first.equations.node.rhs[1] == -X
    written(tmp_path / "well.py", WELL.replace("x**2", "x**4"))
    os.utime(path, (stamp, stamp))
    second = Scene(oscillator=path)
    assert second.equations.node.rhs[1] == -2 * X**3
    assert node(path).rhs[1] == -2 * X**3
    assert first != second
    assert first.replace(topology=chain(2), coupling="spring").equations.node.rhs[1] == -X
    assert first.replace(oscillator=path) == second
    assert Scene.from_dict(first.as_dict()) == second
    written(tmp_path / "well.py", WELL)
    assert Scene(oscillator=path) == first


def test_an_edited_law_coupling_or_group_of_nodes_is_another_model(tmp_path: Path) -> None:
    well, rub, pull = (
        written(tmp_path / f"{name}.py", text) for name, text in (("well", WELL), ("rub", RUB), ("pull", PULL))
    )

    def scene() -> Scene:
        nodes = [{"oscillator": "harmonic", "at": [1]}]
        coupling = f"{pull} on x"
        assert str(Scene(friction=rub).coupling) == "spring"
        return Scene(oscillator=well, nodes=nodes, coupling=coupling, topology=chain(2))

    before, law = scene(), Scene(friction=rub)
    digest = before.equations.digest
    written(tmp_path / "rub.py", RUB.replace("c*w", "2*c*w"))
    assert Scene(friction=rub).equations.digest != law.equations.digest
    written(tmp_path / "pull.py", PULL.replace("/2", "/8"))
    after = scene()
    assert after.equations.digest != digest
    written(tmp_path / "well.py", WELL.replace("x**2", "x**4"))
    assert scene().equations.digest not in (digest, after.equations.digest)
    assert before.replace(rtol=1e-6).equations.digest == digest


def test_one_relative_name_in_two_folders_is_two_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A star must not get the spectrum of a chain, whatever the names of their files."""
    edges = "TOPOLOGY = Family(lambda n: (({}, i, 1) for i in range(1, n)), 1, count=lambda n: n - 1)\n"
    graphs, scenes = [], []
    for folder, first, power in (("a", "0", "x**2"), ("b", "i - 1", "x**4")):
        written(tmp_path / folder / "graph.py", edges.format(first))
        written(tmp_path / folder / "well.py", WELL.replace("x**2", power))
        monkeypatch.chdir(tmp_path / folder)
        graphs.append(topology("./graph.py", 5))
        scenes.append(Scene(oscillator="./well.py"))
        assert graphs[-1].spectrum.exact == topology("star" if folder == "a" else "chain", 5).spectrum.exact
    assert graphs[0] != graphs[1]
    assert len({*graphs}) == 2
    assert [scene.equations.node.rhs[1] for scene in scenes] == [-X, -2 * X**3]
    assert graphs[0].links == topology("star", 5).links
    assert pickle.loads(pickle.dumps(scenes[0])) == scenes[0]


def test_another_process_has_the_model_that_a_scene_was_made_with_whatever_its_file_says(tmp_path: Path) -> None:
    path = written(tmp_path / "well.py", WELL)
    packed = tmp_path / "scene"
    packed.write_bytes(pickle.dumps(Scene(oscillator=path)))
    text = f"import pickle\nprint(pickle.load(open({str(packed)!r}, 'rb')).equations.node.rhs)"
    written(tmp_path / "well.py", WELL.replace("x**2", "x**4"))
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=240, check=False)
    assert done.stdout == "(v, -x)\n"


# -- a file assigns one value -----------------------------------------------------------------------------------


def test_every_plug_in_of_the_package_has_its_name_and_a_summary() -> None:
    for kind in KINDS.values():
        for name in plugin_files.names(kind):
            part = plugin_files.load(kind, name)
            assert isinstance(part, kind.types())
            assert part.name == name
            assert part.summary


def refusal(kind: str, path: Path, text: str) -> str:
    """Why a file is refused, without its folder."""
    with pytest.raises(ValueError) as caught:  # noqa: PT011  (the caller looks at the words)
        plugin_files.load(KINDS[kind], written(path, text))
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(f"{path.parent}{os.sep}", "")


OLD = {
    "oscillator": "FRICTION = False\nPARAMETERS = {}\ndef kinetic(v):\n    return v**2 / 2\n",
    "friction": "ODD = True\nPARAMETERS = {}\ndef force(w):\n    return w\n",
    "coupling": "PARAMETERS = {}\ndef potential(q_i, q_j, weight):\n    return weight * (q_i - q_j) ** 2\n",
    "topology": "SUMMARY, MINIMUM = 's', 1\ndef edges(n):\n    return []\n",
}
"""Files of constants and functions, which were plug-ins before files assigned a value."""


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_without_the_value_is_told_what_to_write(kind: str, tmp_path: Path) -> None:
    message = refusal(kind, tmp_path / "part.py", OLD[kind])
    assert message.startswith(
        f"part.py: found no {kind.upper()}; expected {kind.upper()} = {KINDS[kind].example}; see: "
    )
    message = refusal(kind, tmp_path / "part.py", f"{kind.upper()} = True\n")
    assert message.startswith(f"part.py: found {kind.upper()} = True; expected {kind.upper()} = ")


SCALED = (
    'OSCILLATOR = Lagrangian("m*v**2/2", "k*x**2/2", {"x": "-d*v"}, coordinates={"x": "v"},\n'
    '    parameters={"delta": Parameter(0.1, "kg/s", "damping")},\n'
    '    scaling={"physical": {"delta": "d"}, "units": {"m": "kg", "k": "N/m", "l": "m", "x": "m"},\n'
    '             "scales": {"kg": "m", "m": "l", "s": "sqrt(m/k)"}})\n'
)
FAMILY = (
    "def edges(n, *, step=1):\n    return ((i, i + step, 1) for i in range(n - step))\n"
    "def settle(n, step):\n    return {'step': step}\nTOPOLOGY = Family(edges, 1, settle=settle)\n"
)


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        ("oscillator", WELL.replace('"x**2/2"', '"x**2/2", forces={}'), "line 2: TypeError: unknown keyword 'forces'"),
        ("oscillator", WELL.replace("})", "}, parameters={'d': 1})"), "no expression has the parameter 'd'; use it or"),
        ("oscillator", SCALED.replace("-d*v", "-v"), "no expression has the parameter 'delta' (d in the expressions)"),
        (
            "oscillator",
            SCALED.replace('"kg": "m", ', ""),
            "found scales of 'm', 's'; expected those of 'kg', 'm' and 's'",
        ),
        ("oscillator", SCALED.replace('"m": "kg"', '"m": 1'), "unit of m: found 1 (int); expected text"),
        ("oscillator", SCALED.replace('"delta": "d"', '"dleta": "d"'), "physical: unknown key 'dleta'; known: delta"),
        ("oscillator", SCALED.replace('"d"}', '"k"}'), "the name 'k' stands for two quantities; rename one"),
        (
            "oscillator",
            SCALED.replace('"units"', '"unit"'),
            "scaling: unknown key 'unit'; known: units, scales, physical",
        ),
        ("oscillator", WELL.replace("})", "}, initial={'y': 1})"), "initial has the key 'y'; expected x, v"),
        ("friction", RUB.replace("})", "}, order=[('c', 'd')])"), "order names 'd'; expected parameters: c"),
        ("friction", RUB.replace('"s/m"', "1"), "line 2: TypeError: unit 1 is a int; expected text such as 'N/m'"),
        ("coupling", PULL.replace("sigma*W", "W"), "no expression has the parameter 'sigma'"),
        ("coupling", PULL.replace("*W", ""), "no energy has the weight W of a link; expected it as a factor"),
        ("coupling", PULL.replace("*W", "*W*x_i"), "V: energy: undeclared symbol 'x_i'; declared: q_i, q_j, sigma, W"),
        (
            "coupling",
            PULL.replace("parameters", "between={'clock': ['q_i'], 'beam': ['q_j', 'q_i']}, parameters"),
            "between has the state 'q_i' twice; expected states of different names",
        ),
        (
            "coupling",
            PULL.replace("parameters", "between={'clock': ['x']}, parameters"),
            "expected two oscillators and",
        ),
        ("coupling", PULL.replace('"sigma"', '"W"'), "the name 'W' stands for two things; rename the parameter"),
        ("topology", FAMILY.replace("step=1", "step"), "line 6: ValueError: the option 'step' of edges has no default"),
        ("topology", FAMILY.replace(", settle=settle", ""), "found no settle for the options step; expected one"),
        ("topology", FAMILY.replace("1, s", "1, count=lambda n: n, s"), "count lacks the option 'step' of edges"),
        (
            "topology",
            FAMILY.replace("(n, step)", "(n, step, size)"),
            "settle has the argument 'size', which is no option",
        ),
        ("topology", FAMILY.replace("edges, 1", "edges, '1'"), "minimum is '1'; expected the smallest number of nodes"),
    ],
)
def test_a_wrong_value_is_refused_in_one_line(kind: str, text: str, message: str, tmp_path: Path) -> None:
    assert message in refusal(kind, tmp_path / "part.py", text)


def test_wrong_answers_of_a_family_are_those_of_its_file(tmp_path: Path) -> None:
    spectrum = FAMILY.replace("1, settle", "1, spectrum=spectrum, settle")
    for returned, message in (
        ("[(0, n)]", "family.py: spectrum of .*: correct the closed form"),
        ("[1, 2]", r"family.py: spectrum\(3\) has 1; expected a list of \(eigenvalue, multiplicity\)"),
        ("1 / 0", r"family.py, line 3: ZeroDivisionError"),
    ):
        path = written(tmp_path / "family.py", f"def spectrum(n, *, step=1):\n    return {returned}\n{spectrum}")
        with pytest.raises(ValueError, match=message):
            _ = topology(path, 3).spectrum
    path = written(tmp_path / "family.py", FAMILY.replace("return {'step': step}", "return step.nothing"))
    with pytest.raises(ValueError, match=r"family.py, line 5: AttributeError"):
        topology(path, 3)
    path = written(tmp_path / "family.py", FAMILY.replace("return {'step': step}", "pass"))
    with pytest.raises(ValueError, match="settle returns None; expected a dict of the options"):
        topology(path, 3)


def test_a_file_may_assign_rates_and_potentials_of_links(tmp_path: Path) -> None:
    path = written(
        tmp_path / "pull.py",
        "from synchain import Rates\nCOUPLING = Rates({'x': 'k*W*(x_j - x_i)'}, {'k': 0.1})\n",
    )
    scene = Scene("rossler", path, chain(2))
    assert Scene.from_dict(scene.as_dict()) == scene
    assert scene.as_dict()["coupling"]["rates"] == {"x": "W*k*(-x_i + x_j)"}
    with pytest.raises(ValueError, match="has no energies of coordinates; leave out 'on'"):
        Scene("rossler", f"{path} on x", chain(2))


# -- paths ----------------------------------------------------------------------------------------------------


def test_a_file_that_does_not_exist_is_said_to_be_missing() -> None:
    with pytest.raises(ValueError, match=r"friction '\./none\.py': no such file: .*none\.py; expected a \.py file"):
        Scene(friction="./none.py")


def test_paths_in_a_scene_file_start_in_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "study"
    written(folder / "well.py", WELL)
    written(folder / "pull.py", PULL)
    written(folder / "family.py", FAMILY)
    (folder / "own.toml").write_text(
        'oscillator = "./well.py"\ncoupling = "pull.py on x"\n[topology]\nname = "family.py"\nn = 3\nstep = 2\n'
        '[[nodes]]\noscillator = "./well.py"\nat = [2]\n'
    )
    monkeypatch.chdir(tmp_path)
    scene = load_scene("study/own.toml")
    assert scene.equations.node.rhs[1] == -X
    assert scene.topology.link_count == 2
    assert Scene.from_dict(scene.as_dict()) == scene

"""Hostile files and surroundings, and wrong physics: one clear line each, nothing run, nothing touched, no time lost."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
import sympy as sp
from catalogue import FUZZ_SECONDS
from effort import effort
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from parts import edge

from synchain.models.claims.language import read_claims
from synchain.models.claims.verdict import verify
from synchain.models.graphs import readers
from synchain.models.graphs.families import family, topology
from synchain.models.graphs.symbolic import weight
from synchain.models.inputs import plugin_files
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.runtime.cli import main


def law(folder: Path, body: str, name: str = "law.py") -> str:
    """The path of a file of one's own, allowed to run."""
    head = "from synchain import Lagrangian, Parameter, friction_law, link_energy\n"
    path = folder / name
    path.write_text(head + textwrap.dedent(body))
    plugin_files.allow_code(path)
    return str(path)


# -- wrong physics -------------------------------------------------------------------------------------------

AGAINST = 'FRICTION = friction_law("-c*w", {"c": Parameter(0.3, "s/m", "growth")})\n'


def test_friction_that_feeds_energy_is_refused_unless_it_says_so(tmp_path: Path) -> None:
    wrong = law(tmp_path, AGAINST)
    with pytest.raises(ValueError, match=r"feeds energy; expected w f\(w\) >= 0; turn the sign of the force"):
        Scene(friction=wrong)
    Scene(friction=wrong, parameters={"c": -0.3})
    with pytest.raises(ValueError, match="feeds energy"):
        Scene(friction=wrong, parameters={"c": -0.3}, axes={"c": [-0.3, 0.1]})
    declared = law(tmp_path, AGAINST.replace(")})", ")}, self_exciting=True)"), "declared.py")
    assert Scene(friction=declared).parameters["c"] == 0.3


def test_a_law_with_the_wrong_unit_is_refused(tmp_path: Path) -> None:
    wrong = law(tmp_path, AGAINST.replace('"s/m"', '"s"').replace("-c*", "c*"))
    with pytest.raises(ValueError, match=r"does not cancel in .*; check the units of the parameters"):
        Scene(friction=wrong)


def test_a_law_with_an_unknown_symbol_is_refused(tmp_path: Path) -> None:
    wrong = law(tmp_path, AGAINST.replace("-c*w", "c*w*q"))
    with pytest.raises(ValueError, match="undeclared symbol 'q'"):
        Scene(friction=wrong)


MASS = """
    OSCILLATOR = Lagrangian("mass*v**2/2", "x**2/2", coordinates={"x": "v"},
                            parameters={"mass": Parameter(1.0, "1", "mass")})
"""


def test_masses_must_be_positive(tmp_path: Path) -> None:
    body = law(tmp_path, MASS, "body.py")
    assert Scene(oscillator=body).parameters["mass"] == 1.0
    for value in (0.0, -1.0):
        with pytest.raises(ValueError, match="kinetic energy not positive"):
            Scene(oscillator=body, parameters={"mass": value})
    with pytest.raises(ValueError, match="kinetic energy not positive"):
        Scene(oscillator=body, axes={"mass": [1.0, -0.5]})


PULL = """
    COUPLING = link_energy("sigma*W*(q_i + q_j)**2/2", parameters={"sigma": Parameter(0.1, "N/m", "stiffness")})
"""


def test_a_coupling_that_does_not_vanish_between_equals_is_said(tmp_path: Path) -> None:
    pull = law(tmp_path, PULL, "pull.py")
    messages = Scene(topology=topology("chain", 4), coupling=pull).warnings
    assert any("does not vanish between oscillators in equal states" in warning for warning in messages)
    assert not any(
        "does not vanish" in warning for warning in Scene(topology=topology("ring", 4), coupling=pull).warnings
    )
    assert not edge(pull, Scene().equations.node, "friction").diffusive
    assert Scene(topology=topology("ring", 4)).warnings == ()


# -- files ---------------------------------------------------------------------------------------------------

HUGE = {
    "cells": ("[sweep]\nsigma = {from = 0, to = 1, count = 10000}\nomega = {from = 1, to = 2, count = 10000}\n"
        "u = {from = 0, to = 1, count = 10000}",
              "at most 1000000000"),
    "samples": ('record = ["trajectory"]\nsamples = 1000000\n[sweep]\nomega = {from = 1, to = 2, count = 10000}',
                "trajectory: found"),
    "nodes": ("[topology]\nname = 'chain'\nn = 1000000000000", "100000"),
    "links": ("contact = 'set-valued'\n[topology]\nname = 'complete'\nn = 100000", "too many links"),
    "power": ("[parameters]\nomega = '9**9**9'", "expected"),
    "digits": ("[parameters]\nomega = " + "9" * 5000, "too long a value"),
    "depth": ("[parameters]\nomega = " + "[" * 20000 + "]" * 20000, "too deep"),
    "links of a complete graph": ("contact = 'set-valued'\n[topology]\nname = 'complete'\nn = 4400", "at most 4000000"),
    "degree": ("[topology]\nname = 'random_regular'\nn = 100000\ndegree = 99998", "at most 4000000"),
    "neighbours": ("[topology]\nname = 'small_world'\nn = 99999\nneighbours = 99998",
                   "random numbers; expected at most 10000000"),
    "close neighbours": ("[topology]\nname = 'small_world'\nn = 1900\nneighbours = 1898\np = '1'",
                         "about 3424086900 random numbers; expected at most 10000000"),
    "chances": ("[topology]\nname = 'erdos_renyi'\nn = 100000\np = '1'", "at most 4000000"),
    "axes": ("[sweep]\n" + "".join(f"a{i} = {{from = 0, to = 1, count = 10000000}}\n" for i in range(20)),
             "at most 1000000000"),
    "zipped axes": ("zipped = true\n[sweep]\n" + "".join(f"a{i} = {{from = 0, to = 1, count = 10000000}}\n"
                                                        for i in range(20)), "values on 20 axes together"),
    "key": (".".join("a" * 20000) + " = 1", "line 1 has a key of more than 8 parts"),
    "quoted key": ("[parameters]\nomega = 1\n['a'" + " . \"a\"" * 20000 + "]", "line 3 has a key of more than 8 parts"),
    "key in a table": ("parameters = {" + ".".join("a" * 20000) + " = 1}", "line 1 has a key of more than 8 parts"),
    "long key": (f"[{'a' * 90000}]\n[{'a' * 90000}]", "not TOML"),
    "escape sequence": ("title = \"\\u001b]0;owned\\u0007\"", r"the control character '\x1b'"),
    "direction": ("title = \"\\u202etxt.exe\"", r"the control character '\u202e'"),
    "name of a graph": ("[topology]\nname = \"\\u009b2J\"\nmatrix = [[-1, 1], [1, -1]]", r"the control character '\x9b'"),
    "not a number": ("[parameters]\nomega = nan", "finite"),
    "infinite": ("[initial]\nx = inf", "finite"),
    "twice": ("rtol = 1e-8\nrtol = 1e-9", "not TOML"),
    "code": ("[parameters]\nomega = \"__import__('os').system('touch here')\"", "expected"),
    "a file of code": ("oscillator = './evil.py'", "allow"),
    "a device": ("[topology]\nfile = '/dev/zero'", "device"),
    "a pipe": ("[topology]\nfile = 'pipe'", "device"),
    "a folder": ("[topology]\nfile = '.'", "folder"),
}  # fmt: skip


@pytest.mark.parametrize("name", HUGE)
def test_too_much_is_refused_at_once(name: str, tmp_path: Path, monkeypatch, capsys) -> None:
    text, part = HUGE[name]
    top, _, sweep = text.partition("[sweep]")
    first = top if "topology" in text or "sigma" not in text else "[topology]\nname = 'chain'\nn = 2\n" + top
    path = tmp_path / "scene.toml"
    path.write_text(first + (f"[sweep]{sweep}" if sweep else ""))
    (tmp_path / "evil.py").write_text("open('here', 'w')")
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.chdir(tmp_path)
    before = sorted(p.name for p in tmp_path.iterdir())
    assert main(["run", str(path), "--out", "out"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert len(lines[0]) < 1000
    assert part in lines[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == before


def test_dots_in_strings_comments_and_numbers_are_no_keys(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    title = "a.b.c.d.e.f.g.h.i.j.k"
    path.write_text(
        f"title = '{title}'  # {title}\n[initial]\nx = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]\n"
        "[topology]\nname = 'chain'\nn = 10\n"
    )
    assert load_scene(path).title == title


def test_long_axes_of_the_command_line_are_counted_before_they_are_built(tmp_path: Path, capsys) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("record = []\n")
    command = ["run", str(path), "--out", str(tmp_path / "out"), "--set", "omega=1:2:10000000", "x_1=0:1:10000000"]
    codes: list[int] = []
    _, calls = effort(lambda: codes.append(main(command)))
    assert codes == [2]
    assert "found 100000000000000 cells; expected at most 1000000000" in capsys.readouterr().err
    assert calls < 1_000_000


@pytest.mark.parametrize(
    ("options", "message"),
    [("--edges", "expected at most 4000 links"), ("--matrix", "more than 2000 rows or columns; expected at most 2000")],
)  # fmt: skip
def test_large_files_of_graphs_are_refused_by_their_size(
    options: str, message: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    assert readers.LINK_LIMIT == 4_000_000
    monkeypatch.setattr(readers, "LINK_LIMIT", 4000)
    path = tmp_path / "graph.txt"
    path.write_text("1 2\n" * 2001 if options == "--edges" else ("0 " * 2001 + "\n") * 2001)
    assert main(["spectrum", options, str(path)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_nodes_and_files_with_escape_sequences_are_refused(tmp_path: Path, capsys) -> None:
    nodes, graph, named = tmp_path / "nodes.txt", tmp_path / "graph.xml", tmp_path / "a\x1b[2J.txt"
    nodes.write_text("a\x1b[2J b\na\x1b[2J b\n")
    graph.write_text(
        '<graphml><graph><node id="&#x9b;2J"/><edge source="&#x9b;2J" target="&#x9b;2J"/></graph></graphml>'
    )
    named.write_text("a b\na b\n")
    for option, path, what in (
        ("--edges", nodes, r"nodes.txt: node name: found the control character '\x1b'"),
        ("--graphml", graph, r"graph.xml: node name: found the control character '\x9b'"),
        ("--edges", named, r"edge file: found the control character '\x1b'"),
    ):
        assert main(["spectrum", option, str(path)]) == 2
        error = capsys.readouterr().err
        assert what in error
        assert error.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    "entry",
    ["((((((a+b)**12)**12)**12)**12)**12)**12", "((((((9)**12)**12)**12)**12)**12)**12", "(a+b+c+d+e+f+g+h)**12"],
)
def test_symbolic_weights_are_measured_before_they_are_multiplied_out(entry: str) -> None:
    with pytest.raises(ValueError, match=r"more than (2000 terms|10000 bits)"):
        weight(entry, "w")
    assert weight("(a+b)**12", "w") == sp.expand(weight("a+b", "w") ** 12)
    assert weight("-" + "-".join(f"{a}*{b}*c" for a in "abde" for b in "fghi"), "w").is_Add


@pytest.mark.parametrize(
    "claim", ["erdos_renyi 2000: distinct = 3", "small_world 900000: distinct = 3", "random_regular 501: largest = -3"]
)
def test_claims_about_large_graphs_without_a_closed_form_are_refused_unbuilt(claim: str, tmp_path: Path) -> None:
    path = tmp_path / "claims.txt"
    path.write_text(claim)
    family(claim.split()[0])  # imports of its file are not counted

    def refused() -> None:
        (line,) = read_claims(path)
        with pytest.raises(ValueError, match="a graph without a closed form; expected at most 500 nodes"):
            verify(line[0])

    assert effort(refused)[1] < 10_000


VALUES = st.one_of(
    st.integers(-(10**20), 10**20).map(str), st.floats().map(lambda x: repr(x).replace("Infinity", "inf")),
    st.text(max_size=20).map(lambda s: repr(s)), st.sampled_from(["true", "[]", "{}", "[1, 2]", "'9**9**9'", "'2*pi'"]),
    st.text("0123456789+-*/().eEpisqrt ", max_size=40).map(lambda s: f"'{s}'"),
)  # fmt: skip
KEYS = st.sampled_from(
    ["n", "name", "omega", "sigma", "x", "v", "rtol", "window", "samples", "record", "from", "to", "count", "file"]
)
LINES = st.one_of(
    st.tuples(KEYS, VALUES).map(" = ".join),
    st.sampled_from(["[topology]", "[parameters]", "[initial]", "[sweep]", "[sweep.sigma]", "[[sweep]]", "\ufeff"]),
    st.text(max_size=30),
)
FILES = st.one_of(st.binary(max_size=200), st.lists(LINES, max_size=12).map(lambda rows: "\n".join(rows).encode()))


def refusal(path: Path) -> str:
    """Why a file is no scene, empty where it is one; anything but ValueError and TypeError goes through."""
    try:
        load_scene(path)
    except (ValueError, TypeError) as error:
        return str(error)
    return ""


def feed(folder: Path, examples: int) -> None:
    path = folder / "scene.toml"

    @settings(max_examples=examples, deadline=None, derandomize=FUZZ_SECONDS == 0, database=None,
              suppress_health_check=[HealthCheck.too_slow])  # fmt: skip
    @given(FILES)
    def check(content: bytes) -> None:
        path.write_bytes(content)
        line = refusal(path)
        assert line.startswith("scene.toml: ") or not line
        assert "\n" not in line
        assert len(line) < 1000
        assert [p.name for p in folder.iterdir()] == ["scene.toml"]

    check()


def test_any_file_is_a_scene_or_one_line(tmp_path: Path) -> None:
    end = time.monotonic() + FUZZ_SECONDS
    feed(tmp_path, 300)
    while time.monotonic() < end:
        feed(tmp_path, 1000)


# -- surroundings --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["C", pytest.param("tr_TR.UTF-8", marks=pytest.mark.long)])
def test_locale_time_zone_and_odd_paths_change_nothing(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a place with ünïcode"
    path.mkdir()
    scene = path / "my scène.toml"
    scene.write_text("title = 'ω'\nwindow = 0.5\ntransient = 0\nrecord = []\n", encoding="utf-8")
    assert main(["run", str(scene), "--out", str(path / "here")]) == 0
    environment = {**os.environ, "LC_ALL": name, "LANG": name, "TZ": "Asia/Kathmandu", "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "synchain.runtime", "run", str(scene), "--out", str(path / "there")]
    done = subprocess.run(command, env=environment, capture_output=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    (here,), (there,) = ((path / folder).glob("*.nc") for folder in ("here", "there"))
    assert here.read_bytes() == there.read_bytes()


def test_nothing_asks_the_network(tmp_path: Path, monkeypatch, capsys) -> None:
    def refuse(*arguments: object, **more: object) -> None:
        raise AssertionError("the network was asked")

    for name in ("connect", "connect_ex", "sendto"):
        monkeypatch.setattr(socket.socket, name, refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    with pytest.raises(AssertionError, match="the network was asked"):
        socket.create_connection(("localhost", 9))
    path = tmp_path / "scene.toml"
    path.write_text("window = 0.5\ntransient = 0\nrecord = []\n")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert main(["spectrum", "chain", "4"]) == 0

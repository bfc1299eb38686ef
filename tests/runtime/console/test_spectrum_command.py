"""`synchain spectrum` with options of families and files of edges, `synchain list graphs` with the
options.
"""

from __future__ import annotations

import json
from pathlib import Path

import networkx as nx
import pytest

from synchain.models.graphs.families import family, names
from synchain.runtime.cli import main


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[float, int]:
    assert main(["spectrum", "--json", *arguments]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["verified"] is True
    return {e["exact"]: e["multiplicity"] for e in answer["eigenvalues"]}


def test_options_of_a_family(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(capsys, "circulant", "6", "--option", "offsets=1,3") == {"0": 1, "-3": 4, "-6": 1}
    assert printed(capsys, "torus", "27", "--option", "shape=3x3x3") == {"0": 1, "-3": 6, "-6": 12, "-9": 8}
    assert printed(capsys, "johnson", "20", "--option", "k=3") == {"0": 1, "-6": 5, "-10": 9, "-12": 5}
    assert (
        printed(capsys, "kneser", "10") == printed(capsys, "generalized_petersen", "10") == {"0": 1, "-2": 5, "-5": 4}
    )
    assert (
        printed(capsys, "cycle", "6") == printed(capsys, "cayley_abelian", "6") == {"0": 1, "-1": 2, "-3": 2, "-4": 1}
    )
    generators = ("--option", "shape=4x4", "--option", "generators=1,0,0,1,1,1")
    assert printed(capsys, "cayley_abelian", "16", *generators) == {"0": 1, "-4": 6, "-8": 9}  # Shrikhande's graph
    assert printed(capsys, "erdos_renyi", "4", "--option", "p=1", "--option", "seed=2") == {"0": 1, "-4": 3}


def test_other_matrices(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(capsys, "petersen", "10", "--of", "adjacency") == {"3": 1, "1": 5, "-2": 4}
    assert printed(capsys, "star", "4", "--of", "laplacian") == {"4": 1, "1": 2, "0": 1}
    assert printed(capsys, "ring", "3", "--of", "signless_laplacian") == {"4": 1, "1": 2}
    assert printed(capsys, "chain", "4", "--of", "random_walk_laplacian") == {"2": 1, "3/2": 1, "1/2": 1, "0": 1}
    assert main(["spectrum", "star", "5", "--of", "adjacency"]) == 0
    assert capsys.readouterr().err == ""  # 0 three times: no part of the graph is loose


def test_files_of_edges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    edges, graphml = tmp_path / "g.edges", tmp_path / "g.graphml"
    edges.write_text("1 2\n2 3\n")
    assert printed(capsys, "--edges", str(edges)) == {"0": 1, "-1": 1, "-3": 1}
    assert printed(capsys, "--edges", str(edges), "--directed") == {"0": 1, "-1": 2}
    nx.write_graphml(nx.petersen_graph(), graphml)
    assert printed(capsys, "--graphml", str(graphml)) == {"0": 1, "-2": 5, "-5": 4}


WRONG = [
    ("circulant 9 --option offsets", "--option: found 'offsets'; expected NAME=VALUE, e.g. offsets=1,3"),
    ("circulant 9 --option =1", "expected NAME=VALUE"),
    ("circulant 9 --option offsets=x", "offsets = 'x'; expected a whole number"),
    ("circulant 9 --option offset=1", "unknown option 'offset'; known: offsets"),
    ("circulant 9 --option offsets=1 --option offsets=2", "--option offsets is given twice"),
    (
        "johnson 11",
        "n = 11 with k = 2; expected a number of 2-subsets, such as 10 (of a set of 5) or 15 (of a set of 6)",
    ),
    ("paley 21 ", "n = 21; expected a prime power that leaves 1 on division by 4, such as 17 or 25"),
    ("one_way_ring 4 --of signless_laplacian", "found one-way links, first from 2 to 1; expected an undirected graph"),
    ("chain 4 --of incidence", "invalid choice: 'incidence'"),
    ("chain --of adjacency --symbolic", "found --of with --symbolic"),
    ("erdos_renyi 9 --option p=2", "p = 2; expected a probability from 0 to 1"),
    ("--edges {file} --graphml {file}", "found --edges and --graphml; expected one of them"),
    ("--edges {file} --option p=1", "found both a topology and --edges; expected one of them"),
    ("--graphml {file} --directed", "found --directed without --edges"),
    ("chain 4 --directed", "found --directed without --edges"),
    ("--graphml {file}", "g.txt is no XML"),
    ("--edges {folder}/none", "does not exist"),
    ("--edges {file}", "line 1 has 4 words"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_wrong_words(text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "g.txt").write_text("a b c d\n")
    with_paths = text.format(file=tmp_path / "g.txt", folder=tmp_path).split()
    try:
        code = main(["spectrum", *with_paths])
    except SystemExit as end:
        code = int(str(end.code))
    assert code == 2
    assert message in capsys.readouterr().err


def test_topologies_name_their_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "graphs"]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert set(lines) == set(names())
    assert lines["small_world"].endswith("; options: neighbours, p, seed")
    for name in names():
        assert ("options: " in lines[name]) == bool(family(name).options)

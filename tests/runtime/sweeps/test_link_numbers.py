"""Links with numbers of their own: parameters, weights that are drawn, and what they are refused for."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from catalogue import LAGGING, PHASE
from scipy.integrate import solve_ivp

from synchain import (
    Field,
    Potential,
    Rates,
    Scene,
    cluster_exponents,
    ends,
    exponents,
    lyapunov_spectrum,
    msf,
    plane,
    thresholds,
    universal_probe,
)
from synchain.draw import normal, uniform
from synchain.graphs import Topology, chain, complete, erdos_renyi, from_edges, one_way_ring, ring
from synchain.models.definitions.loader import load_oscillator
from synchain.models.inputs.names import LinkName
from synchain.models.scenes.file import load_scene
from synchain.runtime.results.open import open_result
from synchain.runtime.sweeps.run import run
from synchain.runtime.sweeps.stream import stream

LONG = pytest.mark.long
DICE = np.random.default_rng(5)
K, REST, C = sp.symbols("K rest c")
EXACT: dict[str, Any] = {"transient": 0, "window": 10, "time_unit": "time", "rtol": 1e-11, "record": []}

i, j, W = ends(load_oscillator("harmonic"))
RESTING = Potential(K * W * ((i.x - j.x) ** 2 / 2 + REST * sp.cos(i.x - j.x)), {K: 0.1, REST: 0})
DAMPED = Rates({i.v: C * W * (j.v - i.v)}, {C: 0.1})


def edges_of(graph: Topology) -> list[tuple[int, int]]:
    return [(i, j) for i, j, _ in graph.links if i < j]


def lagging(n: int) -> tuple[Scene, Callable[[float, np.ndarray], np.ndarray]]:
    """Phases with a lag of each link, there and back another one."""
    graph = erdos_renyi(n, p=0.6, seed=4)
    lags, frequencies, start = DICE.uniform(-1, 1, len(graph.links)), DICE.normal(size=n), DICE.uniform(-3, 3, n)

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        rates = frequencies.copy()
        for (a, b, _), lag in zip(graph.links, lags, strict=True):
            rates[a] += np.sin(y[b] - y[a] - lag)
        return rates

    values = {"omega": frequencies, "lag": lags}
    return Scene(PHASE, LAGGING, graph, parameters=values, initial={"theta": start}, **EXACT), rhs


def springs(n: int) -> tuple[Scene, Callable[[float, np.ndarray], np.ndarray]]:
    """Springs with a strength and a rest length of each edge, and dampers with a number of each link of another graph."""
    first, second = erdos_renyi(n, p=0.6, seed=4), ring(n)
    pairs = edges_of(first)
    k, lengths, c = DICE.uniform(0.1, 1, len(pairs)), DICE.uniform(-1, 1, len(pairs)), DICE.uniform(0, 0.3, 2 * n)

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:n], y[n:]
        rates = -x
        for (a, b), strength, length in zip(pairs, k, lengths, strict=True):
            gap = x[a] - x[b]
            pull = strength * (gap - length * np.sin(gap))
            rates[a] -= pull
            rates[b] += pull
        for (a, b, _), damping in zip(second.links, c, strict=True):
            rates[a] += damping * (v[b] - v[a])
        return np.concatenate([v, rates])

    start = {"x": DICE.normal(size=n), "v": DICE.normal(size=n)}
    values = {"K": k, "rest": lengths, "c": c}
    layers = [(RESTING, first), (DAMPED, second)]
    return Scene("harmonic", links=layers, parameters=values, initial=start, **EXACT), rhs


@pytest.mark.parametrize(
    ("make", "n"),
    [(lagging, 3), (springs, 11), pytest.param(lagging, 11, marks=LONG), pytest.param(springs, 5, marks=LONG)],
)
def test_each_link_has_its_number(make: Callable[[int], tuple[Scene, Any]], n: int) -> None:
    """Written-out and looped steps of every family against SciPy's DOP853 on right-hand sides that were written by hand."""
    scene, rhs = make(n)
    exact = solve_ivp(rhs, (0, 10), scene.y0, method="DOP853", rtol=2.3e-14, atol=1e-14).y[:, -1]
    for method in ("dop853", "taylor", "rodas5p"):
        result = run(scene.replace(integrator=method), show_progress=False)
        np.testing.assert_allclose(result.end.values.ravel(), exact, rtol=0, atol=2e-10)


CASES: dict[str, dict[str, Any]] = {
    "set-valued": {"oscillator": "friction", "contact": "set-valued", "record": ["section"]},
    "inerter": {"oscillator": "duffing", "coupling": "inerter", "integrator": "dop853"},
    "mixed": {"oscillator": "van_der_pol", "coupling": "x->x", "nodes": [{"oscillator": "lorenz", "at": [2, 3]}]},
    "driven": {"oscillator": "duffing", "coupling": "damper", "integrator": "taylor"},
}


LINES, LOOPS = ("set-valued",), ("inerter", "mixed")
"""Cases whose written-out steps, and whose looped ones, are tested by default; the others take as long again."""


@pytest.mark.parametrize(
    ("name", "n"),
    [
        pytest.param(name, n, marks=() if name in own else LONG)
        for own, n in ((LINES, 3), (LOOPS, 10))
        for name in CASES
    ],
)
def test_numbers_of_links_are_weights_of_the_graph(name: str, n: int) -> None:
    """Strengths of edges at run time move a network as exact weights do: contacts, inertia, several kinds, drives."""
    pairs = edges_of(ring(n))
    sizes = [0.5 + 0.125 * k for k in range(n)]
    weighted = from_edges([(*pair, size) for pair, size in zip(pairs, sizes, strict=True)])
    settings = {**EXACT, "window": 5, "rtol": 1e-10, **CASES[name]}
    first = run(Scene(topology=weighted, parameters={"sigma": 0.5}, **settings), show_progress=False)
    second = run(
        Scene(topology=ring(n), parameters={"sigma": [0.5 * s for s in sizes]}, **settings), show_progress=False
    )
    np.testing.assert_allclose(second.end.values, first.end.values, rtol=0, atol=1e-9)
    turned = run(second.scene.replace(parameters={"sigma": [0.5 * s for s in reversed(sizes)]}), show_progress=False)
    assert np.nanmax(np.abs(turned.end.values - first.end.values)) > 1e-5


def test_numbers_are_given_in_several_forms(tmp_path: Path) -> None:
    """A list by edges or by links, a matrix, a graph and single names are one scene, which files keep."""
    graph, values = chain(4), [0.1, 0.2, 0.3]
    scene = Scene("harmonic", "spring", graph, parameters={"sigma": values}, integrator="dop853", **EXACT)
    assert [scene.parameters[f"sigma_{k}_{k + 1}"] for k in (1, 2, 3)] == values
    matrix = np.diag(values, 1) + np.diag(values, -1)
    weighted = from_edges([(k, k + 1, number) for k, number in enumerate(values)])
    single = {"sigma": 0.1, "sigma_2_3": 0.2, "sigma_3_4": 0.3}
    for weights in ([0.1, 0.1, 0.2, 0.2, 0.3, 0.3], matrix, matrix.tolist(), weighted):
        assert scene.replace(parameters={"sigma": weights}) == scene
    assert scene.replace(parameters=single).parameters == scene.parameters
    assert scene.replace(sigma=0.5) == scene.replace(parameters={"sigma": 0.5})
    assert scene.replace(sigma_2_3=0.7).parameters["sigma_2_3"] == 0.7
    scene.save(tmp_path / "links.toml")
    assert load_scene(tmp_path / "links.toml") == scene
    result = run(scene, show_progress=False, width=1, sigma_1_2=[0.1, 0.5])
    result.save(tmp_path / "found.nc")
    assert open_result(tmp_path / "found.nc").scene == result.scene
    one = run(scene.replace(sigma_1_2=0.5), show_progress=False, width=1)
    np.testing.assert_array_equal(result.end.values[1], one.end.values)


def test_lags_there_and_back_differ() -> None:
    """Rates have a number for each link, of an undirected graph too; a list of half as many serves both directions."""
    scene = Scene(PHASE, LAGGING, chain(3), parameters={"lag": [0.1, 0.2, 0.3, 0.4]}, **EXACT)
    assert [scene.parameters[f"lag_{name}"] for name in ("1_2", "2_1", "2_3", "3_2")] == [0.1, 0.2, 0.3, 0.4]
    both = scene.replace(parameters={"lag": [0.1, 0.4]})
    assert [both.parameters[f"lag_{name}"] for name in ("1_2", "2_1", "2_3", "3_2")] == [0.1, 0.1, 0.4, 0.4]
    (warning,) = scene.warnings
    assert "lag differs from link to link, so complete synchronisation is no solution" in warning
    assert not scene.replace(parameters={"lag": 0.3}, topology=ring(3)).warnings


RANDOM = Scene(
    "duffing", "spring", ring(10), parameters={"sigma": 0.4}, integrator="taylor",
    **{**EXACT, "window": 3, "rtol": 1e-10, "record": ["sync_error"]},
)  # fmt: skip
"""A scene on whose nodes weights and graphs are drawn; tests that give it one width share a kernel."""
DRAWN: dict[str, Any] = {"realisations": 20, "rng": 3, "show_progress": False}


def test_weights_are_drawn(tmp_path: Path) -> None:
    """Each realisation is the run on the graph of its weights; workers and other draws do not change it."""
    graph = erdos_renyi(10, p=0.5, seed=2)
    scene = RANDOM.replace(topology=graph)
    draws = {"W": uniform(0.5, 1.5)}
    result = run(scene, draws=draws, width=4, **DRAWN)
    names = [f"{a + 1}_{b + 1}" for a, b in edges_of(graph)]
    assert result.data.W.dims == ("realisation", "W_link")
    assert result.data.W_link.values.tolist() == names
    for k in (0, 7):
        listed = [
            (*pair, float(result.data.W.sel(W_link=name)[k])) for pair, name in zip(edges_of(graph), names, strict=True)
        ]
        one = run(scene.replace(topology=from_edges(listed, n=10)), show_progress=False, width=4)
        np.testing.assert_allclose(result.end.values[k], one.end.values, rtol=0, atol=1e-9)
    assert len(set(result.data.W.values.ravel().tolist())) == 20 * len(names)
    other = scene.replace(draws={"x_1": normal(0.0, 1.0), **draws}, realisations=20, rng=3)
    values = {axis.name: axis.values for axis in other.drawn}
    for name in names:
        assert values[f"W_{name}"] == tuple(result.data.W.sel(W_link=name).values.tolist())
    alone = run(scene, draws=draws, width=4, workers=1, **DRAWN)
    np.testing.assert_array_equal(alone.end, result.end)
    assert Scene.from_dict(result.scene.as_dict()) == result.scene
    assert run(result.scene, show_progress=False, width=4).end.identical(result.end)
    result.save(tmp_path / "whole.nc")
    assert open_result(tmp_path / "whole.nc").data.identical(result.data)
    assert stream(scene, tmp_path / "streamed.nc", draws=draws, width=4, **DRAWN).success
    assert (tmp_path / "streamed.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


def test_an_edge_draws_one_number_a_link_its_own() -> None:
    """Of an undirected graph links there and back draw the same number; single names and lists may part them."""
    phases = {"oscillator": PHASE, "coupling": LAGGING, "realisations": 4}
    both = {axis.name: axis.values for axis in Scene(topology=chain(3), draws={"lag": normal(0, 1)}, **phases).drawn}
    assert list(both) == ["lag_1_2", "lag_2_1", "lag_2_3", "lag_3_2"]
    assert both["lag_1_2"] == both["lag_2_1"] != both["lag_2_3"] == both["lag_3_2"]
    single = Scene(topology=chain(3), draws={"lag_2_1": normal(0, 1)}, **phases)
    assert [axis.name for axis in single.drawn] == ["lag_2_1"]
    assert single.parameters["lag_1_2"] == 0.0
    one_way = {axis.name for axis in Scene(topology=one_way_ring(3), draws={"W": normal(0, 1)}, **phases).drawn}
    assert one_way == {f"W_{a + 1}_{b + 1}" for a, b, _ in one_way_ring(3).links}
    rows = [[0.1 * k, 0.2 * k, 0.3 * k, 0.4 * k] for k in range(4)]
    listed = Scene(topology=chain(3), draws={"lag": rows}, **phases)
    assert {axis.name: axis.values[1] for axis in listed.drawn} == dict(zip(both, rows[1], strict=True))
    shared = Scene(topology=chain(3), draws={"lag": [0.1, 0.2, 0.3, 0.4]}, **phases)
    assert [axis.name for axis in shared.drawn] == ["lag"]


GRAPHS = [erdos_renyi(10, p=0.3, seed=k) for k in range(4)]


@pytest.mark.parametrize(
    ("oscillator", "coupling"), [("duffing", "spring"), pytest.param("rossler", "x->x", marks=LONG)]
)
def test_graphs_are_realisations(oscillator: str, coupling: str, tmp_path: Path) -> None:
    """Each realisation is the run on its graph to the last bit, links that it has not add nothing; files keep the graphs."""
    scene = RANDOM.replace(oscillator=oscillator, coupling=coupling)
    one_width = {"show_progress": False, "width": 4}
    result = run(scene, realisations=4, draws={"topology": GRAPHS}, sigma=[0.2, 0.4], **one_width)
    assert result.end.dims == ("sigma", "realisation", "component", "node")
    for k, graph in enumerate(GRAPHS):
        one = run(scene.replace(topology=graph), **one_width)
        np.testing.assert_array_equal(one.end.values, result.end.values[1, k])
        assert float(one.sync_error) == float(result.sync_error[1, k])
    assert len({float(error) for error in result.sync_error[1]}) == 4
    assert Scene.from_dict(result.scene.as_dict()) == result.scene
    assert result.scene.replace(draws=None, realisations=0, axes={}) == scene
    result.scene.save(tmp_path / "graphs.toml")
    assert load_scene(tmp_path / "graphs.toml") == result.scene
    result.save(tmp_path / "graphs.nc")
    assert open_result(tmp_path / "graphs.nc").scene == result.scene


def drawn(text: str, count: int = 4, rng: int = 3, **draws: Any) -> Scene:
    return RANDOM.replace(realisations=count, rng=rng, draws={"topology": text, **draws})


def members(scene: Scene) -> list[dict[tuple[int, int], float]]:
    """The weights of the links of each realisation, without zeros."""
    columns = {LinkName.parse(axis.name): axis.values for axis in scene.drawn if axis.name.startswith("W_")}
    return [
        {(name.target, name.source): values[k] for name, values in columns.items() if values[k]}
        for k in range(scene.realisations)
    ]


@pytest.mark.parametrize(
    ("text", "edges"),
    [
        ("erdos_renyi(10, p=0.3)", None),
        ("random_regular(10, degree=3)", 15),
        ("small_world(10, neighbours=4)", 20),
        ("weighted(random_regular(10, degree=3), 1/4)", 15),
        ("cartesian(erdos_renyi(5), erdos_renyi(2, p=1/2))", None),
    ],
)
def test_members_of_random_families_are_drawn(text: str, edges: int | None) -> None:
    """Each realisation has a member of its own, which `rng` and its number alone decide."""
    scene = drawn(text)
    graphs_drawn = members(scene)
    assert len({tuple(sorted(links)) for links in graphs_drawn}) > 1
    assert {len(links) for links in graphs_drawn} == {edges} or edges is None
    assert set().union(*(links.values() for links in graphs_drawn)) == (
        {0.25} if text.startswith("weighted") else {1.0}
    )
    assert members(drawn(text, 6, x=normal(0, 1)))[:4] == graphs_drawn
    assert members(drawn(text, rng=4)) != graphs_drawn
    graphs = scene.draws["topology"].graphs(4, 3).graphs
    assert [{(i, j) for i, j, _ in graph.links if i < j} for graph in graphs] == [set(links) for links in graphs_drawn]


def test_the_number_of_edges_is_that_of_the_family() -> None:
    """Mean over 500 members of 45 pairs with p = 0.3, within four standard errors; no two members are alike."""
    graphs = members(drawn("erdos_renyi(10, p=0.3)", 500))
    assert np.mean([len(links) for links in graphs]) == pytest.approx(13.5, abs=4 * (45 * 0.21 / 500) ** 0.5)
    assert len({tuple(sorted(links)) for links in graphs}) == 500


def test_runs_on_random_graphs_are_those_on_their_members(tmp_path: Path) -> None:
    scene = drawn("erdos_renyi(10, p=0.3)")
    one_width = {"show_progress": False, "width": 4}
    result = run(scene, **one_width)
    graphs = scene.draws["topology"].graphs(4, 3).graphs
    listed = run(RANDOM, realisations=4, draws={"topology": graphs}, **one_width)
    np.testing.assert_array_equal(result.end.values, listed.end.values)
    one = run(RANDOM.replace(topology=graphs[2]), **one_width)
    np.testing.assert_array_equal(one.end.values, result.end.values[2])
    assert result.scene.as_dict()["draws"] == {"topology": "erdos_renyi(10, p=0.3)"}
    assert Scene.from_dict(result.scene.as_dict()) == result.scene
    result.scene.save(tmp_path / "random.toml")
    assert load_scene(tmp_path / "random.toml") == result.scene
    result.save(tmp_path / "random.nc")
    opened = open_result(tmp_path / "random.nc")
    assert opened.scene == result.scene
    np.testing.assert_array_equal(opened.data.W.values, result.data.W.values)


@pytest.mark.parametrize("graphs", [GRAPHS, "erdos_renyi(10, p=0.3)"])
def test_scenes_with_drawn_graphs_can_be_changed(graphs: Any) -> None:
    scene = RANDOM.replace(realisations=4, draws={"topology": graphs})
    other = scene.replace(rtol=1e-5)
    assert (other.rtol, other.drawn, other.topology) == (1e-5, scene.drawn, scene.topology)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        (
            {"realisations": 2, "draws": {"topology": [chain(3), chain(4)]}},
            "found graphs of 3, 4 nodes; expected one number",
        ),
        (
            {"realisations": 3, "draws": {"topology": GRAPHS}},
            f"found {len(GRAPHS)} graphs; expected 3, one for each realisation",
        ),
        (
            {"realisations": 3, "draws": {"topology": itertools.repeat(ring(10))}},
            "found more than 3 graphs; expected 3, one for each realisation",
        ),
        (
            {"realisations": 4, "draws": {"topology": [chain(4)] * 4}},
            "found graphs of 4 nodes; expected graphs of 10 nodes",
        ),
        ({"realisations": 4, "draws": {"topology": GRAPHS, "W": uniform(0, 1)}}, "is drawn twice"),
        (
            {"realisations": 2, "draws": {"topology": [ring(10), one_way_ring(10)]}},
            "draw topology: found 1.0 and 0.0 at nodes",
        ),
        (
            {"realisations": 1, "draws": {"W": [[*range(1, 21)]]}},
            "draw W on ring(10): found 1.0 and 3.0 at nodes 1 and 2",
        ),
        ({"realisations": 4, "draws": {"topology": "ring"}}, "draw topology: unreadable graph 'ring'"),
        (
            {"realisations": 4, "draws": {"topology": "weighted(erdos_renyi(10), 1e999)"}},
            "found a weight beyond the range of numbers",
        ),
        (
            {"realisations": 4, "draws": {"topology": "ring(10)"}},
            "found 'ring(10)', the same graph in every realisation",
        ),
        ({"realisations": 4, "draws": {"topology": "erdos_renyi(10, seed=3)"}}, "found a seed; expected none"),
        (
            {"realisations": 4, "draws": {"topology": "erdos_renyi(10, q=3)"}},
            "draw topology: topology erdos_renyi: unknown",
        ),
        (
            {"realisations": 4, "draws": {"topology": "erdos_renyi(9)"}},
            "found graphs of 9 nodes; expected graphs of 10",
        ),
        ({"realisations": 4, "draws": {"topology": "__import__('os')"}}, "draw topology: unreadable graph"),
        ({"realisations": 4, "draws": {"topology": "erdos_renyi(2000000)"}}, "2000000 nodes; expected at most 1000000"),
        ({"realisations": 4, "draws": {"topology": {"name": "ring", "n": 10}}}, "or a random one as text"),
        (
            {"realisations": 5000, "topology": ring(200), "draws": {"topology": "erdos_renyi(200, p=0.9)"}},
            "in the union of the first 1 graphs, each with a weight in each of 5000 realisations; expected at most 10000000",
        ),
        (
            {"realisations": 300, "draws": {"topology": [erdos_renyi(300, p=0.3, seed=k) for k in range(3)] * 100}},
            "in the union of the first 2 graphs",
        ),
        (
            {"realisations": 4, "draws": {"topology": GRAPHS}, "coupling": Rates({i.v: sp.cos(W + j.x - i.x)})},
            "found a link that adds",
        ),
    ],
)
def test_wrong_graphs_are_refused(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=re.escape(message)) as error:
        Scene(**{"oscillator": "harmonic", "coupling": "spring", "topology": ring(10), **keywords})
    assert "\n" not in str(error.value)


CHAIN = Scene("rossler", "x->x", chain(3))


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"parameters": {"sigma": [1, 2, 3]}}, "parameter 'sigma' on chain(3): found 3 values for 4 links; expected 2 values, one for each edge, or one for"),
        ({"parameters": {"sigma": iter(range(9))}}, "found more than 4 values for 4 links"),
        ({"parameters": {"sigma": [[0, 1, 1], [1, 0, 1], [1, 1, 0]]}}, "a number without a link where node 1 feels node 3"),
        ({"parameters": {"sigma": [[0, 1], [1, 0]]}}, "expected a matrix of 3 rows of 3 numbers"),
        ({"parameters": {"sigma": one_way_ring(3)}}, "no number where node 2 feels node 1; expected one for each link, no others; a matrix may have the number 0"),
        ({"parameters": {"sigma": {0.1, 0.2}}}, "found a set, which has no order"),
        ({"parameters": {"sigma_1_3": 1.0}}, "unknown parameter 'sigma_1_3'; found no link where node 1 feels node 3; expected one of the 4, such as sigma_1_2, sigma_2_3, sigma_2_1"),
        ({"sigma_1_9": 1.0}, "unknown parameter 'sigma_1_9'; found no link where node 1 feels node 9; expected one of the 4, such as sigma_1_2"),
        ({"axes": {"W_3_1": [1.0]}}, "unknown axis 'W_3_1'; found no link where node 3 feels node 1"),
        ({"oscillator": "harmonic", "coupling": "spring", "parameters": {"sigma_2_1": 1}}, "expected 'sigma_1_2', the one number"),
        ({"parameters": {"W": [1, 2]}}, "the graph has the weights of links; expected an axis such as W_1_2 = [0.5, 1], or draws of W"),
        ({"parameters": {"W_1_2": 1.0}}, "the graph has the weights of links"),
        ({"axes": {"W": [1.0, 2.0]}}, "axis 'W': each link has a weight; expected that of one link, e.g. W_1_2"),
        ({"axes": {"sigma": [1.0]}, "parameters": {"sigma": [1, 2]}}, "expected the parameter of one, e.g. sigma_1_2"),
        ({"axes": {"W_1_2": [1.0]}, "realisations": 2, "draws": {"W": normal(0, 1)}}, "it is an axis as well"),
        ({"topology": complete(2000), "parameters": {"sigma_1_2": 1}}, "found numbers of 3998000 links; expected at most 1000000"),
        ({"realisations": 2, "draws": {"W": [[1.0] * 3] * 2}}, "draw W on chain(3): found 3 values for 4 links"),
        ({"realisations": 2, "draws": {"W": [np.ones((3, 3))] * 2}}, "draw W: found graphs or matrices; expected one number, or one for each"),
        ({"realisations": 2, "draws": {"sigma": [chain(3)] * 2}}, "draws of 'topology' take a graph, or its matrix, for each"),
        ({"realisations": 2, "draws": {"topology": [chain(3), ring(3)]}, "parameters": {"sigma": [1, 2, 3, 4]}},
         "parameter 'sigma' on union of 2 graphs(3): found 4 values for 6 links"),
        ({"oscillator": "harmonic", "coupling": "spring", "parameters": {"sigma": [1, 2, 3, 3]}}, "expected one number for both"),
        ({"oscillator": "mass", "coupling": "fput", "realisations": 2, "draws": {"W": normal(0, 1)}}, "tells the two ends"),
    ],
)  # fmt: skip
def test_wrong_numbers_are_refused(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=re.escape(message)) as error:
        CHAIN.replace(**keywords)
    assert "\n" not in str(error.value)


def test_a_run_says_which_links_there_are() -> None:
    with pytest.raises(
        ValueError, match=r"^run: unknown parameter 'sigma_1_3'; found no link where node 1 feels node 3;"
    ):
        run(CHAIN, sigma_1_3=[1.0, 2.0])
    with pytest.raises(
        ValueError, match=r"^run: unknown parameter 'sigma_2_1'; expected 'sigma_1_2', the one number of a"
    ):
        run(Scene("harmonic", "spring", chain(3)), sigma_2_1=1.0)


def test_graphs_of_networkx_are_numbers_of_links() -> None:
    """Not their nodes, which are numbers too and as many as the edges of a ring."""
    networkx = pytest.importorskip("networkx")
    graph = networkx.cycle_graph(4)
    networkx.set_edge_attributes(graph, {(0, 1): 5, (1, 2): 6, (2, 3): 7, (0, 3): 8}, "weight")
    parameters = Scene("harmonic", "spring", ring(4), parameters={"sigma": graph}).parameters
    assert parameters == {"sigma_1_2": 5, "sigma_2_3": 6, "sigma_3_4": 7, "sigma_1_4": 8}
    with pytest.raises(TypeError, match=r"mu_s: found .*Graph.*; expected a number"):
        Scene(topology=ring(4), parameters={"mu_s": graph})


def test_arrays_of_drawn_numbers_are_lists() -> None:
    rows = np.arange(8.0).reshape(2, 4)
    drawn = {how: CHAIN.replace(realisations=2, draws={"sigma": how_drawn}).drawn for how, how_drawn in
             {"array": rows, "arrays": list(rows), "lists": rows.tolist()}.items()}  # fmt: skip
    assert drawn["array"] == drawn["arrays"] == drawn["lists"]


def test_a_scene_with_drawn_graphs_is_changed() -> None:
    scene = Scene("harmonic", "spring", realisations=2, draws={"topology": [chain(3), ring(3)]})
    assert scene.replace(rtol=1e-6).drawn == scene.drawn
    assert scene.replace(parameters={"sigma": [1, 2, 3]}).parameters["sigma_1_3"] == 2


@pytest.mark.parametrize(
    "keywords",
    [{"parameters": {"K_1_2": 3}}, {"axes": {"K_1_2": [1.0]}}, {"draws": {"K_1_2": normal(0, 1)}, "realisations": 1}],
)
def test_a_name_of_a_node_and_of_a_link_is_refused(keywords: dict[str, Any]) -> None:
    node, link = Field({"x": "-K_1*x"}, parameters={"K_1": 1}), Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.1})
    with pytest.raises(ValueError, match="found 'K_1' of a node and 'K' of a link by this name"):
        Scene(node, link, chain(3), **keywords)


def test_weights_of_layers_are_not_drawn() -> None:
    layers = [("spring", chain(3)), (DAMPED, chain(3))]
    with pytest.raises(ValueError, match="draw W: found 2 layers of links; expected one whose weights are drawn"):
        Scene("harmonic", links=layers, realisations=2, draws={"W": normal(0, 1)})


@pytest.mark.parametrize("keywords", [{"parameters": {"sigma": [0.1, 0.2]}}, {"axes": {"W_1_2": [1.0]}}])
@pytest.mark.parametrize(
    ("function", "more"),
    [
        (msf, {"alpha": [0.1, 0.2]}), (plane, {"alpha": [0.1, 0.2], "beta": [0.0, 0.1]}), (thresholds, {}),
        (run, {"certified": True}),
    ],
)  # fmt: skip
def test_stability_refuses_links_that_differ(
    function: Callable[..., Any], more: dict[str, Any], keywords: dict[str, Any]
) -> None:
    """Modes of the graph are none of the network if its links differ in more than their exact weights."""
    message = r"links that differ in (sigma|W); expected|found axes of W_1_2; expected a scene without them"
    with pytest.raises(ValueError, match=message) as error:
        function(CHAIN.replace(**keywords), show_progress=False, **more)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("function", "more"),
    [
        (exponents, {"alpha": [0.1]}), (universal_probe, {"alpha": [0.1, 0.2], "beta": [0.0, 0.1]}),
        (cluster_exponents, {"state": [0, 1, 0]}),
    ],
)  # fmt: skip
def test_modes_of_one_strength_refuse_links_that_differ(function: Callable[..., Any], more: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="links that differ in sigma; expected"):
        function(CHAIN.replace(parameters={"sigma": [0.1, 0.2]}), show_progress=False, **more)


def test_lyapunov_exponents_take_them() -> None:
    """Two phases with lags of their own: the exponents of an equilibrium that rotates are 0 and -K (cos a + cos b)."""
    scene = Scene(PHASE, LAGGING, chain(2), parameters={"lag": [0.3, -0.2], "K": 0.4}, rtol=1e-9, window=50)
    result = lyapunov_spectrum(scene, show_progress=False)
    # the gap g between them obeys g' = K (sin(0.2 - g) - sin(g - 0.3)), which rests at g = 0.25
    assert result.exponent[0] == pytest.approx(0.0, abs=1e-6)
    assert result.exponent[1] == pytest.approx(-0.8 * np.cos(0.05), abs=1e-6)

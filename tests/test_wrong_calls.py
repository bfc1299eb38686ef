"""Wrong arguments of public functions: TypeError, ValueError or OSError in one line of words, before anything is run."""

from __future__ import annotations

import inspect
import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse
from catalogue import PAIR

import synchain
from synchain import Criterion, Scene, Section
from synchain.graphs import Spectrum, Topology, chain, star
from synchain.models.symmetries.clusters import clusters, orbital_partitions
from synchain.runtime.cells.run_keywords import Given
from synchain.runtime.results.energy_of_states import energy_function
from synchain.runtime.results.labelled import Labelled
from synchain.runtime.support.threads import worker_count
from synchain.runtime.synchronisation.agreement import agreement

ONE = Scene(oscillator="harmonic", transient=1, window=1)
ENERGY = energy_function(PAIR)
THREADS = ThreadPoolExecutor
NAN = math.nan

A_SCENE = "expected a Scene, e.g. load_scene"
A_GRAPH = r"expected a graph, e.g. chain\(4\)"

CALLS = [
    # models
    (lambda: synchain.Axis("a", np.ones((2, 2))), r"array of shape \(2, 2\); expected one row"),
    (lambda: synchain.Axis("a", [NAN]), "found nan; expected a finite number"),
    (lambda: PAIR.replace(parameters=3), r"parameters: found 3 \(int\); expected a table"),
    (lambda: PAIR.replace(simga=3), "unknown parameter or keyword 'simga'.*did you mean 'sigma'"),
    (lambda: PAIR.takes(3), "name: found 3"),
    (lambda: synchain.export.text(PAIR), r"text: found Scene.*expected equations, such as scene\.equations"),
    (lambda: synchain.export.latex(3), r"latex: found 3 \(int\); expected equations"),
    (lambda: synchain.graphs.joint_spectrum(chain(2)), r"joint_spectrum: found Topology.*expected several graphs"),
    (lambda: synchain.plugins.allow_code(3), "plug-in: found 3"),
    (lambda: Section(3), "section variable: found 3"),
    (lambda: Spectrum(3), "spectrum: found 3"),
    (lambda: Spectrum([3]), "expected an Eigenvalue"),
    (lambda: Topology("a", 2.5, ()), r"n = 2\.5; expected a whole number"),
    (lambda: Topology("a", True, ()), "n = True; expected a whole number"),
    (lambda: Topology("a", 3, 3), "links: found 3"),
    (lambda: Topology("a", 3, ((0, 1),)), r"link \(0, 1\); expected \(target, source, weight\)"),
    (lambda: Topology("a", 2, (("a", "b", Fraction(1)),)), r"expected \(target, source, weight\)"),
    (lambda: Topology(3, 2, ()), "topology name: found 3"),
    (lambda: synchain.graphs.cartesian(3, 4), f"cartesian: first: found 3.*{A_GRAPH}"),
    (lambda: synchain.graphs.cartesian(chain(3), "ring"), f"cartesian: second: found 'ring'.*{A_GRAPH}"),
    (lambda: synchain.graphs.kronecker(chain(3), None), f"kronecker: second: found None; {A_GRAPH}"),
    (lambda: synchain.graphs.union(3, chain(3)), f"union: first: found 3.*{A_GRAPH}"),
    (lambda: synchain.graphs.complement([(0, 1)]), "complement: found .*make one of a list with from_edges"),
    (lambda: synchain.graphs.weighted("chain", 2), f"weighted: found 'chain'.*{A_GRAPH}"),
    (lambda: synchain.graphs.from_edges(3), "expected a list of edges"),
    (lambda: synchain.graphs.ring(), r"^topology ring: found 0 arguments for n; expected ring\(n: int\)$"),
    (
        lambda: synchain.graphs.small_world(10, 4),
        r"^topology small_world: found 2 arguments for n; expected .*\*, neighbours=4,",
    ),
    (lambda: synchain.graphs.ring(3, n=4), "topology ring: found 2 arguments for n"),
    (lambda: synchain.graphs.from_edges([{0, 1}]), r"edge 1 is \{0, 1\}; expected \(i, j\)"),
    (lambda: synchain.graphs.from_edges([{"a": 1, "b": 2}]), "edge 1 is"),
    (lambda: synchain.graphs.from_edges([(0, 1)], directed="no"), "directed: found 'no'"),
    (lambda: synchain.graphs.from_edges([({0}, 1)]), r"node: found \{0\} \(set\); expected a label"),
    (lambda: synchain.graphs.from_matrix(scipy.sparse.eye(3)), "read by from_sparse"),
    (lambda: synchain.graphs.from_sparse(scipy.sparse.coo_array(np.ones(3))), "expected a square matrix"),
    (lambda: synchain.graphs.from_symbols(3), "is a int; expected rows"),
    (lambda: synchain.graphs.from_symbols([3]), "row 1 is 3"),
    (lambda: synchain.graphs.read_edges(3), "edge file: found 3"),
    (lambda: synchain.graphs.read_graphml(None), "GraphML file: found None"),
    (lambda: synchain.graphs.read_matrix(""), "matrix file: found ''"),
    (lambda: chain(2.5), r"n = 2\.5 is a float; expected an integer"),
    (lambda: chain(True), "n = True is a bool"),
    (lambda: clusters(chain(2), 3), "partition: found 3"),
    (lambda: clusters("chain", [0]), f"clusters: found 'chain'.*{A_GRAPH}"),
    (lambda: orbital_partitions(4), A_GRAPH),
    # sweeps
    (lambda: synchain.run("figure_4a"), f"found 'figure_4a'.*{A_SCENE}"),
    (lambda: synchain.run(Scene), A_SCENE),
    (lambda: synchain.run(PAIR, sigma=np.ones((2, 2))), "axis sigma: found an array of shape"),
    (lambda: synchain.run(PAIR, sigma=["a"]), "axis sigma: 'a'"),
    (lambda: synchain.run(PAIR, sigma=[NAN]), "axis sigma: found nan"),
    (lambda: synchain.run(PAIR, sigma=[None]), "axis sigma: found None"),
    (lambda: synchain.run(PAIR, sigma=[[1, 2], [3]]), r"axis sigma: found \[1, 2\]"),
    (lambda: synchain.run(PAIR, sigma={1, 2}), "found a set, which has no order"),
    (lambda: synchain.run(PAIR, x_1=None), "x_1: found None"),
    (lambda: synchain.run(PAIR, lanes=4), "unknown parameter or keyword 'lanes' of run; known: sigma, x_1"),
    (lambda: synchain.run(PAIR, workers=1.5), r"workers = 1\.5; expected a whole number"),
    (lambda: synchain.run(PAIR, workers="2"), "workers = '2'"),
    (lambda: synchain.run(PAIR, workers=True), "workers = True"),
    (lambda: synchain.run(PAIR, workers=-1), "workers = -1; expected at least 1"),
    (lambda: synchain.run(PAIR, width=3), "width = 3; expected one of 1, 2, 4, 8, 16"),
    (lambda: synchain.run(PAIR, width="a"), "width = 'a'"),
    (lambda: synchain.run(PAIR, reduce="no"), "reduce: found 'no'"),
    (lambda: synchain.run(PAIR, certified="yes"), "certified: found 'yes'"),
    (lambda: synchain.run(PAIR, resume="file.nc"), "resume: found 'file.nc'"),
    (lambda: synchain.run(PAIR, executor=THREADS), "executor: found <class"),
    (lambda: synchain.run(PAIR, progress=3), "progress: found 3"),
    (lambda: synchain.run(PAIR, show_progress="x"), "show_progress: found 'x'"),
    (lambda: synchain.stream("x", "y.nc"), A_SCENE),
    (lambda: synchain.stream(PAIR, 3), "path: found 3"),
    (lambda: synchain.stream(PAIR, ""), "path: found ''"),
    (lambda: synchain.stream(PAIR, "a\0b"), "path: found"),
    (lambda: synchain.stream(PAIR, "a.nc", resume="yes"), "resume: found 'yes'"),
    (lambda: synchain.stream(PAIR, "a.nc", executor=3), "executor: found 3"),
    (lambda: synchain.stream(PAIR, "a.nc", progress=3), "progress: found 3"),
    (lambda: synchain.kernel("figure_4a"), A_SCENE),
    (lambda: synchain.kernel(PAIR, width=0), "width = 0; expected at least 1"),
    (lambda: synchain.open_result(3), "result: found 3"),
    (lambda: synchain.open_result("no/such/file.nc"), "does not exist; expected a result: check the path"),
    (lambda: synchain.open_result(Path(__file__).parent), "is a folder; expected a file: name the file in it"),
    (lambda: synchain.open_result(__file__), "is no netCDF file; expected a netCDF 3 result"),
    (lambda: synchain.results.Result(None, None), r"data: found None; expected an xarray\.Dataset"),
    # starts, thresholds, probe
    (lambda: synchain.basin("a"), A_SCENE),
    (lambda: synchain.basin(PAIR, ranges=3), "ranges: found 3"),
    (lambda: synchain.basin(PAIR, ranges={"x": 3}), "range of x"),
    (lambda: synchain.basin(PAIR, ranges={"x": ("a", "b")}), "range of x: found"),
    (lambda: synchain.basin(PAIR, tolerance="a"), "tolerance: 'a'"),
    (lambda: synchain.basin(PAIR, rng=-1), "rng = -1"),
    (lambda: synchain.basin(PAIR, samples=10**12), "samples = 1000000000000; expected at most 10000000"),
    (
        lambda: synchain.basin(PAIR, smaples=3),
        "unknown parameter or keyword 'smaples' of basin.*did you mean 'samples'",
    ),
    (lambda: synchain.run(PAIR, worker=2), "'worker' of run.*did you mean 'workers'"),
    (lambda: synchain.run(PAIR, sgima=2), "'sgima' of run.*did you mean 'sigma'"),
    (lambda: synchain.stream(PAIR, "a.nc", overwrit=True), "'overwrit' of stream.*did you mean 'overwrite'"),
    (lambda: synchain.thresholds(PAIR, resolutoin=1), "'resolutoin' of thresholds.*did you mean 'resolution'"),
    (
        lambda: synchain.thresholds(PAIR, record=()),
        r"thresholds: 'record' is a field of the scene.*write scene\.replace\(record=…\)",
    ),
    (lambda: synchain.exponents(PAIR, 0.1, perods=5), "'perods' of exponents.*did you mean 'periods'"),
    (
        lambda: synchain.exponents(PAIR, 0.1, atol=5),
        r"exponents: 'atol' is a field of the scene; expected parameters; write scene\.replace\(atol=…\)",
    ),
    (lambda: synchain.msf(PAIR, [0, 1], perods=5), "'perods' of msf.*did you mean 'periods'"),
    (lambda: synchain.plane(PAIR, [0, 1], [0, 1], perods=5), "'perods' of plane.*did you mean 'periods'"),
    (lambda: synchain.lyapunov_spectrum(PAIR, cuont=5), "'cuont' of lyapunov_spectrum.*did you mean 'count'"),
    (lambda: synchain.cluster_exponents(PAIR, [0, 0], perods=5), "of cluster_exponents.*did you mean 'periods'"),
    (lambda: agreement(PAIR, [0.1], criterium=3), "'criterium' of agreement.*did you mean 'criterion'"),
    (lambda: synchain.periodic_orbit(Scene(), perods=2), "'perods' of periodic_orbit.*did you mean 'periods'"),
    (lambda: synchain.exponents(Scene(oscillator="lorenz"), [0.1]), "name the components that a link joins"),
    (lambda: synchain.thresholds(None), A_SCENE),
    (lambda: synchain.thresholds(ONE), "has no links"),
    (lambda: synchain.thresholds(PAIR, sigma="a"), "sigma: found 'a'; expected real numbers"),
    (lambda: synchain.thresholds(PAIR, sigma=3), r"array of shape \(\); expected a row of at least 2"),
    (lambda: synchain.thresholds(PAIR, sigma=[0.2, 0.1]), "do not increase"),
    (lambda: synchain.thresholds(PAIR, sigma=[NAN, 1]), "sigma: found nan"),
    (lambda: synchain.thresholds(PAIR, resolution="a"), "resolution: 'a'"),
    (lambda: synchain.thresholds(PAIR, criterion={"starts": 2}), "criterion: found {'starts': 2}"),
    (lambda: Criterion(starts=1.5), r"starts = 1\.5; expected a whole number"),
    (lambda: Criterion(tolerance="a"), "tolerance: 'a'"),
    (lambda: Criterion(reach=NAN), "reach: found nan"),
    (lambda: Criterion(rng="a"), "rng = 'a'"),
    (lambda: synchain.universal_probe(3, 0, 0), A_SCENE),
    (lambda: synchain.universal_probe(PAIR, "a", 0), "alpha: found 'a'; expected real numbers"),
    (lambda: synchain.universal_probe(PAIR, 1j, 0), "alpha: found 1j"),
    (lambda: synchain.universal_probe(PAIR, [1, 2], [1, 2, 3]), r"shapes \(2,\) and \(3,\)"),
    # exponents
    (lambda: synchain.exponents(None, [0.1]), A_SCENE),
    (lambda: synchain.exponents(PAIR, "a"), "alpha: found 'a'; expected numbers"),
    (lambda: synchain.exponents(PAIR, []), "expected a row of at least 1 number"),
    (lambda: synchain.exponents(PAIR, [[1, 2], [3, 4]]), r"array of shape \(2, 2\)"),
    (lambda: synchain.exponents(PAIR, {1, 2}), "alpha: found {1, 2}"),
    (lambda: synchain.exponents(PAIR, 0.1, starts=1.5), r"starts = 1\.5"),
    (lambda: synchain.exponents(PAIR, 0.1, periods=0), "periods: found 0; expected a number above 0"),
    (lambda: synchain.exponents(PAIR, 0.1, periods=-1), "periods: found -1; expected a number above 0"),
    (lambda: synchain.msf(PAIR, [math.nan]), "alpha: found nan; expected finite numbers"),
    (lambda: synchain.msf(PAIR, [0, 1e308]), r"alpha: found 1e\+308; expected numbers of at most 1e\+300 in size"),
    (lambda: synchain.exponents(PAIR, [complex(1e308, 1e308)]), r"alpha: found 1e\+308\+1e\+308j; expected"),
    (lambda: synchain.exponents(PAIR, 0.1, periods=math.inf), "periods: found inf"),
    (lambda: synchain.exponents(PAIR, 0.1, transient=-1), "transient: found -1"),
    (lambda: synchain.exponents(PAIR, 0.1, precision="a"), "precision: 'a'"),
    (lambda: synchain.exponents(PAIR, 0.1, rng="a"), "rng = 'a'"),
    (lambda: synchain.exponents(PAIR, 0.1, workers="a"), "workers = 'a'"),
    (lambda: synchain.exponents(PAIR, 0.1, show_progress="no"), "show_progress: found 'no'"),
    (lambda: synchain.thresholds(PAIR, executor=3), "executor: found 3"),
    (lambda: synchain.basin(PAIR, progress=3), "progress: found 3"),
    (lambda: synchain.msf("a", [0, 1]), A_SCENE),
    (lambda: synchain.msf(PAIR, "x"), "alpha: found 'x'"),
    (lambda: synchain.plane(PAIR, [0, 1], 3), "beta: found an array of shape"),
    (lambda: synchain.lyapunov_spectrum("a"), A_SCENE),
    (lambda: synchain.lyapunov_spectrum(PAIR, count=1.5), r"count = 1\.5"),
    (lambda: synchain.lyapunov_spectrum(PAIR, periods="a"), "periods: 'a'"),
    (lambda: synchain.cluster_exponents(None, [0, 0]), A_SCENE),
    (lambda: synchain.cluster_exponents(PAIR, 3), "partition: found 3"),
    (lambda: synchain.cluster_exponents(PAIR, [0, 0], periods=0), "periods: found 0"),
    (lambda: synchain.periodic_orbit("a"), A_SCENE),
    # energy
    (lambda: energy_function("a"), A_SCENE),
    (lambda: ENERGY([1, 2]), "expected rows of 4 numbers"),
    (lambda: ENERGY("abc"), "states: found 'abc'"),
    (lambda: ENERGY(np.zeros(4), "a"), "t: found 'a'"),
    (lambda: ENERGY(np.zeros(4), 0.0, {"nope": 1}), "unknown key 'nope'"),
    (lambda: ENERGY.imbalance(3, np.zeros((2, 4))), "found 1 samples; expected at least three"),
]


@pytest.mark.parametrize(("call", "message"), CALLS, ids=range(len(CALLS)))
def test_a_wrong_argument_is_refused_in_one_line(call, message, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises((TypeError, ValueError, OSError), match=message) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_what_is_right_is_taken():
    """Numbers of other types, and what only looks wrong."""
    assert Given(synchain.run, {"sigma": range(2), "x_1": "sqrt(4)"}).sweep(PAIR).axes[0].values == (0.0, 1.0)
    assert worker_count(np.int64(2)) == 2
    assert synchain.graphs.from_edges([[0, 1], (1, 2, "1/2"), np.array([2, 3])]).n == 4
    assert clusters(star(5), "hpppp").quotients[0].n == 2
    assert Criterion(tolerance=1).tolerance == 1.0
    assert float(ENERGY([0, 1, 0, 0], parameters={"sigma": 0})) == 0.5


OFFERED = [
    value
    for module in (synchain, *(getattr(synchain, name) for name in synchain.MODULES))
    for value in (getattr(module, name) for name in module.HOMES)
    if inspect.isfunction(value) or (inspect.isclass(value) and value is not synchain.results.Status)
]
"""Public functions and classes; `Status` is an enumeration."""


@pytest.mark.parametrize("value", OFFERED, ids=lambda value: value.__name__)
def test_unknown_keywords_are_refused_with_those_that_are_known(value: Any) -> None:
    parameters = inspect.signature(value).parameters.values()
    if any(each.kind is each.VAR_KEYWORD for each in parameters):  # parameters of a scene; see tests/test_keywords.py
        return
    parameter_names = [each.name for each in parameters if each.kind is not each.VAR_POSITIONAL]
    with pytest.raises(TypeError) as caught:
        value(**{f"{parameter_names[-1]}_" if parameter_names else "wrong": 1})
    message = (
        f"known: {', '.join(parameter_names)}; did you mean '{parameter_names[-1]}'?"
        if parameter_names
        else "known: none"
    )
    assert f" of {value.__name__}; {message}" in str(caught.value)


@pytest.mark.parametrize("value", OFFERED, ids=lambda value: value.__name__)
def test_arguments_at_no_place_and_missing_ones_are_refused_in_words_of_ours(value: Any) -> None:
    parameters = inspect.signature(value).parameters.values()
    further = {each.kind for each in parameters} & {inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD}
    accepted = [each for each in parameters if each.kind not in further]
    if inspect.Parameter.VAR_POSITIONAL not in further:
        places = [each.name for each in accepted if each.kind is not inspect.Parameter.KEYWORD_ONLY]
        with pytest.raises(
            TypeError, match=f"^{value.__name__}: found 99 arguments without a name; expected "
        ) as caught:
            value(*[None] * 99)
        message = f"at most {len(places)}, {', '.join(places)}" if places else "none"
        assert f"expected {message}" in str(caught.value)
        for name in places[:1]:
            with pytest.raises(TypeError, match=f"^{value.__name__}: found '{name}' without a name and by name"):
                value(None, **{name: None})
    needed = [each.name for each in accepted if each.default is inspect.Parameter.empty]
    if needed:
        with pytest.raises(
            TypeError, match=f"^{value.__name__}: found no '{needed[0]}'; expected {', '.join(needed)}$"
        ):
            value()


KEPT = [kind for kind in OFFERED if inspect.isclass(kind) and issubclass(kind, Labelled)]
"""The classes of results."""


def test_plots_refuse_unknown_keywords() -> None:
    assert len(KEPT) > 10
    for kind in KEPT:
        valid = ", ".join(name for name in inspect.signature(kind.plot).parameters if name not in ("self", "style"))
        with pytest.raises(TypeError, match=f"^unknown keyword 'axes' of plot; known: {valid}"):
            kind.plot(object.__new__(kind), axes=1)
        with pytest.raises(TypeError, match=r"^save: found no 'path'; expected path$"):
            kind.save(object.__new__(kind))
    with pytest.raises(TypeError, match=r"^unknown keyword 'axes' of draw; known: ax"):
        synchain.graphs.chain(3).draw(axes=1)
    with pytest.raises(TypeError, match=r"^replace: found 1 argument without a name; expected none$"):
        PAIR.replace(3)


@pytest.mark.parametrize("value", OFFERED, ids=lambda value: value.__name__)
def test_public_names_can_be_sent_to_other_processes(value: Any) -> None:
    assert pickle.loads(pickle.dumps(value)) is value


def test_a_class_is_changed_once() -> None:
    for _ in range(3):
        callables = (
            synchain.Criterion.__init__,
            synchain.results.Result.plot,
            synchain.results.Plane.as_dict,
            synchain.graphs.Topology.to_networkx,
        )
    assert [hasattr(each.__wrapped__, "__wrapped__") for each in callables] == [False] * 4


def test_a_parameter_among_the_keywords_is_said_to_be_one() -> None:
    with pytest.raises(
        TypeError, match=r"unknown keyword 'k' of Field; .*; a parameter is given as parameters=\{'k': …\}"
    ):
        synchain.Field({"x": "-k*x"}, k=2.0)

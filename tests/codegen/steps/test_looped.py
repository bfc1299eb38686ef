"""Large networks: the looped step does what the unrolled one does, and its linear algebra what NumPy's does."""

from __future__ import annotations

import numpy as np
import pytest
from samples import FLOATS, plain

import synchain.codegen.kernels.compile as load_module
import synchain.codegen.kernels.sweep as emit_module
from synchain.codegen import driver
from synchain.codegen.printing.names import NAMES
from synchain.codegen.steps import program as sparse
from synchain.codegen.steps.program import order, program
from synchain.models import chain, complete, grid, random_cubic, ring, star, tree
from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import from_matrix
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.kernels import kernel_source
from synchain.runtime.support.status import Status
from synchain.runtime.sweeps.run import run

GRAPHS = [ring(5), star(5), complete(4), from_matrix([[-1, 1, 0], [0, "-1/2", "1/2"], [2, 0, -2]])]


@pytest.fixture
def always_looped(monkeypatch):
    for module in (emit_module, load_module):
        monkeypatch.setattr(module, "LARGEST_UNROLLED", 0)
    load_module._load.cache_clear()
    yield
    load_module._load.cache_clear()


@pytest.mark.parametrize(
    ("graph", "integrator"),
    [
        pytest.param(GRAPHS[1], "rodas5p", marks=pytest.mark.long, id="star5-rodas5p"),
        pytest.param(GRAPHS[3], "rodas5p", marks=pytest.mark.long, id="matrix3-rodas5p"),
        pytest.param(GRAPHS[3], "dop853", marks=pytest.mark.long, id="matrix3-dop853"),
    ],
)
def test_looped_step_equals_the_unrolled_one(graph, integrator, request):
    scene = Scene(
        topology=graph, transient=0, window=1, integrator=integrator, rtol=1e-9,
        parameters={"sigma": 0.1, "kappa": 1e5 if integrator == "rodas5p" else 10.0},
    )  # fmt: skip
    plain = run(scene)
    request.getfixturevalue("always_looped")
    looped = run(scene)
    assert "for i in range(NODES)" in emit_module.emit(scene.equations, integrator, width=1).text
    np.testing.assert_allclose(looped.end, plain.end, atol=1e-8)
    np.testing.assert_allclose(looped.sync_error, plain.sync_error, atol=1e-7)
    assert abs(int(looped.steps) - int(plain.steps)) <= 0.02 * int(plain.steps)


@pytest.mark.long
def test_large_ring_runs_in_loops_and_keeps_its_symmetry():
    """Neighbours alternate, so the ring of twelve is two oscillators coupled by 2 sigma: chain(2) at twice the coupling."""
    start = {"x": [0.30, 0.28] * 6, "v": 0}
    common = {"transient": 0, "window": 2, "rtol": 1e-9, "integrator": "rodas5p"}
    scene = Scene(topology=ring(12), parameters={"sigma": 0.05}, initial=start, **common)
    pair = Scene(topology=chain(2), parameters={"sigma": 0.1}, **common)
    assert "for i in range(NODES)" in kernel_source(scene, width=1, reduce=False).text
    large, small = run(scene, reduce=False), run(pair, reduce=False)
    assert large.status == Status.FINISHED
    np.testing.assert_allclose(large.end.values.reshape(2, 12)[:, :2], small.end.values.reshape(2, 2), atol=1e-8)


@pytest.fixture
def incomplete(monkeypatch):
    """Every elimination keeps only the first level of fill, and solutions are refined."""
    monkeypatch.setattr(sparse, "FILL_LIMIT", 0.0)
    sparse._program.cache_clear()
    yield
    sparse._program.cache_clear()


def strong(equations, shift: float) -> np.ndarray:
    """shift - J for random entries of J between -1 and 1."""
    random = np.random.default_rng(1)
    matrix = shift * np.eye(equations.dimension)
    for place in equations.jacobian():
        matrix[place] -= random.uniform(-1, 1)
    return matrix


def solved(equations, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The solution by the generated program, run by Python itself."""
    made, size = program(equations), equations.dimension
    arrays = dict(zip(NAMES, made.arrays, strict=True))
    space = plain(driver.text("sparse"), {**FLOATS, "DIMENSION": size, "WIDTH": 1})
    rows = np.repeat(arrays["order"], np.diff(arrays["row_start"]))
    apart = 0 if made.exact else made.entries
    x = made.entries + apart
    work = np.full(x + 3 * size, np.nan)
    work[: made.entries] = [*np.diag(matrix), *matrix[rows, arrays["column"]]]
    work[x : x + size] = right
    both = ("row_start", "after_start", "column")
    space["factorise"](work, 0, apart, x + size, arrays["order"], arrays["place"], *(arrays[k] for k in both))
    space["solve"](work, 0, apart, x, x + size, x + 2 * size, arrays["order"], *(arrays[k] for k in both))
    return work[x : x + size]


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: f"{g.name}{g.n}")
def test_program_solves_like_numpy(graph):
    equations = Scene(topology=graph, parameters={"sigma": 0.1}).equations
    assert program(equations).exact
    matrix, right = strong(equations, 6.0), np.random.default_rng(2).normal(size=equations.dimension)
    np.testing.assert_allclose(solved(equations, matrix, right), np.linalg.solve(matrix, right), rtol=1e-12)


@pytest.mark.parametrize("shift", [8.0, 100.0, 1e6])
@pytest.mark.parametrize("graph", [grid(30), random_cubic(20)], ids=lambda g: g.name)
def test_incomplete_elimination_solves_to_rounding(graph, shift, incomplete):
    equations = Scene(topology=graph).equations
    made = program(equations)
    assert not made.exact
    matrix, right = strong(equations, shift), np.random.default_rng(2).normal(size=equations.dimension)
    found, expected = solved(equations, matrix, right), np.linalg.solve(matrix, right)
    assert np.abs(found - expected).max() <= 4e-15 * np.abs(expected).max()


def test_refinement_that_does_not_converge_says_so(incomplete):
    equations = Scene(topology=grid(30)).equations
    right = np.ones(equations.dimension)
    assert np.isnan(solved(equations, strong(equations, 0.5), right)).all()


def test_incomplete_factors_keep_the_first_level_of_fill(incomplete):
    """Positions first: (v_j, v_i) for every link and (v_i, v_i), which is the diagonal; nothing else."""
    graph = grid(30)
    equations = Scene(topology=graph).equations
    made = program(equations)
    links = len(graph.links)
    assert made.entries == 2 * 30 + 2 * 30 + 2 * links
    arrays = dict(zip(NAMES, made.arrays, strict=True))
    assert set(arrays["order"][:30].tolist()) == set(range(30))


@pytest.mark.parametrize(("name", "n"), [("grid", 2500), ("random_cubic", 1000)])
def test_large_fill_is_not_built(name, n):
    graph = topology(name, n)
    made = program(Scene(topology=graph).equations)
    assert not made.exact
    assert made.entries == 4 * n + 2 * len(graph.links)


@pytest.mark.long
def test_incomplete_elimination_changes_no_result(incomplete, request):
    scene = Scene(topology=grid(12), transient=0, window=1, rtol=1e-9, parameters={"sigma": 0.3})
    refined = run(scene)
    assert "solve(dense, MATRIX, ENTRIES, K1" in emit_module.emit(scene.equations, width=1).text
    sparse.FILL_LIMIT = 1e9  # the fixture restores it
    sparse._program.cache_clear()
    load_module._load.cache_clear()
    exact = run(scene)
    np.testing.assert_allclose(refined.end, exact.end, atol=1e-8)
    assert abs(int(refined.steps) - int(exact.steps)) <= 0.02 * int(exact.steps)


@pytest.mark.long
def test_lanes_are_refined_independently(incomplete):
    """A lane with strong coupling needs more corrections than its neighbours, and changes nothing in them."""
    scene = Scene(topology=grid(12), transient=0, window=0.2)
    strengths = [0.1, 0.2, 1e4, 0.3, 0.0, 30.0, 0.5, 0.6]
    together = run(scene, sigma=strengths, width=2)
    assert (together.status == Status.FINISHED).all()
    for i in (0, 2, 4):
        alone = run(scene, sigma=[strengths[i]], width=2)
        np.testing.assert_array_equal(alone.end.values[0], together.end.values[i])


@pytest.mark.parametrize("graph", [chain(2000), star(2000), ring(2000), tree(2000)], ids=lambda g: g.name)
def test_elimination_of_sparse_families_stays_sparse(graph):
    """Trees cause no fill between nodes; a ring adds at most one entry each way for every node."""
    made = program(Scene(topology=graph).equations)
    links = len(graph.links)
    # positions first: each link is one entry (v, x) and one (v, v) of fill; a node has (x, v) and (v, x)
    allowed = 2 * graph.n + 2 * graph.n + 2 * links + (4 * graph.n if graph.name == "ring" else 0)
    assert made.entries <= allowed


def test_order_covers_every_unknown_once():
    steps = order(6, {(0, 1), (1, 0), (2, 2), (3, 0), (5, 4)})
    assert sorted(steps.order) == list(range(6))

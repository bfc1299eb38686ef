"""Large networks: the looped step does what the unrolled one does, and its linear algebra what NumPy's does."""

from __future__ import annotations

import numpy as np
import pytest
from samples import FLOATS, kernel, plain, run_cells

from synchain.codegen import driver
from synchain.codegen.steps.safe_names import NAMES
from synchain.codegen.steps.sparse_plan import SparsePlan, order, sparse_plan
from synchain.graphs import chain, complete, grid, random_cubic, ring, star, tree, wheel
from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import from_matrix
from synchain.models.scenes.scene import Scene
from synchain.runtime.engines.scene_kernels import kernel_source
from synchain.runtime.support.status import Status
from synchain.runtime.sweeps.run import run

INCOMPLETE = 0.0
"""The limit of fill with which every elimination keeps only the first level of it, and solutions are refined."""

GRAPHS = [ring(5), star(5), complete(4), from_matrix([[-1, 1, 0], [0, "-1/2", "1/2"], [2, 0, -2]])]


@pytest.mark.parametrize(
    ("graph", "integrator"),
    [
        pytest.param(GRAPHS[1], "rodas5p", marks=pytest.mark.long, id="star5-rodas5p"),
        pytest.param(GRAPHS[3], "rodas5p", marks=pytest.mark.long, id="matrix3-rodas5p"),
        pytest.param(GRAPHS[3], "dop853", marks=pytest.mark.long, id="matrix3-dop853"),
    ],
)
def test_looped_step_equals_the_unrolled_one(graph, integrator):
    scene = Scene(
        topology=graph, transient=0, window=1, integrator=integrator, rtol=1e-9,
        parameters={"sigma": 0.1, "kappa": 1e5 if integrator == "rodas5p" else 10.0},
    )  # fmt: skip
    kernels = [kernel(scene.equations, integrator, ("sync_error",), width=1, unroll=n) for n in (8, 0)]
    assert ["for i in range(NODES)" in k.source for k in kernels] == [False, True]
    plain, looped = (run_cells(k, scene) for k in kernels)
    np.testing.assert_allclose(looped.end, plain.end, atol=1e-8)
    np.testing.assert_allclose(looped.sums[:, 0], plain.sums[:, 0], atol=1e-7)
    assert abs(looped.steps[0] - plain.steps[0]) <= 0.02 * plain.steps[0]


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
    np.testing.assert_allclose(large.states("end").reshape(2, 12)[:, :2], small.states("end").reshape(2, 2), atol=1e-8)


def strong(equations, shift: float) -> np.ndarray:
    """shift - J for random entries of J between -1 and 1."""
    random = np.random.default_rng(1)
    matrix = shift * np.eye(equations.dimension)
    for entry in equations.jacobian():
        matrix[entry] -= random.uniform(-1, 1)
    return matrix


def solved(equations, plan: SparsePlan, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The solution by the generated program, run by Python itself."""
    size = equations.dimension
    arrays = dict(zip(NAMES, plan.arrays, strict=True))
    space = plain(driver.text("driver.sparse"), {**FLOATS, "DIMENSION": size, "WIDTH": 1})
    rows = np.repeat(arrays["order"], np.diff(arrays["row_start"]))
    apart = 0 if plan.exact else plan.entries
    x = plan.entries + apart
    work = np.full(x + 3 * size, np.nan)
    work[: plan.entries] = [*np.diag(matrix), *matrix[rows, arrays["column"]]]
    work[x : x + size] = right
    both = ("row_start", "after_start", "column")
    space["factorise"](work, 0, apart, x + size, arrays["order"], arrays["place"], *(arrays[k] for k in both))
    space["solve"](work, 0, apart, x, x + size, x + 2 * size, arrays["order"], *(arrays[k] for k in both))
    return work[x : x + size]


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: f"{g.name}{g.n}")
def test_program_solves_like_numpy(graph):
    equations = Scene(topology=graph, parameters={"sigma": 0.1}).equations
    plan = sparse_plan(equations)
    assert plan.exact
    matrix, right = strong(equations, 6.0), np.random.default_rng(2).normal(size=equations.dimension)
    np.testing.assert_allclose(solved(equations, plan, matrix, right), np.linalg.solve(matrix, right), rtol=1e-12)


def test_an_infinite_pivot_has_no_solution():
    equations = Scene(topology=chain(20)).equations
    matrix = strong(equations, 8.0)
    matrix[-1, -1] = np.inf
    with np.errstate(invalid="ignore"):
        solution = solved(equations, sparse_plan(equations), matrix, np.ones(equations.dimension))
    assert np.isnan(solution[-1])


@pytest.mark.parametrize("shift", [8.0, 100.0, 1e6])
@pytest.mark.parametrize("graph", [grid(30), random_cubic(20)], ids=lambda g: g.name)
def test_incomplete_elimination_solves_to_rounding(graph, shift):
    equations = Scene(topology=graph).equations
    plan = sparse_plan(equations, INCOMPLETE)
    assert not plan.exact
    matrix, right = strong(equations, shift), np.random.default_rng(2).normal(size=equations.dimension)
    solution, expected = solved(equations, plan, matrix, right), np.linalg.solve(matrix, right)
    assert np.abs(solution - expected).max() <= 4e-15 * np.abs(expected).max()


def test_refinement_that_does_not_converge_says_so():
    equations = Scene(topology=grid(30)).equations
    plan = sparse_plan(equations, INCOMPLETE)
    right = np.ones(equations.dimension)
    assert np.isnan(solved(equations, plan, strong(equations, 0.5), right)).all()


def test_incomplete_factors_keep_the_first_level_of_fill():
    """Positions first: (v_j, v_i) for every link and (v_i, v_i), which is the diagonal; nothing else."""
    graph = grid(30)
    plan = sparse_plan(Scene(topology=graph).equations, INCOMPLETE)
    links = len(graph.links)
    assert plan.entries == 2 * 30 + 2 * 30 + 2 * links
    arrays = dict(zip(NAMES, plan.arrays, strict=True))
    assert set(arrays["order"][:30].tolist()) == set(range(30))


@pytest.mark.parametrize(("name", "n"), [("grid", 2500), ("random_cubic", 1000)])
def test_large_fill_is_not_built(name, n):
    graph = topology(name, n)
    plan = sparse_plan(Scene(topology=graph).equations)
    assert not plan.exact
    assert plan.entries == 4 * n + 2 * len(graph.links)


@pytest.mark.long
def test_incomplete_elimination_changes_no_result():
    scene = Scene(topology=grid(12), transient=0, window=1, rtol=1e-9, parameters={"sigma": 0.3})
    kernels = [kernel(scene.equations, width=2, fill=fill) for fill in (INCOMPLETE, 1e9)]
    assert ["solve(dense, MATRIX, ENTRIES, K1" in k.source for k in kernels] == [True, False]
    refined, exact = (run_cells(k, scene) for k in kernels)
    np.testing.assert_allclose(refined.end, exact.end, atol=1e-8)
    assert abs(refined.steps[0] - exact.steps[0]) <= 0.02 * exact.steps[0]


@pytest.mark.long
def test_lanes_are_refined_independently():
    """A lane with strong coupling needs more corrections than its neighbours, and changes nothing in them."""
    scene = Scene(topology=grid(12), transient=0, window=0.2)
    strengths = [0.1, 0.2, 1e4, 0.3, 0.0, 30.0, 0.5, 0.6]
    refined = kernel(scene.equations, width=2, fill=INCOMPLETE)
    together = run_cells(refined, scene.replace(axes={"sigma": strengths}))
    assert (together.counts[:, 0] == Status.FINISHED).all()
    for i in (0, 2, 4):
        alone = run_cells(refined, scene.replace(axes={"sigma": [strengths[i]]}))
        np.testing.assert_array_equal(alone.end[0], together.end[i])


@pytest.mark.parametrize("graph", [chain(2000), star(2000), ring(2000), tree(2000)], ids=lambda g: g.name)
def test_elimination_of_sparse_families_stays_sparse(graph):
    """Trees cause no fill between nodes; a ring adds at most one entry each way for every node."""
    plan = sparse_plan(Scene(topology=graph).equations)
    links = len(graph.links)
    # positions first: each link is one entry (v, x) and one (v, v) of fill; a node has (x, v) and (v, x)
    allowed = 2 * graph.n + 2 * graph.n + 2 * links + (4 * graph.n if graph.name == "ring" else 0)
    assert plan.entries <= allowed


def test_order_covers_every_unknown_once():
    steps = order(6, {(0, 1), (1, 0), (2, 2), (3, 0), (5, 4)})
    assert sorted(steps.order) == list(range(6))


@pytest.mark.parametrize(
    ("coupling", "integrator"),
    [("spring", "dop853"), ("inerter", "dop853"), ("spring", "rodas5p"), ("inerter", "rodas5p"), ("spring", "taylor")],
)
def test_the_code_is_the_same_for_all_graphs_of_a_size(coupling: str, integrator: str) -> None:
    """What differs is given at run time: many random graphs cost one compilation."""
    graphs = [ring(12), star(12), wheel(12)]
    scenes = [Scene("duffing", coupling, graph, parameters={"sigma": 0.1}, integrator=integrator) for graph in graphs]
    sources = [kernel_source(scene, reduce=False) for scene in scenes]
    assert len({source.text for source in sources}) == 3
    assert len({source.code for source in sources}) == 1

"""Large networks: the looped step does what the unrolled one does, and its linear algebra what NumPy's does."""

from __future__ import annotations

import numpy as np
import pytest

import synchain.codegen.emit as emit_module
import synchain.codegen.load as load_module
from synchain.codegen.sparse import order, program
from synchain.models import Scene, chain, complete, from_matrix, ring, star
from synchain.runtime import Status, run

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
    [(GRAPHS[1], "rodas5p"), (GRAPHS[3], "rodas5p"), (GRAPHS[3], "dop853")],
    ids=["star5-rodas5p", "matrix3-rodas5p", "matrix3-dop853"],
)
def test_looped_step_equals_the_unrolled_one(graph, integrator, request):
    scene = Scene(
        topology=graph, transient=0, window=1, integrator=integrator, rtol=1e-9,
        parameters={"sigma": 0.1, "kappa": 1e5 if integrator == "rodas5p" else 10.0},
    )  # fmt: skip
    plain = run(scene)
    request.getfixturevalue("always_looped")
    looped = run(scene)
    assert "for i in range(NODES)" in load_module.load(emit_module.emit(scene.equations, integrator)).source
    np.testing.assert_allclose(looped.end, plain.end, atol=1e-8)
    np.testing.assert_allclose(looped.sync_error, plain.sync_error, atol=1e-7)
    assert abs(int(looped.steps) - int(plain.steps)) <= 0.02 * int(plain.steps)


def test_large_ring_runs_in_loops_and_keeps_its_symmetry():
    """Neighbours alternate, so the ring of twelve is two oscillators coupled by 2 sigma: chain(2) at twice the coupling."""
    start = {"x": [0.30, 0.28] * 6, "v": 0}
    scene = Scene(topology=ring(12), transient=0, window=2, rtol=1e-9, parameters={"sigma": 0.05}, initial=start)
    pair = Scene(topology=chain(2), transient=0, window=2, rtol=1e-9, parameters={"sigma": 0.1})
    large, small = run(scene), run(pair)
    assert large.status == Status.FINISHED
    np.testing.assert_allclose(large.end.values.reshape(2, 12)[:, :2], small.end.values.reshape(2, 2), atol=1e-8)


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda g: f"{g.name}{g.n}")
def test_program_solves_like_numpy(graph):
    equations = Scene(topology=graph, parameters={"sigma": 0.1}).equations
    made = program(equations)
    size = equations.dimension
    names = dict(zip(load_module.NAMES, made.arrays, strict=True))
    random = np.random.default_rng(1)
    pattern = {key for key in equations.jacobian()}
    matrix = np.diag(random.uniform(5, 6, size))
    for r, c in pattern:
        if r != c:
            matrix[r, c] = random.uniform(-1, 1)
    work, right = _fill(matrix, names, made.entries, size), random.normal(size=size)
    _factorise(work, names, size)
    np.testing.assert_allclose(_solve(work, right.copy(), names, size), np.linalg.solve(matrix, right), rtol=1e-12)


def _fill(matrix, names, entries, size):
    """The matrix in the program's storage: diagonal, then the entries in order of elimination."""
    work = np.zeros(entries)
    work[:size] = np.diag(matrix)
    for q in range(size):
        k = names["order"][q]
        for b in range(names["below_start"][q], names["below_start"][q + 1]):
            work[names["below_slot"][b]] = matrix[names["below_row"][b], k]
        for a in range(names["after_start"][q], names["after_start"][q + 1]):
            work[names["after_slot"][a]] = matrix[k, names["after_column"][a]]
    return work


def _factorise(work, names, size):
    for q in range(size):
        k = names["order"][q]
        work[k] = 1.0 / work[k]
        for b in range(names["below_start"][q], names["below_start"][q + 1]):
            work[names["below_slot"][b]] *= work[k]
            for u in range(names["update_start"][b], names["update_start"][b + 1]):
                work[names["update_to"][u]] -= work[names["below_slot"][b]] * work[names["update_from"][u]]


def _solve(work, x, names, size):
    for q in range(size):
        for b in range(names["below_start"][q], names["below_start"][q + 1]):
            x[names["below_row"][b]] -= work[names["below_slot"][b]] * x[names["order"][q]]
    for q in range(size - 1, -1, -1):
        k = names["order"][q]
        for a in range(names["after_start"][q], names["after_start"][q + 1]):
            x[k] -= work[names["after_slot"][a]] * x[names["after_column"][a]]
        x[k] *= work[k]
    return x


@pytest.mark.parametrize("graph", [chain(2000), star(2000), ring(2000)], ids=lambda g: g.name)
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

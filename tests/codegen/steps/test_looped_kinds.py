"""Large networks of several kinds and of links with inertia: loops against statements, and kernels against SciPy."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp
from samples import FLOATS, Interpreted, clocks, take_step
from scipy.integrate import solve_ivp

from synchain.codegen.export.python import to_python
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.steps.places import by_joint
from synchain.codegen.steps.sparse_plan import sparse_plan
from synchain.graphs import ring, star
from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.runtime.results.energy_of_states import energy_function
from synchain.runtime.sweeps.run import run


def three_kinds() -> Equations:
    """Nodes of two and of three states in an order that is not that of their kinds; two kinds share a varied parameter."""
    kinds = [{"oscillator": "lorenz", "at": [2, 3]}, {"oscillator": "van_der_pol", "at": [4, 7]}]
    values = {"b": [1, 2], "omega": [1, 2, 3, 4, 5], "delta": [0.1, 0.2, 0.3]}
    return Scene(
        oscillator="duffing", nodes=kinds, topology=ring(7), coupling="x->x, y->y", parameters=values
    ).equations


def pairs(n: int, **keywords: object) -> Scene:
    """A ring of nodes in pairs, two of one kind and two of the other: all of a kind have the same surroundings."""
    kinds = [{"oscillator": "van_der_pol", "at": [i + 1 for i in range(n) if i % 4 > 1]}]
    common = {"transient": 0, "window": 20, "record": (), "time_unit": "time", "rtol": 1e-10}
    return Scene(oscillator="duffing", nodes=kinds, topology=ring(n), coupling="spring", **{**common, **keywords})


def hanging(n: int, **keywords: object) -> Scene:
    """Clocks of different swings on one beam."""
    swings = {"mass": 10, "drag": 20, "escapement": 0.02, "swing": np.linspace(0.3, 0.5, n)}
    start = {"x": 0, "theta": np.linspace(-0.5, 0.6, n), "theta_rate": 0}
    return load_scene("huygens").replace(
        topology=star(n + 1), initial=start, parameters=swings, record=(), window=20, rtol=1e-10, **keywords
    )


def by_scipy(scene: Scene, end: float) -> np.ndarray:
    """The state at the end by SciPy from the exported source."""
    space: dict = {}
    exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
    return solve_ivp(space["rhs"], (0, end), scene.y0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("method", ["cash_karp", "dop853", "rodas5p"])
@pytest.mark.parametrize("case", ["three kinds", "clocks", "clocks, incomplete"])
def test_loops_do_what_the_written_statements_do(case: str, method: str) -> None:
    """Ten steps of the same network by either kernel, in plain Python."""
    equations = three_kinds() if case == "three kinds" else clocks(6)
    fill = 0.0 if "incomplete" in case else 3.0
    random = np.random.default_rng(4)
    y, p = random.uniform(-1, 1, equations.dimension), random.uniform(0.5, 1.5, len(equations.parameters))
    ends = []
    for limit in (8, 0):
        kernel = Interpreted.of(emit(equations, method, Recording(()), width=1, unroll=limit, fill=fill), FLOATS)
        assert kernel.source.driver.looped is (limit == 0)
        weights = [float(weight) for (_, _, weight), _ in by_joint(equations)]
        state, t, h = list(y), 0.0, 0.05
        for _ in range(10):
            graph = (sparse_plan(equations, fill).arrays, weights) if limit == 0 else ()
            state, t = take_step(kernel, t, h, state, list(p), 1e-6, 1e-6, *graph).y_new, t + h
        ends.append(state)
    assert sparse_plan(equations).weights.tolist() == weights
    np.testing.assert_allclose(*ends, rtol=1e-11, atol=1e-11)
    assert np.abs(np.array(ends[0]) - y).max() > 0.1


@pytest.mark.long
def test_forty_nodes_of_two_kinds_move_as_their_exported_equations_say() -> None:
    """And from equal starts the nodes of a kind stay equal bit for bit, though each adds up its own links."""
    random = np.random.default_rng(1)
    values = {"sigma": 0.3, "u": 0.3, "delta": 0.1, "omega": np.linspace(1.0, 1.2, 40)}
    scene = pairs(40, integrator="dop853", parameters=values, initial={"x": random.uniform(-1, 1, 40), "v": 0})
    result = run(scene, reduce=False)
    assert result.success
    np.testing.assert_allclose(result.states(), by_scipy(scene, 20), atol=3e-8)
    first = [i for i in range(40) if i % 4 < 2]
    start = {"x": [0.7 if i in first else 0.2 for i in range(40)], "v": 0}
    frequencies = [1.0 if i in first else 1.3 for i in range(40)]
    end = run(scene.replace(initial=start, omega=frequencies), reduce=False).states("end").reshape(2, 40)
    for kind in (first, [i for i in range(40) if i not in first]):
        assert len(np.unique(end[:, kind], axis=1).T) == 1
    assert abs(end[0, 0] - end[0, 2]) > 0.01
    kept(scene.replace(u=0.0, delta=0.0, mu=0.0), drift=3e-9)


def kept(scene: Scene, drift: float) -> None:
    """Without drive and damping the energy at the end is that at the start."""
    function = energy_function(scene)
    zero = {sp.Symbol(name, real=True): 0 for name, value in scene.parameters.items() if value == 0.0}
    assert all(share.power.xreplace(zero) == 0 for share in (*function.exact.nodes, *function.exact.links))
    start, end = function(scene.y0), function(run(scene, reduce=False).states("end"))
    assert abs(end - start) < drift * abs(start)


@pytest.mark.long  # steps of six clocks, in loops and written out, are compared above
def test_forty_clocks_on_a_beam_move_as_their_exported_equations_say() -> None:
    scene = hanging(40, integrator="rodas5p")
    result = run(scene)
    assert result.success
    np.testing.assert_allclose(result.states(), by_scipy(scene, 20), atol=3e-8)
    kept(scene.replace(escapement=0.0, drag=0.0), drift=3e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_the_text_of_a_kernel_does_not_grow_with_its_kinds_of_nodes(method: str) -> None:
    for make in (lambda n: pairs(n).equations, lambda n: hanging(n).equations):
        small, large = (emit(make(n), method, Recording(()), width=2).code for n in (12, 120))
        body = [re.sub(r"\d+", "0", text) for text in (small, large)]
        assert body[0] == body[1]


def test_equations_and_elimination_of_a_thousand_nodes_cost_no_algebra(monkeypatch) -> None:
    """What is derived does not grow with the network, also where each node has values of its own."""
    plain_subs, calls = sp.Basic.subs, []

    def counted(self, *rules, **options):
        calls.append(self)
        return plain_subs(self, *rules, **options)

    monkeypatch.setattr(sp.Basic, "subs", counted)
    equations = hanging(1000).equations
    assert equations.dimension == 2002
    assert sparse_plan(equations).entries < 20 * 1000
    assert len(calls) < 100

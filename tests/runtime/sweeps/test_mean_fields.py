"""Mean fields from the scene to the result: against SciPy, and in sizes whose links cannot be listed."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from catalogue import LAGGING, PHASE
from scipy.integrate import solve_ivp

import synchain as sc
from synchain.models.dynamics.network import FEW
from synchain.models.graphs.links import LINK_LIMIT, AllPairs
from synchain.runtime.cells.plan import Planner
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.choice import Ladder
from synchain.runtime.engines.scene_kernels import chosen_integrator, kernel_source, ladder_of

THETA, K = sp.symbols("theta K")
HERE, THERE, W = sc.ends(PHASE)
ORDER = sc.observe.end(abs(sc.observe.nodes.mean(sp.exp(sp.I * THETA))))
LARGE = 2001
"""Nodes whose links are more than can be listed."""


def mean_field(n: int) -> sc.graphs.Topology:
    return sc.graphs.weighted(sc.graphs.complete(n), f"1/{n}")


def scene(n: int, coupling: object = LAGGING, **changes: object) -> sc.Scene:
    rng = np.random.default_rng(1)
    settings = {
        "parameters": {"omega": rng.normal(size=n), "K": 1.5},
        "initial": {"theta": rng.uniform(0.0, 6.0, n)},
        "transient": 0, "window": 2, "time_unit": "time", "record": (), "rtol": 1e-10,
    }  # fmt: skip
    return sc.Scene(PHASE, coupling, mean_field(n), **{**settings, **changes})


@pytest.mark.parametrize("integrator", ["dop853", "taylor"])
def test_two_hundred_phases_follow_scipy(integrator: str) -> None:
    taylor = integrator == "taylor"  # the other one shares the driver of tests that observe nothing
    kuramoto = scene(200, integrator=integrator, observe={"r": ORDER} if taylor else None)
    kuramoto = kuramoto.replace(lag=0.3)
    assert len(kuramoto.equations.fields) == 1
    frequencies = np.array([kuramoto.parameters[f"omega_{i + 1}"] for i in range(200)])

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return frequencies + 1.5 * np.mean(np.sin(y[None, :] - y[:, None] - 0.3), axis=1) + 1.5 / 200 * np.sin(0.3)

    end = solve_ivp(rates, (0, 2), kuramoto.y0, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    result = sc.run(kuramoto)
    np.testing.assert_allclose(result.states("end"), end, atol=2e-9)
    assert not taylor or float(result.r) == pytest.approx(abs(np.exp(1j * end).mean()), abs=1e-9)


def test_the_synchronisation_error_is_that_of_listed_links() -> None:
    field = scene(FEW + 1, integrator="dop853", record=("sync_error",))
    listed = field.replace(topology=sc.graphs.from_matrix(field.topology.matrix))
    assert (len(field.equations.fields), len(listed.equations.fields)) == (1, 0)
    error, expected = (float(sc.run(each, width=1).data.sync_error) for each in (field, listed))
    assert error == pytest.approx(expected, rel=1e-9)
    assert error > 0.1


def test_small_complete_graphs_list_their_links() -> None:
    assert scene(FEW).equations.fields == ()
    assert len(scene(FEW + 1).equations.fields) == 1


def test_set_valued_friction_lists_its_links() -> None:
    assert sc.Scene(topology=sc.graphs.complete(9), contact="set-valued").equations.fields == ()
    assert len(sc.Scene(topology=sc.graphs.complete(9)).equations.fields) == 1


def test_a_scene_of_many_phases_lists_no_link(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(pairs: AllPairs) -> None:
        raise AssertionError("the links were run through")

    monkeypatch.setattr(AllPairs, "__iter__", refuse)
    large = scene(LARGE, window=0.1, integrator="taylor", observe={"r": "end(nodes.mean(cos(theta)))"})
    result = sc.run(large)
    assert float(result.r) == pytest.approx(np.cos(result.states("end")).mean(), abs=1e-12)
    result.save(tmp_path / "large.nc")
    again = sc.open_result(tmp_path / "large.nc")
    assert again.scene == large
    np.testing.assert_array_equal(again.states("end"), result.states("end"))
    assert f"{LARGE * (LARGE - 1)} links" in repr(large.equations)
    assert str(LARGE * (LARGE - 1)) in large._repr_html_()
    assert large.spectrum.multiplicities == (1, LARGE - 1)
    assert large.replace(record=("sync_error",)).warnings == scene(100, record=("sync_error",)).warnings


def test_a_link_that_does_not_separate_is_refused_where_it_cannot_be_listed() -> None:
    steep = sc.Rates({HERE.theta: K * W * sp.tanh(THERE.theta - HERE.theta)}, {K: 1})
    with pytest.raises(
        ValueError, match=f"mean field of .*tanh.* expected a finite sum of products, .* or at most {LINK_LIMIT} links"
    ):
        scene(LARGE, steep)
    assert scene(20, steep).equations.fields == ()


def test_auto_takes_explicit_steps_where_the_jacobian_cannot_be_listed() -> None:
    small, large = (
        scene(n, integrator="auto", parameters={"K": 1e4}, initial={"theta": np.linspace(0.0, 0.5, n)})
        for n in (20, LARGE)
    )
    for net, expected in ((small, 2e4 * 0.95), (large, 2e4)):
        rows = Planner(net).rows(np.arange(1))
        paces = Ladder(net, net.equations).at(rows, rows.start, np.zeros(1))
        assert paces.fastest[0] == pytest.approx(expected, rel=0.05)
    assert ladder_of(reduce_scene(small)).methods[-1].name == "rodas5p"
    assert ladder_of(reduce_scene(large)).methods[-1].name == "dop853"
    assert chosen_integrator(reduce_scene(large.replace(parameters={"K": 0.1}))).name == "taylor"
    with pytest.raises(ValueError, match=f"rodas5p: found a mean field of {LARGE} nodes"):
        kernel_source(large.replace(integrator="rodas5p"))


def test_equal_starts_of_many_are_stepped_one_by_one() -> None:
    large = scene(LARGE, initial={"theta": 0.0}, parameters={"K": 1.0, "omega": 1.0})
    assert any("too many to be listed" in reason for reason in reduce_scene(large).kept)
    small = reduce_scene(scene(30, initial={"theta": 0.0}, parameters={"K": 1.0, "omega": 1.0}))
    assert small.equations.n == 1


def test_layers_beside_a_mean_field_keep_their_links() -> None:
    n = 12
    ring = sc.Rates({HERE.theta: sp.Symbol("c") * W * sp.sin(THERE.theta - HERE.theta) ** 3}, {"c": 0.4})
    settings = {"parameters": {"K": 1.5, "omega": np.linspace(-1, 1, n)}, "initial": {"theta": np.linspace(0, 5, n)}}
    more = {"transient": 0, "window": 1, "time_unit": "time", "integrator": "taylor", "rtol": 1e-11, "record": ()}
    both = sc.Scene(PHASE, links=[(LAGGING, mean_field(n)), (ring, sc.graphs.ring(n))], **settings, **more)
    assert (len(both.equations.fields), len(both.equations.listed)) == (1, 1)
    listed = sc.graphs.Topology("listed", n, tuple(AllPairs(n, mean_field(n).all_to_all)))
    same = sc.Scene(PHASE, links=[(LAGGING, listed), (ring, sc.graphs.ring(n))], **settings, **more)
    assert same.equations.fields == ()
    assert both.topology.link_count == n * (n - 1)
    np.testing.assert_allclose(sc.run(both).states("end"), sc.run(same).states("end"), atol=1e-10)

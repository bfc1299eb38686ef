"""The energy of nodes and links as an observable, as a section and as a stop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from synchain import Lagrangian, Potential, Rates, Scene, ends
from synchain.draw import uniform
from synchain.graphs import chain, erdos_renyi, one_way_ring, ring
from synchain.models.definitions.loader import load_oscillator
from synchain.models.networks.energy_terms import EnergyTerms
from synchain.models.scenes.energy import energy_terms as energy_of
from synchain.observe import end, energy, maximum, mean, minimum, nodes
from synchain.runtime.engines.scene_kernels import kernel_source
from synchain.runtime.results.energy_of_states import energy_function
from synchain.runtime.sweeps.run import run

X, V, P, K = sp.symbols("x v P K")
EXACT: dict[str, Any] = {"transient": 0, "window": 20, "time_unit": "time", "rtol": 1e-11, "record": []}
EXTREMES = {"high": maximum(energy), "low": minimum(energy), "last": end(energy)}

LOSSLESS = Lagrangian(V**2 / 2, -P * X, coordinates={X: V}, parameters={P: 0})
i, j, W = ends(LOSSLESS)
LINE = Potential(K * W * (1 - sp.cos(i.x - j.x)), {K: 1})
GRID = erdos_renyi(12, p=0.3, seed=3)
DICE = np.random.default_rng(2)
CONSERVATIVE = {
    "fput": Scene("mass", "fput", chain(12), observe=EXTREMES, initial={"x": list(DICE.normal(0, 0.2, 12))}, **EXACT),
    "swing": Scene(
        LOSSLESS,
        LINE,
        GRID,
        parameters={"P": list(np.linspace(-0.55, 0.55, 12)), "K": list(DICE.uniform(1, 3, len(GRID.links) // 2))},
        observe=EXTREMES,
        initial={"x": list(DICE.normal(size=12)), "v": [0.0] * 12},
        **EXACT,
    ),
    "few": Scene("harmonic", "cubic_spring", chain(2), parameters={"sigma": 0.7}, observe=EXTREMES, **EXACT),
    "inerter": Scene("harmonic", "inerter", chain(2), parameters={"sigma": 0.5}, observe=EXTREMES, initial={"v": [1, 0]}, **EXACT),
}  # fmt: skip


@pytest.mark.parametrize("name", [pytest.param("fput", marks=pytest.mark.long), "swing", "few", "inerter"])
def test_a_conservative_network_keeps_the_energy_of_its_nodes_and_links(name: str) -> None:
    """To the tolerance of the steps, where the nodes' own energy moves by more than a tenth of what the links hold."""
    kinetic = nodes.sum(sp.Symbol("v") ** 2 / 2)
    scene = CONSERVATIVE[name].replace(observe={**EXTREMES, "e": maximum(kinetic), "f": minimum(kinetic)})
    result = run(scene, show_progress=False)
    start = float(energy_function(scene)(np.array(scene.y0)))
    assert float(result.high - result.low) < 1e-8 * abs(start)
    assert float(result.last) == pytest.approx(start, rel=1e-8)
    assert float(result.e - result.f) > 1e-2 * abs(start)


def test_it_is_the_energy_of_the_state() -> None:
    """Nodes of several kinds and with parameters of their own, drives and drawn weights against the energy of end states."""
    kinds = [{"oscillator": "pendulum", "at": [2]}, {"oscillator": "duffing", "at": [3]}]
    parameter_values = {"delta": [0.1, 0.2, 0.3], "sigma": [0.1, 0.2, 0.3]}
    mixed = Scene(
        "duffing",
        "spring",
        ring(3),
        nodes=kinds,
        parameters=parameter_values,
        observe=EXTREMES,
        integrator="dop853",
        **EXACT,
    )
    drawn = Scene(
        "duffing", "damper", ring(10), observe=EXTREMES, realisations=2, draws={"W": uniform(0.5, 1)}, **EXACT
    )
    drawn = drawn.replace(coupling="spring", parameters={"sigma": 0.5})
    for scene in (mixed, drawn):
        result = run(scene, show_progress=False, width=1)
        states = np.atleast_2d(result.states("end"))
        for k, state in enumerate(states):
            values = {axis.name: axis.values[k] for axis in scene.drawn}
            exact = energy_function(scene)(state, 20.0, values)
            assert np.atleast_1d(result.last)[k] == pytest.approx(float(exact), rel=1e-9)


def test_a_stop_and_a_section_at_an_energy() -> None:
    """A damped network passes a level of its energy, and stops where it falls through half of it."""
    scene = Scene(
        "duffing", "spring", chain(2), parameters={"u": 0, "delta": 0.1, "sigma": 0.3}, initial={"x": [1, 2], "v": [0, 0]},
        observe={"last": end(energy)}, **{**EXACT, "window": 200, "record": ["trajectory"], "samples": 2},
    )  # fmt: skip
    of = energy_function(scene)
    level = float(of(np.array(scene.y0))) / 2
    result = run(
        scene.replace(sections={"passed": {"function": f"energy - {level!r}"}}, stop=f"energy - {level / 2!r}"),
        show_progress=False,
    )
    assert int(result.status) == 7
    assert float(of(np.array(result.states("end")))) == pytest.approx(level / 2, rel=1e-9)
    assert float(of(result.passed.values[0])) == pytest.approx(level, rel=1e-9)
    assert int(result.passed_count) == 1


i, j, W = ends(load_oscillator("harmonic"))


def test_the_sums_of_the_energy_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take 0.1 s at 9000 links."""
    built, rows = [], EnergyTerms.rows
    monkeypatch.setattr(EnergyTerms, "rows", lambda terms: built.append(terms) or rows(terms))
    kernel_source(Scene("harmonic", "spring", ring(3), observe={"e": "mean(energy)"}))
    assert len(built) == 1


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"oscillator": "rossler", "coupling": "x->x"}, "observe e: energy: oscillator 'rossler' is a vector field"),
        ({"coupling": Rates({i.v: W * (j.x - i.x)})}, "observe e: energy: the coupling 'rates of v' has none"),
        ({"topology": one_way_ring(3)}, "found one-way links, first from 2 to 1 in one_way_ring(3); expected links"),
        ({"oscillator": "friction", "contact": "set-valued"}, "set-valued friction does work"),
        ({"observe": {"e": "mean(nodes.sum(energy))"}}, "expected the energy of the whole network outside of nodes"),
        ({"observe": {"e": "mean(rate(energy))"}}, "expected the rate of a state"),
    ],
)
def test_networks_without_an_energy(keywords: dict[str, Any], message: str) -> None:
    common = {"oscillator": "harmonic", "coupling": "spring", "topology": ring(3), "observe": {"e": "mean(energy)"}}
    with pytest.raises(ValueError, match="energy") as error:
        Scene(**{**common, **keywords})
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_parameter_of_that_name_is_meant() -> None:
    node = Lagrangian(V**2 / 2, sp.Symbol("energy") * X**2 / 2, coordinates={X: V}, parameters={"energy": 3})
    result = run(Scene(node, observe={"e": "mean(energy + 0*x_1)"}, **EXACT), show_progress=False)
    assert float(result.e) == 3.0


def test_the_work_of_a_force_that_jumps_is_exact_as_an_observable_and_a_quadrature_on_samples() -> None:
    pushed = Lagrangian(V**2 / 2, X**2 / 2, coordinates={X: V}, Q={X: "0.3*sign(cos(1.3*t))"}, initial={X: 1})
    alone = Scene(pushed, **{**EXACT, "window": 60, "record": ["trajectory"], "samples": 2})
    scene = alone.replace(observe={"power": mean(energy_of(alone).whole()[1])})
    function, errors = energy_function(scene), []
    for samples in (301, 3001, 30001):
        result = run(scene.replace(samples=samples), show_progress=False)
        states, time = result.states("trajectory"), result.time.values
        gained = np.diff(function(states)[[0, -1]])[0]
        assert gained == pytest.approx(60 * float(result.power), abs=1e-10)
        errors.append(np.abs(function.imbalance(time, states)).max())
    assert 1e-4 < errors[2] / errors[0] < 0.1  # the first power of the distance; the third would be 1e-6

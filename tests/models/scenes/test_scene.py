"""Scenes: what a user writes down is completed, checked, frozen and written back."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import os
import pickle
import re
from fractions import Fraction
from itertools import count
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
import xarray as xr
from catalogue import paths
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain import Axis, Scene, Section
from synchain.graphs import Topology, cartesian, chain, complete, ring, star, weighted
from synchain.models.graphs.topology import from_matrix
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.file import load_scene, scene_names
from synchain.models.scenes.scene import KEYWORDS

TABLE_1 = {"theta_b": 0.1, "mu_s": 0.3, "mu_k": 0.15, "a": 2.5, "epsilon": 2.0, "u": 0.1, "kappa": 1e5, "omega": 1.15}


def two(**changes: object) -> Scene:
    return Scene(**{"topology": chain(2), **changes})


# ---------------------------------------------------------------- defaults


def test_defaults_are_the_papers() -> None:
    scene = Scene()
    assert dict(scene.parameters) == TABLE_1
    assert scene.initial == {"x": (0.3,), "v": (0.0,)}
    assert (str(scene.oscillator), str(scene.friction), scene.contact, str(scene.coupling)) == (
        "friction",
        "exponential",
        "atan",
        "spring",
    )
    assert scene.topology == chain(1)
    assert scene.record == ()
    assert scene.section == Section("v_1", "falling", 0.0)
    assert (scene.transient, scene.window, scene.time_unit) == (300.0, 100.0, "period")
    assert scene.axes == ()
    assert (scene.shape, scene.cells) == ((), 1)
    assert scene.warnings == ()
    assert scene.period == pytest.approx(2 * math.pi / 1.15, rel=1e-15)


def test_two_oscillators_record_the_error_and_know_sigma() -> None:
    scene = two()
    assert scene.record == ("sync_error",)
    assert dict(scene.parameters) == {**TABLE_1, "sigma": 0.0}
    assert scene.equations.parameters == tuple(scene.parameters)
    assert scene.equations.state == ("x_1", "x_2", "v_1", "v_2")
    assert scene.y0 == (0.3, 0.28, 0.0, 0.0)


@pytest.mark.parametrize(
    ("n", "x"), [(1, (0.3,)), (4, (0.3, 0.28, 0.26, 0.24)), (5, (0.3, 0.285, 0.27, 0.255, 0.24)), (7, None)]
)
def test_default_start(n: int, x: tuple[float, ...] | None) -> None:
    initial = Scene(topology=chain(n)).initial
    assert initial["v"] == (0.0,) * n
    assert len(set(initial["x"])) == n
    assert (initial["x"][0], initial["x"][-1]) == (0.3, 0.3 if n == 1 else 0.24)
    if x is not None:
        assert initial["x"] == x


def test_parameters_are_completed_and_text_is_a_number() -> None:
    scene = two(parameters={"omega": "2*pi/5", "sigma": np.float64(0.1)})
    assert scene.parameters["omega"] == 2 * math.pi / 5
    assert scene.parameters["sigma"] == 0.1
    assert scene.parameters["mu_s"] == 0.3
    assert {type(value) for value in scene.parameters.values()} == {float}


def test_an_undriven_oscillator_counts_plain_time() -> None:
    scene = Scene(oscillator="harmonic", topology=chain(2))
    assert (scene.friction, scene.time_unit, scene.angular_frequency, scene.period) == (None, "time", None, None)
    with pytest.raises(ValueError, match="'harmonic' is not driven"):
        Scene(oscillator="harmonic", time_unit="period")


def test_friction_is_left_out_where_the_oscillator_takes_none() -> None:
    assert Scene(oscillator="duffing").friction is None
    with pytest.raises(ValueError, match="friction"):
        Scene(oscillator="duffing", friction="exponential")


# ---------------------------------------------------------------- frozen


def test_a_scene_is_frozen_hashable_and_picklable() -> None:
    scene = two(axes=[Axis("sigma", [0.1, 0.2])])
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.transient = 1.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        scene.parameters["omega"] = 2.0  # type: ignore[index]
    with pytest.raises(AttributeError):
        scene.parameters._items = {}
    for again in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene), two(axes=scene.axes)):
        assert again == scene
        assert hash(again) == hash(scene)
    assert two() != scene


def test_frozen_reads_like_a_dict() -> None:
    mapping = FrozenDict({"a": 1, "b": 2})
    assert mapping == {"b": 2, "a": 1}
    assert {**mapping, "c": 3} == {"a": 1, "b": 2, "c": 3}
    assert hash(mapping) == hash(FrozenDict({"b": 2, "a": 1}))
    assert repr(mapping) == "{'a': 1, 'b': 2}"


def test_the_givers_list_can_change_later() -> None:
    x = [0.1, 0.2]
    scene = two(initial={"x": x})
    x[0] = 9.0
    assert scene.initial["x"] == (0.1, 0.2)


# ---------------------------------------------------------------- start


@pytest.mark.parametrize(
    ("value", "same"),
    [
        (np.array(0.2), 0.2),
        (xr.DataArray(0.2), 0.2),
        (sp.pi / 7, "pi/7"),
        (sp.sqrt(2), "sqrt(2)"),
        (sp.Rational(1, 7), 1 / 7),
    ],
)
def test_one_number_of_any_kind(value: object, same: object) -> None:
    assert Scene(parameters={"omega": value}) == Scene(parameters={"omega": same})
    assert Scene(initial={"x": value}) == Scene(initial={"x": same})


def test_random_starts_are_reproducible_and_independent() -> None:
    def drawn(**box: object) -> Scene:
        return Scene(topology=chain(6), initial={"x": box, "v": box})

    first = drawn(low=-1, high=1, rng=3)
    assert first == drawn(low=-1, high=1, rng=3)
    assert first.initial["x"] != drawn(low=-1, high=1, rng=4).initial["x"]
    assert first.initial["x"] != first.initial["v"]
    assert all(-1 <= value <= 1 for value in first.y0)
    assert first.initial["x"][:2] == (
        -0.928349613377615,
        0.12825112108307501,
    )  # the same on every machine and in every version


def test_random_starts_use_the_seed_of_the_scene() -> None:
    box = {"x": {"low": 0, "high": 1}}
    assert two(initial=box, rng=7).initial == two(initial={"x": {"low": 0, "high": 1, "rng": 7}}).initial
    assert two(initial=box, rng=7).initial != two(initial=box, rng=8).initial


def test_one_number_starts_all() -> None:
    assert two(initial={"v": 0.2}).initial == {"x": (0.3, 0.28), "v": (0.2, 0.2)}
    assert two(initial={"x": np.array([1.0, 2.0])}).initial["x"] == (1.0, 2.0)


# ---------------------------------------------------------------- axes


def test_axis_values_are_the_nearest_floats_of_their_decimals() -> None:
    axis = Axis.between("sigma", 0, 0.6, 601)
    assert axis.values == tuple(float(Fraction(i, 1000)) for i in range(601))
    assert axis.values[100] == 0.1
    assert Axis.between("x_1", 0.6, -0.6, 3).values == (0.6, 0.0, -0.6)
    assert Axis.between("sigma", 0.3, 0.3, 1).values == (0.3,)


def test_axis_takes_any_iterable() -> None:
    for values in ([0.1, 0.2], (0.1, 0.2), np.array([0.1, 0.2]), iter(["0.1", "1/5"]), np.float32([0.5])):
        axis = Axis("sigma", values)
        assert {type(value) for value in axis.values} == {float}
    assert Axis("sigma", range(3)).values == (0.0, 1.0, 2.0)


def test_shape_and_cells() -> None:
    grid = two(axes={"omega": [1.1, 1.2], "sigma": {"from": 0, "to": 0.6, "count": 7}})
    assert (grid.shape, grid.cells) == ((2, 7), 14)
    pairs = two(axes=[Axis("omega", [1.1, 1.2]), Axis("x_2", [0, 1])], zipped=True)
    assert (pairs.shape, pairs.cells) == ((2,), 2)


REFUSED = [
    # (keywords, part of the message)
    ({"oscillator": "frictoin"}, "unknown oscillator 'frictoin'"),
    ({"friction": "exponentail"}, "unknown friction 'exponentail'"),
    ({"coupling": "sprong"}, "unknown coupling 'sprong'"),
    ({"contact": "tanh"}, "contact"),
    ({"coupling": None}, "which has links"),
    ({"topology": "chain"}, "expected a graph"),
    ({"parameters": {"omga": 1}}, "did you mean 'omega'?"),
    ({"oscilator": "duffing"}, "unknown keyword 'oscilator' of Scene; known: oscillator, "),
    ({"oscilator": "duffing"}, "did you mean 'oscillator'?"),
    ({"sigma": 0.1}, "a parameter is given as parameters={'sigma': …}"),
    ({"coupling": chain(3)}, "coupling: found the graph chain(3); expected a coupling; write topology=…"),
    ({"stop": "nodes.mean(v^2)"}, "found the sign ^; expected powers as x**2"),
    ({"stop": "nodes.max(v)"}, "did you mean 'nodes.maximum'?"),
    ({"stop": "nodes.maximum(v) < 1"}, "found the condition nodes.maximum(v) < 1; expected a value"),
    ({"parameters": {"omega": math.nan}}, "finite"),
    ({"parameters": {"omega": math.inf}}, "finite"),
    ({"parameters": {"omega": 10**400}}, "finite"),
    ({"parameters": {"omega": 10**5000}}, "finite"),
    ({"parameters": {"omega": True}}, "found True (bool)"),
    ({"parameters": {"omega": 1j}}, "expected a number"),
    ({"parameters": {"omega": sp.I}}, "found I (ImaginaryUnit); expected a number"),
    ({"parameters": {"omega": sp.Symbol("a", real=True)}}, "found a (Symbol); expected a number"),
    ({"parameters": {"omega": sp.oo}}, "expected a number"),
    ({"parameters": {"omega": np.array([0.2])}}, "found 1 values for 2 oscillators"),
    ({"parameters": {"omega": "exit()"}}, "not a constant"),
    ({"parameters": {"sigma": -0.1}}, "sigma = -0.1"),
    ({"parameters": {"kappa": 0}}, "above 0"),
    ({"parameters": {1: 1}}, "expected text"),
    ({"parameters": [1]}, "expected a table"),
    ({"topology": ring(10**8)}, "topology ring: n = 100000000; expected at most 1000000 nodes"),
    ({"coupling": "spring", "topology": complete(10**9)}, "expected at most 1000000 nodes in a model: reduce n"),
    ({"initial": {"y": 1}}, "unknown key 'y'; known: x, v"),
    ({"initial": {"x": [1, 2, 3]}}, "found 3 values for 2 oscillators"),
    ({"initial": {"x": [1]}}, "found 1 values for 2 oscillators"),
    ({"initial": {"x": count()}}, "more than 2 values"),
    ({"initial": {"x": [1, "nan"]}}, "initial x_2"),
    ({"initial": {"x": math.inf}}, "finite"),
    ({"transient": math.inf}, "finite"),
    ({"initial": {"x": {1, 2}}}, "initial x"),
    ({"initial": {"x": {"low": 0}}}, "'high' is missing"),
    ({"initial": {"x": {"low": 1, "high": 0}}}, "low <= high"),
    ({"initial": {"x": {"low": 1, "high": 2, "sed": 0}}}, "unknown key 'sed'; known: low, high, rng"),
    ({"record": "sync_error"}, "expected a list"),
    ({"record": ["sync_eror"]}, "did you mean 'sync_error'?"),
    ({"record": ["section", "section"]}, "each record once"),
    ({"record": ["trajectory"], "samples": 1}, "expected at least 2"),
    ({"section": "v_3 falling"}, "unknown section variable 'v_3'"),
    ({"section": "v_0 falling"}, "unknown section variable 'v_0'"),
    ({"section": "v_01 falling"}, "unknown section variable 'v_01'"),
    ({"section": "v_² falling"}, "unknown section variable"),
    ({"section": "w_1 falling"}, "unknown section variable 'w_1'"),
    ({"section": "v_1 faling"}, "did you mean 'falling'?"),
    ({"section": "v_1"}, "expected 'state direction [level]'"),
    ({"section": "v_1 rising x"}, "section level"),
    ({"section": 3}, "expected text"),
    ({"transient": -1}, "transient: found -1.0"),
    ({"window": -1}, "window: found -1.0"),
    ({"window": 0}, "nothing to record"),
    ({"transient": math.nan}, "finite"),
    ({"time_unit": "periods"}, "did you mean 'period'?"),
    ({"samples": 1.0}, "whole number"),
    ({"samples": -1}, "samples"),
    ({"integrator": "rodas 5"}, "unknown integrator 'rodas 5'"),
    ({"integrator": "damper"}, "unknown integrator 'damper'; known: auto, cash_karp, dop853"),
    ({"integrator": "rodas5"}, "did you mean 'rodas5p'?"),
    ({"integrator": 5}, "expected text"),
    ({"rtol": -1e-8}, "rtol"),
    ({"rtol": 9e-16}, "from 1e-15 to 0.1"),
    ({"rtol": 0.2}, "from 1e-15 to 0.1"),
    ({"atol": -1e-8}, "atol"),
    ({"atol": 0}, "above 0"),
    ({"max_steps": 0}, "max_steps"),
    ({"max_steps": True}, "whole number"),
    ({"rng": -1}, "rng"),
    ({"title": 3}, "title"),
    ({"zipped": 1}, "true or false"),
    ({"axes": "sigma"}, "Axis objects"),
    ({"axes": [("sigma", [1])]}, "expected an Axis"),
    ({"axes": {"sgima": [1]}}, "unknown axis 'sgima'"),
    ({"axes": {"sgima": [1]}}, "did you mean 'sigma'?"),
    ({"axes": {"x_3": [1]}}, "unknown axis 'x_3'"),
    ({"axes": {"sigma": [-1]}}, "axis sigma = -1"),
    ({"axes": {"sigma": []}}, "no values"),
    ({"axes": {"sigma": 0.1}}, "expected a list"),
    ({"axes": {"sigma": "0.1"}}, "expected a list"),
    ({"axes": {"sigma": [math.nan]}}, "finite"),
    ({"axes": {"sigma": [[0.1]]}}, "expected a number"),
    ({"axes": {"sigma": {"from": 0, "to": 1}}}, "'count' is missing"),
    ({"axes": {"sigma": {"from": 0, "to": 1, "count": 0}}}, "count"),
    ({"axes": {"sigma": {"from": 0, "to": 1, "count": 1}}}, "two different ends"),
    ({"axes": {"sigma": {"from": 0, "to": 1, "count": 10**9}}}, "count"),
    ({"axes": {"omega": [0, 1]}}, "no period"),
    ({"axes": [Axis("sigma", [0]), Axis("sigma", [1])]}, "occurs twice"),
    ({"axes": {"sigma": [0], "omega": [1, 2]}, "zipped": True}, "different lengths (sigma: 1, omega: 2)"),
    (
        {"axes": {"sigma": range(1001), "omega": range(1, 1001), "x_1": range(1000)}},
        "1001000000 cells; expected at most 1000000000",
    ),
    ({"continuation": "sideways"}, "unknown continuation"),
    ({"continuation": "up", "axes": {"sigma": [0.1], "x_1": [0, 1]}}, "initial state 'x_1'"),
    ({"continuation": "down", "axes": {"sigma": [0.2, 0.1]}}, "do not rise"),
]


@pytest.mark.parametrize(("keywords", "part"), REFUSED, ids=lambda v: v if isinstance(v, str) else "")
def test_refused(keywords: dict, part: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        two(**keywords)
    assert type(caught.value) in (ValueError, TypeError), "a name of our own says nothing"
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "keywords", [{"parameters": {"sigma": 0.1}}, {"axes": {"sigma": [0.1]}}, {"parameters": {"sigma": 0}}]
)
def test_one_oscillator_has_nothing_to_couple(keywords: dict) -> None:
    with pytest.raises(ValueError, match="there is nothing to couple"):
        Scene(topology=chain(1), **keywords)


def test_one_oscillator_has_no_synchronisation_error() -> None:
    with pytest.raises(ValueError, match="one oscillator"):
        Scene(record=["sync_error"])


@pytest.mark.parametrize("name", ["sprong", ""])
def test_the_name_of_an_unused_coupling_is_checked(name: str) -> None:
    with pytest.raises(ValueError, match=f"unknown coupling '{name}'"):
        Scene(topology=chain(1), coupling=name)


def test_no_oscillator() -> None:
    with pytest.raises(ValueError, match="n = 0"):
        Scene.from_dict({"topology": {"name": "chain", "n": 0}})


def test_too_many_values_are_refused_without_building_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synchain.models.sweeps.axis.LIMIT", 10)
    with pytest.raises(ValueError, match="more than 10 values"):
        Axis("sigma", count())


# ---------------------------------------------------------------- warnings


def test_a_disconnected_graph_is_allowed_but_said() -> None:
    pair = [[-1, 1, 0, 0], [1, -1, 0, 0], [0, 0, -1, 1], [0, 0, 1, -1]]
    (sentence,) = Scene(topology=from_matrix(pair)).warnings
    assert "multiplicity 2" in sentence
    assert "no complete synchronisation" in sentence
    assert Scene(topology=ring(5)).warnings == ()


def test_one_way_links_that_reach_everyone_are_fine_and_others_are_said() -> None:
    fed_forward = [[0, 0, 0], [1, -1, 0], [0, 1, -1]]
    assert Scene(topology=from_matrix(fed_forward)).warnings == ()
    two_masters = [[0, 0, 0], [0, 0, 0], [1, 1, -2]]
    (sentence,) = Scene(topology=from_matrix(two_masters)).warnings
    assert "multiplicity 2" in sentence


def test_equal_starts_are_said() -> None:
    (sentence,) = two(initial={"x": 0.3}).warnings
    assert "start from the same state" in sentence
    assert two(initial={"x": 0.3}, axes={"x_1": [0.1, 0.2]}).warnings == ()


def test_equal_starts_of_unequal_nodes_are_not_said_to_stay_equal() -> None:
    """The synchronisation error of this ring becomes 0.113."""
    settings = {"topology": ring(3), "initial": {"x": 0.1, "v": 0.0}}
    uneven = Scene(oscillator="rotor", coupling="torsion", parameters={"power": [0.1, -0.2, 0.1]}, **settings)
    (sentence,) = uneven.warnings
    assert "stays above 0" in sentence
    even = uneven.replace(parameters={"power": 0.1})
    assert "stays 0" in even.warnings[-1]
    swept = even.replace(axes={"power_1": [0.1, 0.2]})
    assert not any("stays 0" in sentence for sentence in swept.warnings)
    kinds = Scene(
        topology=ring(3),
        initial={"x": 0.1, "v": 0.0},
        nodes=[{"oscillator": "harmonic", "at": [2]}],
        parameters={"u": 0.0},
    )
    assert not any("stays 0" in sentence for sentence in kinds.warnings)


# ---------------------------------------------------------------- replace


def test_replace_checks_again_and_keeps_the_rest() -> None:
    scene = two(parameters={"omega": 1.4}, transient=50)
    changed = scene.replace(rtol=1e-6, sigma=0.2)
    assert (changed.rtol, changed.transient) == (1e-6, 50.0)
    assert changed.parameters == {**scene.parameters, "sigma": 0.2}
    with pytest.raises(ValueError, match="rtol"):
        scene.replace(rtol=-1)
    with pytest.raises(TypeError, match="rtoll"):
        scene.replace(rtoll=1)
    assert scene.replace() == scene


def test_another_contact_keeps_the_start_and_finds_the_modes_anew() -> None:
    exact = Scene(topology=chain(2), contact="set-valued", initial={"x": [0.3, 0.2], "v": 0.1})
    smooth = exact.replace(contact="atan")
    assert smooth.initial == {"x": (0.3, 0.2), "v": (0.1, 0.1)}
    assert smooth.replace(contact="set-valued").initial == exact.initial


def test_another_network_keeps_the_start_that_was_given() -> None:
    """A number and a range fit every number of nodes; a list that no longer fits is refused."""
    many = two(initial={"x": 5, "v": {"low": -1, "high": 1}}).replace(topology=star(5))
    assert many == Scene(topology=star(5), initial={"x": 5, "v": {"low": -1, "high": 1}})
    assert many.replace(rng=3) == Scene(topology=star(5), initial={"x": 5, "v": {"low": -1, "high": 1}}, rng=3)
    assert two().replace(topology=star(5)) == Scene(topology=star(5))
    scene = two(initial={"x": [1, 2]})
    with pytest.raises(
        ValueError, match="initial x: found 2 values for 5 oscillators; expected 5 values or one number"
    ):
        scene.replace(topology=star(5))
    assert scene.replace(topology=chain(3), initial={"x": 0.1}).initial["x"] == (0.1,) * 3
    assert scene.replace(nodes=[{"at": [2], "oscillator": "duffing"}], friction="default").initial["x"] == (1.0, 2.0)
    smooth = Scene("harmonic", None, None, initial={"x": 2}).replace(oscillator="duffing")
    assert smooth.initial == {"x": (2.0,), "v": (0.0,)}
    with pytest.raises(ValueError, match="initial: unknown key 'x'; known: phi"):
        smooth.replace(oscillator="double_pendulum")
    assert scene.replace(topology=from_matrix([[-2, 2], [2, -2]])).initial["x"] == (1.0, 2.0)


def test_replace_takes_the_parameters_of_the_new_model() -> None:
    exact = Scene(topology=chain(2), contact="set-valued")
    smooth = exact.replace(contact="atan", kappa=1e4)
    assert smooth == exact.replace(contact="atan").replace(kappa=1e4)
    assert smooth.parameters["kappa"] == 1e4
    assert Scene(topology=chain(1)).replace(topology=chain(2), sigma=0.2).parameters["sigma"] == 0.2
    with pytest.raises(TypeError, match="unknown parameter or keyword 'kappa'; known: theta_b"):
        exact.replace(kappa=1e4)
    with pytest.raises(TypeError, match=r"unknown parameter or keyword 'kapa'; .* kappa"):
        exact.replace(contact="atan", kapa=1e4)
    with pytest.raises(ValueError, match="unknown parameter 'kappa'"):
        smooth.replace(contact="set-valued")


def test_a_parameter_replaces_its_axis_and_lists_are_no_axes() -> None:
    swept = two(axes={"sigma": [0.1, 0.2], "omega": [1.0, 1.1]}, zipped=True)
    fixed = swept.replace(sigma=0.3)
    assert (fixed.axes, fixed.zipped, fixed.parameters["sigma"]) == (two(axes={"omega": [1.0, 1.1]}).axes, True, 0.3)
    assert (fixed.replace(omega=1.2).axes, fixed.replace(omega=1.2).zipped) == ((), False)
    assert swept.replace(u=0.2).axes == swept.axes
    words = r"numbers to compare are an axis: run\(scene, sigma=\[…\]\)"
    with pytest.raises(ValueError, match=f"found 3 values for 2 links.*{words}"):
        two().replace(sigma=[0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=f"found 3 values for 2 oscillators.*{words.replace('sigma', 'u')}"):
        two().replace(u=[0.1, 0.2, 0.3])


def test_replace_between_one_and_many() -> None:
    one = Scene(parameters={"omega": 1.4})
    many = one.replace(topology=chain(4))
    assert many == Scene(parameters={"omega": 1.4}, topology=chain(4))
    assert many.replace(topology=chain(1)) == one
    with pytest.raises(ValueError, match="nothing to couple"):
        many.replace(sigma=0.1).replace(topology=chain(1))


def test_replace_the_model() -> None:
    smooth = two(parameters={"sigma": 0.2}).replace(oscillator="harmonic", friction=None)
    assert dict(smooth.parameters) == {"sigma": 0.2}
    assert smooth.time_unit == "time"


# ---------------------------------------------------------------- dictionaries and files


@pytest.mark.parametrize("name", scene_names())
def test_every_shipped_scene_is_whole_and_written_back(name: str) -> None:
    scene = load_scene(name)
    text = json.dumps(scene.as_dict())
    assert Scene.from_dict(json.loads(text)) == scene
    assert scene.title
    assert scene.warnings == ()
    assert len(repr(scene)) < 200
    assert scene.equations.n == scene.n


def test_a_matrix_is_written_back_as_its_links() -> None:
    scene = Scene(topology=from_matrix([["-1/3", "1/3"], [2, -2]], name="odd"), section=Section("x_2", "both", 0.1))
    again = Scene.from_dict(json.loads(json.dumps(scene.as_dict())))
    assert again == scene
    assert scene.as_dict()["topology"] == {"name": "odd", "n": 2, "directed": True, "edges": [[2, 1, "1/3"], [1, 2, 2]]}
    assert scene.as_dict()["section"] == "x_2 both 0.1"


K3 = [[-2, 1, 1], [1, -2, 1], [1, 1, -2]]


@pytest.mark.parametrize(
    ("name", "rows"),
    [("ring", [[-1, 1, 0], [1, -2, 1], [0, 1, -1]]), ("ring", [[0]]), ("cycle", [[-1, 1], [1, -1]]), ("ring(4)", K3)],
)
def test_a_matrix_under_the_name_of_another_graph_is_refused(name: str, rows: list[list[int]]) -> None:
    message = re.escape(f"topology: found the name {name!r} and links other than those of {name.split('(')[0]}(")
    with pytest.raises(ValueError, match=message):
        Scene.from_dict({"topology": {"name": name, "matrix": rows, "n": 3}})
    with pytest.raises(ValueError, match=message):
        Scene(topology=from_matrix(rows, name=name))
    with pytest.raises(ValueError, match=message.replace("topology", "draw topology")):
        Scene(topology=from_matrix(rows), realisations=1, draws={"topology": [from_matrix(rows, name=name)]})


@pytest.mark.parametrize(
    "graph", [from_matrix(K3, "ring"), from_matrix(K3, "K(3)"), cartesian(chain(2), weighted(chain(2), 2))]
)
def test_matrices_under_names_of_their_own_and_true_ones_are_kept(graph: Topology, tmp_path: Path) -> None:
    scene = Scene(topology=graph)
    scene.save(tmp_path / "scene.toml")
    assert load_scene(tmp_path / "scene.toml") == scene


def test_the_rows_of_a_matrix_are_counted() -> None:
    with pytest.raises(ValueError, match="n = 3 but the matrix has 1 row; remove n"):
        Scene.from_dict({"topology": {"matrix": [[0]], "n": 3}})


FIGURES = {
    "figure_1b": (1, 1.15, None, None),
    "figure_3": (1, None, "omega", (1.3, 1.9)),
    "figure_4a": (2, 1.15, "sigma", (0.0, 0.6)),
    "figure_4b": (2, 1.4, "sigma", (0.0, 0.6)),
    "figure_4c": (2, 1.55, "sigma", (0.0, 0.6)),
    "figure_4d": (2, 1.15, "sigma", (0.0, 0.6)),
    "figure_4e": (2, 1.4, "sigma", (0.0, 0.6)),
    "figure_4f": (2, 1.55, "sigma", (0.0, 0.6)),
    "figure_5": (3, 1.15, "sigma", (0.0, 0.4)),
    "figure_6": (3, 1.55, "sigma", (0.0, 0.4)),
    "figure_7": (4, 1.15, "sigma", (0.0, 0.35)),
    "figure_8": (4, 1.4, "sigma", (0.0, 0.35)),
}


@pytest.mark.parametrize("name", FIGURES)
def test_the_papers_figures(name: str) -> None:
    n, omega, axis, ends = FIGURES[name]
    scene = load_scene(name)
    assert scene.topology == chain(n)
    swept = {"omega", "sigma"} if axis == "omega" else {"sigma"}
    expected = {**TABLE_1, "omega": omega, "sigma": 0.0}
    assert {k: v for k, v in scene.parameters.items() if k not in swept} == {
        k: v for k, v in expected.items() if k not in swept
    }
    assert [a.name for a in scene.axes] == ([axis] if axis else [])
    if axis:
        assert (scene.axes[0].values[0], scene.axes[0].values[-1]) == ends
        assert len(scene.axes[0]) >= 601
        assert scene.transient >= 300
        assert scene.window >= 100
    start = (-0.4, 0.2) if name == "figure_3" else tuple((30 - 2 * i) / 100 for i in range(n)) + (0.0,) * n
    assert scene.y0 == start


def test_the_reference_run() -> None:
    scene = load_scene("two_oscillators")
    assert dict(scene.parameters) == {**TABLE_1, "sigma": 0.1}
    assert scene.y0 == (0.3, 0.28, 0.0, 0.0)
    assert (scene.transient, scene.window, scene.samples) == (0.0, 100.0, 10001)


def write(folder: Path, text: str | bytes, name: str = "mine.toml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_file_says_the_same_as_python(tmp_path: Path) -> None:
    write(tmp_path, "-2 1 1\n1 -2 1\n1 1 -2\n", "G.txt")
    text = """
        record = ["section"]
        section = "x_2 rising 0.1"
        transient = 10
        [topology]
        file = "G.txt"
        [parameters]
        omega = "7/5"
        [initial]
        v = 0.1
        [sweep]
        zipped = true
        sigma = [0.1, 0.2]
        x_1 = {from = 0, to = "1/2", count = 2}
    """
    expected = Scene(
        record=("section",),
        section=Section("x_2", "rising", 0.1),
        transient=10,
        topology=from_matrix([[-2, 1, 1], [1, -2, 1], [1, 1, -2]], name="G.txt"),
        parameters={"omega": 1.4},
        initial={"v": 0.1},
        axes=[Axis("sigma", [0.1, 0.2]), Axis("x_1", [0, 0.5])],
        zipped=True,
    )
    path = write(tmp_path, text)
    assert load_scene(path) == load_scene(str(path)) == expected
    assert load_scene(write(tmp_path, b"\xef\xbb\xbf" + text.encode(), "marked.toml")) == expected


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("oscillator = friction", "mine.toml: not TOML"),
        ("a = 1\nb = =", "line 2, column 5"),
        ("rtoll = 1e-8", "mine.toml: scene: unknown key 'rtoll'"),
        ("rtoll = 1e-8", "did you mean 'rtol'?"),
        ("axes = []", "unknown key 'axes'"),
        ("topology = 'chain'", "topology: found 'chain'"),
        ("[topology]\nname = 'rnig'\nn = 3", "unknown topology 'rnig'"),
        ("[topology]\nname = 'ring'", "'n' is missing"),
        ("[topology]\nname = 'ring'\nn = 3.0", "whole number"),
        ("[topology]\nname = 'ring'\nn = 1000000000000", "whole number from"),
        ("[topology]\nname = 'ring'\nn = 3\nm = 4", "unknown key 'm'"),
        ("[topology]\nmatrix = [[1, 2], [3, 4]]", "sums to 3"),
        ("[topology]\nmatrix = [[0, 0], [0, 0]]\nn = 3", "the matrix has 2 rows"),
        ("[topology]\nfile = 'nowhere.txt'", "nowhere.txt"),
        ("[topology]\nfile = '.'", "folder"),
        ('[topology]\nfile = "a\\u0000b"', "mine.toml"),
        ("[topology]\nfile = 'G.txt'\nn = 2", "'file' alone"),
        ("[parameters]\nomega = 2020-01-01", "found datetime.date(2020, 1, 1)"),
        ("[parameters]\nomega = nan", "finite"),
        ("[parameters.omega]\nx = 1", "expected a number"),
        ("zipped = true\n[sweep]\nzipped = true\nomega = [1]", "given twice"),
        ("sweep = 3", "expected a table"),
        ("parameters = 3", "expected a table"),
        ("x = " + "[" * 100_000, "too deep"),
        ("x = " + "9" * 5000, "too deep or too long"),
        (b"title = '\xff'", "not UTF-8"),
        ("#" * 1_000_001, "more than 1000000 bytes"),
    ],
)
def test_bad_files(tmp_path: Path, text: str | bytes, part: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        load_scene(write(tmp_path, text))
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "mine.toml" in str(caught.value)


def test_missing_scenes(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"unknown scene 'figure_4'; known: .*figure_4a.*did you mean 'figure_"):
        load_scene("figure_4")
    with pytest.raises(ValueError, match=r"no such file; .* 'figure_3' without .toml names a shipped scene"):
        load_scene(tmp_path / "figure_3.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ValueError, match="found a folder"):
        load_scene(tmp_path / "folder.toml")
    with pytest.raises(TypeError, match="found 3"):
        load_scene(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown scene"):
        load_scene("../scenes/figure_3")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="the superuser reads everything")
def test_a_file_without_rights(tmp_path: Path) -> None:
    path = write(tmp_path, "")
    path.chmod(0)
    with pytest.raises(ValueError, match="cannot be read"):
        load_scene(path)


def test_a_device_is_not_read() -> None:
    link = Path("/dev/zero.toml")
    with pytest.raises(ValueError, match="no such file"):
        load_scene(link)


# ---------------------------------------------------------------- the manual

MANUAL = (Path(__file__).parents[3] / "docs" / "scenes.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", MANUAL, re.DOTALL)


def test_the_manuals_python_and_file_say_the_same(tmp_path: Path) -> None:
    (program,) = blocks("python")
    path = write(tmp_path, blocks("toml")[0])
    names: dict[str, object] = {}
    exec(program.replace("mine.toml", str(path)), names)
    assert names["scene"] == load_scene(path)


@pytest.mark.parametrize("text", blocks("toml"))
def test_the_manuals_files_are_scenes(tmp_path: Path, text: str) -> None:
    assert load_scene(write(tmp_path, text)).n > 1


def test_the_manuals_message_is_the_real_one(tmp_path: Path) -> None:
    text = '[topology]\nname = "chain"\nn = 2\n[parameters]\nomga = 1'
    with pytest.raises(ValueError, match="omga") as caught:
        load_scene(write(tmp_path, text))
    assert f"```\n{caught.value}\n```" in MANUAL


def test_the_manual_has_every_key() -> None:
    rows = {name for row in re.findall(r"^\| (`.*?) \|", MANUAL, re.MULTILINE) for name in re.findall(r"\w+", row)}
    keys = set(KEYWORDS) - {"axes"} | {"sweep"}
    assert rows == keys


# ---------------------------------------------------------------- anything at all

ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["x", "v_1 rising", "2*pi", "sigma", "trajectory", "up", "none", 10**400, b"x"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["name", "n", "matrix", "x", "sigma", "from", "to", "count", "low", "high", "x_1", 3])
            | st.text(max_size=3),
            inner,
            max_size=4,
        )
    ),
    max_leaves=6,
)
VALID = Scene(
    topology=chain(3),
    axes={"sigma": [0.1, 0.2], "x_1": [0, 1]},
    record=("sync_error", "trajectory"),
    samples=5,
    parameters={"omega": 1.4},
).as_dict()


def outcome(tree: dict) -> tuple[Scene | None, str]:
    try:
        return Scene.from_dict(tree), ""
    except (ValueError, TypeError) as error:
        return None, str(error)


def is_one_clear_line(message: str) -> bool:
    return 10 < len(message) < 1000 and "\n" not in message


@settings(max_examples=250)
@given(st.data())
def test_any_mutated_scene_is_a_scene_or_one_clear_line(data: st.DataObject) -> None:
    tree = copy.deepcopy(VALID)
    for path in data.draw(st.lists(st.sampled_from(paths(VALID)[1:]), min_size=1, max_size=2)):
        *inside, last = path
        branch = tree
        try:
            for key in inside:
                branch = branch[key]
            if data.draw(st.booleans()):
                branch[last] = data.draw(ANYTHING)
            elif isinstance(branch, dict):
                branch[data.draw(st.text(max_size=6))] = branch.pop(last)
        except (LookupError, TypeError):
            pass  # an earlier change removed this place
    scene, message = outcome(tree)
    if scene is None:
        assert is_one_clear_line(message)
    else:
        assert Scene.from_dict(json.loads(json.dumps(scene.as_dict()))) == scene
        assert hash(scene) == hash(Scene.from_dict(scene.as_dict()))


@settings(max_examples=200)
@given(st.sampled_from(sorted(VALID)), ANYTHING)
def test_any_value_of_any_key_is_a_scene_or_one_clear_line(key: str, value: object) -> None:
    scene, message = outcome({key: value})
    assert scene is not None or is_one_clear_line(message)
    assert scene is None or Scene.from_dict(scene.as_dict()) == scene

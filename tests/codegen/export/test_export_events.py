"""Exported runs through events against `sc.run`: compiled C, and Python; times, rows, modes, and states at the end."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from test_export import COMPILER, array, shared_library

import synchain as sc
from synchain.codegen.export.c import to_c
from synchain.codegen.export.numba import to_numba
from synchain.codegen.export.python import to_python

x, v, y, th, om, t, e, V, U = sp.symbols("x v y th om t e V U")
ALONE = sc.graphs.chain(1)


def scene_of(*parts: Any, window: float, **given: Any) -> sc.Scene:
    return sc.Scene(
        *parts, transient=0, window=window, time_unit="time", record=["events"], rtol=1e-11, atol=1e-12, integrator="dop853", **given
    )  # fmt: skip


def scenes() -> dict[str, Callable[[], sc.Scene]]:
    """Scenes by name."""
    pole = sc.Lagrangian(
        v**2 / 2 + om**2 / 2, x**2 / 2 - sp.cos(th) / 2 + x * th / 4, coordinates={x: v, th: om},
        initial={x: 0.05, th: 1, v: 0, om: 0.1},
        friction="coulomb", contact="set-valued",
        events=[sc.Friction(3 * sp.sin(2 * t) / 10 - v, load=0.6), sc.Friction(-om, load=0.05), sc.Stop(sp.Rational(1, 10) - x, 0.6)],
    )  # fmt: skip
    ball = sc.Lagrangian(
        v**2 / 2, 10 * y, coordinates={y: v}, parameters={e: 0.8}, initial={y: 1}, events=[sc.Stop(y, e)]
    )
    neuron = sc.Field({V: V**2 / 25 + 5 * V + 150 - U, U: (V / 5 - U) / 50}, initial={V: -65, U: -13},
                      events=[sc.Reset(V - 30, {V: -65, U: U + 8})])  # fmt: skip
    relay = sc.Field({x: y, y: -sp.sign(x + sp.Rational(7, 10) * y)}, contact="set-valued", initial={x: 3, y: 0})
    joined = sc.Rates({"V": "W*(V_j - V_i)/10"})
    return {
        "pole": lambda: scene_of(pole, None, ALONE, window=8),
        "ball": lambda: scene_of(ball, None, ALONE, window=3),
        "neurons": lambda: scene_of(neuron, joined, sc.graphs.chain(2), window=60),
        "relay": lambda: scene_of(relay, None, ALONE, window=8),
        "friction": lambda: scene_of("friction", "spring", sc.graphs.chain(2), window=25, friction="coulomb_static", contact="set-valued"),
    }  # fmt: skip


SCENES = scenes()
Events = list[tuple[float, int, float, float]]


def start_of(scene: sc.Scene) -> list[float]:
    """The states at the start; the modes, which `begin` sets, are left wrong."""
    given = iter(np.ravel(scene.y0))
    modes = {f"{mode}_{i + 1}" for mode in scene.equations.modes for i in range(scene.n)} | scene.equations.modes
    return [7.0 if name in modes else float(next(given)) for name in scene.equations.state]


def run_python(scene: sc.Scene, folder: Path, stop: float) -> tuple[list[float], Events]:
    space: dict[str, Any] = {}
    exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
    state, events = start_of(scene), Events()
    assert space["begin"](0.0, state, space["NUMBERS"]) == 0
    assert space["run"](0.0, stop, state, space["NUMBERS"], 1e-11, 1e-12, lambda *event: events.append(event)) == 0
    return state, events


def run_c(scene: sc.Scene, folder: Path, stop: float) -> tuple[list[float], Events]:
    equations, real = scene.equations, ctypes.c_double
    library = shared_library(to_c(equations, scene.parameters), folder)
    state, events = array(equations.dimension, start_of(scene)), Events()
    numbers = array(len(equations.parameters), [scene.parameters[name] for name in equations.parameters])
    seen = ctypes.CFUNCTYPE(None, real, ctypes.c_int, real, real)(lambda *event: events.append(event))
    library.begin.argtypes = [real, ctypes.c_void_p, ctypes.c_void_p]
    library.run.argtypes = [real, real, ctypes.c_void_p, ctypes.c_void_p, real, real, type(seen)]
    assert library.begin(0.0, state, numbers) == 0
    assert library.run(0.0, stop, state, numbers, 1e-11, 1e-12, seen) == 0
    return list(state), events


@pytest.mark.parametrize("name", SCENES)
def test_exported_runs_pass_the_events_of_a_run(name: str, tmp_path: Path) -> None:
    scene = SCENES[name]()
    result = sc.run(scene)
    record, count = result.events, int(result.events.event_count)
    times, nodes, before, after = (
        record[f"event_{part}"].values.ravel()[:count] for part in ("time", "node", "before", "after")
    )
    for run in (run_python, *([run_c] if COMPILER else [])):
        state, events = run(scene, tmp_path, scene.window)
        assert len(events) == count > 0
        assert max(abs(event[0] - at) for event, at in zip(events, times, strict=True)) < 1e-7
        rows_of_node = len(scene.equations.nodes[0].conditions)
        assert [event[1] // rows_of_node for event in events] == [int(node) - 1 for node in nodes]
        assert [event[2:] for event in events] == list(zip(before, after, strict=True))
        np.testing.assert_allclose(state, result.end.transpose("component", ...).values.ravel(), rtol=0, atol=2e-8)


def test_both_languages_do_the_same_steps(tmp_path: Path) -> None:
    if not COMPILER:
        pytest.skip("no C compiler")
    scene = SCENES["ball"]()
    assert run_python(scene, tmp_path, 2.5) == run_c(scene, tmp_path, 2.5)


def test_a_start_behind_a_stop_is_refused() -> None:
    space: dict[str, Any] = {}
    scene = SCENES["ball"]()
    exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
    assert space["begin"](0.0, [-0.1, 0.0, 1.0], space["NUMBERS"]) == 1
    assert space["begin"](0.0, [0.0, 0.0, 0.0], space["NUMBERS"]) == 0


def test_a_restitution_above_one_ends_an_exported_run() -> None:
    """e = 1 + v**2 at the impact: the run ends as AMBIGUOUS, 1."""
    ball = sc.Lagrangian(v**2 / 2, y, coordinates={y: v}, initial={y: 0.5}, events=[sc.Stop(y, 1 + v**2)])
    scene, space = scene_of(ball, None, ALONE, window=2), dict[str, Any]()
    exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
    state = start_of(scene)
    assert space["begin"](0.0, state, space["NUMBERS"]) == 0
    assert space["run"](0.0, 2.0, state, space["NUMBERS"], 1e-11, 1e-12, None) == 1


def test_texts_without_events_say_so() -> None:
    scene = SCENES["neurons"]()
    many = scene.replace(topology=sc.graphs.chain(9))
    assert "No events" not in to_python(scene.equations) + to_c(scene.equations)
    for text in (to_numba(scene.equations), to_python(many.equations), to_c(many.equations)):
        assert "No events: the caller finds" in text
        assert "run(" not in text

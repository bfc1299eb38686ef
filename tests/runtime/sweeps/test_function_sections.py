"""Sections on functions beside SciPy's events and the section on a state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import Scene, Section, open_result, run, stream
from synchain.graphs import chain, ring
from synchain.models.mechanics.components import TIME
from synchain.observe import mean, nodes
from synchain.results import Result, Status

x, v, x_1, x_2 = sp.symbols("x v x_1 x_2")
TIMES = {"transient": 2.0, "window": 20.0, "time_unit": "time"}
SCENE = Scene(
    oscillator="duffing", topology=chain(2), record=(), rtol=1e-12, integrator="dop853", **TIMES,
    initial={"x": [0.1, 0.5]}, axes={"sigma": [0.1, 0.2]}, observe={"speed": mean(nodes.mean(v))},
    sections={
        "gap": Section(x_1 - x_2, "both", keep=(v, "nodes.mean(x)*sigma")),
        "turn": Section("v_1", "falling"),
        "wave": {"function": "cos(t)", "direction": "rising", "level": 0.5, "keep": []},
    },
)  # fmt: skip


@pytest.fixture(scope="module")
def found() -> Result:
    return run(SCENE, show_progress=False, width=1)


def points(result: Result, name: str, cell: int) -> np.ndarray:
    times = result.data[f"{name}_time"].values[cell]
    assert int(result.data[f"{name}_count"][cell]) == np.isfinite(times).sum()
    return times[np.isfinite(times)]


def test_times_are_those_of_scipy(found: Result) -> None:
    equations = SCENE.equations
    symbols = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    rates = sp.lambdify([TIME, *symbols], equations.rhs())
    for cell, sigma in enumerate((0.1, 0.2)):
        values = [{**SCENE.parameters, "sigma": sigma}[name] for name in equations.parameters]
        events = [lambda t, y: y[0] - y[1], lambda t, y: y[2]]
        events[1].direction = -1.0
        solution = solve_ivp(
            lambda t, y, p=tuple(values): rates(t, *y, *p), (0.0, 22.0), SCENE.y0, "DOP853", events=events,
            rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        for name, times, states in zip(("gap", "turn"), solution.t_events, solution.y_events, strict=True):
            inside = times > 2.0
            assert inside.sum() >= 3
            np.testing.assert_allclose(points(found, name, cell), times[inside], rtol=0, atol=1e-9)
            kept = found.data[name].values[cell, : inside.sum()]
            if name == "gap":
                np.testing.assert_allclose(kept[:, :2], states[inside, 2:], rtol=0, atol=1e-9)
                np.testing.assert_allclose(kept[:, 2], states[inside, :2].mean(axis=1) * sigma, rtol=0, atol=1e-9)
            else:
                np.testing.assert_allclose(kept, states[inside], rtol=0, atol=1e-9)
    assert found.gap_kept.values.tolist() == ["v_1", "v_2", "sigma*nodes.mean(x)"]
    assert found.turn_kept.values.tolist() == list(equations.state)
    assert "wave" not in found.data


def test_a_function_of_time_passes_a_level(found: Result) -> None:
    """cos t rises through 1/2 at 2 pi k - pi/3."""
    expected = 2 * np.pi * np.arange(1, 4) - np.pi / 3
    np.testing.assert_allclose(points(found, "wave", 0), expected, rtol=0, atol=1e-9)


def test_the_section_on_a_state_is_one_of_these(found: Result) -> None:
    """The same points as those of the record, whose kernel has a function of its own."""
    records = {"record": ("sync_error", "section", "trajectory"), "samples": 2, "section": "v_1 falling"}
    old = run(SCENE.replace(sections=None, observe=None, **records), show_progress=False, width=1)
    count = int(old.section_count[0])
    np.testing.assert_allclose(points(found, "turn", 0), old.section_time[0, :count], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.turn[0, :count], old.states("section")[0, :count], rtol=0, atol=1e-11)


@pytest.mark.long
def test_large_networks_have_sections() -> None:
    """In loops over nodes: the mean speed of a free oscillator falls where its mean position is largest."""
    scene = Scene(
        oscillator="harmonic", topology=ring(20), integrator="dop853", rtol=1e-11, record=(), transient=0.0, window=13.0,
        time_unit="time", initial={"x": [1.0 + 0.1 * i for i in range(20)], "v": [0.3] * 20}, axes={"sigma": [0.1]},
        sections={"top": Section("nodes.mean(v)", "falling", keep="nodes.mean(x)")},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    start = 1.95 + 0.3j  # x + i v rotates backwards
    assert points(result, "top", 0).tolist() == pytest.approx(
        [np.angle(start) + 2 * np.pi * k for k in range(3)], abs=1e-8
    )
    assert result.top.values[0, :3, 0] == pytest.approx([abs(start)] * 3, abs=1e-8)


def test_files_and_resumed_runs_keep_points(found: Result, tmp_path: Path) -> None:
    found.save(tmp_path / "whole.nc")
    assert open_result(tmp_path / "whole.nc").scene == SCENE
    assert stream(SCENE, tmp_path / "streamed.nc", show_progress=False, width=1).success
    assert (tmp_path / "streamed.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()
    data = found.data.copy(deep=True)
    data["status"][1] = Status.NOT_RUN
    again = run(SCENE, resume=Result(data, SCENE), show_progress=False, width=1)
    assert again.data.identical(found.data)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"gap": Section("x")}, "section gap: found x, which each node has"),
        ({"gap": Section("y_1")}, "section gap: unknown name 'y_1'"),
        ({"gap": {"direction": "rising"}}, "expected function = 'x_1 - x_2'"),
        ({"gap": {"function": "x_1", "kept": ["x"]}}, "kept"),
        ({"gap": {"function": "x_1", "keep": ["w"]}}, "unknown name 'w'"),
        ({"gap": {"function": "x_1 -"}}, "unreadable expression 'x_1 -'"),
        ({"gap": {"function": "x_1", "direction": "up"}}, "section direction"),
        ({"status": Section("x_1")}, "found the name 'status'"),
    ],
)
def test_wrong_sections_are_refused(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=r"section") as error:
        Scene(topology=ring(3), record=(), sections=keywords)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_what_is_kept_is_a_list_of_expressions() -> None:
    with pytest.raises(TypeError, match=r"section keep: found 3; expected expressions, such as \('v', 'x_1'\)"):
        Section("x_1", "both", keep=3)  # type: ignore[arg-type]


def test_two_ways_to_say_a_section_are_refused() -> None:
    with pytest.raises(ValueError, match="found 'section' beside sections"):
        Scene(record=("section",), sections={"gap": Section("x_1")})
    with pytest.raises(ValueError, match="found the name 'gap_time', which a section has"):
        Scene(topology=ring(3), sections={"gap": Section("x_1")}, observe={"gap_time": mean(x)})


def test_scene_files_hold_sections() -> None:
    assert Scene.from_dict(SCENE.as_dict()) == SCENE
    assert SCENE.as_dict()["sections"]["wave"] == {
        "function": "cos(t)", "direction": "rising", "level": 0.5, "keep": [],
    }  # fmt: skip
    assert "sections" not in Scene().as_dict()

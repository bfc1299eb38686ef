"""Set-valued friction of more oscillators than are written out: the looped kernel does what the written-out one does."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from samples import kernel, run_cells

from synchain import Scene, run
from synchain.graphs import topology
from synchain.results import Status
from synchain.runtime.cells.initial_modes import with_modes
from synchain.runtime.cli import main

NINE = topology("chain", 9)
WIDTH = 4
"""One width for all runs of the nine, so that they share a kernel."""


def nine(x: list[float], v: list[float], window: float, **more: float) -> Scene:
    return Scene(
        topology=NINE, contact="set-valued", transient=0.0, window=window, rtol=1e-10, initial={"x": x, "v": v},
        parameters={"omega": 1.4, **more},
    )  # fmt: skip


def ran(scene: Scene, **more: Any) -> np.ndarray:
    """The states (component, oscillator) at the end of the only cell."""
    result = run(scene, reduce=False, show_progress=False, width=WIDTH, **more)
    assert np.all(result.status == Status.FINISHED)
    return np.asarray(result.states("end").reshape(3, -1))


@pytest.mark.long
@pytest.mark.parametrize("coupling", ["spring", "damper"])
def test_looped_events_are_those_of_the_kernel_that_is_written_out(coupling: str) -> None:
    """To the tolerance: sums of forces are fused differently, and a step that differs by a rounding differs for good."""
    scene = Scene(
        topology=topology("ring", 3), contact="set-valued", transient=0.0, window=20.0, rtol=1e-12, record=(),
        coupling=coupling, initial={"x": [0.3, -0.2, 0.1], "v": [0.0, 0.2, -0.1]}, parameters={"sigma": 0.3},
    )  # fmt: skip
    plain, looped = (run_cells(kernel(scene.equations, "dop853", width=1, unroll=n), scene) for n in (8, 0))
    np.testing.assert_allclose(looped.end, plain.end, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(looped.end[0, 6:], plain.end[0, 6:])
    assert abs(looped.steps[0] - plain.steps[0]) <= 0.1 * plain.steps[0]


def test_nodes_with_contacts_of_their_own_move_as_each_alone() -> None:
    """Each begins to stick or slip by its own ground and its own static friction."""
    parameter_values = {"epsilon": [0.3, 0.4], "theta_b": [0.2, 0.25], "mu_s": [0.3, 0.35]}
    settings: dict[str, Any] = {
        "contact": "set-valued",
        "transient": 0,
        "window": 2,
        "record": ("section",),
        "rtol": 1e-10,
    }
    start = {"x": [0.3, 0.1], "v": [0.2, 0.25]}
    both = run(
        Scene(topology=topology("chain", 2), parameters={"sigma": 0.0, **parameter_values}, initial=start, **settings)
    )
    for k in range(2):
        alone = {name: values[k] for name, values in parameter_values.items()}
        begin = {name: values[k : k + 1] for name, values in start.items()}
        one = run(Scene(topology=topology("chain", 1), coupling="none", parameters=alone, initial=begin, **settings))
        np.testing.assert_allclose(both.data.end.values[:, k], one.data.end.values[:, 0], atol=1e-8)
    assert both.success


def test_each_node_begins_on_its_own_ground() -> None:
    scene = Scene(topology=topology("chain", 2), contact="set-valued", parameters={"theta_b": [0.2, 0.25]})
    values = np.array([[scene.parameters[name] for name in scene.equations.parameters]])
    for v, modes in (([0.2, 0.25], [0.0, 0.0]), ([0.25, 0.2], [-1.0, 1.0])):
        state = with_modes(scene.equations, np.array([[0.0, 0.0, *v, 0.5, 0.5]]), values)
        assert state[0, 4:].tolist() == modes


def test_equal_starts_stay_equal_bit_for_bit_and_fire_at_once() -> None:
    """Coupled where synchrony is unstable, and free: three of nine that start equal stay so, whatever the others do."""
    end = ran(nine([0.3] * 9, [0.0] * 9, 100.0, sigma=0.01))
    assert np.ptp(end, axis=1).max() == 0.0
    x = [0.3, -0.2, 0.3, 0.1, 0.3, 0.0, -0.4, 0.2, 0.4]
    free = ran(nine(x, [0.0] * 9, 40.0, sigma=0.0))
    assert np.ptp(free[:, [0, 2, 4]], axis=1).max() == 0.0
    assert np.ptp(free[0]) > 0.01


def test_a_mirrored_chain_has_the_mirrored_end() -> None:
    x, v = np.random.default_rng(1).uniform(-0.5, 0.5, (2, 9))
    there = ran(nine(x.tolist(), v.tolist(), 10.0, sigma=0.2))
    back = ran(nine(x[::-1].tolist(), v[::-1].tolist(), 10.0, sigma=0.2))
    np.testing.assert_allclose(back[:, ::-1], there, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(back[2, ::-1], there[2])


def test_a_sweep_finds_the_end_of_the_synchronous_range() -> None:
    """omega = 1.15: the largest mode of nine, sigma (2 + 2 cos(pi/9)) = 0.465, leaves the stable range at 0.1199."""
    x = [0.3 + 1e-6 * i for i in range(9)]
    scene = nine(x, [0.0] * 9, 20.0, omega=1.15).replace(transient=300.0, rtol=1e-8)
    result = run(scene, reduce=False, show_progress=False, width=WIDTH, sigma=[0.1, 0.11, 0.13, 0.14])
    assert np.all(result.status == Status.FINISHED)
    assert list(result.sync_error.values < 1e-6) == [True, True, False, False]


@pytest.mark.parametrize(("friction", "end"), [("exponential", 0.0465033877), ("coulomb_static", 0.05831)])
def test_modes_of_ten_oscillators_from_the_command_line(
    friction: str, end: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A star's strongest mode has gamma = -n: its range of sigma is that of alpha over 10, 0.465033877 at omega = 1.15."""
    scene = tmp_path / "star.toml"
    scene.write_text(f'friction = "{friction}"\ncontact = "set-valued"\n[topology]\nname = "star"\nn = 10\n'
                     "[parameters]\nomega = 1.15\n")  # fmt: skip
    assert main(f"msf {scene} --alpha 0:1.2:25 --periods 100 --starts 1 --workers 1".split()) == 0
    said = capsys.readouterr().out
    match = re.search(r"sigma +0.0000 … (\S+) ± \S+; lost above: gamma = -10\n", said)
    assert match is not None, said
    assert float(match[1]) == pytest.approx(end, abs=1e-6 if friction == "exponential" else 1e-5)
    assert re.search(r"possible +yes", said)

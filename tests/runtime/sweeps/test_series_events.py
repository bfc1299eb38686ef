"""Events of set-valued friction on Taylor steps: the step ends at the first of them, in loops as written out."""

from __future__ import annotations

import numpy as np
from samples import run_cells

from synchain import Scene
from synchain.codegen.driver.columns import Count
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code.compile import load
from synchain.graphs import chain
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.scene_kernels import chosen_integrator
from synchain.runtime.sweeps.run import run

PAIR = Scene(
    topology=chain(2), contact="set-valued", parameters={"sigma": 0.15, "omega": 1.15}, record=(), transient=0.0,
    window=5.0, rtol=1e-11, integrator="taylor", initial={"x": [0.3, -0.2], "v": [0.0, 0.1]},
)  # fmt: skip
WIDTH = 4
"""One width for all runs, whose drivers other tests have."""


def test_an_event_costs_no_second_step_and_is_where_another_method_finds_it() -> None:
    series, stages = (run(PAIR.replace(integrator=name), width=WIDTH) for name in ("taylor", "dop853"))
    assert series.rejected.item() == 0
    assert stages.rejected.item() > 10  # steps that passed an event were taken back
    np.testing.assert_allclose(series.end, stages.end, rtol=0, atol=1e-11)


def test_loops_have_the_events_of_steps_that_are_written_out() -> None:
    method = chosen_integrator(reduce_scene(PAIR))
    written, looped = (load(emit(PAIR.equations, method, Recording(()), width=WIDTH, unroll=most)) for most in (8, 0))
    scene = PAIR.replace(
        parameters={"u": 0.5, "theta_b": 0.01, "sigma": 0.3}
    )  # both limits of static friction are reached
    ends = [run_cells(kernel, scene) for kernel in (written, looped)]
    assert "closing" in looped.source
    np.testing.assert_allclose(*(result.end for result in ends), rtol=0, atol=1e-11)
    assert abs(ends[0].counts[0, Count.ACCEPTED] - ends[1].counts[0, Count.ACCEPTED]) < 3


def test_a_load_that_dips_below_the_limit_within_a_step_sets_the_body_free() -> None:
    """The drive exceeds friction by a thousandth for 0.09 units of time; a step in stick is twenty times as long."""
    scene = Scene(
        topology=chain(1), friction="coulomb", contact="set-valued", record=(), transient=0.0, window=7.0,
        time_unit="time", initial={"x": [0.0], "v": [1e-9]}, integrator="taylor",
        parameters={"epsilon": 1.0, "mu": 1.0, "theta_b": 1e-9, "u": 1.001, "omega": 1.0},
    )  # fmt: skip
    result, close = (run(each, width=WIDTH) for each in (scene, scene.replace(integrator="dop853", rtol=1e-12)))
    assert result.steps.item() < 12
    np.testing.assert_allclose(result.end, close.end, rtol=0, atol=1e-9)

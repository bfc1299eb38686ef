"""Which integrator "auto" is, and the warning of stiffness that appears."""

from __future__ import annotations

import warnings

import pytest

from synchain.models import Scene, chain
from synchain.runtime import run
from synchain.runtime.cells.choice import STIFF, stiffness
from synchain.runtime.cells.kernels import kernel_source


def method(scene: Scene) -> tuple[str, int]:
    source = kernel_source(scene)
    return source.integrator, source.dimensions.dense_rows


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (Scene(oscillator="pendulum", topology=chain(2)), "taylor"),
        (Scene(oscillator="pendulum", topology=chain(20)), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 1.0}), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}), "rodas5p"),
        (Scene(topology=chain(2), contact="set-valued"), "taylor"),
        (Scene(topology=chain(2), parameters={"kappa": 10.0}), "taylor"),  # the smoothed law has a kink
        (Scene(topology=chain(20), parameters={"kappa": 10.0}), "taylor"),
        (Scene(topology=chain(3)), "rodas5p"),  # its layer is steep, although the start lies outside
        (Scene(topology=chain(3), friction="coulomb"), "rodas5p"),
        (Scene(topology=chain(3), contact="sign"), "rodas5p"),  # it jumps
        (Scene(oscillator="chua", coupling="x->x", topology=chain(2)), "taylor"),
        (Scene(topology=chain(2), rtol=1e-10, parameters={"sigma": 0.1}), "switching"),
    ],
)
def test_auto(scene, expected):
    assert method(scene)[0] == expected


def test_a_named_integrator_is_taken():
    assert method(Scene(oscillator="pendulum", topology=chain(2), integrator="dop853"))[0] == "dop853"
    stiff = Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}, integrator="taylor")
    assert method(stiff)[0] == "taylor"


def test_the_order_follows_the_tolerance():
    orders = [method(Scene(oscillator="pendulum", topology=chain(2), rtol=r))[1] for r in (1e-2, 1e-4, 1e-8, 1e-14)]
    assert orders == sorted(orders)
    assert orders[0] < orders[-1]


def test_linear_equations_take_the_highest_order():
    scene = Scene(oscillator="harmonic", topology=chain(2))
    assert method(scene) == ("taylor", 24)
    assert method(scene.replace(oscillator="pendulum"))[1] < 24
    assert method(scene.replace(rtol=1e-2))[1] < 24


def test_what_jumps_is_refused():
    with pytest.raises(ValueError, match=r"taylor: a function that jumps; found sign\(.*use integrator dop853"):
        kernel_source(Scene(topology=chain(2), contact="sign", integrator="taylor"))


def test_the_layer_of_a_smoothed_jump_is_seen_from_a_start_outside():
    scene = Scene(topology=chain(2), friction="coulomb", parameters={"kappa": 1e5})
    assert stiffness(scene) > STIFF > stiffness(scene.replace(parameters={"kappa": 10.0}))
    link = Scene(oscillator="duffing", coupling="friction_damper", topology=chain(2), initial={"v": (0.0, 1.0)})
    assert stiffness(link.replace(parameters={"sigma": 1e4})) > STIFF > stiffness(link)


def test_stiffness_is_that_of_the_extreme_cells():
    scene = Scene(oscillator="van_der_pol", topology=chain(2))
    assert stiffness(scene.replace(parameters={"mu": 1.0})) < STIFF
    swept = scene.replace(axes={"mu": [1.0, 200.0]})
    assert stiffness(swept) > STIFF
    assert kernel_source(swept).integrator == "rodas5p"


def test_stiffness_that_appears_is_said():
    scene = Scene(
        oscillator="van_der_pol",
        topology=chain(2),
        record=(),
        transient=0,
        window=60,
        time_unit="time",
        integrator="taylor",
    )
    with pytest.warns(RuntimeWarning, match=r"stiff equations: found a rate of .*integrator = 'rodas5p'"):
        run(scene, mu=[1.0, 200.0], show_progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(scene, mu=[1.0, 2.0], show_progress=False)

"""Work against precision of a scene with a closed form, and what the table refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import synchain as sc

DECAY = sc.Scene(
    sc.Field({"x": "-a*x"}, parameters={"a": 1.0}), initial={"x": 2.0}, transient=0, window=1, axes={"a": [1.0, 2.0]}
)


def table(**keywords: object) -> sc.results.WorkPrecision:
    return sc.work_precision(DECAY, [1e-4, 1e-8], show_progress=False, repeats=1, **keywords)


def test_errors_are_those_of_the_closed_form() -> None:
    found = table(integrators=["dop853", "rodas5p"])
    exact = 2.0 * np.exp(-np.array([1.0, 2.0]))
    for (i, k), error in np.ndenumerate(found.error):
        scene = DECAY.replace(integrator=found.integrator[i], rtol=found.rtol[k])
        end = sc.run(scene, show_progress=False).end.values.ravel()
        assert error == pytest.approx(np.abs(end - exact).max() / exact.max(), abs=1e-12)
    assert (found.seconds > 0).all()
    assert (found.error[:, 1] < 1e-6).all()


def test_fastest_run_of_an_error_is_found_or_refused() -> None:
    found = table(integrators="dop853")
    assert found.fastest(found.error[0, 1]) == ("dop853", 1e-8)
    with pytest.raises(ValueError, match=r"found no run with an error of at most 1e-30; the least is .*smaller rtol"):
        found.fastest(1e-30)


def test_a_cell_that_ends_early_has_no_error() -> None:
    blown = sc.Scene(sc.Field({"x": "x**2"}), initial={"x": 2.0}, transient=0, window=1)
    with pytest.warns(RuntimeWarning):
        found = sc.work_precision(blown, 1e-4, integrators="dop853", show_progress=False)
    assert math.isnan(found.error[0, 0])
    with pytest.raises(ValueError, match="found no run"):
        found.fastest(1.0)


@pytest.mark.parametrize(
    ("keywords", "text"),
    [
        ({"integrators": ["euler"]}, "unknown integrator 'euler'"),
        ({"repeats": 0}, "repeats = 0; expected at least 1"),
    ],
)
def test_what_no_scene_takes_is_refused(keywords: dict[str, object], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        sc.work_precision(DECAY, **keywords)

"""Errors of angles: full turns change none, and states that are no angles are measured by their size."""

from __future__ import annotations

import math

import pytest
from samples import FLOATS, Interpreted, take_step
from turning import NETWORKS, network, starts

import synchain as sc
from synchain.codegen.integrators import integrator, names
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.steps.places import by_joint
from synchain.codegen.steps.sparse_plan import sparse_plan

STEPPED = [name for name in names() if name != "taylor"]
WAYS = [(name, looped) for name in STEPPED for looped in (False, True) if not (integrator(name).inexact and looped)]


@pytest.mark.parametrize(("method", "looped"), WAYS)
@pytest.mark.parametrize("name", NETWORKS)
def test_full_turns_change_no_error_of_a_step(name: str, method: str, looped: bool) -> None:
    equations = network(name)
    kernel = Interpreted.of(emit(equations, method, Recording(()), width=1, unroll=0 if looped else 8), FLOATS)
    assert kernel.source.driver.looped is looped
    weights = [float(weight) for (_, _, weight), _ in by_joint(equations)]
    graph = (sparse_plan(equations).arrays, weights) if looped else ()
    # without atol, so that sizes of states alone decide
    near, far = (take_step(kernel, 0.0, 0.7, list(y), [], 1e-8, 0.0, *graph).error for y in starts(equations))
    assert far == pytest.approx(near, rel=1e-4)


@pytest.mark.parametrize("method", STEPPED)
def test_the_text_of_a_step_holds_no_period_where_no_state_is_an_angle(method: str) -> None:
    fields = (sc.Field({"q": "sin(q) + q/1000"}), sc.Field({"q": "sin(q) + 1/1000"}))
    texts = [emit(sc.Scene(f, None).equations, method, Recording(()), width=1).code for f in fields]
    assert [repr(2 * math.pi) in text for text in texts] == [False, True]

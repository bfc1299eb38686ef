"""Lengths of Taylor steps by angles: full turns change none."""

from __future__ import annotations

import math

import pytest
from plain import Text
from turning import NETWORKS, network, starts

import synchain as sc
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import write_looped, write_rolled, write_step


@pytest.mark.parametrize("looped", [False, True], ids=["written out", "looped"])
@pytest.mark.parametrize("name", NETWORKS)
def test_full_turns_change_no_length_of_a_taylor_step(name: str, looped: bool) -> None:
    text = Text(network(name), 12, looped)
    near, far = (text.step(y, 0.0, 10.0, 0.5, 1e-8, 0.0)[0] for y in starts(network(name)))
    assert far == pytest.approx(near, rel=1e-4)


def test_full_turns_change_no_length_of_a_rolled_taylor_step() -> None:
    field = sc.Field({"a": "u", "b": "w", "u": "-sin(a)", "w": "-sin(b/2) - sin(a)", "x": "cos(a) - x"})
    equations = sc.Scene(field, None).equations
    near, far = starts(equations)
    lengths = [
        Text(equations, 12, rolled=way).step(y, 0.0, 10.0, 0.5, 1e-8, 0.0)[0]
        for y in (near, far)
        for way in (True, False)
    ]
    assert lengths == pytest.approx([lengths[0]] * 4, rel=1e-4)


@pytest.mark.parametrize("write", [write_step, write_looped, write_rolled])
def test_the_text_of_a_taylor_step_holds_no_period_where_no_state_is_an_angle(write) -> None:
    fields = (sc.Field({"q": "sin(q) + q/1000", "x": "1 - x"}), sc.Field({"q": "sin(q) + 1/1000", "x": "1 - x"}))
    texts = [write(tidy(sc.Scene(f, None).equations), 12).text for f in fields]
    assert [repr(2 * math.pi) in text for text in texts] == [False, True]

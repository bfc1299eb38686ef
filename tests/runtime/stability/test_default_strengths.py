"""The strengths of a master stability function that is asked for without any: one rule for Python, commands and reports."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from synchain import Scene, msf
from synchain.graphs import chain, ring
from synchain.models.scenes.file import load_scene
from synchain.runtime.cli import main
from synchain.runtime.stability.msf import default_strengths

SHORT: dict[str, Any] = {"starts": 1, "transient": 2, "periods": 2, "show_progress": False}


@pytest.mark.parametrize(
    ("changes", "ends"),
    [
        ({"sigma": 0.1}, (0.0, 0.6)),
        ({"sigma": -0.1}, (-0.6, 0.0)),
        ({"sigma": 0.0}, (0.0, 1.2)),
        ({"sigma": 1234.0}, (0.0, 7500.0)),
        ({"axes": {"sigma": [0.2, 0.5]}}, (0.0, 1.5)),
        ({"axes": {"omega": [1.0, 2.0], "sigma": [-0.2, 0.1]}}, (-0.6, 0.3)),
        ({"topology": chain(1), "parameters": None}, (0.0, 1.2)),
    ],
)
def test_strengths_reach_all_modes_of_the_sweep(changes: dict[str, object], ends: tuple[float, float]) -> None:
    line = default_strengths(Scene("duffing", "x->v", chain(3)).replace(**changes), 5)
    assert (line[0], line[-1], len(line)) == (*map(pytest.approx, ends), 5)


def test_a_function_without_strengths_takes_them() -> None:
    scene = Scene("duffing", "spring", chain(3), axes={"sigma": [0.1, 0.2]})
    np.testing.assert_array_equal(msf(scene, **SHORT).alpha, np.linspace(0.0, 0.6, 241))
    np.testing.assert_array_equal(msf(scene, sigma=0.05, **SHORT).alpha, np.linspace(0.0, 0.3, 241))
    assert msf(scene, [0.0, 0.1], **SHORT).alpha[-1] == 0.1


def test_unequal_nodes_are_sent_to_mismatch() -> None:
    scene = Scene("rossler", "x->x", chain(3), parameters={"a": [0.2, 0.2, 0.21]})
    with pytest.raises(ValueError, match=r"nodes that differ in a; .*; `mismatch` computes how far nearly equal nodes"):
        msf(scene, [0.0, 0.1], **SHORT)


def test_the_command_takes_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["msf", "figure_8", "--periods", "1", "--starts", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["alpha"] == default_strengths(load_scene("figure_8")).tolist()
    assert default_strengths(load_scene("figure_8"))[-1] == 1.2


def test_a_range_that_ends_at_zero_has_a_verdict() -> None:
    """FitzHugh-Nagumo through y is negative up to alpha = 0, where the exponent is 0 to its error."""
    scene = Scene("fitzhugh_nagumo", "y->x", ring(4), transient=100, window=10)
    function = msf(scene, np.linspace(-1.0, 3.0, 41), starts=1, periods=100, show_progress=False)
    assert function.intervals[0][0] == -1.0
    assert abs(function.intervals[0][1]) < 1e-5
    assert str(function.verdict)

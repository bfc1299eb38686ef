"""A ragged master stability function: two ranges of synchronisation with a gap, seen by the exponent and in simulation.

Springs between driven cubic oscillators: Stefański, Perlikowski & Kapitaniak, Phys. Rev. E 75, 016210 (2007).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from synchain import Scene, exponents, run
from synchain.graphs import topology
from synchain.plugins import allow_code
from synchain.runtime.stability.msf import classify

pytestmark = pytest.mark.long

UEDA = """
from synchain import Lagrangian

# Ueda, J. Stat. Phys. 20, 181 (1979)
OSCILLATOR = Lagrangian("v**2/2", "x**4/4 - u*x*cos(omega*t)", {"x": "-h*v"}, coordinates={"x": "v"},
                        parameters={"h": 0.1, "u": 5.6, "omega": 1.0})
"""


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = Path(tmp_path_factory.mktemp("ragged"), "ueda.py")
    path.write_text(UEDA)
    allow_code(path)
    return Scene(oscillator=str(path), coupling="spring", topology=topology("chain", 2))


def test_two_ranges_with_a_gap(pair: Scene) -> None:
    alpha = np.linspace(0.0, 6.0, 121)
    result = exponents(pair, alpha, precision=0.01)
    (low, high), (again, end) = result.intervals
    assert low == pytest.approx(0.98, abs=0.06)
    assert high == pytest.approx(2.88, abs=0.06)
    assert again == pytest.approx(3.60, abs=0.06)
    assert end == 6.0
    assert classify(result.intervals, 6.0) == "several intervals"
    assert result.exponent[0] > 0.05, "the oscillator is chaotic"


@pytest.mark.parametrize(("alpha", "synchronous"), [(0.6, False), (2.0, True), (3.2, False), (4.5, True)])
def test_a_pair_does_what_the_exponent_says(pair: Scene, alpha: float, synchronous: bool) -> None:
    scene = pair.replace(initial={"x": [0.1, 0.11], "v": [0.2, 0.2]}, transient=1500, window=50)
    error = float(run(scene, sigma=alpha / 2, workers=1).data.sync_error)
    assert (error < 1e-6) == synchronous

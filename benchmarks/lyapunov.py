"""Lyapunov spectra: time beside error, for one oscillator and for a ring, beside JiTCODE.

All programs take blocks of the same length, between which they make the directions orthogonal, and
average over the same number of blocks after the same transient. The error of the sum is that from
the divergence, which is a constant of each case. The largest exponent of a chaotic motion converges
only as the square root of time: its error is of the average, not of the program. The exponents of
the ring are known in closed form. Times are CPU times of one core, without compilation.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.interactions.interaction import Rates
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.tangent_frame import TangentFrame

from . import peers
from .peers import jitcode_lyapunov

COLUMNS = (
    "case",
    "program",
    "rtol",
    "exponents",
    "blocks",
    "microseconds per unit of time",
    "largest exponent",
    "error of the sum",
    "largest error",
)
PEER = "jitcode_dop853"  # needs the same packages as JiTCODE's exponents
RTOLS = (1e-6, 1e-8, 1e-10)
nan = math.nan
Row = tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Case:
    """A scene, the time of a block, the numbers of blocks of the transient and of the average, the sum
    of all exponents, and the exponents in descending order where they are known.
    """

    name: str
    scene: Scene
    block: float
    transient: int
    blocks: int
    total: float
    exact: np.ndarray | None = None

    @property
    def count(self) -> int:
        """Number of exponents."""
        return len(self.scene.y0)


def _ring(n: int) -> Case:
    """Stuart-Landau oscillators in phase; in the turning frame the modes are 2 x 2 blocks."""
    node = Field({"x": "x - y - (x**2 + y**2)*(x - y/2)", "y": "y + x - (x**2 + y**2)*(y + x/2)"})
    push = {"x": "kap*W*(x_j - x_i - b*(y_j - y_i))", "y": "kap*W*(y_j - y_i + b*(x_j - x_i))"}
    strengths = 0.3 * (2.0 - 2.0 * np.cos(2.0 * np.pi * np.arange(n) / n))
    blocks = [np.array([[-2.0 - k, -k], [-1.0 + k, -k]]) for k in strengths]
    exact = np.sort(np.concatenate([np.linalg.eigvals(block).real for block in blocks]))[::-1]
    start = {"x": 1.0, "y": 0.0}
    scene = Scene(node, Rates(push, {"kap": 0.3, "b": -1.0}), topology("ring", n), initial=start)
    return Case(f"Stuart-Landau ring, n = {n}", scene, 2.0, 400, 200, float(exact.sum()), exact)


LORENZ = Field({"x": "10*(y - x)", "y": "28*x - y - x*z", "z": "x*y - 8*z/3"}, initial={"x": 1.0, "y": 1.0, "z": 20.0})
UEDA = Field({"x": "v", "v": "-x**3 - k*v + u*cos(t)"}, parameters={"k": 0.05, "u": 7.5}, initial={"x": 2.5})
CASES = (
    Case("Lorenz", Scene(LORENZ, None), 0.5, 100, 4000, -41.0 / 3.0),
    Case("Ueda", Scene(UEDA, None), 2.0 * math.pi, 50, 1000, -0.05),
    _ring(16),
)


def notes() -> list[str]:
    """A line for the peer where it cannot run, with the reason and the remedy."""
    return peers.skipped([PEER])


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes one tolerance and a
    twentieth of the blocks.
    """
    rows = []
    for case in CASES:
        for rtol in RTOLS[1:2] if quick else RTOLS:
            programs: list[tuple[str, Callable[[Case, float, int], tuple[np.ndarray, float]]]] = [("synchain", own)]
            programs += [("JiTCODE dop853", of_peer)] if peers.present([PEER]) else []
            blocks = max(10, case.blocks // 20) if quick else case.blocks
            rows += [_row(case, name, rtol, blocks, *run(case, rtol, blocks)) for name, run in programs]
    return rows


def own(case: Case, rtol: float, blocks: int) -> tuple[np.ndarray, float]:
    """Return the growth (count,) over all blocks after the transient, and the seconds."""
    scene = case.scene.replace(rtol=rtol, atol=0.1 * rtol)
    frame = TangentFrame.make(scene, case.count, 0)
    frame.turns = frame.turns._replace(time=case.block)
    frame.advance(np.array([case.transient]))
    begun = time.process_time()
    (growth,), _, _ = frame.advance(np.array([blocks]))
    return growth[: case.count], time.process_time() - begun


def of_peer(case: Case, rtol: float, blocks: int) -> tuple[np.ndarray, float]:
    """Return the same of JiTCODE."""
    steps = jitcode_lyapunov.growths(case.scene, case.count, "dop853", rtol, case.block)
    for _ in islice(steps, case.transient):
        pass
    begun = time.process_time()
    return np.sum([*islice(steps, blocks)], axis=0), time.process_time() - begun


def _row(case: Case, program: str, rtol: float, blocks: int, growth: np.ndarray, seconds: float) -> Row:
    length = blocks * case.block
    exponents = np.sort(growth / length)[::-1]
    worst = nan if case.exact is None else float(np.abs(exponents - case.exact).max())
    error = abs(float(exponents.sum()) - case.total)
    return (case.name, program, rtol, case.count, blocks, 1e6 * seconds / length, exponents[0], error, worst)

"""What a call costs besides its integration: `run`, compiled runs and their derivatives, beside SciPy.

One scene is called with another number each time: a pendulum over ten units of time, whose angle is wanted at three
times.  The columns are the fastest and the median wall-clock time of one call, and the largest error of the angle
against SciPy's DOP853 at rtol 1e-13.  The derivative by the frequency is timed with the run that it belongs to; that of
SciPy is a central difference of two runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from synchain.models.definitions.inline import Field
from synchain.models.scenes.scene import Scene
from synchain.runtime.sweeps.compiled import compile
from synchain.runtime.sweeps.run import run

Row = tuple[str, int, float, float, float]

COLUMNS = ("call", "cells", "microseconds", "median", "error")

TIMES = (0.5, 5.0, 10.0)
SQUARES = np.linspace(1.0, 9.0, 64)
"""Squared frequencies of the calls."""


def measure(quick: bool = False) -> list[Row]:
    """Return a row for each way to call the pendulum."""
    node = Field({"x": "v", "v": "-k*sin(x) - c*v"}, parameters={"k": 1.0, "c": 0.1})
    scene = Scene(node, initial={"x": 1.0, "v": 0.0}, transient=0.0, window=10.0, t_eval=TIMES)
    plain, go = compile(scene, ["k"]), compile(scene, ["k"], gradient=["k"])
    reference = np.array([_angles(k, 1e-13) for k in SQUARES])
    step = 1e-5
    slopes = np.array([_angles(k + step, 1e-13) - _angles(k - step, 1e-13) for k in SQUARES]) / (2.0 * step)
    one: dict[str, tuple[Callable[[float], Any], np.ndarray]] = {
        "run": (lambda k: run(scene, k=k, show_progress=False).data.trajectory.values[:, 0, 0], reference),
        "compiled run": (lambda k: plain(k=k).y[:, 0, 0], reference),
        "compiled run, and the derivative": (lambda k: go(k=k).d["k"][:, 0, 0], slopes),
        "SciPy, DOP853": (lambda k: _angles(k, 1e-8), reference),
        "SciPy, DOP853, difference quotient": (
            lambda k: (_angles(k + step, 1e-8) - _angles(k - step, 1e-8)) / (2.0 * step),
            slopes,
        ),
    }
    repeats = 1 if quick else 20
    rows = [
        _row(name, 1, [partial(call, k) for k in SQUARES.tolist() * repeats], wanted)
        for name, (call, wanted) in one.items()
    ]
    together = [lambda: plain(k=SQUARES).y[:, :, 0, 0]] * (10 * repeats)
    return [*rows[:3], _row("compiled run", len(SQUARES), together, reference), *rows[3:]]


def _row(name: str, cells: int, calls: list[Callable[[], Any]], wanted: np.ndarray) -> Row:
    calls[0]()  # compiles, or loads the kernel
    seconds, found = [], []
    for call in calls:
        began = time.perf_counter()
        found.append(call())
        seconds.append(time.perf_counter() - began)
    error = np.abs(np.array(found[: len(SQUARES)] if cells == 1 else found[0]) - wanted).max()
    return name, cells, 1e6 * min(seconds), 1e6 * float(np.median(seconds)), float(error)


def _angles(k: float, rtol: float) -> np.ndarray:
    """Integrate the pendulum with SciPy."""
    found = solve_ivp(
        lambda t, y: (y[1], -k * np.sin(y[0]) - 0.1 * y[1]),
        (0.0, 10.0),
        (1.0, 0.0),
        "DOP853",
        TIMES,
        rtol=rtol,
        atol=rtol / 10,
    )
    return np.asarray(found.y[0])

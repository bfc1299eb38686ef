"""129 chaotic flows of other people, by default settings: states against SciPy, exponents against Benettin's method.

A run is right if it has `DIGITS` digits after two periods, or three Lyapunov times if they are shorter.  The exponents
that dysts stores are not used: those of half of its flows are off by more than a quarter.
"""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
import sympy as sp

pytestmark = pytest.mark.skipif(importlib.util.find_spec("dysts") is None, reason="needs the extra 'examination'")

from flows import Flow, digits, flow, names  # noqa: E402

from synchain import lyapunov_spectrum  # noqa: E402

DIGITS = 5.0
QUICK = ("Chua", "Duffing", "Halvorsen", "HyperRossler", "LiuChen", "Lorenz", "NoseHoover", "Rossler")
DEFECTS = {
    "BlinkingVortex": "B1: Taylor steps stall at a saturated tanh",
    "LidDrivenCavityFlow": "B2: printing and parsing are not inverse",
    "LiuChen": "A0: states of 5e-10 lie below the absolute tolerance",
}


def cases() -> list[object]:
    if importlib.util.find_spec("dysts") is None:
        return []
    return [
        pytest.param(
            name,
            marks=[
                *([] if name in QUICK else [pytest.mark.long]),
                *([pytest.mark.xfail(strict=True, reason=DEFECTS[name])] if name in DEFECTS else []),
            ],
        )
        for name in names()
    ]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", cases())
def test_states_of_a_flow(name: str) -> None:
    assert digits(flow(name)) > DIGITS


@pytest.mark.long
def test_all_flows_are_here() -> None:
    assert len(names()) == 129


BENETTIN = {"Halvorsen": 0.02, "Lorenz": 0.02, "Rossler": 0.02, "SprottB": 0.02, "Thomas": 0.02, "HyperRossler": 0.02,
            "Chen": 0.02, "RikitakeDynamo": 0.02, "LorenzStenflo": 0.02, "Arneodo": 0.02}  # fmt: skip
"""Flows whose spectra are compared, and the standard error that is asked for, in units of the largest exponent."""
PATHS, STEPS_PER_PERIOD, TRANSIENT, AVERAGE = 48, 400, 30, 150


def benettin(of: Flow) -> tuple[np.ndarray, np.ndarray]:
    """Exponents and standard errors by independent paths: fourth-order Runge-Kutta steps with QR (Benettin et al.,
    Meccanica 15, 9 (1980)).
    """
    symbols = [sp.Symbol(name, real=True) for name in of.field.states]
    rates = sp.Matrix(of.expressions)
    function = sp.lambdify([symbols], list(rates), "numpy")
    slopes = sp.lambdify([symbols], rates.jacobian(symbols).tolist(), "numpy")
    d, h = len(symbols), of.period / STEPS_PER_PERIOD
    random = np.random.default_rng(1)
    state = of.start[:, None] * (1.0 + 1e-3 * random.standard_normal((d, PATHS)))
    frame = np.broadcast_to(np.eye(d), (PATHS, d, d)).copy()

    def both(z: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rate = np.array([np.broadcast_to(value, PATHS) for value in function(z)])
        jacobian = np.array([[np.broadcast_to(value, PATHS) for value in row] for row in slopes(z)])
        return rate, np.einsum("ijp,pjk->pik", jacobian, q)

    total = np.zeros((PATHS, d))
    for step in range((TRANSIENT + AVERAGE) * STEPS_PER_PERIOD):
        a, p = both(state, frame)
        b, q = both(state + h / 2 * a, frame + h / 2 * p)
        c, r = both(state + h / 2 * b, frame + h / 2 * q)
        e, s = both(state + h * c, frame + h * r)
        state, frame = state + h / 6 * (a + 2 * b + 2 * c + e), frame + h / 6 * (p + 2 * q + 2 * r + s)
        if step % 20 == 19:
            frame, upper = np.linalg.qr(frame)
            if step >= TRANSIENT * STEPS_PER_PERIOD:
                total += np.log(np.abs(np.diagonal(upper, axis1=1, axis2=2)))
    exponents = total / (AVERAGE * of.period)
    return exponents.mean(axis=0), exponents.std(axis=0, ddof=1) / np.sqrt(PATHS)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", BENETTIN)
def test_exponents_of_a_flow(name: str) -> None:
    """The difference lies within four joint standard errors and the discretisation of the reference."""
    of = flow(name)
    expected, error = benettin(of)
    result = lyapunov_spectrum(of.scene(), precision=BENETTIN[name] * expected[0])
    allowed = 4.0 * np.hypot(error, result.stderr) + 2e-3 * np.abs(expected[0])
    assert np.all(np.abs(result.exponent - expected) < allowed), (
        f"{result.exponent} ± {result.stderr}; {expected} ± {error}"
    )

"""Stribeck's law with the exponents of textbooks under set-valued contact, beside SciPy with events by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import synchain as sc

MU_S, MU_D, VS, BELT, TIME = 0.6, 0.3, 0.5, 0.2, 20.0
EXPONENTS = (0.5, 1.0, 1.5, 2.0)


def scene(exponent: str, **parameters: float) -> sc.Scene:
    law = sc.friction_law(
        f"sign(w)*(mu_d + (mu_s - mu_d)*exp(-(abs(w)/vs)**{exponent}))",
        {"mu_s": MU_S, "mu_d": MU_D, "vs": VS, **parameters},
    )
    block = sc.Lagrangian(
        "v**2/2", "x**2/2", {"x": f"friction({BELT} - v)"}, coordinates={"x": "v"}, friction=law, contact="set-valued"
    )
    return sc.Scene(block, None, initial={"x": 0, "v": 0}, transient=0, window=TIME, time_unit="time", rtol=1e-9)


def by_hand(delta: float) -> float:
    """Where the block is at the end: slip with w > 0 or w < 0 until w = 0, then stick until the spring pulls with mu_s."""

    def force(w: float) -> float:
        return MU_D + (MU_S - MU_D) * np.exp(-((abs(w) / VS) ** delta))

    t, x, v, sign = 0.0, 0.0, 0.0, 1.0
    while t < TIME:
        if sign == 0.0:  # stick: x grows with the belt
            rise = (MU_S - x) / BELT
            if t + rise >= TIME:
                return x + BELT * (TIME - t)
            t, x, v, sign = t + rise, MU_S, BELT, 1.0

        def rates(_: float, y: np.ndarray, s: float = sign) -> list[float]:
            return [y[1], s * force(BELT - y[1]) - y[0]]

        def rest(_: float, y: np.ndarray, s: float = sign) -> float:
            return s * (BELT - y[1])

        rest.terminal, rest.direction = True, -1.0  # type: ignore[attr-defined]
        solution = solve_ivp(rates, (t, TIME), [x, v], method="DOP853", rtol=1e-11, atol=1e-13, events=rest)
        t, (x, v) = solution.t[-1], solution.y[:, -1]
        sign = 0.0 if abs(x) < MU_S else -sign
    return float(x)


def test_exponents_as_a_parameter() -> None:
    result = sc.run(scene("delta", delta=2.0), delta=EXPONENTS, show_progress=False)
    assert result.success
    np.testing.assert_allclose(result.end.sel(component="x").values.ravel(), [*map(by_hand, EXPONENTS)], atol=2e-7)


@pytest.mark.parametrize("integrator", ["auto", "dop853"])
def test_an_exponent_as_a_number(integrator: str) -> None:
    result = sc.run(scene("(3/2)").replace(integrator=integrator), show_progress=False)
    assert result.success
    np.testing.assert_allclose(result.end.sel(component="x").values.ravel(), [by_hand(1.5)], atol=2e-7)


def powers(text: str, **parameters: float) -> sc.Scene:
    law = sc.friction_law(f"sign(w)*(3/10 + {text}/5)", parameters)
    block = sc.Lagrangian("v**2/2", "x**2/2", {"x": "friction(1/5 - v) + cos(t)/3"}, coordinates={"x": "v"}, friction=law,
                          contact="set-valued")  # fmt: skip
    return sc.Scene(block, "spring", sc.graphs.chain(2), transient=0, window=6)


def test_deviations_pass_the_start_of_slip_under_powers_above_one() -> None:
    """The second derivative of |w|**(3/2) is infinite at w = 0: exponents are those of a law that is rounded there."""
    smooth = sc.exponents(powers("(w**2 + 1e-10)**(3/4)"), [0.0, 0.1, 0.3]).exponent
    for law in (powers("abs(w)**(3/2)"), powers("abs(w)**p", p=1.5), powers("(abs(w)/c)**p", p=1.5, c=1.0)):
        np.testing.assert_allclose(sc.exponents(law, [0.0, 0.1, 0.3]).exponent, smooth, atol=2e-6)
    result = sc.run(powers("abs(2*w)**(3/2)"), sigma=[0.1, 0.3], certified=True, show_progress=False)
    assert result.success


@pytest.mark.parametrize("text", ["sqrt(abs(w))", "(abs(w)/2)**(2/3)"])
def test_infinite_slopes_at_rest_are_refused_before_a_run(text: str) -> None:
    words = "small deviations: found .*, whose slope is infinite where slip begins; expected finite slopes"
    with pytest.raises(ValueError, match=words):
        sc.run(powers(text), sigma=[0.1, 0.3], certified=True, show_progress=False)
    with pytest.raises(ValueError, match=words):
        sc.exponents(powers(text), [0.1])
    assert sc.run(powers(text), sigma=0.1, show_progress=False).success


def test_stiff_methods_start_where_a_slope_is_infinite() -> None:
    """The slope of sqrt(|v|) is infinite at the start v = 0, where the Jacobian of the first step is evaluated."""
    node = sc.Field({"v": "-sqrt(abs(v))*sign(v) + sin(t)"}, initial={"v": 0.0})
    given = sc.Scene(node, None, transient=0, window=6, time_unit="time", rtol=1e-9, atol=1e-11)
    ends = [sc.run(given.replace(integrator=name), show_progress=False).end for name in ("rodas5p", "dop853")]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)

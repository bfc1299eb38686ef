"""AUTO-07p by bifpy: rates in Python are written as Fortran, compiled and run in a process of their own.

AUTO writes eleven digits of parameters and periods, and six of multipliers.  A driven oscillator is an autonomous one
beside a Stuart-Landau oscillator that turns with the drive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

Rates = Callable[[Any, Any], list[Any]]
PERIOD = 11  # AUTO's number of the parameter that holds the period
STEPS = {"nmx": 20_000, "npr": 20_000, "iad": 3, "ilp": 1, "isp": 2, "iads": 1, "itmx": 20, "itnw": 9, "nwtn": 3}
TOLERANCES = {"epsl": 1e-10, "epsu": 1e-10, "epss": 1e-8, "a0": -1e300, "a1": 1e300}
MESH = {"ntst": 80, "ncol": 5, "ds": 0.01, "dsmin": 1e-7}


def column(state: Any, parameters: Any) -> list[Any]:
    """Return the rates of Jansen and Rit's column."""
    y0, u0, y1, u1, y2, u2 = state
    first, second, third = (5 / (1 + np.exp(0.56 * (6 - v))) for v in (y1 - y2, 135 * y0, 135 * y0 / 4))
    excited = 325 * (parameters[0] + 108 * second) - 200 * u1 - 10000 * y1
    return [u0, 325 * first - 200 * u0 - 10000 * y0, u1, excited, u2, 37125 * third - 100 * u2 - 2500 * y2]


def lorenz(state: Any, parameters: Any) -> list[Any]:
    """Return the rates of Lorenz's equations."""
    x, y, z = state
    return [10 * (y - x), parameters[0] * x - y - x * z, x * y - 8 * z / 3]


def van_der_pol(state: Any, parameters: Any) -> list[Any]:
    """Return the rates of the pair."""
    x, v, y, w = state
    k = parameters[0]
    return [v, (1 - x * x) * v - x - k * (w - v), w, (1 - y * y) * w - y - k * (v - w)]


def duffing(state: Any, parameters: Any) -> list[Any]:
    """Return the rates of Duffing's oscillator and of its drive (c, s) on the unit circle."""
    x, v, c, s = state
    inward = 1 - c * c - s * s
    return [v, -x - x**3 - v / 10 + 0.3 * c, inward * c - parameters[0] * s, inward * s + parameters[0] * c]


def rest() -> Mapping[str, Sequence[float]]:
    """Return folds and Hopf points of the column."""
    points = equilibria(column, [0.00065, 0, -1.332, 0, 2.522, 0], -60.0, (-100.0, 400.0), dsmax=0.5)
    return {"fold": values(points, "FOLD"), "Hopf": values(points, "HOPF_BIFURCATION")}


def unstable() -> Mapping[str, Sequence[float]]:
    """Return the Hopf point of Lorenz's equations, periods and multipliers of its cycles."""
    from bifpy import auto

    points = equilibria(lorenz, [7, 7, 19], 20.0, (19.0, 26.0), dsmax=0.2)
    (hopf,) = (point for point in points if point.point_type.name == "HOPF_BIFURCATION")
    cycles = auto.restart(
        lorenz,
        settings(auto.IPS_PERIODIC_ORBIT, 3, 1, (19.5, 26.0), dsmax=0.2),
        hopf,
        icu=[1, PERIOD],
        isw=auto.ISW_HOPF_TO_PERIODIC_ORBIT,
        uzr={1: [24.0, 22.0, 20.0]},
        transpile=True,
    )
    return {"Hopf": [hopf.parameters[0]], **orbits(labelled(cycles))}


def antiphase() -> Mapping[str, Sequence[float]]:
    """Return periods and multipliers of the antiphase cycle of the pair."""
    from bifpy import auto

    return orbits(cycles(van_der_pol, [2, 0, -2, 0], 0.35, (0.05, 0.4), auto, uzr={1: [0.3, 0.1]}, uzstop={1: [0.08]}))


def resonance() -> Mapping[str, Sequence[float]]:
    """Return the folds of Duffing's resonance."""
    from bifpy import auto

    return {"fold": values(cycles(duffing, [0, 0, 1, 0], 2.2, (1.0, 2.3), auto, uzstop={1: [1.1]}), "FOLD")}


def settings(kind: int, states: int, parameters: int, span: tuple[float, float], **more: float) -> dict[str, float]:
    """Return AUTO's constants."""
    return (
        STEPS
        | TOLERANCES
        | MESH
        | {"ips": kind, "ndim": states, "npar": parameters, "rl0": span[0], "rl1": span[1]}
        | more
    )


def equilibria(rates: Rates, near: Sequence[float], value: float, span: tuple[float, float], dsmax: float) -> list[Any]:
    """Return the labelled points of a branch of equilibria that begins near a state."""
    from bifpy import auto

    begin = fsolve(lambda state: rates(state, [value]), near, xtol=1e-14)

    def start(state: Any, parameters: Any, _: float) -> None:
        for number, each in enumerate(begin):
            state[number] = float(each)
        parameters[0] = value

    constants = settings(auto.IPS_EQUILIBRIUM, len(begin), 1, span, dsmax=dsmax)
    return labelled(auto.run(rates, start, constants, icu=[1], transpile=True))


def cycles(
    rates: Rates, near: Sequence[float], value: float, span: tuple[float, float], auto: Any, **more: Any
) -> list[Any]:
    """Return the labelled points of a branch of cycles, downward from the one that a transient reaches."""

    def slope(_: float, state: Any) -> Any:
        return rates(state, [value])

    def turn(_: float, state: Any) -> float:
        return float(state[1])

    turn.direction = -1  # type: ignore[attr-defined]
    end = solve_ivp(slope, (0, 400), near, "DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    last = solve_ivp(slope, (0, 40), end, "DOP853", rtol=1e-12, atol=1e-13, events=turn, dense_output=True)
    first, second = last.t_events[0][:2]
    times = np.linspace(first, second, 400)

    def start(_: Any, parameters: Any, __: float) -> None:
        parameters[0], parameters[PERIOD - 1] = value, second - first

    constants = settings(auto.IPS_PERIODIC_ORBIT, len(near), PERIOD, span, dsmax=0.05) | {"ds": -0.01}
    data = (times - first) / (second - first), last.sol(times).T
    return labelled(auto.run(rates, start, constants, icu=[1, PERIOD], dat=data, transpile=True, **more))


def labelled(result: Any) -> list[Any]:
    """Return the labelled points of all branches."""
    return [point for branch in result.branches for point in branch.points if point.is_labeled]


def values(points: Sequence[Any], kind: str) -> list[float]:
    """Return the parameter at points of a type."""
    return [float(point.parameters[0]) for point in points if point.point_type.name == kind]


def orbits(points: Sequence[Any]) -> dict[str, list[float]]:
    """Return periods and second multipliers at the values that were asked for."""
    asked = [point for point in points if point.point_type.name == "USER_SPECIFIED_VALUE"]
    return {
        "period": [float(each.periodic_orbit.period) for each in asked],
        "multiplier": [float(each.floquet_multipliers[1].real) for each in asked],
    }


CASES: Mapping[str, Callable[[], Mapping[str, Sequence[float]]]] = {
    "Jansen-Rit, rest": rest,
    "van der Pol pair, antiphase": antiphase,
    "Lorenz, unstable cycles": unstable,
    "Duffing, resonance": resonance,
}

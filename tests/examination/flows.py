"""The flows of the package dysts (Gilpin, arXiv:2110.05266) as fields: their rates are called with symbols of SymPy."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import FunctionType
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import Field, Scene, run
from synchain.results import Status

PERIODS = 2.0
"""Length of a comparison in periods of the flow, if the Lyapunov time is not shorter."""

GROWTH = 3.0
"""Longest comparison in Lyapunov times: a difference grows by less than exp(3)."""


@dataclass(frozen=True)
class Flow:
    """One flow: rates as a function of numbers, the same as expressions, a start on the attractor and its times."""

    name: str
    rates: Callable[[float, np.ndarray], np.ndarray]
    expressions: tuple[sp.Expr, ...]
    field: Field
    start: np.ndarray
    period: float
    exponent: float

    @property
    def span(self) -> float:
        return min(PERIODS * self.period, GROWTH / self.exponent)

    def scene(self, **settings: Any) -> Scene:
        """One node on the attractor, run for the span of the comparison by default settings."""
        initial = dict(zip(self.field.states, map(float, self.start), strict=True))
        times = {"transient": 0.0, "window": self.span, "time_unit": "time"} | settings
        return Scene(self.field, None, initial=initial, **times)


class _Symbolic:
    """NumPy whose elementary functions take expressions, and arrays of them."""

    _ELEMENTARY = {"abs": sp.Abs, "sign": sp.sign, "log": sp.log, "exp": sp.exp, "sqrt": sp.sqrt} | {
        name: getattr(sp, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")
    }
    pi = sp.pi

    def __getattr__(self, name: str) -> Any:
        if name in self._ELEMENTARY:
            return np.vectorize(self._ELEMENTARY[name], otypes=[object])
        return getattr(np, name)

    @staticmethod
    def heaviside(x: sp.Expr, at_zero: float) -> sp.Expr:
        return sp.Heaviside(x, at_zero)

    @staticmethod
    def min(values: Any, axis: int | None = None) -> Any:
        if axis is None:
            return sp.Min(*np.ravel(values))
        return np.apply_along_axis(lambda row: sp.Min(*row), axis, np.asarray(values, object))

    @staticmethod
    def zeros_like(values: Any) -> np.ndarray:
        return np.full(np.shape(values), sp.S.Zero, dtype=object)


def _python(function: Any, numpy: Any) -> Any:
    """A function of dysts without Numba, which finds another NumPy."""
    static = isinstance(function, staticmethod)
    plain = function.__func__ if static else function
    plain = getattr(plain, "py_func", plain)
    if not isinstance(plain, FunctionType):
        return function
    names = plain.__globals__ | ({"np": numpy} if numpy is np else {"np": numpy, "max": sp.Max, "min": sp.Min})
    copy = FunctionType(plain.__code__, names, plain.__name__, plain.__defaults__)
    return staticmethod(copy) if static else copy


def _rates(kind: type, parameters: dict[str, Any], numpy: Any) -> Callable[[Any, Any], Any]:
    """The rates of a flow, of (state, time), with the numbers of its parameters."""
    body: dict[str, Any] = {}
    for parent in reversed(kind.__mro__[: kind.__mro__.index(_base())]):
        body |= {name: _python(value, numpy) for name, value in vars(parent).items() if not name.startswith("__")}
    model = type(kind.__name__, (), body)()
    vars(model).update(parameters)
    if hasattr(model, "rhs"):
        return model.rhs
    values = [parameters[name] for name in sorted(parameters)]
    return lambda state, t: model._rhs(*state, t, *values)


def _base() -> type:
    from dysts.base import DynSys

    return DynSys


@cache
def _table() -> dict[str, dict[str, Any]]:
    text = (resources.files("dysts") / "data" / "chaotic_attractors.json").read_text(encoding="utf-8")
    return json.loads(text)


def names() -> list[str]:
    """All flows of dysts but those with delays."""
    return sorted(name for name, row in _table().items() if not row["delay"])


def flow(name: str) -> Flow:
    """Read one flow."""
    from dysts import flows

    row, kind = _table()[name], getattr(flows, name)
    parameters = {key: np.array(v) if isinstance(v, list) else v for key, v in row["parameters"].items()}
    exact = {key: _exact(value) for key, value in row["parameters"].items()}
    start = np.array(row["initial_conditions"], float)
    states = [sp.Symbol(f"x{k + 1}", real=True) for k in range(len(start))]
    symbolic = _rates(kind, exact, _Symbolic())(np.array(states, object), sp.Symbol("t", real=True))
    rates = {state: sp.nsimplify(rate, rational=True) for state, rate in zip(states, symbolic, strict=True)}
    numeric = _rates(kind, parameters, np)
    return Flow(
        name,
        lambda t, state: np.asarray(numeric(state, t), float),
        tuple(rates.values()),
        Field(rates, name=name),
        start,
        float(row["period"]),
        float(row["maximum_lyapunov_estimated"]),
    )


def _exact(value: Any) -> Any:
    """A number, or an array of numbers, as the rational that its digits say."""
    if isinstance(value, list):
        return np.array([_exact(v) for v in value], object)
    return sp.Rational(str(value)) if value is not None else None


def reference(of: Flow, span: float) -> tuple[np.ndarray, np.ndarray]:
    """The state after the span by SciPy, and the largest absolute value of each component on the way."""
    for method in ("DOP853", "Radau"):
        path = solve_ivp(of.rates, (0.0, span), of.start, method=method, rtol=1e-12, atol=1e-22, max_step=span / 20)
        if path.success:
            return path.y[:, -1], np.abs(path.y).max(axis=1)
    raise RuntimeError(f"{of.name}: no reference; {path.message}")


def digits(of: Flow, **settings: Any) -> float:
    """Correct digits of the state after the span, in the component that has fewest; -inf if the run did not end."""
    expected, extent = reference(of, of.span)
    result = run(of.scene(**settings), show_progress=False)
    if int(result.data["status"]) != Status.FINISHED:
        return -np.inf
    error = np.abs(result.end.values.ravel() - expected) / np.where(extent > 0, extent, 1.0)
    return float(-np.log10(max(error.max(), 1e-16)))

"""Checks of the physics of a model: friction must not feed energy unless declared, masses must be positive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

import sympy as sp

from .contact import ContactModel, FrictionLaw
from .lagrangian import mass_matrix
from .nondimensional import friction_coefficient, nondimensional
from .oscillator import FieldModel, Oscillator

SPEEDS = tuple(side * 10.0 ** (k / 4) for k in range(-24, 9) for side in (1.0, -1.0))
"""Sliding velocities at which a law is checked (a choice): four per decade from 1e-6 to 100, in both directions."""


def check_power(law: FrictionLaw, values: Mapping[str, float]) -> None:
    """Raise ValueError if friction feeds energy, w f(w) < 0, and the law does not declare it."""
    if law.self_exciting:
        return
    coefficient, names = _coefficient(law)
    parameters = [values[name] for name in names]
    for w in SPEEDS:
        try:
            f = coefficient(w, *parameters)
        except (ArithmeticError, ValueError):  # skip: the integration reports poles and overflows
            continue
        if w * f < 0.0:
            raise ValueError(
                f"friction law {law.name!r}: f({w:.3g}) = {f:.3g} has the sign against the sliding velocity and feeds energy; "
                "expected w f(w) >= 0; turn the sign of the force, correct the parameters, or write self_exciting=True"
            )


@lru_cache(maxsize=64)
def _coefficient(law: FrictionLaw) -> tuple[Callable[..., float], tuple[str, ...]]:
    """Return f(w, …) as a plain function, and the names of its parameters."""
    names = tuple(law.parameters)
    w = sp.Symbol("w", real=True)
    value = friction_coefficient(law, ContactModel.SIGN)(w)
    symbols = [w, *(sp.Symbol(name, real=True) for name in names)]
    sign = {"sign": lambda x: (x > 0) - (x < 0)}
    return sp.lambdify(symbols, value, [sign, "math"]), names


def check_masses(oscillator: Oscillator, values: Mapping[str, float]) -> None:
    """Raise ValueError if the kinetic energy of an oscillator is not positive for every velocity.

    Masses that depend on the state are not checked, nor are vector fields.
    """
    if isinstance(oscillator.model, FieldModel):
        return
    masses, names, velocities = _masses(oscillator)
    if not {*names} <= values.keys():
        return
    matrix = masses(*(values[name] for name in names))
    diagonal = [row[k] for k, row in enumerate(matrix)]
    for k, velocity in enumerate(velocities):  # the matrix is positive if all pivots of its elimination are
        if not matrix[k][k] > 0.0:
            raise ValueError(
                f"oscillator {oscillator.name!r}: the mass of the velocity {velocity} is {diagonal[k]:g}, and its kinetic "
                "energy not positive; expected T > 0 for every motion; correct T or the parameters"
            )
        for row in matrix[k + 1 :]:
            factor = row[k] / matrix[k][k]
            row[:] = [a - factor * b for a, b in zip(row, matrix[k], strict=True)]


def checked_parameters(oscillator: Oscillator, law: FrictionLaw | None) -> set[str]:
    """Return the names of the parameters that `check_masses` and `check_power` read."""
    names = set() if isinstance(oscillator.model, FieldModel) else {*_masses(oscillator)[1]}
    return names if law is None else names | {*law.parameters}


@lru_cache(maxsize=64)
def _masses(
    oscillator: Oscillator,
) -> tuple[Callable[..., list[list[float]]], tuple[str, ...], tuple[sp.Symbol, ...]]:
    """Return the mass matrix as a function of numbers, their names, and the velocities that its rows belong to."""
    system = nondimensional(oscillator)
    masses = mass_matrix(system.kinetic, system.velocities)
    symbols = sorted(masses.free_symbols, key=str)
    return sp.lambdify(symbols, masses.tolist(), "math"), tuple(s.name for s in symbols), system.velocities

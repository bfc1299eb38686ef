"""From a physical Lagrangian to non-dimensional equations, by substitution: no scaled equation is typed in.

Every physical quantity of unit kg^a m^b s^c is written as its non-dimensional value times M^a L^b T^c, where M, L and T are
the oscillator's own units of mass, length and time.  Put into the energies and the forces, M, L and T must cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

import sympy as sp

from ..inputs.plugins import call
from .calculus import derivative
from .components import TIME
from .friction import CONTACTS, regularise
from .lagrangian import Mechanics
from .parameter import dimension

__all__ = [
    "FRICTION",
    "friction_coefficient",
    "mechanics",
    "nondimensional",
    "physical",
    "physical_symbols",
    "scale",
    "static_coefficient",
]

FRICTION = sp.Function("f", real=True)
"""The friction coefficient as an unknown function of the sliding velocity; a law takes its place at the end."""

MASS, LENGTH, DURATION = sp.symbols("M L T", positive=True)


def magnitude(unit: str) -> sp.Expr:
    """Return the amount M^a L^b T^c of a quantity that the non-dimensional value 1 stands for."""
    mass, length, duration = dimension(unit)
    return MASS**mass * LENGTH**length * DURATION**duration


def scale(model: ModuleType, unit: str) -> sp.Expr:
    """Return that amount in the physical symbols of an oscillator, such as g*m/k for the unit m.

    It is 1 where the oscillator is non-dimensional from the start.  Raises ValueError where the oscillator's scales do not
    turn each quantity of its UNITS into 1.
    """
    if not hasattr(model, "scales"):
        return sp.S.One
    symbols = {name: sp.Symbol(name, positive=True) for name in model.UNITS}
    units = call(model.scales, symbols)
    values = {MASS: units["kg"], LENGTH: units["m"], DURATION: units["s"]}
    for name, own in model.UNITS.items():
        value = sp.powdenest(symbols[name] / magnitude(own).xreplace(values), force=True)
        if value != 1:
            raise ValueError(f"{_name(model)}.scales: {name} becomes {value}; expected 1: correct the scales or UNITS")
    return sp.powdenest(magnitude(unit).xreplace(values), force=True)


def physical(model: ModuleType) -> Mechanics:
    """Return the Lagrangian system of an oscillator in physical symbols (eq. 2), with `FRICTION` for its friction law."""
    return mechanics(model, physical_symbols(model))


def physical_symbols(model: ModuleType) -> dict[str, Any]:
    """Return what the functions of an oscillator may ask for by name, in physical symbols."""
    names = {name: sp.Symbol(name, positive=True) for name in getattr(model, "UNITS", {})}
    terms = getattr(model, "PHYSICAL", {})
    for name in model.PARAMETERS:
        names[terms.get(name, name)] = sp.Symbol(terms.get(name, name), real=True)
    return {**names, **_state(model), "t": TIME, "friction": FRICTION}


def nondimensional(model: ModuleType) -> Mechanics:
    """Return the Lagrangian system in non-dimensional symbols (eq. 3), with `FRICTION` for its friction law.

    Raises ValueError where units do not cancel.
    """
    if not hasattr(model, "scales"):
        return physical(model)
    scale(model, "1")  # the scales must turn every quantity of UNITS into 1
    given: dict[str, Any] = {name: magnitude(unit) for name, unit in model.UNITS.items()}
    for name, parameter in model.PARAMETERS.items():
        given[model.PHYSICAL[name]] = sp.Symbol(name, real=True) * magnitude(parameter.unit)
    units = coordinates(model)
    symbols = _state(model)
    for name, (speed, unit) in units.items():
        given[name] = symbols[name] * magnitude(unit)
        given[speed] = symbols[speed] * magnitude(unit) / DURATION
    given["t"] = TIME * DURATION
    given["friction"] = lambda w: FRICTION(_cancel(w / magnitude("m/s"), f"{_name(model)}: sliding velocity"))
    found = mechanics(model, given)
    energy = magnitude("N*m")
    return Mechanics(
        tuple(symbols[name] for name in units),
        tuple(symbols[speed] for speed, _ in units.values()),
        _cancel(found.kinetic / energy, f"{_name(model)}: kinetic energy"),
        _cancel(found.potential / energy, f"{_name(model)}: potential energy"),
        tuple(
            _cancel(force * magnitude(unit) / energy, f"{_name(model)}: force on {name}")
            for force, (name, (_, unit)) in zip(found.forces, units.items(), strict=True)
        ),
    )


def mechanics(model: ModuleType, given: Mapping[str, Any]) -> Mechanics:
    """Return the energies and forces of an oscillator with `given` expressions put in for the names that it uses."""
    units = coordinates(model)
    force = call(model.force, given) if hasattr(model, "force") else (sp.S.Zero,) * len(units)
    forces = tuple(force) if isinstance(force, tuple | list) else (force,)
    if hasattr(model, "dissipation"):
        lost = _damping(model, given, [speed for speed, _ in units.values()])
        forces = tuple(sp.sympify(own) - rate for own, rate in zip(forces, lost, strict=True))
    return Mechanics(
        tuple(given[name] for name in units),
        tuple(given[speed] for speed, _ in units.values()),
        call(model.kinetic, given),
        call(model.potential, given),
        forces,
    )


def _damping(model: ModuleType, given: Mapping[str, Any], speeds: list[str]) -> tuple[sp.Expr, ...]:
    """The derivatives of Rayleigh's function by the velocities, whatever expressions stand for these."""
    moving = {name: sp.Dummy(name, real=True) for name in speeds}
    function = sp.sympify(call(model.dissipation, {**given, **moving}))
    values = {moving[name]: given[name] for name in speeds}
    return tuple(derivative(function, symbol).xreplace(values) for symbol in moving.values())


def friction_coefficient(law: ModuleType, contact: str) -> Callable[[sp.Expr], sp.Expr]:
    """Return f(w), the friction coefficient as a function of the non-dimensional sliding velocity.

    The parameters of a law have units too, so they scale with the rest: a rate of decay a = 2.5 of unit s/m decays with
    2.5 |w| only when w is measured in L/T.  Raises ValueError where the units of a law do not cancel, and for an unknown
    contact.
    """
    if contact not in CONTACTS:
        raise ValueError(f"unknown contact {contact!r}; known: {', '.join(CONTACTS)}")
    w = sp.Dummy("w", real=True)
    given = {name: sp.Symbol(name, real=True) * magnitude(p.unit) for name, p in law.PARAMETERS.items()}
    value = _cancel(call(law.force, {**given, "w": w * magnitude("m/s")}), f"friction law {_name(law)}")
    if contact == "atan":
        value = regularise(value, sp.Symbol("kappa", real=True))
    return lambda argument: value.xreplace({w: argument})


def static_coefficient(law: ModuleType) -> sp.Expr | None:
    """Return the static friction coefficient of a law that has one of its own."""
    if not hasattr(law, "static"):
        return None
    given = {name: sp.Symbol(name, real=True) * magnitude(p.unit) for name, p in law.PARAMETERS.items()}
    return _cancel(call(law.static, given), f"friction law {_name(law)}: static")


def coordinates(model: ModuleType) -> Mapping[str, tuple[str, str]]:
    """Return coordinate -> (velocity, unit) of an oscillator."""
    return getattr(model, "COORDINATES", {"x": ("v", "m")})


def _state(model: ModuleType) -> dict[str, sp.Symbol]:
    names = [name for pair in coordinates(model).items() for name in (pair[0], pair[1][0])]
    return {name: sp.Symbol(name, real=True) for name in names}


def _cancel(expression: sp.Expr, what: str) -> sp.Expr:
    """The expression with common factors taken out; ValueError where a unit has not cancelled."""
    result = sp.factor_terms(sp.sympify(expression))
    left = {MASS: "kg", LENGTH: "m", DURATION: "s"}.items()
    found = [name for symbol, name in left if result.has(symbol)]
    if found:
        raise ValueError(f"{what}: the unit {found[0]} does not cancel in {result}; check the units of the parameters")
    return result


def _name(model: ModuleType) -> str:
    return model.__name__.rpartition(".")[2]

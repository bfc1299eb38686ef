"""Derive non-dimensional equations from a physical Lagrangian by substitution; nobody types scaled equations.

Every physical quantity of unit kg^a m^b s^c is replaced by its non-dimensional value times M^a L^b T^c.  M, L and T are
the units of mass, length and time of the oscillator.  M, L and T must cancel in the scaled energies and forces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import sympy as sp

from .calculus import derivative
from .components import TIME
from .contact import SLIDING, ContactModel, FrictionLaw, regularise
from .impacts import Friction
from .lagrangian import Mechanics
from .oscillator import FRICTION, LagrangianModel, Oscillator
from .parameter import Parameter, dimension

MASS, LENGTH, DURATION = sp.symbols("M L T", positive=True)


def magnitude(unit: str) -> sp.Expr:
    """Return the physical amount M^a L^b T^c of the non-dimensional value 1."""
    mass, length, duration = dimension(unit)
    return MASS**mass * LENGTH**length * DURATION**duration


def scale(oscillator: Oscillator, unit: str) -> sp.Expr:
    """Return the physical amount of the non-dimensional value 1, in the physical symbols of an oscillator."""
    scaling = oscillator.model.scaling if isinstance(oscillator.model, LagrangianModel) else None
    if scaling is None:
        return sp.S.One
    values = {MASS: scaling.scales["kg"], LENGTH: scaling.scales["m"], DURATION: scaling.scales["s"]}
    for name, quantity_unit in scaling.units.items():
        value = sp.powdenest(sp.Symbol(name, positive=True) / magnitude(quantity_unit).xreplace(values), force=True)
        if value != 1:
            raise ValueError(f"{oscillator}.scales: {name} becomes {value}; expected 1: correct the scales or UNITS")
    return sp.powdenest(magnitude(unit).xreplace(values), force=True)


def physical(oscillator: Oscillator) -> Mechanics:
    """Return the Lagrangian system of an oscillator in physical symbols (eq. 2), with `FRICTION` for its friction law."""
    model = oscillator.model
    if not isinstance(model, LagrangianModel):
        raise ValueError(f"oscillator {oscillator.name!r} is a vector field; expected one with a Lagrangian")
    speeds = tuple(_real(c.velocity) for c in model.coordinates)
    forces = model.forces
    if model.dissipation != 0:  # Rayleigh: Q = -dR/dv
        lost = (derivative(model.dissipation, speed) for speed in speeds)
        forces = tuple(force - rate for force, rate in zip(forces, lost, strict=True))
    for k, event in enumerate(model.events):
        if isinstance(event, Friction):  # virtual work: the force on a coordinate is -load f(w) dw/dv
            number = () if event.law is None else (sp.Integer(k),)
            coefficient = event.load * FRICTION(event.sliding, *number)
            forces = tuple(
                force - coefficient * derivative(event.sliding, speed)
                for force, speed in zip(forces, speeds, strict=True)
            )
    positions = tuple(_real(c.name) for c in model.coordinates)
    return Mechanics(positions, speeds, model.kinetic, model.potential, forces)


def nondimensional(oscillator: Oscillator) -> Mechanics:
    """Return the Lagrangian system in non-dimensional symbols (eq. 3), with `FRICTION` for its friction law."""
    system, model = physical(oscillator), oscillator.model
    if not isinstance(model, LagrangianModel) or model.scaling is None:
        return system
    scale(oscillator, "1")  # raises ValueError unless the scales turn every quantity of UNITS into 1
    # Substitute for each physical symbol: its non-dimensional value times M^a L^b T^c.
    amounts = {sp.Symbol(name, positive=True): magnitude(unit) for name, unit in model.scaling.units.items()}
    for name, parameter in oscillator.parameters.items():
        amounts[_real(model.scaling.physical[name])] = _real(name) * magnitude(parameter.unit)
    for c in model.coordinates:
        amounts[_real(c.name)] = _real(c.name) * magnitude(c.unit)
        amounts[_real(c.velocity)] = _real(c.velocity) * magnitude(c.unit) / DURATION
    amounts[TIME] = TIME * DURATION
    energy = magnitude("N*m")

    def scaled_by(expression: sp.Expr, over: sp.Expr, what: str) -> sp.Expr:
        scaled = expression.xreplace(amounts).replace(
            FRICTION, lambda w: FRICTION(_cancel(w / magnitude("m/s"), f"{oscillator}: sliding velocity"))
        )
        return _cancel(scaled / over, f"{oscillator}: {what}")

    return Mechanics(
        system.coordinates,
        system.velocities,
        scaled_by(system.kinetic, energy, "kinetic energy"),
        scaled_by(system.potential, energy, "potential energy"),
        tuple(
            scaled_by(force, energy / magnitude(c.unit), f"force on {c.name}")
            for force, c in zip(system.forces, model.coordinates, strict=True)
        ),
    )


def friction_coefficient(law: FrictionLaw, contact: str) -> Callable[[sp.Expr], sp.Expr]:
    """Return f(w), the friction coefficient as a function of the non-dimensional sliding velocity.

    Parameters of a law may have units.  A rate of decay a = 2.5 of unit s/m multiplies |w| in the unit L/T of velocity.
    If no parameter has a unit, w has none either.
    """
    treatment = ContactModel.parse("contact", contact)
    w = sp.Dummy("w", real=True)
    pure = all(parameter.unit == "1" for parameter in law.parameters.values())
    amounts = {SLIDING: w if pure else w * magnitude("m/s"), **_amounts(law.parameters)}
    value = _cancel(law.force.xreplace(amounts), f"friction law {law}")
    if treatment == ContactModel.ATAN:
        value = regularise(value, w, sp.Symbol("kappa", real=True))
    return lambda argument: value.xreplace({w: argument})


def static_coefficient(law: FrictionLaw) -> sp.Expr | None:
    """Return the static friction coefficient of a law; None if the law has none."""
    if law.static is None:
        return None
    return _cancel(law.static.xreplace(_amounts(law.parameters)), f"friction law {law}: static")


def _amounts(parameters: Mapping[str, Parameter]) -> dict[sp.Symbol, sp.Expr]:
    """Return for each parameter its symbol times its `magnitude`."""
    return {_real(name): _real(name) * magnitude(parameter.unit) for name, parameter in parameters.items()}


def _real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


def _cancel(expression: sp.Expr, what: str) -> sp.Expr:
    """Cancel M, L and T in an expression; raise ValueError if one of them remains."""
    result = sp.factor_terms(sp.sympify(expression))
    for symbol, unit in {MASS: "kg", LENGTH: "m", DURATION: "s"}.items():
        if result.has(symbol):
            raise ValueError(f"{what}: the unit {unit} does not cancel in {result}; check the units of the parameters")
    return result

"""From physical to non-dimensional equations, by substitution: nothing on the non-dimensional side is typed in.

Every physical quantity q of unit kg^a m^b s^c is written as (its non-dimensional value) M^a L^b S^c, where M, L and S are
the oscillator's own units of mass, length and time.  Put into the physical equations of motion and divided by the unit of
acceleration, the units must cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType

import sympy as sp

from .equations import TIME
from .frictions import KAPPA, regularise
from .lagrangian import accelerations
from .parameter import Parameter
from .plugins import call
from .units import dimension

__all__ = ["Scales", "law_function", "model_energies", "scaled_accelerations"]


class Scales:
    """Units of mass, length and time in physical symbols; all 1 where a model is non-dimensional already."""

    def __init__(self, model: ModuleType) -> None:
        names = getattr(model, "UNITS", {})
        self.symbols = {name: sp.Symbol(name, positive=True) for name in names}
        units = call(model.scales, self.symbols) if hasattr(model, "scales") else {}
        self.base = tuple(sp.sympify(units.get(unit, 1)) for unit in ("kg", "m", "s"))

    def of(self, unit: str) -> sp.Expr:
        """The amount of a quantity of this unit that the non-dimensional value 1 stands for."""
        return sp.Mul(*(scale**power for scale, power in zip(self.base, dimension(unit), strict=True)))


def law_function(
    law: ModuleType | None, contact: str, scales: Scales, symbols: Mapping[str, sp.Symbol]
) -> Callable[[sp.Expr], sp.Expr]:
    """Return f(w), the friction coefficient as a function of the physical sliding velocity.

    The law's own parameters are physical too: a rate of decay of unit s/m is its non-dimensional value over the unit of
    velocity.  Raises ValueError where the units of a law do not cancel.
    """

    def friction(w: sp.Expr) -> sp.Expr:
        if law is None:
            raise ValueError("this oscillator needs a friction law; give one, for example friction = 'exponential'")
        speed, inner = scales.of("m/s"), sp.Dummy("w", real=True)
        physical = {name: symbols[name] * scales.of(p.unit) for name, p in law.PARAMETERS.items()}
        value = call(law.force, {**physical, "w": speed * inner})
        if contact == "atan" and value.has(sp.sign):
            # sign(speed w) is sign(w) already, so kappa must carry the unit of velocity that the sign has lost
            value = regularise(value, symbols["kappa"] * scales.of(KAPPA.unit) * speed)
        value = cancel_units(value, scales, f"friction law {law.__name__.rpartition('.')[2]}")
        return value.xreplace({inner: cancel_units(sp.expand(w / speed), scales, "sliding velocity")})

    return friction


def model_energies(
    model: ModuleType, friction: Callable[[sp.Expr], sp.Expr], scales: Scales, symbols: Mapping[str, sp.Symbol]
) -> tuple[sp.Expr, sp.Expr, tuple[sp.Expr, ...], tuple[tuple[sp.Symbol, sp.Symbol], ...]]:
    """Return T, V, the forces Q and the pairs (coordinate, velocity), all physical, in non-dimensional symbols."""
    coordinates: Mapping[str, tuple[str, str]] = getattr(model, "COORDINATES", {"x": ("v", "m")})
    given: dict[str, object] = dict(scales.symbols)
    pairs = []
    for name, (speed, unit) in coordinates.items():
        q, v = sp.Symbol(f"{name}_physical", real=True), sp.Symbol(f"{speed}_physical", real=True)
        given |= {name: q, speed: v}
        pairs.append((q, v))
    physical: Mapping[str, str] = getattr(model, "PHYSICAL", {})
    for name, parameter in model.PARAMETERS.items():
        given[physical.get(name, name)] = symbols[name] * scales.of(parameter.unit if physical else "1")
    given |= {"t": TIME, "friction": friction}
    force = call(model.force, given) if hasattr(model, "force") else sp.S.Zero
    forces = tuple(force) if isinstance(force, tuple | list) else (force,) + (sp.S.Zero,) * (len(pairs) - 1)
    return call(model.kinetic, given), call(model.potential, given), forces, tuple(pairs)


def scaled_accelerations(
    model: ModuleType, law: ModuleType | None, contact: str, symbols: Mapping[str, sp.Symbol]
) -> tuple[tuple[sp.Symbol, ...], tuple[sp.Expr, ...]]:
    """Return the state (x …, v …) and the non-dimensional accelerations of an oscillator given by its Lagrangian."""
    scales = Scales(model)
    coordinates: Mapping[str, tuple[str, str]] = getattr(model, "COORDINATES", {"x": ("v", "m")})
    hidden: dict[sp.Symbol, sp.Expr] = {}
    friction = _hide(law_function(law, contact, scales, symbols), hidden, coordinates, scales)
    kinetic, potential, forces, pairs = model_energies(model, friction, scales, symbols)
    found = accelerations(kinetic, potential, forces, [q for q, _ in pairs], [v for _, v in pairs])
    units = {name: unit if scales.symbols else "1" for name, (_, unit) in coordinates.items()}
    swap: dict[sp.Symbol, sp.Expr] = {TIME: TIME * scales.of("s")}
    for (q, v), (name, (speed, _)) in zip(pairs, coordinates.items(), strict=True):
        length = scales.of(units[name])
        swap |= {q: sp.Symbol(name, real=True) * length, v: sp.Symbol(speed, real=True) * length / scales.of("s")}
    rates = []
    for e, name in zip(found, coordinates, strict=True):
        scaled = e.xreplace(swap)
        if scales.symbols:
            scaled = sp.expand(scaled * scales.of("s") ** 2 / scales.of(units[name]))
        rates.append(cancel_units(scaled, scales, f"acceleration of {name}").xreplace(hidden))
    state = (*(sp.Symbol(n, real=True) for n in coordinates), *(sp.Symbol(v, real=True) for v, _ in coordinates.values()))
    return state, tuple(rates)


def _hide(
    friction: Callable[[sp.Expr], sp.Expr],
    hidden: dict[sp.Symbol, sp.Expr],
    coordinates: Mapping[str, tuple[str, str]],
    scales: Scales,
) -> Callable[[sp.Expr], sp.Expr]:
    """Friction as a symbol that stands for its value in `hidden`, so that scaling leaves the law as it was written."""
    swap = {}
    for name, (speed, unit) in coordinates.items():
        length = scales.of(unit) if scales.symbols else sp.S.One
        swap[sp.Symbol(f"{speed}_physical", real=True)] = sp.Symbol(speed, real=True) * length / scales.of("s")
        swap[sp.Symbol(f"{name}_physical", real=True)] = sp.Symbol(name, real=True) * length

    def opaque(w: sp.Expr) -> sp.Expr:
        stand_in = sp.Dummy("f", real=True)
        hidden[stand_in] = friction(w.xreplace(swap))
        return stand_in

    return opaque


def cancel_units(e: sp.Expr, scales: Scales, what: str) -> sp.Expr:
    """The expression itself, once its physical units have cancelled; ValueError where they have not."""
    left = sorted(s.name for s in e.free_symbols & set(scales.symbols.values()))
    if left:
        raise ValueError(f"{what}: the physical {', '.join(left)} did not cancel; check the units of the parameters")
    return e


def describe(parameters: Mapping[str, Parameter], scales: Scales) -> dict[str, Parameter]:
    """The parameters with what their value 1 stands for, in physical symbols."""
    from dataclasses import replace

    return {name: replace(p, scale=str(scales.of(p.unit))) for name, p in parameters.items()}

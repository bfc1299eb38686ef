"""Plug-in files become values here: oscillators, friction laws and couplings by name.

The functions of a file are called once, with symbols; nothing later knows that there was a file.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import lru_cache
from types import ModuleType
from typing import Any

import sympy as sp

from ..inputs.frozen import FrozenDict
from ..inputs.plugins import call, load
from ..interactions.coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling, split
from ..mechanics.components import TIME
from ..mechanics.contact import SLIDING, FrictionLaw
from ..mechanics.oscillator import Coordinate, FieldModel, LagrangianModel, Oscillator, Scaling
from .definition import COUPLING, FRICTION_LAW, OSCILLATOR, coordinates_of, lagrangian_symbols

__all__ = ["load_friction_law", "load_oscillator", "read_coupling"]

USUAL_LAW = "exponential"
"""The friction law of an oscillator whose file says that it takes one."""


def load_oscillator(name: str) -> Oscillator:
    """Return the oscillator of a plug-in."""
    return _oscillator(name, load(OSCILLATOR, name))


def load_friction_law(name: str) -> FrictionLaw:
    """Return the friction law of a plug-in; ValueError as `load_oscillator` does."""
    return _friction_law(name, load(FRICTION_LAW, name))


def read_coupling(words: str) -> Coupling:
    """Return the coupling of a text."""
    matrix = MatrixCoupling.parse(words)
    if matrix is not None:
        return matrix
    name, coordinates = split(words)
    return _coupling(name, coordinates, load(COUPLING, name))


def _symbols(names: Iterable[str]) -> dict[str, sp.Symbol]:
    """A real symbol for each name."""
    return {name: sp.Symbol(name, real=True) for name in names}


def _text(module: ModuleType, name: str) -> str:
    return str(getattr(module, name, ""))


@lru_cache(maxsize=256)
def _oscillator(name: str, module: ModuleType) -> Oscillator:
    """The oscillator that a module defines."""
    initial = getattr(module, "INITIAL", None)
    return Oscillator(
        name,
        FrozenDict(module.PARAMETERS),
        _field(module) if hasattr(module, "field") else _lagrangian(module),
        None if initial is None else FrozenDict(initial),
        load_friction_law(USUAL_LAW) if module.FRICTION else None,
        summary=_text(module, "SUMMARY"),
        source=_text(module, "SOURCE"),
    )


def _field(module: ModuleType) -> FieldModel:
    """The vector field that a module defines."""
    rates = call(module.field, {**_symbols((*module.PARAMETERS, *module.STATE)), TIME.name: TIME})
    return FieldModel(tuple(module.STATE), tuple(map(sp.sympify, rates)))


def _lagrangian(module: ModuleType) -> LagrangianModel:
    """The Lagrangian that a module defines."""
    table = coordinates_of(module)
    scaling = _scaling(module)
    coordinates = tuple(
        Coordinate(name, velocity, "1" if scaling is None else unit) for name, (velocity, unit) in table.items()
    )
    given = lagrangian_symbols(module)
    force = call(module.force, given) if hasattr(module, "force") else (sp.S.Zero,) * len(coordinates)
    return LagrangianModel(
        coordinates,
        sp.sympify(call(module.kinetic, given)),
        sp.sympify(call(module.potential, given)),
        tuple(map(sp.sympify, force if isinstance(force, tuple | list) else (force,))),
        sp.sympify(call(module.dissipation, given)) if hasattr(module, "dissipation") else sp.S.Zero,
        scaling,
    )


def _scaling(module: ModuleType) -> Scaling | None:
    """The scaling that a module defines, None if its Lagrangian is non-dimensional."""
    if not hasattr(module, "scales"):
        return None
    scales = call(module.scales, {name: sp.Symbol(name, positive=True) for name in module.UNITS})
    return Scaling(FrozenDict(module.UNITS), FrozenDict(getattr(module, "PHYSICAL", {})), FrozenDict(scales))


@lru_cache(maxsize=256)
def _friction_law(name: str, module: ModuleType) -> FrictionLaw:
    """The friction law that a module defines."""
    parameters = _symbols(module.PARAMETERS)
    static = sp.sympify(call(module.static, parameters)) if hasattr(module, "static") else None
    return FrictionLaw(
        name,
        FrozenDict(module.PARAMETERS),
        sp.sympify(call(module.force, {**parameters, SLIDING.name: SLIDING})),
        static,
        tuple((low, high) for low, high in getattr(module, "ORDER", ())),
        getattr(module, "SELF_EXCITING", False),
        _text(module, "SUMMARY"),
        _text(module, "SOURCE"),
    )


@lru_cache(maxsize=256)
def _coupling(name: str, coordinates: tuple[str, ...] | None, module: ModuleType) -> LagrangianCoupling:
    """The coupling that a module defines, on some coordinates."""
    between = tuple(module.BETWEEN) if hasattr(module, "BETWEEN") else None

    def energy(function: str, *ends: str) -> sp.Expr:
        if not hasattr(module, function):
            return sp.S.Zero
        own: Callable[..., Any] = getattr(module, function)
        asked = tuple(inspect.signature(own).parameters) if between else ends
        return sp.sympify(call(own, {**_symbols((*asked, *module.PARAMETERS)), WEIGHT.name: WEIGHT}))

    return LagrangianCoupling(
        name,
        FrozenDict(module.PARAMETERS),
        energy("potential", "q_i", "q_j"),
        energy("dissipation", "v_i", "v_j"),
        energy("kinetic", "v_i", "v_j"),
        between,
        coordinates,
        _text(module, "SUMMARY"),
        _text(module, "SOURCE"),
    )

"""Oscillators and friction laws as tables of text and numbers, the form of scene files and results, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

import sympy as sp

from ..inputs.checks import check_keys, check_table, check_text, short_repr, typed_repr
from ..mechanics.components import TIME
from ..mechanics.contact import SLIDING, ContactModel, FrictionLaw
from ..mechanics.expression import read, written
from ..mechanics.oscillator import FieldModel, LagrangianModel, Oscillator
from ..mechanics.parameter import Parameter
from .inline import Field, Lagrangian, friction_law
from .loader import load_friction_law, load_oscillator

_COMMON = ("name", "parameters", "initial")
_FIELD = (*_COMMON, "rates")
_LAGRANGIAN = (*_COMMON, "coordinates", "kinetic", "potential", "forces", "dissipation", "friction", "contact")
_LAW = ("name", "parameters", "force", "static", "order", "self_exciting")


def oscillator_of_table(table: Mapping[object, Any]) -> Oscillator:
    """Return the oscillator of a table in a scene file."""
    first_order = "rates" in table
    check_keys("oscillator", table, _FIELD if first_order else _LAGRANGIAN)
    given = {str(key): value for key, value in table.items()}
    if first_order:
        rates = given.pop("rates")
        return Field(_texts("oscillator: rates", rates), **given)
    for key in ("coordinates", "kinetic"):
        if key not in given:
            raise ValueError(f"oscillator: {key!r} is missing; expected coordinates and kinetic, or rates of a field")
    law = given.pop("friction", None)
    return Lagrangian(
        _text("oscillator: kinetic", given.pop("kinetic")),
        _text("oscillator: potential", given.pop("potential", 0)),
        _texts("oscillator: forces", given.pop("forces", {})),
        _text("oscillator: dissipation", given.pop("dissipation", 0)),
        friction=_law(law),
        **given,
    )


def law_of_table(table: Mapping[object, Any]) -> FrictionLaw:
    """Return the friction law of a table in a scene file."""
    check_keys("friction", table, _LAW)
    given = {str(key): value for key, value in table.items()}
    if "force" not in given:
        raise ValueError("friction: 'force' is missing; expected the friction coefficient as a text in w")
    order = given.pop("order", ())
    if isinstance(order, str) or not isinstance(order, Sequence) or not all(_is_pair(pair) for pair in order):
        raise TypeError(f"friction: order: found {short_repr(order)}; expected pairs of parameters")
    force, static = _text("friction: force", given.pop("force")), given.pop("static", None)
    return friction_law(
        force,
        given.pop("parameters", None),
        static=None if static is None else _text("friction: static", static),
        order=tuple(tuple(pair) for pair in order),
        **given,
    )


def _is_pair(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(entry, str) for entry in value)


def _law(given: object) -> FrictionLaw | None:
    """The law of a table or a name; an expression needs the table."""
    if given is None or isinstance(given, Mapping):
        return None if given is None else law_of_table(given)
    name = check_text("oscillator: friction", given, 4096)
    return None if name == "none" else load_friction_law(name)


def _text(what: str, value: object) -> Any:
    """An expression of a file: text, or a number."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected an expression in quotation marks")
    return value


def _texts(what: str, table: object) -> dict[str, Any]:
    return {str(key): _text(f"{what}: {key}", value) for key, value in check_table(what, table).items()}


# -- and back ----------------------------------------------------------------------------------------------------


def as_name_or_table(part: Oscillator | FrictionLaw) -> str | dict[str, Any]:
    """Return the name of an oscillator or friction law that is a plug-in's, else its table.

    A file outside the package is a plug-in too, named by its path.
    """
    if part.name.endswith(".py"):
        return str(part.name)
    load = load_oscillator if isinstance(part, Oscillator) else load_friction_law
    try:
        same = load(part.name) == part
    except (ValueError, TypeError):
        same = False
    if same:
        return str(part.name)
    return _oscillator_table(part) if isinstance(part, Oscillator) else _law_table(part)


def _oscillator_table(node: Oscillator) -> dict[str, Any]:
    symbols = (*node.states, *node.parameters)
    texts = _Texts(f"oscillator {node.name!r}", (*symbols, TIME.name))
    model = node.model
    table: dict[str, Any] = {"name": node.name}
    if isinstance(model, FieldModel):
        table["rates"] = dict(zip(model.state, map(texts.write, model.rates), strict=True))
    else:
        table |= _lagrangian_table(model, texts)
        if node.friction is not None:
            table["friction"] = as_name_or_table(node.friction)
        if node.contact != ContactModel.ATAN:
            table["contact"] = str(node.contact)
    table["parameters"] = _parameter_tables(node.parameters)
    if node.initial is not None:
        table["initial"] = {str(name): float(value) for name, value in node.initial.items()}
    return table


def _lagrangian_table(model: LagrangianModel, texts: _Texts) -> dict[str, Any]:
    if model.scaling is not None:
        raise ValueError(f"{texts.what}: found scales of its quantities and no file; expected a non-dimensional model")
    table: dict[str, Any] = {
        "coordinates": {c.name: c.velocity for c in model.coordinates},
        "kinetic": texts.write(model.kinetic),
        "potential": texts.write(model.potential),
        "forces": {c.name: texts.write(e) for c, e in zip(model.coordinates, model.forces, strict=True) if e != 0},
    }
    if model.dissipation != 0:
        table["dissipation"] = texts.write(model.dissipation)
    return table


def _law_table(law: FrictionLaw) -> dict[str, Any]:
    texts = _Texts(f"friction law {law.name!r}", (SLIDING.name, *law.parameters))
    table: dict[str, Any] = {"name": law.name, "force": texts.write(law.force)}
    if law.static is not None:
        table["static"] = texts.write(law.static)
    if law.order:
        table["order"] = [list(pair) for pair in law.order]
    if law.self_exciting:
        table["self_exciting"] = True
    return {**table, "parameters": _parameter_tables(law.parameters)}


class _Texts:
    """Writes the expressions of one part as text that is read as the same expressions."""

    def __init__(self, what: str, names: Sequence[str]) -> None:
        self.what = what
        self.names = {name: sp.Symbol(name, real=True) for name in names}

    def write(self, e: sp.Expr) -> str:
        text = written(e)
        if read(self.what, text, self.names) != e:
            raise ValueError(
                f"{self.what}: found {short_repr(e)}, which no text says; make it with Lagrangian or Field"
            )
        return text


def _parameter_tables(parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    return {name: _parameter_table(parameter) for name, parameter in parameters.items()}


def _parameter_table(parameter: Parameter) -> float | dict[str, Any]:
    """The default alone, or all that was said about a parameter."""
    told = {
        own.name: getattr(parameter, own.name)
        for own in fields(Parameter)
        if own.default is MISSING or getattr(parameter, own.name) != own.default
    }
    return float(parameter.default) if len(told) == 1 else told

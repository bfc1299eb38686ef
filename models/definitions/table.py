"""Convert oscillators, friction laws and couplings to and from tables of text and numbers, as in scene files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields, replace
from functools import lru_cache
from typing import Any

import sympy as sp

from ..inputs.checks import check_keys, check_table, check_text, short_repr, typed_repr
from ..interactions.coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling, Potential, from_table
from ..mechanics.components import TIME
from ..mechanics.contact import SLIDING, ContactModel, FrictionLaw
from ..mechanics.expression import read, written
from ..mechanics.impacts import EventDefinition, Friction, Reset, Stop
from ..mechanics.oscillator import Coordinate, FieldModel, LagrangianModel, Oscillator, Scaling
from ..mechanics.parameter import Parameter
from .inline import Field, Lagrangian, friction_law, link_energy
from .loader import load_friction_law, load_oscillator, read_coupling

_COMMON = ("name", "source", "parameters", "initial", "events")
_FIELD = (*_COMMON, "rates", "contact")
_LAGRANGIAN = (
    *_COMMON,
    "coordinates",
    "kinetic",
    "potential",
    "forces",
    "dissipation",
    "friction",
    "contact",
    "scaling",
)
_LAW = ("name", "source", "parameters", "force", "static", "order", "self_exciting")
_LINK = ("name", "source", "parameters", "energies", "on")
_EVENTS = {"friction": ("load", "law"), "stop": ("restitution", "in_order"), "reset": ("sets",)}
_ENERGIES = ("potential", "dissipation", "kinetic")


def oscillator_of_table(table: Mapping[object, Any]) -> Oscillator:
    """Make an oscillator from a table of a scene file."""
    first_order = "rates" in table
    check_keys("oscillator", table, _FIELD if first_order else _LAGRANGIAN)
    keywords = {str(key): value for key, value in table.items()}
    keywords["events"] = _events("oscillator", keywords.get("events", []))
    if first_order:
        return Field(_texts("oscillator: rates", keywords.pop("rates")), **keywords)
    for key in ("coordinates", "kinetic"):
        if key not in keywords:
            raise ValueError(f"oscillator: {key!r} is missing; expected coordinates and kinetic, or rates of a field")
    return Lagrangian(
        _text("oscillator: kinetic", keywords.pop("kinetic")),
        _text("oscillator: potential", keywords.pop("potential", 0)),
        _texts("oscillator: forces", keywords.pop("forces", {})),
        _text("oscillator: dissipation", keywords.pop("dissipation", 0)),
        friction=_law(keywords.pop("friction", None)),
        **keywords,
    )


def law_of_table(table: Mapping[object, Any]) -> FrictionLaw:
    """Make a friction law from a table of a scene file."""
    check_keys("friction", table, _LAW)
    keywords = {str(key): value for key, value in table.items()}
    if "force" not in keywords:
        raise ValueError("friction: 'force' is missing; expected the friction coefficient as a text in w")
    order = keywords.pop("order", ())
    if isinstance(order, str) or not isinstance(order, Sequence) or not all(_is_pair(pair) for pair in order):
        raise TypeError(f"friction: order: found {short_repr(order)}; expected pairs of parameters")
    force, static = _text("friction: force", keywords.pop("force")), keywords.pop("static", None)
    return friction_law(
        force,
        keywords.pop("parameters", None),
        static=None if static is None else _text("friction: static", static),
        order=tuple(tuple(pair) for pair in order),
        **keywords,
    )


def coupling_of_table(table: Mapping[object, Any]) -> Coupling:
    """Make a coupling from a table of a scene file: energies of coordinates, or rates or a potential of states."""
    if "energies" not in table:
        return from_table("coupling", table, _events("coupling", table.get("events", [])))
    check_keys("coupling", table, _LINK)
    keywords = {str(key): value for key, value in table.items()}
    on = keywords.pop("on", None)
    check_keys("coupling: energies", check_table("coupling: energies", keywords["energies"]), _ENERGIES)
    energies = _texts("coupling: energies", keywords.pop("energies"))
    potential, dissipation, kinetic = (energies.get(key, 0) for key in _ENERGIES)
    coupling = link_energy(potential, R=dissipation, T=kinetic, **keywords)
    if on is None:
        return coupling
    if not isinstance(on, list | tuple) or not on:
        raise TypeError(f"coupling: on: found {typed_repr(on)}; expected a list of coordinates")
    return replace(coupling, coordinates=tuple(check_text("coupling: on", name) for name in on))


def _is_pair(value: object) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(entry, str) for entry in value)


def _law(value: object) -> FrictionLaw | None:
    """Make a friction law from a table or a name; a bare expression is refused."""
    if value is None or isinstance(value, Mapping):
        return None if value is None else law_of_table(value)
    name = check_text("oscillator: friction", value, 4096)
    return None if name == "none" else load_friction_law(name)


def _events(owner: str, value: object) -> list[EventDefinition]:
    """Make events from their tables."""
    if not isinstance(value, list | tuple):
        raise TypeError(f"{owner}: events: found {typed_repr(value)}; expected a list of tables")
    found: list[EventDefinition] = []
    for k, entry in enumerate(value):
        what = f"{owner}: events[{k + 1}]"
        event = check_table(what, entry)
        kind = next((word for word in _EVENTS if word in event), None)
        if kind is None:
            raise ValueError(f"{what}: found {short_repr(dict(event))}; expected one of {', '.join(_EVENTS)}")
        check_keys(what, event, (kind, *_EVENTS[kind]))
        level = _text(f"{what}: {kind}", event[kind])
        if kind == "friction":
            found.append(Friction(level, _text(f"{what}: load", event.get("load", 1)), _law(event.get("law"))))
        elif kind == "stop":
            restitution = _text(f"{what}: restitution", event.get("restitution", 0))
            in_order: Any = event.get("in_order", False)
            found.append(Stop(level, restitution, in_order))
        else:
            found.append(Reset(level, _texts(f"{what}: sets", event.get("sets", {}))))
    return found


def _text(what: str, value: object) -> Any:
    """Check an expression of a file: a text or a number."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected an expression in quotation marks")
    return value


def _texts(what: str, table: object) -> dict[str, Any]:
    return {str(key): _text(f"{what}: {key}", value) for key, value in check_table(what, table).items()}


# -- and back ----------------------------------------------------------------------------------------------------


def as_name_or_table(part: Oscillator | FrictionLaw) -> str | dict[str, Any]:
    """Return the name of an oscillator or friction law that a plug-in defines, else its table.

    A file outside the package is a plug-in named by its path.
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


def as_text_or_table(coupling: Coupling | None) -> str | dict[str, Any]:
    """Return the text of a coupling made from components or by a plug-in, else its table; "none" for None."""
    if coupling is None or isinstance(coupling, MatrixCoupling):
        return "none" if coupling is None else str(coupling)
    if isinstance(coupling, Potential) and coupling.events:
        return {**coupling.as_dict(), "events": [_event_table(event, coupling) for event in coupling.events]}
    if not isinstance(coupling, LagrangianCoupling):
        return coupling.as_dict()
    if coupling.name.endswith(".py"):
        return str(coupling)
    try:
        same = read_coupling(str(coupling)) == coupling
    except (ValueError, TypeError):
        same = False
    return str(coupling) if same else _link_table(coupling)


def _oscillator_table(node: Oscillator) -> dict[str, Any]:
    model = node.model
    scaling = model.scaling if isinstance(model, LagrangianModel) else None
    texts = _Texts(f"oscillator {node.name!r}", (*node.states, *node.parameters, TIME.name), scaling)
    table: dict[str, Any] = _names(node)
    if isinstance(model, FieldModel):
        table["rates"] = dict(zip(model.state, map(texts.write, model.rates), strict=True))
    else:
        table |= _lagrangian_table(model, texts)
        if node.friction is not None:
            table["friction"] = as_name_or_table(node.friction)
    if node.contact != ContactModel.ATAN:
        table["contact"] = str(node.contact)
    if model.events:
        table["events"] = [_event_table(event, texts) for event in model.events]
    table["parameters"] = _parameter_tables(node.parameters)
    if node.initial is not None:
        table["initial"] = {str(name): float(value) for name, value in node.initial.items()}
    return table


def _event_table(event: EventDefinition, texts: _Texts | Potential) -> dict[str, Any]:
    if isinstance(event, Friction):
        law = {} if not isinstance(event.law, FrictionLaw) else {"law": as_name_or_table(event.law)}
        return {"friction": texts.write(event.sliding), "load": texts.write(event.load), **law}
    if isinstance(event, Stop):
        table = {"stop": texts.write(event.gap), "restitution": texts.write(event.restitution)}
        return table | ({"in_order": True} if event.in_order else {})
    return {"reset": texts.write(event.guard), "sets": {s: texts.write(e) for s, e in event.sets.items()}}


def _lagrangian_table(model: LagrangianModel, texts: _Texts) -> dict[str, Any]:
    table: dict[str, Any] = {
        "coordinates": {c.name: c.velocity for c in model.coordinates},
        "kinetic": texts.write(model.kinetic),
        "potential": texts.write(model.potential),
        "forces": {c.name: texts.write(e) for c, e in zip(model.coordinates, model.forces, strict=True) if e != 0},
    }
    if model.dissipation != 0:
        table["dissipation"] = texts.write(model.dissipation)
    if model.scaling is not None:
        table["scaling"] = _scaling_table(model.scaling, model.coordinates, texts)
    return table


def _scaling_table(scaling: Scaling, coordinates: Iterable[Coordinate], texts: _Texts) -> dict[str, Any]:
    return {
        "units": {**scaling.units, **{c.name: c.unit for c in coordinates if c.unit != "1"}},
        "scales": {unit: texts.write(e) for unit, e in scaling.scales.items()},
        "physical": {name: inside for name, inside in scaling.physical.items() if inside != name},
    }


def _law_table(law: FrictionLaw) -> dict[str, Any]:
    texts = _Texts(f"friction law {law.name!r}", (SLIDING.name, *law.parameters))
    table: dict[str, Any] = {**_names(law), "force": texts.write(law.force)}
    if law.static is not None:
        table["static"] = texts.write(law.static)
    if law.order:
        table["order"] = [list(pair) for pair in law.order]
    if law.self_exciting:
        table["self_exciting"] = True
    return {**table, "parameters": _parameter_tables(law.parameters)}


def _link_table(coupling: LagrangianCoupling) -> dict[str, Any]:
    what = f"coupling {coupling.name!r}"
    if coupling.between is not None:
        raise ValueError(
            f"{what}: found a coupling between {' and '.join(coupling.between)} and no file; write it in a file"
        )
    texts = _Texts(what, ("q_i", "q_j", "v_i", "v_j", "W", *coupling.parameters))
    energies = zip(_ENERGIES, (coupling.potential, coupling.dissipation, coupling.kinetic), strict=True)
    weight = {WEIGHT: texts.names["W"]}  # in texts the weight is called W
    table: dict[str, Any] = {
        **_names(coupling),
        "energies": {key: texts.write(e.xreplace(weight)) for key, e in energies if e != 0},
    }
    if coupling.coordinates is not None:
        table["on"] = list(coupling.coordinates)
    return {**table, "parameters": _parameter_tables(coupling.parameters)}


def _names(part: Oscillator | FrictionLaw | LagrangianCoupling) -> dict[str, Any]:
    """Return name and source of an oscillator, law or coupling; leave out an unknown source."""
    return {"name": part.name, **({"source": part.source} if part.source else {})}


class _Texts:
    """Write the expressions of an oscillator, law or coupling as text; reading the text gives equal expressions."""

    def __init__(self, what: str, names: Sequence[str], scaling: Scaling | None = None) -> None:
        self.what = what
        self.names = {name: sp.Symbol(name, real=True) for name in names}
        if scaling is not None:  # physical parameters are real, constants of the scales positive
            self.names |= {name: sp.Symbol(name, real=True) for name in scaling.physical.values()}
            self.names |= {name: sp.Symbol(name, positive=True) for name in scaling.units}

    def write(self, e: sp.Expr) -> str:
        return _text_of(self.what, e, tuple(self.names.items()))


@lru_cache(maxsize=1024)  # each result stores its scene
def _text_of(what: str, e: sp.Expr, names: tuple[tuple[str, sp.Symbol], ...]) -> str:
    """Return an expression as text; raise ValueError if reading the text gives another expression."""
    text = written(e)
    if read(what, text, dict(names)) != e:
        raise ValueError(
            f"{what}: found {short_repr(e)}, which no text makes; make it with Lagrangian, Field or link_energy"
        )
    return text


def _parameter_tables(parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    return {name: _parameter_table(parameter) for name, parameter in parameters.items()}


def _parameter_table(parameter: Parameter) -> float | dict[str, Any]:
    """Return the default value alone, or a table of the fields that differ from their defaults."""
    entries = {
        field.name: getattr(parameter, field.name)
        for field in fields(Parameter)
        if field.default is MISSING or getattr(parameter, field.name) != field.default
    }
    return float(parameter.default) if len(entries) == 1 else entries

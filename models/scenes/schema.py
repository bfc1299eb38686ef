"""Derive the JSON Schema of scene files, for editors, from the keywords of `Scene`, their types and their limits."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from typing import Any, TypeAlias, get_args, get_origin, get_type_hints

from ..definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from ..definitions.inline import LONGEST_SOURCE
from ..definitions.loader import load_friction_law, load_oscillator, read_coupling
from ..graphs.families import Family, family
from ..graphs.families import names as families
from ..inputs import plugin_files
from ..inputs.plugin_files import PluginKind
from ..inputs.words import Word
from ..mechanics.contact import KAPPA, ContactModel
from ..mechanics.parameter import Parameter
from ..networks.model import MOST_NODES
from ..sweeps.axis import LIMIT as AXIS_LIMIT
from ..sweeps.draws import GRAPH
from .defaults import LIMITS, integrators
from .scene import KEYWORDS, Scene
from .section import Direction

Table: TypeAlias = dict[str, Any]

TEXT: Table = {"type": "string", "maxLength": 200}
CITATION: Table = {"type": "string", "maxLength": LONGEST_SOURCE}
FILE: Table = {"type": "string", "pattern": r"\.py$"}
"""The path of a part outside the package."""

NUMBER: Table = {"type": ["number", "string"]}
"""A number, or a constant as text: "2*pi/5"."""

EXPRESSIONS: Table = {"type": "object", "additionalProperties": NUMBER}
"""Expressions as text, or numbers, by names."""

WHOLE = {"type": "integer", "minimum": 1, "maximum": MOST_NODES}
OPTIONS = {int: ["integer", "string"], str: ["number", "string"]}
"""JSON types of an option of a family of graphs, by the type of its default; other options are lists."""


def schema() -> Table:
    """Return the JSON Schema of scene files, in JSON types.

    The schema lists the keys of every table, their types and ranges, and the names of all parts.  `Scene` checks
    conditions on several keys, such as whether an oscillator has a parameter, and the grammar of texts.  The schema
    uses only keywords that draft 4 and draft 7 share, since editors read one or the other.

    References
    ----------
    A. Wright, H. Andrews & G. Luff, JSON Schema Validation, draft-handrews-json-schema-validation-01, 2018.
    """
    types, defaults, meanings = get_type_hints(Scene), inspect.signature(Scene).parameters, _meanings(Scene)
    rows = _rows()
    properties = {}
    for name in KEYWORDS:
        row = {"description": meanings.get(name, ""), **(rows[name] if name in rows else _of_type(name, types[name]))}
        default = defaults[name].default
        if isinstance(default, bool | int | float | str):
            row["default"] = default
        properties["sweep" if name == "axes" else name] = row
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A scene of synchain",
        **_table(properties),
    }


def _rows() -> dict[str, Table]:
    """Return the rows of keywords that the type of the keyword does not determine."""
    oscillator, friction, events_of_links = _written_out()
    group = {"oscillator": oscillator, "friction": friction, "at": {"type": "array", "items": WHOLE, "minItems": 1}}
    uniform = {"low": NUMBER, "high": NUMBER, "rng": _of_type("rng", int)}
    span = {"from": NUMBER, "to": NUMBER, "count": {"type": "integer", "minimum": 1, "maximum": AXIS_LIMIT}}
    numbers = {"type": "array", "items": NUMBER, "minItems": 1}
    values = _either(numbers, {"type": "array", "items": numbers, "minItems": 1})
    expressions: Table = {"type": "object", "additionalProperties": NUMBER}
    link = {
        "name": TEXT,
        "source": CITATION,
        "on": {"type": "array", "items": TEXT, "minItems": 1},
        "parameters": {"type": "object"},
    }
    tables = [
        _table({"energies": EXPRESSIONS, **link}, "energies"),
        _table({"rates": expressions, "parameters": {"type": "object"}}, "rates"),
        _table({"potential": NUMBER, "parameters": {"type": "object"}, "events": events_of_links}, "potential"),
    ]
    components = {"type": "string", "pattern": "->| on "}
    coupling = {"anyOf": [*_part(COUPLING, "none")["anyOf"], components, *tables]}
    graph = {"anyOf": _graphs()}
    section = {
        "function": TEXT,
        "direction": {"enum": list(map(str, Direction))},
        "level": NUMBER,
        "keep": {"anyOf": [TEXT, {"type": "array", "items": TEXT}]},
    }
    return {
        "oscillator": oscillator,
        "friction": friction,
        "coupling": coupling,
        "links": {"type": "array", "items": _table({"coupling": coupling, "topology": graph}, "coupling", "topology")},
        "nodes": {"type": "array", "items": _table(group, "oscillator", "at")},
        "topology": graph,
        "parameters": {
            "type": "object",
            "properties": {name: {"description": text, **values} for name, text in _parameters().items()},
            "additionalProperties": values,
        },
        "initial": {"type": "object", "additionalProperties": _either(numbers, _table(uniform, "low", "high"))},
        "t_eval": numbers,
        "observe": {"type": "object", "additionalProperties": TEXT},
        "sections": {"type": "object", "additionalProperties": _table(section, "function")},
        "stop": TEXT,
        "draws": {
            "type": "object",
            "properties": {GRAPH: {"anyOf": [TEXT, {"type": "array", "minItems": 1, "items": graph}]}},
            "additionalProperties": {"anyOf": [TEXT, {"type": "array", "minItems": 1}]},
        },
        "section": {**TEXT, "pattern": rf"^\s*\S+\s+({'|'.join(Direction)})(\s|$)"},
        "integrator": {"enum": ["auto", *integrators()]},
        "axes": {
            "type": "object",
            "properties": {"zipped": _of_type("zipped", bool)},
            "additionalProperties": {"anyOf": [numbers, _table(span, *span)]},
        },
    }


def _of_type(name: str, kind: Any) -> Table:
    """Return the row of a keyword from its type: a word, several words, text, a number in its range, true or false."""
    if isinstance(kind, type) and issubclass(kind, Word):
        return {"enum": [str(word) for word in kind]}
    if get_origin(kind) is tuple:
        return {"type": "array", "items": _of_type(name, get_args(kind)[0]), "uniqueItems": True}
    if kind in (int, float):
        low, high = LIMITS[name]
        span = {"minimum": low, "maximum": high}
        return {"type": "integer", **span} if kind is int else {"anyOf": [{"type": "number", **span}, TEXT]}
    if kind not in (bool, str):
        raise TypeError(f"keyword {name!r}: its type {kind} does not tell its form in a file; expected a row in _rows")
    return {"type": "boolean"} if kind is bool else TEXT


def _table(properties: Mapping[str, Table], *required: str) -> Table:
    """Return the row of a table with these keys and no others."""
    row = {"type": "object", "properties": dict(properties), "additionalProperties": False}
    return {**row, "required": list(required)} if required else row


def _either(*others: Table) -> Table:
    """Return the row of a number or something else."""
    return {"anyOf": [NUMBER, *others]}


def _part(kind: PluginKind, *words: str) -> Table:
    """Return the row of the name of a part, of a file outside the package, or of some words."""
    return {"anyOf": [{"enum": [*plugin_files.names(kind), *words]}, FILE]}


def _written_out() -> tuple[Table, Table, Table]:
    """Return the rows of an oscillator and of a friction law, a name or a table of expressions, and of events of links."""
    anything: Table = {"type": "object"}
    contact = {"enum": [str(word) for word in ContactModel]}
    law = _part(FRICTION_LAW, "none", "default")
    keys = {"name": TEXT, "source": CITATION, "force": NUMBER, "static": NUMBER, "order": {"type": "array"}}
    table = _table({**keys, "self_exciting": {"type": "boolean"}, "parameters": anything}, "force")
    friction = {"anyOf": [*law["anyOf"], table]}
    events = [
        _table({"friction": NUMBER, "load": NUMBER, "law": friction}, "friction"),
        _table({"stop": NUMBER, "restitution": NUMBER, "in_order": {"type": "boolean"}}, "stop"),
        _table({"reset": NUMBER, "sets": EXPRESSIONS}, "reset", "sets"),
    ]
    common = {"name": TEXT, "source": CITATION, "parameters": anything, "initial": anything,
              "events": {"type": "array", "items": {"anyOf": events}}}  # fmt: skip
    field = _table({**common, "rates": EXPRESSIONS, "contact": contact}, "rates")
    energies = {"coordinates": anything, "kinetic": NUMBER, "potential": NUMBER, "dissipation": NUMBER}
    more = {"forces": EXPRESSIONS, "friction": friction, "contact": contact, "scaling": anything}
    lagrangian = _table({**common, **energies, **more}, "coordinates", "kinetic")
    of_links: Table = {"type": "array", "items": {"anyOf": events[:2]}}  # contacts and stops
    return {"anyOf": [*_part(OSCILLATOR)["anyOf"], field, lagrangian]}, friction, of_links


def _graphs() -> list[Table]:
    """Return the tables of a topology: one for each family, a file of code, a matrix, a list of edges, a file of a matrix."""
    rows = {"type": "array", "minItems": 1, "items": {"type": "array", "items": NUMBER}}
    outside = {"type": "object", "properties": {"name": FILE, "n": WHOLE}, "required": ["name", "n"]}
    matrix = {"matrix": rows, "name": TEXT, "n": WHOLE}
    label = {"type": ["integer", "string"]}
    edge = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 3}
    edges: dict[str, Table] = {
        "edges": {"type": "array", "items": edge},
        "labels": {"type": "array", "minItems": 1, "items": label},
        "directed": {"type": "boolean"},
        "name": TEXT,
        "n": WHOLE,
    }
    triangle = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 3, "maxItems": 4}
    triangles: dict[str, Table] = {"triangles": {"type": "array", "items": triangle}, "name": TEXT, "n": WHOLE}
    composed: dict[str, Table] = {"name": {"type": "string", "pattern": r"\("}, "n": WHOLE}
    return [
        *(_family(family(name)) for name in families()),
        outside,
        _table(composed, "name", "n"),
        _table(matrix, "matrix"),
        _table(edges, "edges"),
        _table(triangles, "triangles"),
        _table({"file": {"type": "string"}}, "file"),
    ]


def _family(graphs: Family) -> Table:
    """Return the table of one family of graphs; types of options follow from the types of their defaults."""
    options: dict[str, Table] = {
        name: {"type": OPTIONS.get(type(default), ["array", "integer", "string"])}
        for name, default in graphs.options.items()
    }
    keys: dict[str, Table] = {"name": {"enum": [graphs.name]}, "n": {**WHOLE, "minimum": graphs.minimum}, **options}
    return {"description": graphs.summary, **_table(keys, "name", "n")}


def _parameters() -> dict[str, str]:
    """Return the meanings of each parameter in all oscillators, laws and couplings that have a parameter of the name."""
    parts: dict[str, Mapping[str, Parameter]] = {
        **{name: load_oscillator(name).parameters for name in plugin_files.names(OSCILLATOR)},
        **{f"friction {name}": load_friction_law(name).parameters for name in plugin_files.names(FRICTION_LAW)},
        **{f"coupling {name}": read_coupling(name).parameters for name in plugin_files.names(COUPLING)},
        "contact atan": {"kappa": KAPPA},
    }
    meanings: dict[str, list[str]] = {}
    for part, parameters in parts.items():
        for name, parameter in parameters.items():
            meanings.setdefault(name, []).append(f"{part}: {parameter.meaning}")
    return {name: "; ".join(meanings[name]) for name in sorted(meanings)}


def _meanings(kind: type) -> dict[str, str]:
    """Return the meanings of the parameters of a class from its NumPy-style docstring."""
    text = inspect.getdoc(kind) or ""
    section = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    rows = re.findall(r"^(\w[\w, ]*) : .*\n((?: {4}.*\n?)+)", section, re.MULTILINE)
    return {name: " ".join(text.split()) for names, text in rows for name in names.split(", ")}

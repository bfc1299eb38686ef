"""Check the observables, sections and stop of a scene against its model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from ..dynamics.observable import ENERGY, AtNode, Observable, Rate, Reduction, node_symbols
from ..dynamics.observable_text import as_observable, as_value
from ..inputs.checks import check_table, check_text, short_repr, suggestion
from ..inputs.frozen import FrozenDict
from ..inputs.names import ATTRIBUTES, NodeName, expect_free
from ..mechanics.components import TIME
from ..mechanics.impacts import Stop
from ..networks.energy_terms import energy_of
from ..networks.model import Model
from ..sweeps.parameters import varied
from .section import Section

ENDINGS = ("", "_time", "_count", "_kept")
"""The endings that results append to the name of a section."""

LISTED = 30
"""Most names that an error lists in full: a choice."""


def observables(model: Model, values: Mapping[str, float], table: object) -> FrozenDict[Observable]:
    """Return the observables of a scene by their names; `values` are its parameters."""
    checked: dict[str, Observable] = {}
    names = _Names(model, values)
    for name, value in names.entries("observe", table):
        checked[name] = as_observable(f"observe {name}", value)
        names.check(f"observe {name}", checked[name].value)
    return FrozenDict(checked)


def sections(model: Model, values: Mapping[str, float], table: object) -> FrozenDict[Section]:
    """Return the sections on functions of the states by name, with `keep` filled in; arguments as in `observables`."""
    checked: dict[str, Section] = {}
    names = _Names(model, values)
    for name, value in names.entries("sections", table, ENDINGS):
        what = f"section {name}"
        section = Section.of_table(what, value)
        function = as_value(what, section.variable)
        names.check(what, function)
        if names.at_each_node(function):
            raise ValueError(
                f"{what}: found {function}, which each node has; expected one function, e.g. of x_1 or nodes.mean(x)"
            )
        kept: list[str] = []
        for text in model.unlinked.state if section.keep is None else section.keep:
            expr = as_value(what, text)
            names.check(what, expr)
            if not names.at_each_node(expr):
                kept.append(sp.sstr(expr, order="lex"))
            elif expr.is_Symbol:
                kept += [f"{expr}_{i + 1}" for i in range(model.n)]
            else:
                kept += [f"nodes[{i + 1}]({sp.sstr(expr, order='lex')})" for i in range(model.n)]
        checked[name] = replace(section, variable=sp.sstr(function, order="lex"), keep=tuple(kept))
    return FrozenDict(checked)


def stop(model: Model, values: Mapping[str, float], text: object) -> str | None:
    """Return the text of the function that ends a cell when the function passes zero; None without a stop.

    Raises ValueError or TypeError as `observables` does, and for set-valued friction, whose events already end steps.
    """
    if text is None:
        return None
    function, names = as_value("stop", text), _Names(model, values)
    names.check("stop", function)
    if names.at_each_node(function):
        raise ValueError(
            f"stop: found {function}, which each node has; expected one function, e.g. of x_1 or of nodes.maximum(x)"
        )
    if events := [event for coupling, _ in model.linked for event in getattr(coupling, "events", ())]:
        found = "stops" if all(isinstance(event, Stop) for event in events) else "contacts"
        raise ValueError(f"stop: found {found} in links; expected links without events; leave stop out")
    if any(isinstance(event, Stop) for kind in model.kinds for event in getattr(kind.oscillator.model, "events", ())):
        raise ValueError("stop: found stops of nodes; expected smooth equations; leave stop out")
    if model.unlinked.sticks:
        raise ValueError("stop: found set-valued contacts; expected smooth equations; take contact 'atan'")
    return str(sp.sstr(function, order="lex"))


def has_own_energy(model: Model) -> bool:
    """Return True if a state or parameter is called energy; the name in observables then means this symbol."""
    return ENERGY.name in {*model.parameters, *model.components}


@dataclass
class _Names:
    """The names that may occur in expressions of a scene."""

    model: Model
    values: Mapping[str, float]  # the parameters of the scene

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Parameters with a value for each node or each link."""
        return varied(self.values, self.model.parameters)

    @cached_property
    def of_nodes(self) -> tuple[str, ...]:
        """States, and parameters, with a value for each node."""
        return (*self.model.unlinked.components, *(name for name in self.varied if self.model.holders(name)))

    def at_each_node(self, expr: sp.Expr) -> bool:
        """Return True if an expression has a value for each node."""
        return any(s.name in self.of_nodes for s in node_symbols(expr))

    def entries(self, keyword: str, table: object, endings: Sequence[str] = ("",)) -> Iterator[tuple[str, object]]:
        """Yield names and values of a table; refuse a name that with one of `endings` has another meaning in results."""
        if table is None:
            return
        model = self.model
        links = {name for name in self.varied if not model.holders(name)}
        coordinates = {f"{name}_link" for name in links}
        taken = {*ATTRIBUTES, *model.parameters, *self.values, *model.unlinked.state, *links, *coordinates}
        for key, value in check_table(keyword, table).items():
            name = check_text(keyword, key)
            if not name.isidentifier() or name.startswith("_"):
                raise ValueError(f"{keyword}: found the name {short_repr(name)}; expected letters, digits and _")
            variables = [f"{name}{ending}" for ending in endings]
            expect_free(keyword, variables, taken)
            taken.update(variables)
            yield name, value

    def check(self, what: str, expr: sp.Expr) -> None:
        """Raise ValueError for symbols other than states, parameters and t, states that nodes lack, and constants."""
        network, model = self.model.unlinked, self.model
        partly = {name for name in self.of_nodes if network.holders(name) != tuple(range(model.n))}
        valid_names = (*self.of_nodes, *network.state, *self.values, TIME.name)
        for name in sorted(s.name for s in expr.free_symbols):
            if name in partly:
                one = NodeName(name, network.holders(name)[0])
                raise ValueError(f"{what}: some nodes have no {name!r}; expected what all nodes have, or {one} of one")
            if name not in valid_names and name != ENERGY.name:
                energy = () if self._no_energy() else (ENERGY.name,)
                names = tuple(dict.fromkeys((*valid_names, *energy)))
                text = (
                    ", ".join(names) if len(names) <= LISTED else f"{', '.join(names[:15])}, … {', '.join(names[-5:])}"
                )
                raise ValueError(f"{what}: unknown name {short_repr(name)}; known: {text}{suggestion(name, names)}")
        if expr.has(ENERGY) and not has_own_energy(model):
            inside = next((e for e in sorted(expr.atoms(Reduction), key=str) if e.has(ENERGY)), None)
            if inside is not None:
                raise ValueError(f"{what}: found {inside}; expected the energy of the whole network outside of nodes")
            if problem := self._no_energy():
                raise ValueError(f"{what}: {problem}")
        for rate in expr.atoms(Rate):
            if rate.args[0].name not in {*network.components, *network.state}:
                raise ValueError(f"{what}: found {rate}; expected the rate of a state: {', '.join(network.components)}")
        for part in expr.atoms(AtNode):
            if part.args[1] > model.n:
                raise ValueError(f"{what}: found node {part.args[1]}; expected 1 to {model.n}")
        if not expr.free_symbols:
            raise ValueError(f"{what}: found the constant {short_repr(expr)}; expected an expression of states")

    def _no_energy(self) -> str:
        """Return the reason why the network has no energy; "" if there is an energy."""
        try:
            energy_of(self.model, self.varied)
        except ValueError as problem:
            return str(problem)
        return ""

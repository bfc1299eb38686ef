"""The observables and the sections of a scene, checked against its model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import sympy as sp

from ..dynamics.observable import ENERGY, AtNode, Observable, Rate, Reduction, node_symbols
from ..dynamics.observable_text import as_observable, as_value
from ..inputs.checks import check_table, check_text, short_repr, suggestion
from ..inputs.frozen import FrozenDict
from ..inputs.names import ATTRIBUTES, NodeName, expect_free
from ..mechanics.components import TIME
from ..networks.energy_terms import energy_of
from ..networks.model import Model
from ..sweeps.parameters import varied
from .section import Section

ENDINGS = ("", "_time", "_count", "_kept")
"""What follows the name of a section in the names that results have of it."""


def observables(model: Model, numbers: Mapping[str, float], given: object) -> FrozenDict[Observable]:
    """Return the observables of a scene by their names."""
    if given is None:
        return FrozenDict()
    found: dict[str, Observable] = {}
    for name, value in _named("observe", model, numbers, given):
        found[name] = as_observable(f"observe {name}", value)
        _check_names(f"observe {name}", found[name].value, model, numbers)
    return FrozenDict(found)


def sections(model: Model, numbers: Mapping[str, float], given: object) -> FrozenDict[Section]:
    """Return the sections on functions of a scene by their names, with all that they keep spelled out.

    Parameters and errors are those of `observables`; the values are sections or their tables.
    """
    if given is None:
        return FrozenDict()
    found: dict[str, Section] = {}
    for name, value in _named("sections", model, numbers, given, ENDINGS):
        what = f"section {name}"
        section = Section.of_table(what, value)
        function = as_value(what, section.variable)
        _check_names(what, function, model, numbers)
        if _own(function, model, numbers):
            raise ValueError(
                f"{what}: found {function}, which each node has; expected one function, e.g. of x_1 or nodes.mean(x)"
            )
        kept: list[str] = []
        for text in model.unlinked.state if section.keep is None else section.keep:
            kept += _kept(what, as_value(what, text), model, numbers)
        found[name] = replace(section, variable=sp.sstr(function, order="lex"), keep=tuple(kept))
    return FrozenDict(found)


def stop(model: Model, numbers: Mapping[str, float], given: object) -> str | None:
    """Return the text of the function that ends a cell when it passes zero; None for none.

    Raises ValueError or TypeError as `observables`, and for set-valued contacts, whose events end steps themselves.
    """
    if given is None:
        return None
    function = as_value("stop", given)
    _check_names("stop", function, model, numbers)
    if _own(function, model, numbers):
        raise ValueError(
            f"stop: found {function}, which each node has; expected one function, e.g. of x_1 or of nodes.maximum(x)"
        )
    if model.unlinked.sticks:
        raise ValueError("stop: found set-valued contacts; expected smooth equations; take contact 'atan'")
    return sp.sstr(function, order="lex")


def _kept(what: str, value: sp.Expr, model: Model, numbers: Mapping[str, float]) -> list[str]:
    """What a section keeps of one expression: it, or its value at each node."""
    _check_names(what, value, model, numbers)
    own = _own(value, model, numbers)
    if not own:
        return [sp.sstr(value, order="lex")]
    if value.is_Symbol:
        return [f"{value}_{i + 1}" for i in range(model.n)]
    return [f"nodes[{i + 1}]({sp.sstr(value, order='lex')})" for i in range(model.n)]


def _own(value: sp.Expr, model: Model, numbers: Mapping[str, float]) -> bool:
    """True if an expression has a value for each node."""
    names = {*model.unlinked.components, *_of_nodes(model, numbers)}
    return any(s.name in names for s in node_symbols(value))


def _of_nodes(model: Model, numbers: Mapping[str, float]) -> tuple[str, ...]:
    """The parameters that have a value for each node."""
    return tuple(name for name in varied(numbers, model.parameters) if model.holders(name))


def _named(
    keyword: str, model: Model, numbers: Mapping[str, float], given: object, endings: Sequence[str] = ("",)
) -> Iterator[tuple[str, object]]:
    """Yield names and values of a table; no name with one of the `endings` may mean something else in results."""
    links = {name for name in varied(numbers, model.parameters) if not model.holders(name)}
    taken = {
        *ATTRIBUTES,
        *model.parameters,
        *numbers,
        *model.unlinked.state,
        *links,
        *(f"{name}_link" for name in links),
    }
    for key, value in check_table(keyword, given).items():
        name = check_text(keyword, key)
        if not name.isidentifier() or name.startswith("_"):
            raise ValueError(f"{keyword}: found the name {short_repr(name)}; expected letters, digits and _")
        made = [f"{name}{ending}" for ending in endings]
        expect_free(keyword, made, taken)
        taken.update(made)
        yield name, value


def _check_names(what: str, value: sp.Expr, model: Model, numbers: Mapping[str, float]) -> None:
    """Refuse symbols that are no state, parameter or t, and states that some nodes lack."""
    apart, everywhere = model.unlinked, range(model.n)
    own = (*apart.components, *_of_nodes(model, numbers))
    partly = {name for name in own if apart.holders(name) != tuple(everywhere)}
    states = {*apart.components, *apart.state}
    known = (*own, *apart.state, *numbers, TIME.name)
    for name in sorted(s.name for s in value.free_symbols):
        if name in partly:
            one = NodeName(name, apart.holders(name)[0])
            raise ValueError(f"{what}: some nodes have no {name!r}; expected what all nodes have, or {one} of one")
        if name not in known and name != ENERGY.name:
            known = tuple(dict.fromkeys((*known, *_energy(model, numbers))))
            raise ValueError(f"{what}: unknown name {short_repr(name)}; known: {_few(known)}{suggestion(name, known)}")
    if value.has(ENERGY) and not has_own_energy(model):
        _check_energy(what, value, model, varied(numbers, model.parameters))
    for e in value.atoms(Rate):
        if e.args[0].name not in states:
            raise ValueError(f"{what}: found {e}; expected the rate of a state: {', '.join(apart.components)}")
    for e in value.atoms(AtNode):
        if e.args[1] > model.n:
            raise ValueError(f"{what}: found node {e.args[1]}; expected 1 to {model.n}")
    if not value.free_symbols:
        raise ValueError(f"{what}: found the constant {short_repr(value)}; expected an expression of states")


def has_own_energy(model: Model) -> bool:
    """True if a state or parameter is called energy, which observables mean then."""
    return ENERGY.name in {*model.parameters, *model.components}


def _energy(model: Model, numbers: Mapping[str, float]) -> tuple[str, ...]:
    """The name of the energy if the network has one."""
    try:
        energy_of(model, varied(numbers, model.parameters))
    except ValueError:
        return ()
    return (ENERGY.name,)


def _check_energy(what: str, value: sp.Expr, model: Model, own: tuple[str, ...]) -> None:
    """Refuse the energy of a network that has none, and that of single nodes."""
    inside = next((e for e in sorted(value.atoms(Reduction), key=str) if e.has(ENERGY)), None)
    if inside is not None:
        raise ValueError(f"{what}: found {inside}; expected the energy of the whole network outside of nodes")
    try:
        energy_of(model, own)
    except ValueError as problem:
        raise ValueError(f"{what}: {problem}") from None


def _few(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= 30 else f"{', '.join(names[:15])}, … {', '.join(names[-5:])}"

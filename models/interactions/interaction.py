"""Arbitrary links as values: rates of the states of the target, or a potential of the coordinates of both ends.

Expressions contain the symbols of `ends`: x_i is the state or parameter x of the target, x_j is x of the source.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import sympy as sp
from sympy.core.function import AppliedUndef

from ..inputs.checks import (
    check_instance,
    check_number,
    check_table,
    check_text,
    short_repr,
    suggestion,
    typed_repr,
)
from ..inputs.expression_text import FUNCTIONS
from ..inputs.frozen import FrozenDict
from ..mechanics.components import TIME, Node
from ..mechanics.contact import FrictionLaw
from ..mechanics.expression import FRICTION_NAME, LENGTH, exact, read, written
from ..mechanics.impacts import EventDefinition, Friction, Stop
from ..mechanics.law_plugins import load_friction_law
from ..mechanics.parameter import Parameter
from .ends import WEIGHT, Pair, Terms, directed, has_velocities

_WEIGHT = "W"
"""Name of the weight of a link in a text."""

_TAKEN = frozenset({"pi", FRICTION_NAME, *FUNCTIONS})
"""Names with another meaning in a text."""


@dataclass(frozen=True, slots=True, init=False)
class Rates:
    """A link that adds terms to the rates of its target and does not act back on the sources.

    A term of a link of weight W from j to i may be any function of the states and parameters of both ends, of W, of the
    parameters of the link and of time.  The term need not vanish between equal states.  A link with symbols of a second
    source, x_k, has three ends; its graph is a `Hypergraph`, over whose triangles the terms are added.

    Parameters
    ----------
    rates : mapping of Symbol or str to Expr or str
        The term for each state of the target: in the symbols of `ends`, such as {i.theta: K*W*sin(j.theta - i.theta)},
        or as text, such as {"theta": "K*W*sin(theta_j - theta_i)"}.  Decimals are exact: 0.1 is 1/10.
    parameters : mapping of Symbol or str to number or Parameter
        Parameters of the link with their defaults.

    Raises
    ------
    ValueError, TypeError
        For a key that is no state of the target, a symbol that is not declared, a parameter or weight that no term
        contains, and a value that is no expression.

    See Also
    --------
    synchain.Potential
    synchain.ends
    synchain.link_energy

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import Rates, ends
    >>> from synchain.models.definitions.loader import load_oscillator
    >>> i, j, W = ends(load_oscillator("rossler"))
    >>> K = sp.Symbol("K")
    >>> link = Rates({i.x: K * W * (j.x - i.x)}, {K: 0.1})
    >>> link == Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.1})
    True
    """

    rates: FrozenDict[sp.Expr]
    parameters: FrozenDict[Parameter]

    def __init__(
        self, rates: Mapping[sp.Symbol | str, object], parameters: Mapping[sp.Symbol | str, object] | None = None
    ) -> None:
        table = check_table("rates of a link", rates)
        if not table:
            raise ValueError("rates of a link: found none; expected one at least, e.g. {i.x: W*(j.x - i.x)}")
        targets = [_target(key) for key in table]
        twice = next((name for name in targets if targets.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"rates of a link: the rate of {twice!r} is given twice; expected it once")
        values = [
            _parsed(f"rates of a link: rate of {name}", e) for name, e in zip(targets, table.values(), strict=True)
        ]
        checked, defaults = _checked("rates of a link", values, parameters, ("_i", "_j", "_k"))
        for name, rate in zip(targets, checked, strict=True):
            if rate == 0:
                raise ValueError(f"rates of a link: the rate of {name!r} is 0; expected a function; leave it out")
        # In alphabetical order, so that equal contents make equal couplings.
        object.__setattr__(self, "rates", FrozenDict(sorted(zip(targets, checked, strict=True))))
        object.__setattr__(self, "parameters", defaults)

    def __reduce__(self) -> tuple[type[Rates], tuple[object, ...]]:
        keyed = {sp.Symbol(f"{name}_i", real=True): rate for name, rate in self.rates.items()}
        return Rates, (keyed, dict(self.parameters))

    @property
    def forced(self) -> bool:
        """True if time occurs."""
        return any(e.has(TIME) for e in self.rates.values())

    @property
    def triadic(self) -> bool:
        """True if the link has three ends: a state of the second source occurs."""
        symbols = {s for e in self.rates.values() for s in e.free_symbols} - _of_link(self.parameters)
        return any(s.name.endswith("_k") for s in symbols)

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> Rates:
        """Return the coupling itself: equal rates have one spelling."""
        return self

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for a state or parameter that the nodes at the ends of a link do not have."""
        self.terms(Pair((single, other or single), (None, None)))

    def terms(self, pair: Pair) -> Terms:
        """Return the terms of a link in the rates of its target."""
        states = pair.names[0]
        for name in self.rates:
            if name not in states:
                raise ValueError(
                    f"coupling '{self}': unknown state {name!r} of {pair.nodes[0].state}; known: {', '.join(states)}"
                    f"{suggestion(name, states)}"
                )
        rates = {name: _in_symbols_of(pair, self, e) for name, e in self.rates.items()}
        return Terms(rates=tuple(rates.get(name, sp.S.Zero) for name in states))

    def as_dict(self) -> dict[str, object]:
        """Return the coupling as a table of a scene file."""
        rates = {name: _written(e) for name, e in self.rates.items()}
        return {"rates": rates, "parameters": _tables(self.parameters)}

    def __str__(self) -> str:
        return f"rates of {', '.join(self.rates)}"


@dataclass(frozen=True, slots=True, init=False)
class Potential:
    """A link with a potential of the coordinates and parameters of its two ends, so that forces act on both ends.

    A link of weight W between i and j stores the energy V(i, j).  If V changes when the ends are exchanged, the link
    has a direction (`synchain.models.interactions.link`), and weights other than 1 are refused.  A potential with symbols
    of three ends, such as x_i, x_j and x_k, is the energy of a triangle; it is equal for all orders of the ends.

    Parameters
    ----------
    energy : Expr or str
        The energy of a link, in the symbols of `ends`: -G*W*i.m*j.m/sqrt((i.x - j.x)**2 + (i.y - j.y)**2), or as text,
        "k*W*(x_i - x_j)**2/2".
    parameters : mapping of Symbol or str to number or Parameter
        Parameters of the link with their defaults.
    events : iterable of Friction or Stop, optional
        Contacts and stops between the two ends; the energy may then be 0.  A contact has a law, whose parameters belong to
        the link.  It is set-valued, whatever `contact` the scene has.

    Raises
    ------
    ValueError, TypeError
        For a symbol that is not declared, a parameter or weight that the energy does not contain, an energy or event of only
        one end, and a value that is no expression.

    See Also
    --------
    synchain.Rates
    synchain.ends
    synchain.link_energy
    synchain.Lagrangian

    Examples
    --------
    >>> import synchain as sc
    >>> i, j, W = sc.ends(sc.load_oscillator("harmonic"))
    >>> spring = sc.Potential(W * (j.x - i.x) ** 2 / 2)
    >>> print(sc.export.text(sc.Scene("harmonic", spring, sc.graphs.chain(2)).equations))
    x_1'' = -x_1 + x_2 - x_1
    x_2'' = -x_2 + x_1 - x_2

    Balls that hit their neighbours:

    >>> stop = sc.Potential(0, {"e": 0.9}, events=[sc.Stop(j.x - i.x, restitution="e")])
    >>> stop.events
    (Stop(gap=-x_i + x_j, restitution=e, in_order=False),)
    """

    energy: sp.Expr
    parameters: FrozenDict[Parameter]
    events: tuple[Friction | Stop, ...]

    def __init__(
        self,
        energy: object,
        parameters: Mapping[sp.Symbol | str, object] | None = None,
        events: Iterable[EventDefinition] = (),
    ) -> None:
        what = "potential of a link"
        listed = [_event(k, event) for k, event in enumerate(events, start=1)]
        laws = {
            name: p for event in listed if isinstance(event, Friction) for name, p in _law(event).parameters.items()
        }
        of_events = [e for event in listed for e in event.expressions]
        (e, *_), own = _checked(what, [_parsed(what, energy), *of_events], parameters, ("_i", "_j", "_k"), laws)
        object.__setattr__(self, "energy", e)
        object.__setattr__(self, "parameters", FrozenDict(sorted({**laws, **own}.items())))
        object.__setattr__(self, "events", tuple(listed))
        self._check_both_ends(what)
        # Each node of a triangle feels the derivative by its own coordinates.
        orders = [self._exchanged(e, "ij"), self._exchanged(e, "jk")] if self.triadic else []
        if any(sp.expand(e - other) != 0 and sp.simplify(e - other) != 0 for other in orders):
            raise ValueError(
                f"{what}: found {short_repr(e)}, which changes if ends are exchanged; expected an energy of three equal ends"
            )

    def _check_both_ends(self, what: str) -> None:
        """Raise ValueError for an energy or an event of one end, and for events of three ends."""
        for e in (self.energy, *(event.expressions[0] for event in self.events)):
            ends = {s.name[-2:] for s in self._of_ends(e)}
            if not {"_i", "_j"} <= ends and not (e == 0 and self.events):
                raise ValueError(f"{what}: found {short_repr(e)}, of one end; expected a function of both")
        if self.events and self.triadic:
            raise ValueError(f"{what}: found events of three ends; expected contacts and stops between two nodes")

    def __reduce__(self) -> tuple[type[Potential], tuple[object, ...]]:
        return Potential, (self.energy, dict(self._own()), self.events)

    def _own(self) -> dict[str, Parameter]:
        """Return the parameters without those of friction laws that have the defaults of the law."""
        laws = {
            name: p
            for event in self.events
            if isinstance(event, Friction)
            for name, p in _law(event).parameters.items()
        }
        return {name: p for name, p in self.parameters.items() if laws.get(name) != p}

    @property
    def oriented(self) -> bool:
        """True if the energy or an event changes when the ends are exchanged."""
        changes = sp.expand(self.energy - self._exchanged(self.energy, "ij")) != 0
        return changes or any(map(self._tells_ends_apart, self.events))

    @property
    def laws(self) -> tuple[FrictionLaw, ...]:
        """The friction laws of the contacts."""
        return tuple(_law(event) for event in self.events if isinstance(event, Friction))

    @property
    def forced(self) -> bool:
        """True if time occurs."""
        return any(e.has(TIME) for e in (self.energy, *(e for event in self.events for e in event.expressions)))

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> Potential:
        """Return the coupling itself: equal energies have one spelling."""
        return self

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for nodes without velocities, unknown names and an energy that contains velocities."""
        for node in (single, other or single):
            if not has_velocities(node):
                raise ValueError(
                    f"coupling '{self}' needs coordinates with velocities; found a node of {node.state}; expected Rates, "
                    "which say what a link adds to each state"
                )
        pair = Pair((single, other or single), (None, None))
        # An energy that contains velocities is a kinetic energy or a dissipation, not a potential.
        used = _in_symbols_of(pair, self, self.energy).free_symbols
        velocities = {*pair.velocities, *pair.beyond[len(pair.beyond) // 2 :]}
        speeds = sorted(s.name for s in used & velocities)
        if speeds:
            raise ValueError(
                f"coupling '{self}': found the velocity {speeds[0]!r} in the energy; expected coordinates and parameters"
            )

    @property
    def triadic(self) -> bool:
        """True if the energy is that of a triangle: a symbol of a third end occurs."""
        return any(s.name.endswith("_k") for s in self._of_ends(self.energy))

    def _exchanged(self, e: sp.Expr, letters: str) -> sp.Expr:
        """Return an expression with two ends exchanged."""
        swap = dict(zip(letters, reversed(letters), strict=True))
        return e.xreplace(
            {s: sp.Symbol(s.name[:-1] + swap.get(s.name[-1], s.name[-1]), real=True) for s in self._of_ends(e)}
        )

    def terms(self, pair: Pair) -> Terms:
        """Return the energy of a link; of a triangle, the half, since a node feels its two sources in both orders."""

        def of_pair(e: sp.Expr) -> sp.Expr:
            return _in_symbols_of(pair, self, e)

        if self.triadic:
            return Terms(potential=of_pair(self.energy) / 2)
        directions = [event for event in self.events if self._tells_ends_apart(event)]
        events = tuple(event.map(lambda _, e: of_pair(e), str) for event in self.events)
        if pair.nodes[0] != pair.nodes[1]:
            return Terms(potential=of_pair(self.energy), events=events)
        # Between equal nodes compare the energy with the energy of exchanged ends: is the link oriented?
        energy, oriented = directed(of_pair(self.energy), of_pair(self._exchanged(self.energy, "ij")))
        if directions:
            # the weight is the direction: 1 or -1 in the energy, and 1 in the events, which only one direction has
            energy = energy if oriented else WEIGHT**2 * energy.xreplace({WEIGHT: sp.S.One})
            events = tuple(event.map(lambda _, e: e.xreplace({WEIGHT: sp.S.One}), str) for event in events)
        return Terms(potential=energy, oriented=oriented or bool(directions), events=events)

    def _tells_ends_apart(self, event: Friction | Stop) -> bool:
        """Return True if an event changes when the ends are exchanged; the sign of a sliding velocity is arbitrary."""
        level, size = event.expressions
        other, other_size = (self._exchanged(e, "ij") for e in event.expressions)
        same = sp.expand(level - other) == 0 or (isinstance(event, Friction) and sp.expand(level + other) == 0)
        return not (same and sp.expand(size - other_size) == 0)

    def _of_ends(self, e: sp.Expr) -> set[sp.Symbol]:
        return e.free_symbols - _of_link(self.parameters)

    def as_dict(self) -> dict[str, object]:
        """Return the coupling as a table of a scene file, without its events."""
        return {"potential": self.write(self.energy), "parameters": _tables(self._own())}

    def write(self, e: sp.Expr) -> str:
        """Return the text of an expression of the link."""
        return _written(e)

    def __str__(self) -> str:
        parts = (self.energy, *(e for event in self.events for e in event.expressions))
        names = dict.fromkeys(sorted(s.name[:-2] for e in parts for s in self._of_ends(e)))
        return f"potential of {', '.join(names)}"


def _event(k: int, event: object) -> Friction | Stop:
    """Return a contact or stop of a link with exact expressions and its law."""
    what = f"potential of a link: event {k}"
    check_instance(what, event, (Friction, Stop), "a Friction or a Stop")
    assert isinstance(event, Friction | Stop)

    def change(part: str, e: object) -> sp.Expr:
        return _exact(f"{what}: {part}", _parsed(f"{what}: {part}", e))

    made = event.map(change, str)
    if not isinstance(made, Friction):
        return made
    if made.law is None:
        raise ValueError(f"{what}: found no friction law; expected law='coulomb', or a law that friction_law(…) makes")
    check_instance(f"{what}: law", made.law, (str, FrictionLaw), "a name, or a friction_law(…)")
    law = load_friction_law(made.law) if isinstance(made.law, str) else made.law
    if not law.jumps:
        raise ValueError(f"{what}: found the law {law}, which has no jump at w = 0; write its force as Rates")
    return replace(made, law=law)


def _law(event: Friction) -> FrictionLaw:
    assert isinstance(event.law, FrictionLaw)
    return event.law


def _of_link(names: Iterable[str]) -> set[sp.Symbol]:
    """Return the symbols of a link that belong to no end: time, weight and parameters of the link."""
    return {TIME, WEIGHT, *(sp.Symbol(name, real=True) for name in names)}


def _checked(
    what: str,
    values: Iterable[object],
    parameters: Mapping[sp.Symbol | str, object] | None,
    ends: tuple[str, ...] = ("_i", "_j"),
    of_laws: Iterable[str] = (),
) -> tuple[tuple[sp.Expr, ...], FrozenDict[Parameter]]:
    """Return the expressions and parameters of a coupling, with every symbol declared and every parameter used."""
    table = _parameters(what, parameters)
    of_link = _of_link((*table, *of_laws))
    expressions = tuple(_exact(what, e) for e in values)
    used = {s for e in expressions for s in e.free_symbols}
    for s in sorted(used - of_link, key=lambda s: s.name):
        if not s.name.endswith(ends) or len(s.name) < 3:
            names = (*table, *(s.name for s in used if s.name.endswith(ends)))
            meant = suggestion(s.name, names) or f", or write {s.name}_i for what the node has"
            raise ValueError(
                f"{what}: undeclared symbol {s.name!r}; expected symbols of both ends, the weight, t and the parameters "
                f"{', '.join(table) or '(none)'}; give it a default{meant}"
            )
    for name in table:  # in the order of the alphabet
        if sp.Symbol(name, real=True) not in used and name not in of_laws:
            raise ValueError(f"{what}: nothing uses the parameter {name!r}; use it or leave it out")
    if WEIGHT not in used and expressions[0] != 0:
        raise ValueError(f"{what}: nothing uses the weight of a link; expected it as a factor, e.g. W*sin(j.x - i.x)")
    unknown = next(
        (f for e in expressions for f in sorted(e.atoms(AppliedUndef, sp.Derivative, sp.Integral), key=str)), None
    )
    if unknown is not None:
        raise ValueError(f"{what}: found {unknown}; expected known functions of symbols; write it out")
    return expressions, table


def _parsed(what: str, value: object) -> object:
    """Parse a text into an expression; return any other value unchanged."""
    return read(what, check_text(what, value, LENGTH), _AnyName()) if isinstance(value, str) else value


def _exact(what: str, value: object) -> sp.Expr:
    """Return an expression with real symbols and rational numbers."""
    symbols = value.free_symbols if isinstance(value, sp.Expr) else ()
    taken = sorted(s.name for s in symbols if s.name in _TAKEN)
    if taken:
        raise ValueError(f"{what}: the symbol {taken[0]!r} has the name of a constant or a function; rename it")
    return exact(what, value, {s.name: sp.Symbol(s.name, real=True) for s in symbols})


def _target(key: object) -> str:
    """Return the name of the state of the target from a key of the rates, a symbol x_i or a text."""
    if isinstance(key, str):
        return check_text("rates of a link", key)
    if not isinstance(key, sp.Symbol):
        raise TypeError(f"rates of a link: found the key {typed_repr(key)}; expected a state of the target, e.g. i.x")
    if not key.name.endswith("_i") or len(key.name) < 3:
        raise ValueError(f"rates of a link: found the rate of {key.name!r}; expected a state of the target, e.g. i.x")
    return key.name[:-2]


def _parameters(what: str, defaults: Mapping[sp.Symbol | str, object] | None) -> FrozenDict[Parameter]:
    """Return the parameters in alphabetical order, so that equal contents make equal couplings."""
    parameters: dict[str, Parameter] = {}
    for key, value in check_table(f"{what}: parameters", {} if defaults is None else defaults).items():
        name = key.name if isinstance(key, sp.Symbol) else key
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            # For a keyword of Python the message suggests to append an underscore.
            reserved = isinstance(name, str) and keyword.iskeyword(name)
            why, close = (", a word of Python", f"{name}_") if reserved else ("", "K")
            raise ValueError(f"{what}: found the parameter {short_repr(key)}{why}; expected a name such as {close!r}")
        if name in (TIME.name, WEIGHT.name, _WEIGHT):
            meaning = "the time" if name == TIME.name else "the weight of a link"
            raise ValueError(f"{what}: the parameter {name!r} has the name of {meaning}; rename it")
        if name in parameters:
            raise ValueError(f"{what}: the parameter {name!r} is given twice; expected it once")
        parameters[name] = value if isinstance(value, Parameter) else _parameter(f"{what}: parameter {name}", value)
    return FrozenDict(sorted(parameters.items(), key=lambda item: item[0]))


def _parameter(what: str, value: object) -> Parameter:
    """Return a parameter from its default, or from a table with default, unit, meaning and range."""
    if not isinstance(value, Mapping):
        return _plain(check_number(what, value))
    names = [f.name for f in fields(Parameter) if f.name != "scale"]
    return Parameter.of_table(what, value, names, meaning=_plain(0.0).meaning)


def _in_symbols_of(pair: Pair, coupling: Rates | Potential, e: sp.Expr) -> sp.Expr:
    """Convert an expression from symbols of `ends` to symbols of an `Edge`; ValueError for names the nodes lack."""
    symbols = pair.symbols()
    for s in sorted(e.free_symbols - _of_link(coupling.parameters), key=lambda s: s.name):
        if s not in symbols:
            end, node = ("target", pair.nodes[0]) if s.name.endswith("_i") else ("source", pair.nodes[1])
            names = [each.name for each in (*node.state, *(() if s.name.endswith("_k") else node.parameters))]
            raise ValueError(
                f"coupling '{coupling}': unknown {s.name[:-2]!r} at the {end} of a link; known: {', '.join(names)}"
                f"{suggestion(s.name[:-2], names)}"
            )
    return e.xreplace({s: symbol for s, symbol in symbols.items() if s != symbol})


# -- tables of scene files ---------------------------------------------------------------------------------------


def _written(e: sp.Expr) -> str:
    """Return the text of an expression."""
    return written(e.xreplace({WEIGHT: sp.Symbol(_WEIGHT, real=True)}))


def _tables(parameters: Mapping[str, Parameter]) -> dict[str, object]:
    """Return each parameter as its default, or as a table if it has a unit, a meaning or a range."""
    tables: dict[str, object] = {}
    for name, parameter in parameters.items():
        values = {f.name: getattr(parameter, f.name) for f in fields(Parameter) if f.name != "scale"}
        table = {key: value for key, value in values.items() if value is not None and value is not False}
        tables[name] = parameter.default if parameter == _plain(parameter.default) else table
    return tables


def _plain(default: float) -> Parameter:
    return Parameter(default, "1", "parameter of a link")


def from_table(what: str, table: Mapping[object, object], events: Sequence[EventDefinition] = ()) -> Rates | Potential:
    """Return the coupling of a table of a scene file, {rates = {x = "…"}, parameters = {…}} or {potential = "…", …}.

    `events` are those of the table.
    """
    kinds = sorted(str(key) for key in table if key in ("rates", "potential"))
    known = (*kinds, "parameters", *(["events"] if kinds == ["potential"] else []))
    if len(kinds) != 1 or any(key not in known for key in table):
        found = ", ".join(map(short_repr, table)) or "nothing"
        raise ValueError(
            f"{what}: found {found}; expected either 'rates' or 'potential', with 'parameters', and 'events' of a potential"
        )
    parameters = check_table(f"{what}: parameters", table.get("parameters", {}))
    named = {str(name): value for name, value in parameters.items()}
    if kinds == ["potential"]:
        return Potential(table["potential"], named, events)
    return Rates(check_table(f"{what}: rates", table["rates"]), named)


class _AnyName(Mapping[str, sp.Symbol]):
    """Map every name except constants and functions to a symbol; used before the nodes of a link are known."""

    def __contains__(self, name: object) -> bool:
        return name not in _TAKEN

    def __getitem__(self, name: str) -> sp.Symbol:
        return WEIGHT if name == _WEIGHT else sp.Symbol(name, real=True)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0

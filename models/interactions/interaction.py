"""Any link as a value: rates of the states of its target, or a potential of the coordinates of both ends.

Expressions are made of the symbols of `ends`: x_i is the state or parameter x of the target, x_j that of the source.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields

import sympy as sp
from sympy.core.function import AppliedUndef

from ..inputs.checks import (
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
from ..mechanics.expression import FRICTION_NAME, LENGTH, exact, read, written
from ..mechanics.parameter import Parameter
from .ends import WEIGHT, Pair, Terms

_WEIGHT = "W"
"""What the weight of a link is called in a text."""

_TAKEN = frozenset({"pi", FRICTION_NAME, *FUNCTIONS})
"""Names that mean something else in a text."""


@dataclass(frozen=True, slots=True, init=False)
class Rates:
    """A link that adds to the rates of states of its target; nothing acts back on the source.

    The rate that a link of weight W from j to i adds may be any function of the states and parameters of both ends, of
    W, of the link's own parameters and of time.  It need not vanish between equal states.

    Parameters
    ----------
    rates : mapping of Symbol or str to Expr or str
        What a link adds to the rate of each state of its target, such as {i.theta: K*W*sin(j.theta - i.theta)}, in the
        symbols of `ends`, or as text, {"theta": "K*W*sin(theta_j - theta_i)"}.  Decimals are exact: 0.1 is 1/10.
    parameters : mapping of Symbol or str to number or Parameter
        Parameters of the link with their defaults.

    Raises
    ------
    ValueError, TypeError
        For a rate of anything but a state of the target, a symbol that is not declared, a parameter or a weight that
        nothing uses, and whatever is no expression.

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain.models import Rates, ends
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
        given = [_told(f"rates of a link: rate of {name}", e) for name, e in zip(targets, table.values(), strict=True)]
        found = _Content.of("rates of a link", given, parameters)
        for name, rate in zip(targets, found.expressions, strict=True):
            if rate == 0:
                raise ValueError(f"rates of a link: the rate of {name!r} is 0; expected a function; leave it out")
        ordered = sorted(zip(targets, found.expressions, strict=True))
        object.__setattr__(self, "rates", FrozenDict(ordered))
        object.__setattr__(self, "parameters", found.parameters)

    def __reduce__(self) -> tuple[type[Rates], tuple[object, ...]]:
        return Rates, (self._keyed(), dict(self.parameters))

    def _keyed(self) -> dict[sp.Symbol, sp.Expr]:
        return {sp.Symbol(f"{name}_i", real=True): rate for name, rate in self.rates.items()}

    @property
    def forced(self) -> bool:
        """True if time occurs."""
        return any(e.has(TIME) for e in self.rates.values())

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> Rates:
        """The coupling itself, whose spelling is one."""
        return self

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for a state or parameter that the nodes at the ends of a link do not have."""
        self.terms(Pair((single, other or single), (None, None)))

    def terms(self, pair: Pair) -> Terms:
        """Return what a link adds to the rates of its target."""
        known = pair.names[0]
        for name in self.rates:
            if name not in known:
                raise ValueError(
                    f"coupling '{self}': unknown state {name!r} of {pair.nodes[0].state}; known: {', '.join(known)}"
                    f"{suggestion(name, known)}"
                )
        added = {name: _placed(self, e, pair) for name, e in self.rates.items()}
        return Terms(rates=tuple(added.get(name, sp.S.Zero) for name in known))

    def as_dict(self) -> dict[str, object]:
        """Return the coupling as a table of a scene file."""
        written = {name: _written(e) for name, e in self.rates.items()}
        return {"rates": written, "parameters": _numbers(self.parameters)}

    def __str__(self) -> str:
        return f"rates of {', '.join(self.rates)}"


@dataclass(frozen=True, slots=True, init=False)
class Potential:
    """A link with a potential of any coordinates and parameters of its two ends: forces on both.

    A link of weight W between i and j stores the energy V(i, j).  If V changes in the exchange of its ends, a link has a
    direction, as `synchain.models.interactions.link` says, and weights other than 1 are refused.

    Parameters
    ----------
    energy : Expr or str
        The energy of a link, in the symbols of `ends`: -G*W*i.m*j.m/sqrt((i.x - j.x)**2 + (i.y - j.y)**2), or as text,
        "k*W*(x_i - x_j)**2/2".
    parameters : mapping of Symbol or str to number or Parameter
        Parameters of the link with their defaults.

    Raises
    ------
    ValueError, TypeError
        For a symbol that is not declared, a parameter or a weight that nothing uses, an energy of one end alone, and
        whatever is no expression.
    """

    energy: sp.Expr
    parameters: FrozenDict[Parameter]

    def __init__(self, energy: object, parameters: Mapping[sp.Symbol | str, object] | None = None) -> None:
        found = _Content.of("potential of a link", [_told("potential of a link", energy)], parameters)
        letters = {s.name[-2:] for s in found.expressions[0].free_symbols - found.own}
        if not {"_i", "_j"} <= letters:
            raise ValueError(
                f"potential of a link: found {short_repr(found.expressions[0])}, of one end; expected a function of both"
            )
        object.__setattr__(self, "energy", found.expressions[0])
        object.__setattr__(self, "parameters", found.parameters)

    def __reduce__(self) -> tuple[type[Potential], tuple[object, ...]]:
        return Potential, (self.energy, dict(self.parameters))

    @property
    def forced(self) -> bool:
        """True if time occurs."""
        return self.energy.has(TIME)

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> Potential:
        """The coupling itself, whose spelling is one."""
        return self

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for nodes without velocities, unknown names and an energy of velocities."""
        for node in (single, other or single):
            half = len(node.state) // 2
            if not node.events and node.rhs[:half] != node.state[half:]:
                raise ValueError(
                    f"coupling '{self}' needs coordinates with velocities; found a node of {node.state}; expected Rates, "
                    "which say what a link adds to each state"
                )
        pair = Pair((single, other or single), (None, None))
        speeds = sorted(s.name for s in _placed(self, self.energy, pair).free_symbols & set(pair.velocities))
        if speeds:
            raise ValueError(
                f"coupling '{self}': found the velocity {speeds[0]!r} in the energy; expected coordinates and parameters"
            )

    def terms(self, pair: Pair) -> Terms:
        """Return the energy of a link."""
        if pair.nodes[0] != pair.nodes[1]:
            return Terms(potential=_placed(self, self.energy, pair))
        turned = {s: sp.Symbol(s.name[:-1] + ("j" if s.name.endswith("_i") else "i"), real=True) for s in self._ends()}
        back = self.energy.xreplace(turned)
        here, there = (_placed(self, e, pair) for e in (self.energy, back))
        if sp.expand(here - there) == 0:
            return Terms(potential=here)
        here, there = (e.xreplace({WEIGHT: sp.S.One}) for e in (here, there))
        directed = sp.expand(WEIGHT**2 * (here + there) / 2 + WEIGHT * (here - there) / 2)
        return Terms(potential=directed, oriented=True)

    def _ends(self) -> set[sp.Symbol]:
        own = {TIME, WEIGHT, *(sp.Symbol(name, real=True) for name in self.parameters)}
        return self.energy.free_symbols - own

    def as_dict(self) -> dict[str, object]:
        """Return the coupling as a table of a scene file."""
        return {"potential": _written(self.energy), "parameters": _numbers(self.parameters)}

    def __str__(self) -> str:
        names = dict.fromkeys(sorted(s.name[:-2] for s in self._ends()))
        return f"potential of {', '.join(names)}"


@dataclass(frozen=True, slots=True)
class _Content:
    """The checked expressions and parameters of a coupling, and the symbols that belong to no end."""

    expressions: tuple[sp.Expr, ...]
    parameters: FrozenDict[Parameter]
    own: frozenset[sp.Symbol]

    @classmethod
    def of(cls, what: str, given: Iterable[object], parameters: Mapping[sp.Symbol | str, object] | None) -> _Content:
        table = _parameters(what, parameters)
        symbols = {sp.Symbol(name, real=True) for name in table}
        own = frozenset({TIME, WEIGHT, *symbols})
        found = tuple(_exact(what, e) for e in given)
        used = {s for e in found for s in e.free_symbols}
        for s in sorted(used - own, key=lambda s: s.name):
            if not s.name.endswith(("_i", "_j")) or len(s.name) < 3:
                names = (*table, *(s.name for s in used if s.name.endswith(("_i", "_j"))))
                meant = suggestion(s.name, names) or f", or write {s.name}_i for what the node has"
                raise ValueError(
                    f"{what}: undeclared symbol {s.name!r}; expected symbols of both ends, the weight, t and the parameters "
                    f"{', '.join(table) or '(none)'}; give it a default{meant}"
                )
        for s in sorted(symbols - used, key=lambda s: s.name):
            raise ValueError(f"{what}: nothing uses the parameter {s.name!r}; use it or leave it out")
        if WEIGHT not in used:
            raise ValueError(
                f"{what}: nothing uses the weight of a link; expected it as a factor, e.g. W*sin(j.x - i.x)"
            )
        strange = next(
            (f for e in found for f in sorted(e.atoms(AppliedUndef, sp.Derivative, sp.Integral), key=str)), None
        )
        if strange is not None:
            raise ValueError(f"{what}: found {strange}; expected known functions of symbols; write it out")
        return cls(found, table, own)


def _told(what: str, value: object) -> object:
    """The expression that a text tells; any other value as it is."""
    return read(what, check_text(what, value, LENGTH), _AnyName()) if isinstance(value, str) else value


def _exact(what: str, value: object) -> sp.Expr:
    """The expression with real symbols and rational numbers."""
    symbols = value.free_symbols if isinstance(value, sp.Expr) else ()
    taken = sorted(s.name for s in symbols if s.name in _TAKEN)
    if taken:
        raise ValueError(f"{what}: the symbol {taken[0]!r} has the name of a constant or a function; rename it")
    return exact(what, value, {s.name: sp.Symbol(s.name, real=True) for s in symbols})


def _target(key: object) -> str:
    """The state of the target that a key of the rates means."""
    if isinstance(key, str):
        return check_text("rates of a link", key)
    if not isinstance(key, sp.Symbol):
        raise TypeError(f"rates of a link: found the key {typed_repr(key)}; expected a state of the target, e.g. i.x")
    if not key.name.endswith("_i") or len(key.name) < 3:
        raise ValueError(f"rates of a link: found the rate of {key.name!r}; expected a state of the target, e.g. i.x")
    return key.name[:-2]


def _parameters(what: str, given: Mapping[sp.Symbol | str, object] | None) -> FrozenDict[Parameter]:
    """The parameters by name, in the order of the alphabet: equal contents make equal couplings."""
    found: dict[str, Parameter] = {}
    for key, value in check_table(f"{what}: parameters", {} if given is None else given).items():
        name = key.name if isinstance(key, sp.Symbol) else key
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            word = isinstance(name, str) and keyword.iskeyword(name)
            why, close = (", a word of Python", f"{name}_") if word else ("", "K")
            raise ValueError(f"{what}: found the parameter {short_repr(key)}{why}; expected a name such as {close!r}")
        if name in (TIME.name, WEIGHT.name, _WEIGHT):
            meaning = "the time" if name == TIME.name else "the weight of a link"
            raise ValueError(f"{what}: the parameter {name!r} has the name of {meaning}; rename it")
        if name in found:
            raise ValueError(f"{what}: the parameter {name!r} is given twice; expected it once")
        found[name] = value if isinstance(value, Parameter) else _parameter(f"{what}: parameter {name}", value)
    return FrozenDict(sorted(found.items(), key=lambda item: item[0]))


def _parameter(what: str, value: object) -> Parameter:
    """The parameter of a default, or of a table with its default, unit, meaning and range."""
    if not isinstance(value, Mapping):
        return _plain(check_number(what, value))
    names = [f.name for f in fields(Parameter) if f.name != "scale"]
    return Parameter.of_table(what, value, names, meaning=_plain(0.0).meaning)


def _placed(coupling: Rates | Potential, e: sp.Expr, pair: Pair) -> sp.Expr:
    """An expression in the symbols of an edge; ValueError for a name that a node does not have."""
    known = pair.known()
    own = {sp.Symbol(name, real=True) for name in coupling.parameters}
    for s in sorted(e.free_symbols - own, key=lambda s: s.name):
        if s not in known:
            end, node = ("target", pair.nodes[0]) if s.name.endswith("_i") else ("source", pair.nodes[1])
            names = [own.name for own in (*node.state, *node.parameters)]
            raise ValueError(
                f"coupling '{coupling}': unknown {s.name[:-2]!r} at the {end} of a link; known: {', '.join(names)}"
                f"{suggestion(s.name[:-2], names)}"
            )
    return e.xreplace({s: own for s, own in known.items() if s != own})


# -- tables of scene files ---------------------------------------------------------------------------------------


def _written(e: sp.Expr) -> str:
    """An expression as the text that `read` reads."""
    return written(e.xreplace({WEIGHT: sp.Symbol(_WEIGHT, real=True)}))


def _numbers(parameters: Mapping[str, Parameter]) -> dict[str, object]:
    """Parameters as a table has them: a number, or a table of its own for one that has a unit, a meaning or a range."""
    return {name: own.default if own == _plain(own.default) else _table(own) for name, own in parameters.items()}


def _plain(default: float) -> Parameter:
    return Parameter(default, "1", "parameter of a link")


def _table(parameter: Parameter) -> dict[str, object]:
    """A parameter without what is as it is by default."""
    written = {f.name: getattr(parameter, f.name) for f in fields(Parameter) if f.name != "scale"}
    return {name: value for name, value in written.items() if value is not None and value is not False}


def from_table(what: str, given: Mapping[object, object]) -> Rates | Potential:
    """Return the coupling of a table of a scene file, {rates = {x = "…"}, parameters = {…}} or {potential = "…", …}."""
    kinds = sorted(str(key) for key in given if key in ("rates", "potential"))
    strange = next((key for key in given if key not in ("rates", "potential", "parameters")), None)
    if strange is not None or len(kinds) != 1:
        found = ", ".join(map(short_repr, given)) or "nothing"
        raise ValueError(f"{what}: found {found}; expected either 'rates' or 'potential', with 'parameters'")
    parameters = check_table(f"{what}: parameters", given.get("parameters", {}))
    named = {str(name): value for name, value in parameters.items()}
    if kinds == ["potential"]:
        return Potential(given["potential"], named)
    return Rates(check_table(f"{what}: rates", given["rates"]), named)


class _AnyName(Mapping[str, sp.Symbol]):
    """A symbol for every name but those of a constant and of friction: the nodes of a link are not known yet."""

    def __contains__(self, name: object) -> bool:
        return name not in _TAKEN

    def __getitem__(self, name: str) -> sp.Symbol:
        return WEIGHT if name == _WEIGHT else sp.Symbol(name, real=True)

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0

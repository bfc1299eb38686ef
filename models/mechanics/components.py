"""The equations of one oscillator and of one link: the templates from which a network is built."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import sympy as sp

from .calculus import derivative
from .contact import SLIP
from .events import Event
from .rows import Law, Row, Surface

TIME = sp.Symbol("t", real=True)
"""Non-dimensional time, the one time symbol of all equations."""

Block: TypeAlias = tuple[tuple[sp.Expr, ...], ...]
"""The entries of a matrix that belong to one node or to one end of a link, row by row."""

WEIGHT_NUMBER = sp.Symbol("W", real=True)
"""The weight of a link as a parameter: a number set for each run, in place of the exact weight from the graph."""


@dataclass(frozen=True, slots=True)
class Node:
    """One uncoupled oscillator: M d(state)/dt = rhs(state, t; parameters)."""

    state: tuple[sp.Symbol, ...]  # continuous states, then the modes of events and rows, which change only at events
    rhs: tuple[sp.Expr, ...]  # the right-hand side of each state: its rate where M is the identity
    parameters: tuple[sp.Symbol, ...]
    events: tuple[Event, ...] = ()  # friction of one coordinate on a ground of constant velocity: at most one
    rows: tuple[Row, ...] = ()  # all other surfaces at which rates jump or states are reset
    # Of networks with rows in links: rows that are solved with those of links (`Equations.parts`); their modes, then the
    # modes of the rows of links of which this node is the source. `rhs` holds the rates with all x = 0.
    surfaces: tuple[Surface, ...] = ()
    joined: tuple[sp.Symbol, ...] = ()
    law: sp.Expr | None = field(default=None, compare=False)  # friction coefficient in terms of `SLIDING`, for printing
    inertia: Block = ()  # m(state; parameters), a row and a column for each state; empty if M is the identity

    def __post_init__(self) -> None:
        _check_names("node", (TIME, *self.state, *self.parameters))
        declared = {TIME, *self.state, *self.parameters}
        size = len(self.state)
        _check("node", self.rhs, size, declared)
        for event in self.events:
            if self.state[2:3] != (event.mode,):
                raise ValueError(f"a node with set-valued friction has the states x, v, slip, …; found {self.state}")
            _check("contact", event.expressions, len(event.expressions), declared)
        for held in self.rows:
            _check("row", held.expressions, len(held.expressions), declared)
        for surface in self.surfaces:
            _check("row", surface.expressions, len(surface.expressions), declared)
        if self.inertia and self.sticks:
            raise ValueError("node: found events beside a mass matrix; expected at most three coupled coordinates")
        if self.inertia and len(self.inertia) != size:
            raise ValueError(
                f"node: found a mass matrix of {len(self.inertia)} rows; expected one for each of {size} states"
            )
        for row in self.inertia:
            if any(e.has(TIME) for e in row):
                raise ValueError(
                    f"node: the masses {row} depend on time; expected a mass matrix of states and parameters"
                )
            _check("node inertia", row, size, declared - {TIME})

    @property
    def driven(self) -> tuple[sp.Expr, ...]:
        """The right-hand side, and the rows that it does not contain."""
        return (*self.rhs, *(e for surface in self.surfaces for e in surface.expressions))

    @property
    def forced(self) -> bool:
        """True if time occurs explicitly."""
        return any(e.has(TIME) for e in (*self.driven, *self.expressions))

    @property
    def continuous(self) -> tuple[sp.Symbol, ...]:
        """The states that change continuously: all states except modes."""
        return self.state[: len(self.state) - len(self.modes)]

    @property
    def modes(self) -> tuple[sp.Symbol, ...]:
        """The states that change only at events, behind the continuous ones."""
        of_rows = (row.mode for row in self.rows if row.law is not Law.RESET)
        return (*(e.mode for e in self.events), *of_rows, *self.joined)

    @property
    def held(self) -> tuple[tuple[sp.Symbol, sp.Symbol], ...]:
        """Pairs of a state and a mode: the state is zero while the mode is, such as a speed in stick on a ground at rest."""
        pairs = []
        for row in self.rows:
            zeros = {Law.SIGN: (row.level,), Law.STOP: (row.level, row.speed), Law.RESET: ()}[row.law]
            pairs += [(s, row.mode) for e in zeros for s in self.continuous if e != 0 and (e / s).is_number]
        return tuple(pairs)

    @property
    def conditions(self) -> tuple[Event | Row, ...]:
        """Events and rows."""
        return (*self.events, *self.rows)

    @property
    def sticks(self) -> bool:
        """True if the node has events or rows, or links with rows."""
        return bool(self.conditions or self.surfaces or self.joined)

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """The right-hand side, the conditions of events and the entries of M."""
        conditions = (e for condition in (*self.conditions, *self.surfaces) for e in condition.expressions)
        return (*self.rhs, *conditions, *_entries((self.inertia,)))

    @property
    def constant_inertia(self) -> bool:
        """True if M depends on parameters alone."""
        return not any(e.free_symbols & set(self.state) for e in _entries((self.inertia,)))

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Node:
        """Return the node with every symbol and expression changed."""
        state, rhs, parameters = (tuple(map(change, part)) for part in (self.state, self.rhs, self.parameters))
        events, rows = tuple(e.map(change) for e in self.events), tuple(row.map(change) for row in self.rows)
        surfaces, joined = tuple(s.map(change) for s in self.surfaces), tuple(map(change, self.joined))
        # Drop parameters that `change` replaced by numbers.
        parameters = tuple(p for p in parameters if p.is_Symbol)
        return Node(state, rhs, parameters, events, rows, surfaces, joined, inertia=_mapped(self.inertia, change))

    def without_unused_parameters(self, needed: Container[sp.Symbol] = ()) -> Node:
        """Return the node without parameters that occur neither in its expressions nor in `needed` (by links)."""
        used = set(_occurring(self.parameters, self.expressions))
        return replace(self, parameters=tuple(p for p in self.parameters if p in used or p in needed))

    def jacobian(self) -> Block:
        """Return d(rhs)/d(state), one-sided at kinks (see `synchain.models.mechanics.calculus`)."""
        return _jacobian(self.rhs, self.state)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """Return the partial derivative of rhs with respect to time."""
        return tuple(derivative(e, TIME) for e in self.rhs)


@dataclass(frozen=True, slots=True)
class Edge:
    """The term that one link adds to the right-hand side of its target: rhs(here, there, t; weight, parameters)."""

    here: tuple[sp.Symbol, ...]  # states of the target and of the source, both in the order of Node.state
    there: tuple[sp.Symbol, ...]
    weight: sp.Symbol  # of an oriented edge: the sign of the link's direction
    rhs: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]  # of the link and of the target
    # Two blocks that the link adds to the rows of its target in M: columns of target, of source. Empty without inertia.
    inertia: tuple[Block, ...] = ()
    theirs: tuple[tuple[sp.Symbol, sp.Symbol], ...] = ()  # pairs: symbol in `rhs`, parameter of the source
    oriented: bool = False
    beyond: tuple[sp.Symbol, ...] = ()  # states of the second source of a link of three ends; empty for two ends
    # Rows of the link; pushes have an entry for each continuous state of the target, then of the source.
    surfaces: tuple[Surface, ...] = ()

    def __post_init__(self) -> None:
        sources, states = tuple(s for s, _ in self.theirs), [s for end in self.end_states for s in end]
        _check_names("edge", (TIME, self.weight, *states, *self.parameters, *sources))
        declared = {self.weight, *states, *self.parameters}
        _check("edge", self.rhs, len(self.here), {TIME, *declared, *sources})
        for block in self.inertia:
            for row in block:
                _check("edge inertia", row, len(row), declared)
        for surface in self.surfaces:
            _check("edge", surface.expressions, len(surface.expressions), {TIME, SLIP, *declared, *sources})

    @property
    def end_states(self) -> tuple[tuple[sp.Symbol, ...], ...]:
        """The states at the target, at the source, and at the second source of a link of three ends."""
        return (self.here, self.there, self.beyond) if self.beyond else (self.here, self.there)

    def jacobian_here(self) -> Block:
        """Return d(rhs)/d(here)."""
        return _jacobian(self.rhs, self.here)

    def jacobian_there(self) -> Block:
        """Return d(rhs)/d(there)."""
        return _jacobian(self.rhs, self.there)

    def jacobian_beyond(self) -> Block:
        """Return d(rhs)/d(beyond), of a link of three ends."""
        return _jacobian(self.rhs, self.beyond)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """Return the partial derivative of rhs with respect to time."""
        return tuple(derivative(e, TIME) for e in self.rhs)

    @property
    def driven(self) -> tuple[sp.Expr, ...]:
        """The right-hand side and the rows."""
        return (*self.rhs, *(e for surface in self.surfaces for e in surface.expressions))

    @property
    def forced(self) -> bool:
        """True if time occurs explicitly."""
        return any(e.has(TIME) for e in self.driven)

    @property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """The right-hand side, the entries of the inertia and the rows."""
        return (*self.driven, *_entries(self.inertia))

    @property
    def acts(self) -> bool:
        """True if a force or an inertia of the link is not zero."""
        return any(e != 0 for e in self.expressions)

    @property
    def constant_inertia(self) -> bool:
        """True if the inertia depends on parameters alone."""
        states = {*self.here, *self.there}
        return not any(e.free_symbols & states for e in _entries(self.inertia))

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Edge:
        """Return the edge with every symbol and expression changed."""
        here, there, beyond, rhs, parameters = (
            tuple(map(change, part)) for part in (self.here, self.there, self.beyond, self.rhs, self.parameters)
        )
        inertia = tuple(_mapped(block, change) for block in self.inertia)
        return replace(
            self,
            here=here,
            there=there,
            beyond=beyond,
            weight=change(self.weight),
            rhs=rhs,
            parameters=tuple(p for p in parameters if p.is_Symbol),
            inertia=inertia if any(e != 0 for e in _entries(inertia)) else (),
            theirs=tuple((change(a), change(b)) for a, b in self.theirs),
            surfaces=tuple(surface.map(change) for surface in self.surfaces),
        )

    def without_unused_parameters(self) -> Edge:
        """Return the edge without parameters that do not occur."""
        used = _occurring(tuple(s for s, _ in self.theirs), self.expressions)
        theirs = tuple(pair for pair in self.theirs if pair[0] in used)
        return replace(self, parameters=_occurring(self.parameters, self.expressions), theirs=theirs)

    def with_shared(self, varied: Iterable[str]) -> Edge:
        """Return the edge with one symbol for equal parameters of both ends; `varied` parameters differ and stay."""
        shared = {s: parameter for s, parameter in self.theirs if parameter.name not in varied}
        if not shared:
            return self
        more = tuple(parameter for parameter in shared.values() if parameter not in self.parameters)
        theirs = tuple(pair for pair in self.theirs if pair[0] not in shared)
        rhs = tuple(e.xreplace(shared) for e in self.rhs)
        surfaces = tuple(surface.map(lambda e: e.xreplace(shared)) for surface in self.surfaces)
        return replace(self, rhs=rhs, parameters=(*self.parameters, *more), theirs=theirs, surfaces=surfaces)

    def with_weight_number(self) -> Edge:
        """Return the edge with the parameter `WEIGHT_NUMBER` in place of the weight."""
        swap = {self.weight: WEIGHT_NUMBER}
        inertia = tuple(_mapped(block, lambda e: e.xreplace(swap)) for block in self.inertia)
        rhs = tuple(e.xreplace(swap) for e in self.rhs)
        surfaces = tuple(surface.map(lambda e: e.xreplace(swap)) for surface in self.surfaces)
        return replace(self, rhs=rhs, parameters=(*self.parameters, WEIGHT_NUMBER), inertia=inertia, surfaces=surfaces)

    @property
    def diffusive(self) -> bool:
        """True if the link vanishes between equal states, so that synchronous motion solves the network."""
        equal = {s: p for end in self.end_states[1:] for s, p in zip(end, self.here, strict=True)} | dict(self.theirs)
        return all(_vanishes(e.xreplace(equal)) for e in self.rhs)


def _entries(blocks: Iterable[Block]) -> Iterator[sp.Expr]:
    return (e for block in blocks for row in block for e in row)


def _mapped(block: Block, change: Callable[[sp.Expr], sp.Expr]) -> Block:
    return tuple(tuple(map(change, row)) for row in block)


def _jacobian(rhs: tuple[sp.Expr, ...], symbols: tuple[sp.Symbol, ...]) -> Block:
    return tuple(tuple(derivative(e, s) for s in symbols) for e in rhs)


def _vanishes(e: sp.Expr) -> bool:
    """Return True if an expression is 0."""
    # Evaluate at one point first: a value other than 0 saves the simplification, which may take minutes.
    point = {s: sp.Rational(13 + 7 * k, 17) for k, s in enumerate(sorted(e.free_symbols, key=str))}
    value = e.xreplace(point).evalf(30)
    if value.is_number and value.is_finite and abs(value) > 1e-12:
        return False
    return bool(sp.simplify(e) == 0)


def _occurring(parameters: tuple[sp.Symbol, ...], expressions: tuple[sp.Expr, ...]) -> tuple[sp.Symbol, ...]:
    used = {s for e in expressions for s in e.free_symbols}
    return tuple(p for p in parameters if p in used)


def _check_names(what: str, symbols: tuple[sp.Symbol, ...]) -> None:
    """Raise ValueError if two symbols have one name."""
    names = [s.name for s in symbols]
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        meaning = "is the time" if twice == TIME.name else "stands for two things"
        raise ValueError(f"{what}: the name {twice!r} {meaning}; rename that state or parameter")


def _check(what: str, rhs: tuple[sp.Expr, ...], size: int, declared: set[sp.Symbol]) -> None:
    """Raise ValueError for a wrong number of expressions, undeclared symbols and decimals, which are not exact."""
    if len(rhs) != size:
        raise ValueError(f"{what}: {len(rhs)} equations for {size} states; expected one each")
    for expression in rhs:
        undeclared = sorted(s.name for s in expression.free_symbols - declared)
        if undeclared:
            raise ValueError(
                f"{what}: undeclared symbol {undeclared[0]!r} in {expression}; declare it as a state or parameter"
            )
        floats = sorted(expression.atoms(sp.Float), key=str)
        if floats:
            raise ValueError(
                f"{what}: floating-point number {floats[0]} in {expression}; use a parameter or a Rational"
            )

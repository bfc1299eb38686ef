"""The function that computes the observed values of a scene at a point inside a step, and the rule of its quadrature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import sympy as sp
from numpy.polynomial.legendre import Legendre, legvander
from scipy.special import comb

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.observable import (
    AtNode,
    NodeMaximum,
    NodeMean,
    NodeMinimum,
    NodeSum,
    Rate,
    Reduction,
    Rows,
    RowSum,
    node_symbols,
)
from synchain.models.mechanics.components import TIME

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, Number, call, plus
from ..program.lowering import lower
from ..program.passes import real
from ..program.statements import Function, Loop, Role, Statement, let, store
from .between import calmed, depths_in, gaps_in, settled
from .rounding import magnitude

LARGEST = 1.7976931348623157e308
BEGINS = {NodeSum: 0.0, NodeMean: 0.0, NodeMaximum: -LARGEST, NodeMinimum: LARGEST}
"""What the loop of a reduction begins with."""


def rule_of(method: Integrator) -> tuple[tuple[float, ...], ...]:
    """Return the rule of Gauss and Lobatto on a panel from 0 to 1: a row for each point.

    These are the point, its weight, its weights in the upper half of the Legendre coefficients of the interpolant, the last
    one first, and a row of the matrix that turns values at all points into the Bernstein coefficients of the interpolant
    (Farouki, *Computer Aided Geometric Design* 29, 379 (2012)).  A rule of m points is exact for polynomials of degree 2 m - 3 (Abramowitz &
    Stegun, *Handbook of Mathematical Functions*, 1964, 25.4.32).  Steps of high order are long, and the rule has more
    points for them.
    """
    return _lobatto(11 if method.series else max(5, method.order - 1))


@cache
def _lobatto(count: int) -> tuple[tuple[float, ...], ...]:
    """The rule of some number of points."""
    degrees = np.arange(count)
    last = Legendre.basis(count - 1)
    inner = np.sort(last.deriv().roots().real)
    ends = np.concatenate([[-1.0], (inner - inner[::-1]) / 2.0, [1.0]])
    weights = 1.0 / (count * (count - 1) * last(ends) ** 2)
    legendre = weights[:, None] * legvander(ends, count - 1) * np.append(2 * degrees[:-1] + 1, count - 1)
    points = (ends + 1.0) / 2.0
    bernstein = comb(count - 1, degrees) * points[:, None] ** degrees * (1.0 - points[:, None]) ** degrees[::-1]
    rule = np.column_stack([points, weights, legendre[:, : count // 2 : -1], np.linalg.inv(bernstein)])
    return tuple(map(tuple, rule.tolist()))


def with_rows(equations: Equations, value: sp.Expr) -> bool:
    """True if an expression has one value for each node, False if it has one for the network."""
    own = {*equations.components, *equations.varied}
    return any(s.name in own for s in node_symbols(value))


def count_of(equations: Equations, values: Sequence[sp.Expr]) -> int:
    """Return how many numbers some expressions are."""
    return sum(equations.n if with_rows(equations, value) else 1 for value in values)


@dataclass(frozen=True, slots=True)
class Recording:
    """Functions of the state that a kernel watches beside its records."""

    # values that the kernel tallies over the window (`synchain.models.dynamics.observable`)
    observed: tuple[sp.Expr, ...] = ()
    # functions of which points are taken when they pass zero, each followed by the values that its points keep
    sections: tuple[tuple[sp.Expr, ...], ...] = ()
    stop: sp.Expr | None = None  # a function that ends a cell when it passes zero
    sums: tuple[Rows, ...] = ()  # the rows that are summed in them (`RowSum`)

    @property
    def kept(self) -> int:
        """The largest number of values that the points of a section keep."""
        return max((len(parts) - 1 for parts in self.sections), default=0)

    @property
    def events(self) -> tuple[sp.Expr, ...]:
        """The section functions, what each keeps, filled up with zeros, what ends a cell, and the sizes of the terms.

        The sizes are those of the terms of each function and of what ends a cell, 0 if it has a single one.
        """
        rows = [[*parts[1:], *[sp.S.Zero] * (self.kept + 1 - len(parts))] for parts in self.sections]
        first, last = [parts[0] for parts in self.sections], [] if self.stop is None else [self.stop]
        sizes = [(e, magnitude(e)) for e in (*first, *last)]
        terms = [sp.S.Zero if size == sp.Abs(e) else size for e, size in sizes]
        return (*first, *(e for row in rows for e in row), *last, *terms)

    @property
    def gaps(self) -> tuple[sp.Expr, ...]:
        """What passes zero where an observed value jumps or has a kink, 0 where it is rounding of its terms."""
        return tuple(map(settled, gaps_in(self.observed)))

    @property
    def depths(self) -> tuple[sp.Expr, ...]:
        """How many e-folds parts of the observed values lie below or above the size one."""
        return depths_in(self.observed)

    @property
    def has_rates(self) -> bool:
        """True if a rate of a state occurs."""
        return any(e.has(Rate) for e in (*self.observed, *self.events))

    def __bool__(self) -> bool:
        return bool(self.observed or self.events)

    def words(self, equations: Equations) -> tuple[str, ...]:
        """Return what is watched, in words."""
        found = [(count_of(equations, self.observed), "observed values"), (len(self.sections), "sections")]
        stop = () if self.stop is None else ("a stop",)
        return (*(f"{number} {what}" for number, what in found if number), *stop)

    def functions(self, equations: Equations, plain: Equations) -> list[Function]:
        """Return the functions that compute what is watched inside a step, in the names of `plain`."""
        what = "The section functions at the fraction theta of the step, what their points keep, and what ends a cell."
        seen = "The observed values at the fraction theta of the step, and what tells where they change quickly."
        parts = (
            ("values", (*map(calmed, self.observed), *self.gaps, *self.depths), seen),
            ("section", self.events, what),
        )
        return [_function(self, equations, plain, values, name, about) for name, values, about in parts if values]

    def tables(self, equations: Equations) -> dict[str, str]:
        """Return the text of the tables that the sums read, by their names: slots of a bank, or numbers."""
        if not self.sums:
            return {}
        slots = {name: k for k, name in enumerate((*equations.state, *equations.parameters))}
        found = {}
        for k, rows in enumerate(self.sums):
            for number, (_, entries) in enumerate(rows.at):
                values = [slots[entry] if isinstance(entry, str) else entry for entry in entries]
                found[table_name(k, number)] = f"np.array({values!r})"
        return found


def table_name(rows: int, number: int) -> str:
    """What the table of one symbol of some rows is called."""
    return f"ROWS_{rows}_{number}"


UNWATCHED = Recording()
"""Nothing beside the records."""


def _function(
    watched: Recording, equations: Equations, plain: Equations, observed: Sequence[sp.Expr], name: str, about: str
) -> Function:
    """A function that writes values at the fraction theta of a step."""
    writer = _LoopWriter(equations, plain, watched.sums)
    return Function(
        name,
        ("theta", "t", "h", "y", "y_new", "dense", "out", "dims"),
        about,
        tuple(writer.statements(observed)),
        role=Role.ENTRY,
    )


class _LoopWriter:
    """Writes the loops over nodes, those of inner reductions first."""

    def __init__(self, equations: Equations, plain: Equations, sums: Sequence[Rows] = ()) -> None:
        self.n, self.sums, self.state = plain.n, sums, frozenset(equations.state)
        self.own = self._places(equations.components, plain.components, equations.state, plain)
        self.own |= self._parameters(equations.varied, plain.varied, equations)
        self.own = {name: place for name, place in self.own.items() if name not in self.state}  # the network's own name
        self.whole = _numbered(equations.state, plain.state, 0)
        self.numbers = _numbered(equations.parameters, plain.parameters, plain.dimension)
        self.components, self.varied = equations.components, equations.varied
        self.reduced: dict[sp.Expr, sp.Symbol] = {}

    def _places(
        self, names: Sequence[str], shown: Sequence[str], state: Sequence[str], plain: Equations
    ) -> dict[str, tuple[str, Expression]]:
        """Name and place of each component of node i, of those that all nodes have."""
        whole = [(a, b) for a, b in zip(names, shown, strict=True) if len(plain.holders(b)) == plain.n]
        return {a: (b, _row(state.index(f"{a}_1"))) for a, b in whole}

    def _parameters(
        self, names: Sequence[str], shown: Sequence[str], equations: Equations
    ) -> dict[str, tuple[str, Expression]]:
        """Name and place of each parameter of node i that has a value for each node."""
        first = {name: equations.parameters.index(f"{name}_{equations.holders(name)[0] + 1}") for name in names}
        return {a: (b, _row(equations.dimension + first[a])) for a, b in zip(names, shown, strict=True)}

    def statements(self, observed: Sequence[sp.Expr]) -> list[Statement]:
        """All statements of the function."""
        values = [self._placed(e) for e in observed]
        body: list[Statement] = []
        if any(e.has(TIME) for e in (*values, *(rows.value for rows in self.sums))):
            body.append(let("now", Name("t") + Name("theta") * "h"))
        summed = [self.sums[int(r.args[0])].value for e in values for r in e.atoms(RowSum)]
        body += self._loads([*values, *summed], {**self.whole, **self.numbers})
        while left := self._innermost(values):
            body += self._reductions(left)
            values = [e.xreplace(self.reduced) for e in values]
        slot = 0
        for value in values:
            if any(s.name in self.own for s in node_symbols(value)):
                inside, (computed,) = self._node_values([value])
                inside.append(store("out", plus(Number(slot), Name("i")), computed))
                body.append(Loop("i", Number(0), Number(self.n), tuple(inside)))
                slot += self.n
            else:
                body.append(store("out", slot, lower(self._shown(value)) + 0.0 * Name("theta")))
                slot += 1
        return body

    def _placed(self, e: sp.Expr) -> sp.Expr:
        """The expression with the names of the network where it takes the value of one node."""
        names = (*self.components, *self.varied)

        def at_node(value: sp.Expr, number: sp.Integer) -> sp.Expr:
            return value.xreplace({real(name): real(f"{name}_{number}") for name in names})

        return e.replace(AtNode, at_node)

    def _innermost(self, values: Sequence[sp.Expr]) -> list[sp.Expr]:
        """The reductions that hold no other, in a fixed order."""
        found = {r for e in values for r in e.atoms(Reduction) if not any(a.has(Reduction) for a in r.args)}
        return sorted(found, key=sp.default_sort_key)

    def _reductions(self, found: Sequence[sp.Expr]) -> list[Statement]:
        """The loops that compute reductions."""
        begins: list[Statement] = [line for r in found if isinstance(r, RowSum) for line in self._row_sum(r)]
        found = [r for r in found if not isinstance(r, RowSum)]
        if not found:
            return begins
        inside, computed = self._node_values([r.args[0] for r in found])
        for r, value in zip(found, computed, strict=True):
            symbol = real(f"_total{len(self.reduced)}")
            begins.append(let(symbol.name, BEGINS[type(r)] + 0.0 * Name("theta")))
            linear = type(r) in (NodeSum, NodeMean)
            function = {NodeMaximum: "maximum", NodeMinimum: "minimum"}.get(type(r), "")
            inside.append(let(symbol.name, Name(symbol.name) + value if linear else call(function, symbol.name, value)))
            self.reduced[r] = symbol / self.n if type(r) is NodeMean else symbol
        return [*begins, Loop("i", Number(0), Number(self.n), tuple(inside))]

    def _row_sum(self, r: sp.Expr) -> list[Statement]:
        """The loop that adds up a value of some nodes or links."""
        k = int(r.args[0])
        rows, total = self.sums[k], real(f"_total{len(self.reduced)}")
        inside: list[Statement] = []
        swap = {}
        for number, (s, entries) in enumerate(rows.at):
            entry: Expression = Load(table_name(k, number), Name("e"), None)
            if isinstance(entries[0], str):
                entry = _inside(entry) if entries[0] in self.state else Load("y", entry)
            swap[s] = real(f"_row{number}")
            inside.append(let(swap[s].name, entry))
        value = lower(self._shown(rows.value.xreplace(swap)))
        inside.append(let(total.name, Name(total.name) + value))
        self.reduced[r] = total
        return [let(total.name, 0.0 * Name("theta")), Loop("e", Number(0), Number(rows.count), tuple(inside))]

    def _node_values(self, values: Sequence[sp.Expr]) -> tuple[list[Statement], list[Expression]]:
        """The statements that a loop over nodes needs for some values, and the values."""
        loads = self._loads(values, self.own)
        shown = [self._shown(e) for e in values]
        parts, results = sp.cse(shown, symbols=(real(f"_part{k}") for k in range(10**6)))
        return [*loads, *(let(s.name, lower(e)) for s, e in parts)], [lower(e) for e in results]

    def _loads(self, values: Sequence[sp.Expr], places: Mapping[str, tuple[str, Expression]]) -> list[Statement]:
        """The statements that load what has a place and is used: states, their rates, and parameters."""
        rates = {r.args[0].name for e in values for r in e.atoms(Rate)}
        plain = {s.name for e in values for s in e.xreplace({r: sp.Dummy() for r in e.atoms(Rate)}).free_symbols}
        body: list[Statement] = []
        for name, (shown, place) in places.items():
            if name in rates:
                body.append(
                    let(f"_rate_{shown}", call("slope", "theta", place, "y", "y_new", "dense", "dims") / Name("h"))
                )
            if name not in plain:
                continue
            parameter = name in self.numbers or name in self.varied
            body.append(let(shown, Load("y", place) if parameter else _inside(place)))
        return body

    def _shown(self, e: sp.Expr) -> sp.Expr:
        """The expression in the names of the function."""
        names = {name: shown for name, (shown, _) in (*self.whole.items(), *self.numbers.items(), *self.own.items())}
        names[TIME.name] = "now"
        rates = {r: real(f"_rate_{names[r.args[0].name]}") for r in e.atoms(Rate)}
        e = e.xreplace(self.reduced).xreplace(rates)
        return e.xreplace({real(name): real(shown) for name, shown in names.items() if name != shown})


def _inside(place: Expression) -> Expression:
    return call("inside", "theta", place, "y", "y_new", "dense", "dims")


def _numbered(names: Sequence[str], shown: Sequence[str], first: int) -> dict[str, tuple[str, Expression]]:
    """Name and place of variables that stand one behind another."""
    return {a: (b, Number(slot)) for slot, (a, b) in enumerate(zip(names, shown, strict=True), start=first)}


def _row(first: int) -> Expression:
    """The place of a variable of node i, that of the first node being known."""
    return plus(Number(first), Name("i")) if first else Name("i")

"""Write the functions that compute observed values and sections inside a step, and the quadrature rule for them."""

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
    ObservableRows,
    Rate,
    Reduction,
    RowSum,
    node_symbols,
)
from synchain.models.dynamics.record import Record
from synchain.models.mechanics.components import TIME

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, Number, call, plus
from ..program.lowering import lower
from ..program.passes import real
from ..program.statements import Function, Loop, Role, Statement, let, store
from .between import calmed, depths_in, gaps_in, settled
from .kernel_text import NamedEquations
from .rounding import magnitude

LARGEST = 1.7976931348623157e308  # largest finite double-precision number
# Initial value of the loop of each reduction.
BEGINS = {NodeSum: 0.0, NodeMean: 0.0, NodeMaximum: -LARGEST, NodeMinimum: LARGEST}


def rule_of(method: Integrator) -> tuple[tuple[float, ...], ...]:
    """Return the Gauss-Lobatto rule on [0, 1] for a method, one row for each point."""
    # Steps of high order are long and need more points.
    return _lobatto(11 if method.series else max(5, method.order - 1))


@cache
def _lobatto(count: int) -> tuple[tuple[float, ...], ...]:
    """Compute a rule: point, weight, weights in Legendre coefficients (last first), row of the Bernstein matrix."""
    # The points are -1, 1 and the roots of P'_{m-1}; the rule is exact for polynomials of degree 2 m - 3:
    # Abramowitz & Stegun, *Handbook of Mathematical Functions*, 1964, 25.4.32. Symmetrised against rounding.
    degrees = np.arange(count)
    last = Legendre.basis(count - 1)
    inner = np.sort(last.deriv().roots().real)
    ends = np.concatenate([[-1.0], (inner - inner[::-1]) / 2.0, [1.0]])
    weights = 1.0 / (count * (count - 1) * last(ends) ** 2)
    # Upper half of the Legendre coefficients of the interpolant, linear in the values at the points.
    legendre = weights[:, None] * legvander(ends, count - 1) * np.append(2 * degrees[:-1] + 1, count - 1)
    # The inverse maps values at the points to Bernstein coefficients of the interpolant: Farouki,
    # *Computer Aided Geometric Design* 29, 379 (2012).
    points = (ends + 1.0) / 2.0
    bernstein = comb(count - 1, degrees) * points[:, None] ** degrees * (1.0 - points[:, None]) ** degrees[::-1]
    rule = np.column_stack([points, weights, legendre[:, : count // 2 : -1], np.linalg.inv(bernstein)])
    return tuple(map(tuple, rule.tolist()))


def with_rows(equations: Equations, value: sp.Expr) -> bool:
    """True if an expression has one value for each node, False if it has one for the network."""
    node_names = {*equations.components, *equations.varied}
    return any(s.name in node_names for s in node_symbols(value))


def count_of(equations: Equations, values: Sequence[sp.Expr]) -> int:
    """Count the numbers that expressions yield: one for each node, or one for the network."""
    return sum(equations.n if with_rows(equations, value) else 1 for value in values)


@dataclass(frozen=True, slots=True)
class Recording:
    """The records of a kernel, and the functions of the state that it evaluates inside steps for them."""

    records: tuple[str, ...] = ("sync_error",)  # words of `Record`
    section: sp.Expr | None = None  # section function of the record "section", whose points are whole states
    # values that are tallied over the window (`synchain.models.dynamics.observable`)
    observed: tuple[sp.Expr, ...] = ()
    # section functions, each followed by the values that are stored where it passes zero
    sections: tuple[tuple[sp.Expr, ...], ...] = ()
    stop: sp.Expr | None = None  # a function that ends a cell when it passes zero
    sums: tuple[ObservableRows, ...] = ()  # the rows that the `RowSum`s of these functions add up
    multiplicity: tuple[int, ...] | None = None  # oscillators that each node represents in the synchronisation error
    own_times: bool = False  # whether the samples of the trajectory are at given times, not equally spaced

    def check(self, equations: Equations) -> None:
        """Raise ValueError for records that are unknown, lack an argument or exclude each other."""
        unknown = [r for r in self.records if r not in list(Record)]
        if unknown:
            raise ValueError(f"unknown record {unknown[0]!r}; known: {', '.join(Record)}")
        if "section" in self.records:
            if self.sections or self.stop is not None:
                raise ValueError("the record 'section' beside functions of the state: found both; expected one of them")
            if self.section is None:
                raise ValueError("the record 'section' needs a section function, for example v_1")
            known = {*equations.state, *equations.parameters, TIME.name}
            unknown = sorted({s.name for s in self.section.free_symbols} - known)
            if unknown:
                raise ValueError(
                    f"section function {self.section}: unknown symbol {unknown[0]!r}; use the state, parameters and t"
                )
        if "sync_error" in self.records:
            if not equations.common:
                raise ValueError(
                    "the record 'sync_error' compares states of one name, and these nodes have none in common"
                )
            if self.multiplicity is not None and len(self.multiplicity) != equations.n:
                raise ValueError(
                    f"multiplicity has {len(self.multiplicity)} entries; expected one for each of {equations.n} nodes"
                )

    @property
    def event_sections(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """The section of the record "section", or else `sections`."""
        if self.section is None or "section" not in self.records:
            return self.sections
        return ((self.section.xreplace({s: real(s.name) for s in self.section.free_symbols}),),)

    @property
    def kept(self) -> int:
        """Largest number of values stored at the points of a section; -1 if the points are whole states."""
        if "section" in self.records:
            return -1
        return max((len(parts) - 1 for parts in self.sections), default=0)

    @property
    def events(self) -> tuple[sp.Expr, ...]:
        """Section functions, stored values of each, stop function, and term sizes of section and stop functions."""
        # rows of stored values are filled up with zeros to one length; the size of a single term is 0
        sections = self.event_sections
        rows = [[*parts[1:], *[sp.S.Zero] * (self.kept + 1 - len(parts))] for parts in sections]
        first, last = [parts[0] for parts in sections], [] if self.stop is None else [self.stop]
        sizes = [(e, magnitude(e)) for e in (*first, *last)]
        terms = [sp.S.Zero if size == sp.Abs(e) else size for e, size in sizes]
        return (*first, *(e for row in rows for e in row), *last, *terms)

    @property
    def gaps(self) -> tuple[sp.Expr, ...]:
        """Expressions that pass zero where an observed value jumps or has a kink."""
        return tuple(map(settled, gaps_in(self.observed)))

    @property
    def depths(self) -> tuple[sp.Expr, ...]:
        """Distances, in e-folds, of exponential parts of the observed values from the size one."""
        return depths_in(self.observed)

    @property
    def has_functions(self) -> bool:
        """True if the kernel evaluates functions of the state inside steps."""
        return bool(self.observed or self.event_sections) or self.stop is not None

    @property
    def has_rates(self) -> bool:
        """True if a rate of a state occurs."""
        return any(e.has(Rate) for e in (*self.observed, *self.events))

    def summary(self, equations: Equations) -> tuple[str, ...]:
        """Return the records in their order, and one text for observed values, sections and the stop each."""
        counts = [(count_of(equations, self.observed), "observed values"), (len(self.sections), "sections")]
        ordered = (record for record in Record if record in self.records)
        stop = () if self.stop is None else ("a stop",)
        return (*ordered, *(f"{number} {kind}" for number, kind in counts if number), *stop)

    def functions(self, named: NamedEquations) -> list[Function]:
        """Write the functions `values` and `section`, if they have results."""
        arguments = ("theta", "t", "h", "y", "y_new", "dense", "out", "dims")
        texts = {
            "values": "The observed values at the fraction theta of the step, and what tells where they change quickly.",
            "section": (
                "The section functions at the fraction theta of the step, what their points keep, and what ends a cell."
            ),
        }
        results = {"values": (*map(calmed, self.observed), *self.gaps, *self.depths), "section": self.events}
        return [
            Function(
                name, arguments, texts[name], tuple(_LoopWriter(named, self.sums).statements(values)), role=Role.ENTRY
            )
            for name, values in results.items()
            if values
        ]

    def tables(self, equations: Equations) -> dict[str, str]:
        """Return the text of the tables that the sums read, by name: indices into a bank, or numbers."""
        slots = {name: k for k, name in enumerate((*equations.state, *equations.parameters))}
        tables = {}
        for k, rows in enumerate(self.sums):
            for number, (_, entries) in enumerate(rows.at):
                values = [slots[entry] if isinstance(entry, str) else entry for entry in entries]
                tables[table_name(k, number)] = f"np.array({values!r})"
        return tables


def table_name(rows: int, number: int) -> str:
    """Return the name of the table of symbol `number` of the sum `rows`."""
    return f"ROWS_{rows}_{number}"


SYNC_ERROR = Recording()  # the synchronisation error, and no functions inside steps


class _LoopWriter:
    """Writes the loops over nodes, those of inner reductions first."""

    def __init__(self, named: NamedEquations, sums: Sequence[ObservableRows]) -> None:
        equations, plain = named.original, named.plain
        self.n, self.sums, self.state = plain.n, sums, frozenset(equations.state)
        # tables: name -> (name in the function, index in a bank). `at_node` has the components that all nodes have and
        # the parameters with a value for each node, indexed by the loop variable i; names of the network go first.
        self.at_node: dict[str, tuple[str, Expression]] = {}
        for name, shown in zip(equations.components, plain.components, strict=True):
            if len(plain.holders(shown)) == plain.n:
                self.at_node[name] = shown, _row(equations.state.index(f"{name}_1"))
        for name, shown in zip(equations.varied, plain.varied, strict=True):
            first = equations.parameters.index(f"{name}_{equations.holders(name)[0] + 1}")
            self.at_node[name] = shown, _row(equations.dimension + first)
        self.at_node = {name: entry for name, entry in self.at_node.items() if name not in self.state}
        self.states = _numbered(equations.state, plain.state, 0)
        self.parameters = _numbered(equations.parameters, plain.parameters, plain.dimension)
        self.components, self.varied = equations.components, equations.varied
        self.reduced: dict[sp.Expr, sp.Symbol] = {}  # reductions whose loops are written, and their results

    def statements(self, observed: Sequence[sp.Expr]) -> list[Statement]:
        # `AtNode` becomes a name of the network
        names = (*self.components, *self.varied)
        values = [
            e.replace(AtNode, lambda value, k: value.xreplace({real(a): real(f"{a}_{k}") for a in names}))
            for e in observed
        ]
        body: list[Statement] = []
        if any(e.has(TIME) for e in (*values, *(rows.value for rows in self.sums))):
            body.append(let("now", Name("t") + Name("theta") * "h"))
        summed = [self.sums[int(r.args[0])].value for e in values for r in e.atoms(RowSum)]
        body += self._loads([*values, *summed], {**self.states, **self.parameters})
        # loops of inner reductions come first: those that hold no other, in a fixed order
        while reductions := {
            r for e in values for r in e.atoms(Reduction) if not any(a.has(Reduction) for a in r.args)
        }:
            body += self._reductions(sorted(reductions, key=sp.default_sort_key))
            values = [e.xreplace(self.reduced) for e in values]
        # a value of each node takes n entries of `out`, a value of the network takes one
        slot = 0
        for value in values:
            if any(s.name in self.at_node for s in node_symbols(value)):
                inside, (computed,) = self._node_values([value])
                inside.append(store("out", plus(Number(slot), Name("i")), computed))
                body.append(Loop("i", Number(0), Number(self.n), tuple(inside)))
                slot += self.n
            else:
                body.append(store("out", slot, lower(self._shown(value)) + 0.0 * Name("theta")))
                slot += 1
        return body

    def _reductions(self, reductions: Sequence[sp.Expr]) -> list[Statement]:
        """Write a loop for each sum over rows, and one loop over nodes for all other reductions."""
        begins: list[Statement] = [line for r in reductions if isinstance(r, RowSum) for line in self._row_sum(r)]
        over_nodes = [r for r in reductions if not isinstance(r, RowSum)]
        if not over_nodes:
            return begins
        inside, computed = self._node_values([r.args[0] for r in over_nodes])
        for r, value in zip(over_nodes, computed, strict=True):
            symbol = real(f"_total{len(self.reduced)}")
            begins.append(let(symbol.name, BEGINS[type(r)] + 0.0 * Name("theta")))
            linear = type(r) in (NodeSum, NodeMean)
            function = {NodeMaximum: "maximum", NodeMinimum: "minimum"}.get(type(r), "")
            inside.append(let(symbol.name, Name(symbol.name) + value if linear else call(function, symbol.name, value)))
            self.reduced[r] = symbol / self.n if type(r) is NodeMean else symbol
        return [*begins, Loop("i", Number(0), Number(self.n), tuple(inside))]

    def _row_sum(self, r: sp.Expr) -> list[Statement]:
        """Write the loop that adds up a value of selected nodes or links."""
        k = int(r.args[0])
        rows, total = self.sums[k], real(f"_total{len(self.reduced)}")
        inside: list[Statement] = []
        # a table holds numbers, or indices of states or of parameters
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
        """Write the body of a loop over nodes that computes values with common parts once; return the values too."""
        loads = self._loads(values, self.at_node)
        shown = [self._shown(e) for e in values]
        parts, results = sp.cse(shown, symbols=(real(f"_part{k}") for k in range(10**6)))
        return [*loads, *(let(s.name, lower(e)) for s, e in parts)], [lower(e) for e in results]

    def _loads(self, values: Sequence[sp.Expr], table: Mapping[str, tuple[str, Expression]]) -> list[Statement]:
        """Load the states, rates and parameters of a table that occur in the values."""
        rates = {r.args[0].name for e in values for r in e.atoms(Rate)}
        plain = {s.name for e in values for s in e.xreplace({r: sp.Dummy() for r in e.atoms(Rate)}).free_symbols}
        body: list[Statement] = []
        for name, (shown, index) in table.items():
            if name in rates:
                slope = call("slope", "theta", index, "y", "y_new", "dense", "dims")
                body.append(let(f"_rate_{shown}", slope / Name("h")))
            if name in plain:
                parameter = name in self.parameters or name in self.varied
                body.append(let(shown, Load("y", index) if parameter else _inside(index)))
        return body

    def _shown(self, e: sp.Expr) -> sp.Expr:
        """Replace symbols by the names in the function, and reductions by their results."""
        names = {name: shown for name, (shown, _) in {**self.states, **self.parameters, **self.at_node}.items()}
        names[TIME.name] = "now"
        rates = {r: real(f"_rate_{names[r.args[0].name]}") for r in e.atoms(Rate)}
        e = e.xreplace(self.reduced).xreplace(rates)
        return e.xreplace({real(name): real(shown) for name, shown in names.items() if name != shown})


def _inside(index: Expression) -> Expression:
    return call("inside", "theta", index, "y", "y_new", "dense", "dims")


def _numbered(names: Sequence[str], shown: Sequence[str], first: int) -> dict[str, tuple[str, Expression]]:
    """Map names to their names in the function and to consecutive indices."""
    return {a: (b, Number(slot)) for slot, (a, b) in enumerate(zip(names, shown, strict=True), start=first)}


def _row(first: int) -> Expression:
    """Return the index of a variable of node i from that of the first node."""
    return plus(Number(first), Name("i")) if first else Name("i")

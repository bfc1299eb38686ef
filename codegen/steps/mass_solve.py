"""The mass matrix of a network whose nodes or links have inertia: M d(state)/dt = f, solved by a sparse elimination.

A Rosenbrock step for y' = F = M^-1 f solves (shift M - J) k = M (F(u) + rate sum c_j k_j) + d h f_t with M at the start of
the step and J = df/dy - d(M F)/dy at fixed F: that is the exact Jacobian, multiplied by M.  Where M is constant, M F(u) is
f(u) and no system in M is solved at all; otherwise F(u) takes one elimination of M a stage, of the links' structure (Hairer
& Wanner, Solving Ordinary Differential Equations II (Springer, 1996), section IV.7: Rosenbrock methods and M y' = f).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge, Node

from ..program.expressions import Expression, Name, Product, call
from ..program.lowering import lower
from ..program.passes import Names, real
from ..program.statements import Assign, Function, Return, Statement, let
from .elimination import EliminationPlan, Entries, Entry, Factors, plan, write_elimination, write_solve
from .step import StepWriter, function_of, prefix


def added_masses(node: Node) -> Block:
    """Return M - 1 of one node, empty where M is the identity."""
    return tuple(tuple(e - sp.Integer(r == c) for c, e in enumerate(row)) for r, row in enumerate(node.inertia))


def turned_masses(node: Node, rates: Sequence[sp.Symbol]) -> Block:
    """Return d(M F)/dy of one node at fixed rates F, by its states; empty where M depends on none."""
    if node.constant_inertia:
        return ()
    carried = [sp.Add(*(e * f for e, f in zip(row, rates, strict=True))) for row in node.inertia]
    return tuple(tuple(derivative(e, s) for s in node.state) for e in carried)


def momentum_slopes(edge: Edge, here: Sequence[sp.Symbol], there: Sequence[sp.Symbol]) -> tuple[Block, Block]:
    """Return d(M F)/dy of one link at fixed rates F of its target, `here`, and of its source, by the states of either."""
    if not edge.inertia:
        zero = tuple((sp.S.Zero,) * len(edge.here) for _ in edge.here)
        return zero, tuple((sp.S.Zero,) * len(edge.there) for _ in edge.here)
    pairs = zip(edge.inertia, (here, there), strict=True)
    parts = [[sp.Add(*(e * f for e, f in zip(row, rates, strict=True))) for row in block] for block, rates in pairs]
    carried = [a + b for a, b in zip(*parts, strict=True)]
    own, other = (tuple(tuple(derivative(e, s) for s in end) for e in carried) for end in (edge.here, edge.there))
    return own, other


class Mass:
    """The entries of M and what a step writes about it; without entries M is the identity and nothing is written."""

    def __init__(self, writer: StepWriter) -> None:
        self.writer, self.equations = writer, writer.equations

    @cached_property
    def entries(self) -> dict[Entry, sp.Expr]:
        """The non-zero entries of M by row and column; empty if M is the identity."""
        return self.equations.mass()

    @property
    def coupled(self) -> set[Entry]:
        """The entries that are not those of the identity."""
        return {key for key, e in self.entries.items() if e != sp.Integer(key[0] == key[1])}

    @property
    def rows(self) -> list[int]:
        """The rows that are solved together: those with such entries, and those of the rates that these multiply."""
        return sorted({k for key in self.coupled for k in key})

    @property
    def constant(self) -> bool:
        """True if M depends on parameters alone."""
        return self.equations.constant_mass

    def refuse(self, what: str) -> None:
        """Raise ValueError where M is not the identity."""
        if self.equations.inertial:
            found = "links with inertia" if self.equations.inertial_links else "nodes with a mass matrix"
            raise ValueError(f"{what}: found {found}; expected none; use integrator 'rodas5p' or 'dop853'")

    @property
    def names(self) -> list[str]:
        """The states whose rates M couples."""
        return [self.writer.state[row] for row in self.rows]

    def elimination(self, matrix: Mapping[Entry, sp.Expr]) -> tuple[EliminationPlan, Factors]:
        """The elimination of the coupled rows of M, whose entries may have been given names."""
        place = {row: k for k, row in enumerate(self.rows)}
        inner = {(place[r], place[c]): e for (r, c), e in matrix.items() if r in place and c in place}
        steps = plan(len(place), set(inner))
        return steps, write_elimination(steps, inner, {}, tuple(f"mass_{name}" for name in self.names))

    def solution(self, steps: EliminationPlan, factors: Factors, out: str) -> list[Statement]:
        """Statements that solve for the right-hand sides r_x, …, which are overwritten."""
        numbered = list(enumerate(self.names))
        return write_solve(steps, factors, {k: f"r_{s}" for k, s in numbered}, {k: f"{out}{s}" for k, s in numbered})

    @cached_property
    def factors(self) -> tuple[EliminationPlan, Factors]:
        """The factors of a constant M, written where they are asked for first."""
        found = self.elimination(self.entries)
        self.writer.note("factors of M")
        self.writer.put(*found[1].statements)
        return found

    @cached_property
    def function(self) -> Function:
        """The function that solves M rates = r where M depends on the state; stages call it."""
        known = [*self.writer.state, *self.equations.parameters]
        waves = sorted({f for e in self.entries.values() for f in e.atoms(sp.Function)}, key=sp.default_sort_key)
        once = dict(zip(waves, Names(known).fresh("z"), strict=False))
        steps, factors = self.elimination({key: e.xreplace(once) for key, e in self.entries.items()})
        statements: list[Statement] = [let(s.name, lower(e)) for e, s in once.items()]
        statements += [*factors.statements, *self.solution(steps, factors, "g_")]
        found = Return(tuple(Name(f"g_{name}") for name in self.names))
        used = {s.name for e in self.entries.values() for s in e.free_symbols}
        arguments = [name for name in known if name in used]
        about = "Rates of the states that the mass matrix couples: M rates = r."
        made = function_of(
            "solve_masses", (*arguments, *(f"r_{name}" for name in self.names)), about, (*statements, found)
        )
        self.writer.functions.append(made)
        return made

    def solve(self, base: str, source: str, out: str) -> None:
        """Write out = M^-1 source for the rows that M couples, M at a vector of states."""
        w = self.writer
        if self.constant:
            steps, factors = self.factors
            w.put(*(let(f"r_{name}", f"{source}_{name}") for name in self.names))
            w.put(*self.solution(steps, factors, f"{out}_"))
            return
        at = {name: prefix(base) + name for name in w.state} | {f"r_{name}": f"{source}_{name}" for name in self.names}
        rates = call(self.function.name, *(at.get(name, name) for name in self.function.arguments))
        w.put(Assign(tuple(f"{out}_{name}" for name in self.names), rates))

    def explicit(self, base: str, out: str) -> None:
        """Turn the right-hand sides `out` of a stage into rates; a constant M is factorised in the first stage alone."""
        if self.entries:
            self.solve(base, out, out)

    def at_start(self, jacobian: Entries) -> Entries:
        """J = df/dy - d(M F)/dy at fixed F, from the entries of df/dy."""
        if not self.entries or self.constant:
            return jacobian
        self.solve("y", "f", "g")
        found, rows, names = dict(jacobian), set(self.rows), self.writer.state
        states = [real(name) for name in names]
        for (row, column), e in self.entries.items():
            rate = real(f"{'g' if column in rows else 'f'}_{names[column]}")
            for k, s in enumerate(states):
                if e.has(s):
                    found[row, k] = found.get((row, k), sp.S.Zero) - derivative(e, s) * rate
        return {key: e for key, e in found.items() if e != 0}

    def known(self, sums: Mapping[str, Expression], i: int) -> dict[str, Expression]:
        """By state, M (F + rate sum c k) for the rows that M couples, in stage i; `sums` are the sums of c k."""
        if not self.entries or i == 0:
            return {}
        w, rate = self.writer, Name("rate")
        names = {row: w.state[row] for row in self.rows}
        if not self.constant:
            self.solve("u", "f", "g")
        found = {}
        for name in names.values():
            change = sums[name] if self.constant else Name(f"g_{name}") + Product((rate, sums[name]))
            w.put(let(f"g_{name}", change))
        for row, name in names.items():
            terms = [e * sp.Symbol(f"g_{w.state[c]}") for (r, c), e in self.entries.items() if r == row]
            carried = lower(sp.Add(*terms))
            found[name] = Name(f"f_{name}") + Product((rate, carried)) if self.constant else carried
        return found

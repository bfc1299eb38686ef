"""The mass matrix of a network whose links have inertia: M d(state)/dt = f, solved by a sparse elimination, never inverted.

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
from synchain.models.mechanics.components import Edge

from ..program.expressions import Expression, Name, Product
from ..program.lowering import lower
from ..program.statements import let
from .elimination import Entries, Entry, Factors, plan, write_elimination, write_solve
from .step import Block, Step, prefix

__all__ = ["Mass", "momentum_slopes"]


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

    def __init__(self, writer: Step) -> None:
        self.writer, self.equations = writer, writer.equations
        self.factors: Factors | None = None

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
            raise ValueError(f"{what}: found links with inertia; expected none; use integrator 'rodas5p' or 'dop853'")

    def factorise(self, base: str) -> None:
        """Write the elimination of M at a vector of states."""
        w, rows = self.writer, self.rows
        at = {sp.Symbol(n, real=True): sp.Symbol(prefix(base) + n, real=True) for n in w.state}
        place = {row: k for k, row in enumerate(rows)}
        matrix = {
            (place[r], place[c]): e.xreplace(at) for (r, c), e in self.entries.items() if r in place and c in place
        }
        self.steps = plan(len(rows), set(matrix))
        self.factors = write_elimination(self.steps, matrix, {}, tuple(f"mass_{w.state[row]}" for row in rows))
        w.note("factors of M")
        w.put(*self.factors.statements)

    def solve(self, source: str, out: str) -> None:
        """Write out = M^-1 source for the rows that M couples, by the factors at hand."""
        if self.factors is None:
            raise RuntimeError("the mass matrix has not been factorised; this is a mistake in the program")
        w, names = self.writer, [self.writer.state[row] for row in self.rows]
        w.put(*(let(f"r_{name}", f"{source}_{name}") for name in names))
        rights = {k: f"r_{name}" for k, name in enumerate(names)}
        w.put(*write_solve(self.steps, self.factors, rights, {k: f"{out}_{name}" for k, name in enumerate(names)}))

    def explicit(self, base: str, out: str, first: bool) -> None:
        """Turn the right-hand sides `out` of a stage into rates; a constant M is factorised in the first stage alone."""
        if self.entries:
            if first or not self.constant:
                self.factorise(base)
            self.solve(out, out)

    def at_start(self, jacobian: Entries) -> Entries:
        """J = df/dy - d(M F)/dy at fixed F, from the entries of df/dy."""
        if not self.entries or self.constant:
            return jacobian
        self.factorise("y")
        self.solve("f", "g")
        found, rows, names = dict(jacobian), set(self.rows), self.writer.state
        states = [sp.Symbol(name, real=True) for name in names]
        for (row, column), e in self.entries.items():
            rate = sp.Symbol(f"{'g' if column in rows else 'f'}_{names[column]}", real=True)
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
            self.factorise("u")
            self.solve("f", "g")
        found = {}
        for name in names.values():
            change = sums[name] if self.constant else Name(f"g_{name}") + Product((rate, sums[name]))
            w.put(let(f"g_{name}", change))
        for row, name in names.items():
            terms = [e * sp.Symbol(f"g_{w.state[c]}") for (r, c), e in self.entries.items() if r == row]
            carried = lower(sp.Add(*terms))
            found[name] = Name(f"f_{name}") + Product((rate, carried)) if self.constant else carried
        return found

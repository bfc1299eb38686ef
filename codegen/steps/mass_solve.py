"""Solve M d(state)/dt = f by sparse elimination, for networks whose nodes or links have inertia (mass matrix M).

A Rosenbrock step for y' = F = M^-1 f solves

    (shift M - J) k_i = M (F(u_i) + rate sum c_ij k_j) + d_i h f_t,    J = df/dy - d(M F)/dy at fixed F,

with M at the start of the step. J is the exact Jacobian of F, multiplied by M (Hairer & Wanner, Solving Ordinary
Differential Equations II (Springer, 1996), section IV.7). If M is constant, M F(u) = f(u) and no system in M is solved.
Otherwise each stage computes F(u) by one sparse elimination of M. Explicit methods solve M F = f in each stage.
`Mass` writes the solves of steps in registers; `LoopMass` (looped_step) writes the solves of steps in loops.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge, Node

from ..program.expressions import Expression, Name, ProductExpr, call
from ..program.lowering import lower
from ..program.passes import Names, real
from ..program.statements import Assign, Function, Return, Statement, let
from .elimination import EliminationPlan, Entries, Entry, Factors, plan, write_elimination, write_solve
from .step import StepWriter, function_of, prefix


def added_masses(node: Node) -> Block:
    """Return the block M - 1 of one node; empty if M is the identity."""
    return tuple(tuple(e - sp.Integer(r == c) for c, e in enumerate(row)) for r, row in enumerate(node.inertia))


def turned_masses(node: Node, rates: Sequence[sp.Symbol]) -> Block:
    """Return d(M F)/dy of one node for fixed rates F, y the node's states; empty if M is constant."""
    if node.constant_inertia:
        return ()
    momenta = [sp.Add(*(e * f for e, f in zip(row, rates, strict=True))) for row in node.inertia]
    return tuple(tuple(derivative(e, s) for s in node.state) for e in momenta)


def momentum_slopes(edge: Edge, here: Sequence[sp.Symbol], there: Sequence[sp.Symbol]) -> tuple[Block, Block]:
    """Return d(M F)/dy of one link by the target's and by the source's states, for fixed rates F = `here`, `there`."""
    if not edge.inertia:
        zero = tuple((sp.S.Zero,) * len(edge.here) for _ in edge.here)
        return zero, tuple((sp.S.Zero,) * len(edge.there) for _ in edge.here)
    parts = [
        [sp.Add(*(e * f for e, f in zip(row, rates, strict=True))) for row in block]
        for block, rates in zip(edge.inertia, (here, there), strict=True)
    ]
    momenta = [a + b for a, b in zip(*parts, strict=True)]
    by_target, by_source = (
        tuple(tuple(derivative(e, s) for s in end) for e in momenta) for end in (edge.here, edge.there)
    )
    return by_target, by_source


class Mass:
    """Write the terms of a mass matrix M in a step that is written out; write nothing if M is the identity."""

    # entries: the non-zero entries of M by (row, column); empty if M is the identity. coupled: the entries that differ
    # from the identity. rows: the rows and columns of all coupled entries, which are solved together. names: the states
    # of `rows`. constant: True if M depends on parameters only.

    def __init__(self, writer: StepWriter) -> None:
        self.writer, self.equations, self.constant = writer, writer.equations, writer.equations.constant_mass
        self.entries: dict[Entry, sp.Expr] = writer.equations.mass()
        self.coupled = {key for key, e in self.entries.items() if e != sp.Integer(key[0] == key[1])}
        self.rows = sorted({k for key in self.coupled for k in key})
        self.names = [writer.state[row] for row in self.rows]

    def refuse(self, subject: str) -> None:
        if self.equations.inertial:
            parts = "links with inertia" if self.equations.inertial_links else "nodes with a mass matrix"
            raise ValueError(f"{subject}: found {parts}; expected none; use integrator 'rodas5p' or 'dop853'")

    # -- M rates = r ------------------------------------------------------------------------------------------

    def elimination(self, matrix: Mapping[Entry, sp.Expr]) -> tuple[EliminationPlan, Factors]:
        """Plan and write the elimination of the coupled rows of M; `matrix` holds the entries under any names."""
        index = {row: k for k, row in enumerate(self.rows)}
        inner = {(index[r], index[c]): e for (r, c), e in matrix.items() if r in index and c in index}
        steps = plan(len(index), set(inner))
        return steps, write_elimination(steps, inner, {}, tuple(f"mass_{name}" for name in self.names))

    def solution(self, steps: EliminationPlan, factors: Factors, out: str) -> list[Statement]:
        """Write the solve for the right-hand sides r_x, …, which are overwritten."""
        rights, results = ({k: f"{p}_{name}" for k, name in enumerate(self.names)} for p in ("r", out))
        return write_solve(steps, factors, rights, results)

    @cached_property
    def factors(self) -> tuple[EliminationPlan, Factors]:
        """Factors of a constant M; the first stage writes the factorisation."""
        steps, factors = self.elimination(self.entries)
        self.writer.note("factors of M")
        self.writer.put(*factors.statements)
        return steps, factors

    @cached_property
    def function(self) -> Function:
        """The function that stages call to solve M rates = r if M depends on the state."""
        arguments = [*self.writer.state, *self.equations.parameters]
        # compute functions such as cos(x_1 - x_2) once
        waves = sorted({f for e in self.entries.values() for f in e.atoms(sp.Function)}, key=sp.default_sort_key)
        once = dict(zip(waves, Names(arguments).fresh("z"), strict=False))
        steps, factors = self.elimination({key: e.xreplace(once) for key, e in self.entries.items()})
        body: list[Statement] = [let(s.name, lower(e)) for e, s in once.items()]
        body += [*factors.statements, *self.solution(steps, factors, "g")]
        body.append(Return(tuple(Name(f"g_{name}") for name in self.names)))
        used = {s.name for e in self.entries.values() for s in e.free_symbols}
        arguments = [*(name for name in arguments if name in used), *(f"r_{name}" for name in self.names)]
        about = "Rates of the states that the mass matrix couples: M rates = r."
        function = function_of("solve_masses", arguments, about, body)
        self.writer.functions.append(function)
        return function

    def solve(self, base: str, source: str, out: str) -> None:
        """Write out = M^-1 source for the rows that M couples; M is evaluated at the states in `base`."""
        w = self.writer
        if self.constant:
            steps, factors = self.factors
            w.put(*(let(f"r_{name}", f"{source}_{name}") for name in self.names))
            w.put(*self.solution(steps, factors, out))
            return
        at = {name: prefix(base) + name for name in w.state} | {f"r_{name}": f"{source}_{name}" for name in self.names}
        rates = call(self.function.name, *(at.get(name, name) for name in self.function.arguments))
        w.put(Assign(tuple(f"{out}_{name}" for name in self.names), rates))

    def explicit(self, base: str, out: str) -> None:
        """Replace the right-hand side `out` of a stage by the rates M^-1 out."""
        if self.entries:
            self.solve(base, out, out)

    # -- Rosenbrock methods: (shift M - J) k = M (F + rate sum c k) -------------------------------------------

    def at_start(self, jacobian: Entries) -> Entries:
        """Return J = df/dy - d(M F)/dy, F fixed, from the entries of df/dy; rates F that M couples are named g_x, …"""
        if not self.entries or self.constant:
            return jacobian
        self.solve("y", "f", "g")
        entries, names = dict(jacobian), self.writer.state
        states = [real(name) for name in names]
        for (row, column), e in self.entries.items():
            rate = real(f"{'g' if column in self.rows else 'f'}_{names[column]}")
            for k, s in enumerate(states):
                if e.has(s):
                    entries[row, k] = entries.get((row, k), sp.S.Zero) - derivative(e, s) * rate
        return {key: e for key, e in entries.items() if e != 0}

    def stage_terms(self, sums: Mapping[str, Expression], i: int) -> dict[str, Expression]:
        """Return M (F + rate sum c k) in stage i for the states that M couples; `sums` holds sum c k by state."""
        if not self.entries or i == 0:
            return {}
        w, rate = self.writer, Name("rate")
        if not self.constant:
            self.solve("u", "f", "g")
        # M multiplies this vector: sum c k if M is constant (then M F = f), else F + rate sum c k
        for name in self.names:
            w.let(f"g_{name}", sums[name] if self.constant else Name(f"g_{name}") + ProductExpr((rate, sums[name])))
        terms: dict[str, Expression] = {}
        for row, name in zip(self.rows, self.names, strict=True):
            products = [e * sp.Symbol(f"g_{w.state[c]}") for (r, c), e in self.entries.items() if r == row]
            product = lower(sp.Add(*products))
            terms[name] = Name(f"f_{name}") + ProductExpr((rate, product)) if self.constant else product
        return terms

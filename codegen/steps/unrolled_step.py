"""A step for a small network, written out node by node, its states in registers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.dynamics.angles import periods_of_states

from ..program.expressions import ZERO, Expression, Load, Name, Number, Product, call, linear, plus
from ..program.lowering import lower
from ..program.passes import real
from ..program.statements import If, Return, let, store
from .blocks import NodeBlocks
from .elimination import Entries, plan, times, write_factors, write_solve
from .mass_solve import Mass
from .step import NOW, StepWriter, entry, lane, linearised, prefix


class UnrolledStep(StepWriter):
    """Names its vectors by prefixes: x_1 at the start, u_x_1 in a stage, f_x_1 the slope, k2_x_1 of stage 2, n_x_1 new."""

    @cached_property
    def mass(self) -> Mass:
        """What is written about M."""
        return Mass(self)

    def of(self, i: int) -> NodeBlocks:
        """The blocks of node i."""
        return self.kinds[self.equations.kind_of[i]]

    def at(self, i: int, base: str) -> dict[sp.Symbol, sp.Symbol]:
        """The names of the states of node i in a vector, and of the parameters that it has for itself."""
        states = self.equations.node_at(i).state
        found = {s: real(f"{prefix(base)}{s.name}_{i + 1}") for s in states}
        return {**self.equations.at_node(i), **found}

    def stages(self, name: str, count: int) -> list[str]:
        """Names of the first `count` stage values of one state variable."""
        return [f"k{j + 1}_{name}" for j in range(count)]

    def opening(self) -> None:
        """Load the state and the parameters."""
        for slot, name in enumerate(self.state):
            self.let(name, Load("y", Number(slot)))
        self.parameters()

    # -- right-hand side --------------------------------------------------------------------------------------

    def slopes(self, base: str, out: str) -> None:
        """Compute the right-hand side at one vector of states into another."""
        for i in range(self.equations.n):
            body, names = self.of(i).rhs, self.at(i, base)
            targets = [f"{prefix(out)}{s.name}_{i + 1}" for s in self.equations.node_at(i).state]
            self.put(*self.node_call("node", self.equations.kind_of[i], body, targets, names))
            for target, e in zip(targets, body.results, strict=True):
                if self.is_plain(e):
                    self.let(target, lane(lower(e.xreplace(names))))
        self.links(base, out)

    def links(self, base: str, out: str, at: Mapping[sp.Symbol, sp.Symbol] = NOW) -> None:
        """Add what the links contribute to the right-hand side, `at` the time of a stage or at that of the start."""
        eq, terms = self.equations, dict[str, list[Expression]]()
        staged = {real(n): real(prefix(base) + n) for n in self.state} | dict(at)
        for link, edge in eq.linked():
            for s, e in zip(eq.node_at(link[0]).state, edge.rhs, strict=True):
                term = e.xreplace(eq.at_link(link, edge)).xreplace(staged)
                if term != 0:
                    terms.setdefault(f"{prefix(out)}{s.name}_{link[0] + 1}", []).append(lower(term))
        for target, parts in terms.items():
            self.let(target, plus(Name(target), *parts))

    # -- linearisation ----------------------------------------------------------------------------------------

    def linearise(self) -> None:
        """Right-hand side, Jacobian and time derivative at the start, and the factors of shift*M - J."""
        if self.method.inexact:
            self.mass.refuse(f"integrator {self.method.name}")
        own = self.linear_nodes()
        entries = self.mass.at_start(self.gather(own))
        self.steps = plan(len(self.state), set(entries) | self.mass.coupled)
        self.factors = write_factors(self.steps, entries, tuple(self.state), self.mass.entries)
        self.note(f"factors of {'shift*M - J' if self.mass.entries else 'shift - J'}")
        self.put(*self.factors.statements)
        self.time_slopes = {
            k: lower(own[i][f"ft_{s.name}"])
            for i, places in enumerate(self.equations.places)
            for k, s in zip(places, self.equations.node_at(i).state, strict=True)
        }
        for k, e in self.equations.link_time_derivative():
            self.time_slopes[k] = lower(e) if self.time_slopes[k] == ZERO else plus(self.time_slopes[k], lower(e))

    def linear_nodes(self) -> list[dict[str, sp.Expr]]:
        """Write right-hand side, Jacobian and time derivative at the start; return the value of each entry, by node."""
        eq = self.equations
        self.note("right-hand side, Jacobian and time derivative at the start")
        self.timed("t", self.wanted([blocks.linear for blocks in self.kinds]))
        kept = self.keep_times()
        own: list[dict[str, sp.Expr]] = []
        for i in range(eq.n):
            states, body, at = eq.node_at(i).state, self.of(i).linear, self.at(i, "y")
            words = linearised(states)[: len(body.results)]
            names = [f"{word}_{i + 1}" for word in words]
            self.put(*self.node_call("node_linear", eq.kind_of[i], body, names, at))
            found = {}
            for k, (word, name, e) in enumerate(zip(words, names, body.results, strict=True)):
                plain = self.is_plain(e)
                if plain and k < len(states):
                    self.let(name, lane(lower(e.xreplace(at))))
                found[word] = (e.xreplace(at) if plain else real(name)).xreplace(kept)
            own.append(found)
        self.links("y", "f", {})
        return own

    def keep_times(self) -> dict[sp.Symbol, sp.Symbol]:
        """Keep time terms that stand for themselves in the linearisation, where stages give these names other values."""
        results = [e for blocks in self.kinds for e in blocks.linear.results if self.is_plain(e)]
        moved = self.wanted([blocks.rhs for blocks in self.kinds]) & {s for e in results for s in e.free_symbols}
        kept = {s: real(f"at_{s.name}") for s in sorted(moved, key=lambda s: s.name)}
        self.put(*(let(there.name, here.name) for here, there in kept.items()))
        return kept

    def gather(self, own: list[dict[str, sp.Expr]]) -> Entries:
        """Entries of the whole Jacobian: those of the nodes by name, plus what the links add."""
        eq = self.equations
        entries: Entries = {}
        for i, places in enumerate(eq.places):
            state = eq.node_at(i).state
            for row, r in zip(places, state, strict=True):
                for column, c in zip(places, state, strict=True):
                    entries[row, column] = own[i][entry(r, c)]
        node = {k: i for i, places in enumerate(eq.places) for k in places}
        for key, e in eq.link_jacobian():
            if node[key[0]] == node[key[1]] or not self.method.inexact:
                entries[key] = entries.get(key, sp.S.Zero) + e
        return {key: e for key, e in entries.items() if e != 0}

    # -- stages -----------------------------------------------------------------------------------------------

    def advance(self, i: int) -> None:
        """Compute the state of stage i > 0; a row of `a` equal to `b` is the new state itself."""
        m = self.method
        for name in self.state:
            if m.implicit:
                self.let(f"u_{name}", stage_state(m.a[i], m.a[i - 1], name))
            elif i >= m.stages and m.a[i] == m.b:
                self.let(f"u_{name}", f"n_{name}")
            else:
                self.let(f"u_{name}", Name(name) + self.increment(m.a[i], self.stages(name, i)))

    def solve(self, i: int) -> None:
        """Turn the slopes of stage i into its rates."""
        m = self.method
        if not m.implicit:
            self.mass.explicit("u" if i else "y", f"k{i + 1}")
            return
        rights, results = {}, {}
        sums = {name: linear(m.big_c[i], self.stages(name, i)) for name in self.state} if i > 0 else {}
        known = self.mass.known(sums, i)
        for slot, name in enumerate(self.state):
            terms = [known.get(name, Name(f"f_{name}"))]
            if i > 0 and name not in known:
                terms.append(Product((Name("rate"), sums[name])))
            self.let(f"r_{name}", plus(*terms, *self.time_slope(i, self.time_slopes[slot])))
            rights[slot], results[slot] = f"r_{name}", f"k{i + 1}_{name}"
        self.put(*write_solve(self.steps, self.factors, rights, results))

    # -- end --------------------------------------------------------------------------------------------------

    def finish(self) -> None:
        """Compute the new state and the error; stages that serve the dense output alone run if DENSE."""
        m = self.method
        self.note("new state and error")
        errors = [self.new_state(name) for name in self.state]
        if m.dense_error:
            self.put(*(let(f"e_{name}", e) for name, e in zip(self.state, errors, strict=True)))
            errors = [Name(f"e_{name}") for name in self.state]
        with self.apart() as dense:
            for i in range(m.stages, len(m.c)):
                self.stage(i)
            for j, row in enumerate(m.dense):
                for slot, name in enumerate(self.state):
                    value = self.dense_value(row, self.stages(name, len(row)))
                    self.put(store("dense", j * len(self.state) + slot, value))
            if m.dense_error:
                self.stiff_errors()
        self.put(If(Name("DENSE"), tuple(dense)))
        periods = periods_of_states(self.equations)
        for slot, (name, e) in enumerate(zip(self.state, errors, strict=True)):
            self.put(store("y_new", slot, f"n_{name}"))
            self.put(*self.embedded(self.stages(name, m.stages)))
            self.let(f"e_{name}", self.scaled_error(e, name, f"n_{name}", periods[slot]))
        first, *others = terms = [Name(f"e_{name}") for name in self.state]
        self.let("total", plus(*terms))
        self.let("error", first)
        self.put(*(let("error", call("maximum", "error", term)) for term in others))
        self.put(Return((Name("error") + 0.0 * Name("total"),), "NaN or infinite where any estimate is"))

    def stiff_errors(self) -> None:
        """Raise the errors of states with large pivots to that of the dense output."""
        self.note("the dense output has errors of its own where the state is stiff")
        for slot, name in enumerate(self.state):
            pivot, mass = self.factors.inverse[slot], self.mass.entries.get((slot, slot), sp.S.One)
            if pivot != Name("reach"):
                self.let(f"f_{name}", times(lower(mass), Name("shift") * pivot))
                last = linear(self.method.dense[-1], self.stages(name, len(self.method.dense[-1])))
                self.let(f"e_{name}", self.stiff_error(f"e_{name}", last, Name(f"f_{name}")))

    def new_state(self, name: str) -> Expression:
        """Compute the new value of one state variable; returns its error, the first one of two."""
        m, values = self.method, self.stages(name, self.method.stages)
        last = stage_state(m.b, m.a[-1], name) if m.implicit else Name(name) + self.increment(m.b, values)
        self.let(f"n_{name}", last)
        return self.increment(m.e[0], values)


def stage_state(row: Sequence[float], previous: Sequence[float], name: str) -> Expression:
    """y + sum a_j k_j, written as the previous stage's state plus its increment where the rows allow that."""
    names = [f"k{j + 1}_{name}" for j in range(len(row))]
    if len(previous) > 0 and tuple(row) == (*previous, 1.0):
        return Name(f"u_{name}") + names[-1]
    return linear(row, names, name)

"""Write the step of a small network node by node, with states in registers.

The prefix of a name denotes the vector:

    x_1     at the start        u_x_1    in a stage             n_x_1    at the end
    f_x_1   right-hand side     k2_x_1   rate of stage 2        r_x_1    right-hand side of linear equations
    g_x_1   vector of mass_solve                                e_x_1    error

SymPy adds up the Jacobian entries of nodes and links before they are lowered to code, so that zeros and units cost no
operation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.parts import PartTemplate

from ..program.expressions import ZERO, Expression, Load, Name, Number, ProductExpr, call, linear, plus
from ..program.lowering import lower
from ..program.passes import Names, StraightLine, real, share
from ..program.statements import If, Return, let, store
from .blocks import assigned
from .elimination import Entries, plan, times, write_factors, write_solve
from .mass_solve import Mass
from .step import NOW, StepWriter, entry, lane, linearised, prefix


class UnrolledStep(StepWriter):
    """Write a step that holds each state of each vector in a register."""

    @cached_property
    def part_bodies(self) -> dict[PartTemplate, StraightLine]:
        """What the rows of parts add to rates, by shape; filled where they are first written."""
        return {}

    @cached_property
    def supply(self) -> Iterator[sp.Symbol]:
        """Names for the values that several x share."""
        eq = self.equations
        return Names([*eq.state, *eq.parameters, *(s.name for s in self.of_nodes)]).fresh("row_")

    @cached_property
    def mass(self) -> Mass:
        return Mass(self)

    def at(self, i: int, base: str) -> dict[sp.Symbol, sp.Symbol]:
        """Return the map from template symbols to those of node i: states in the vector `base`, and parameters."""
        states = self.equations.node_at(i).state
        return {**self.equations.at_node(i), **{s: real(f"{prefix(base)}{s.name}_{i + 1}") for s in states}}

    def stages(self, name: str, count: int) -> list[str]:
        """Return the names of the first `count` rates of one state."""
        return [f"k{j + 1}_{name}" for j in range(count)]

    def opening(self) -> None:
        for slot, name in enumerate(self.state):
            self.let(name, Load("y", Number(slot)))
        self.parameters()

    # -- right-hand side --------------------------------------------------------------------------------------

    def slopes(self, base: str, out: str) -> None:
        """Compute the right-hand side at the states in vector `base` into vector `out`."""
        for i, kind in enumerate(self.equations.kind_of):
            body, names = self.kinds[kind].rhs, self.at(i, base)
            targets = [f"{prefix(out)}{s.name}_{i + 1}" for s in self.equations.node_at(i).state]
            self.put(*self.node_call("node", kind, body, targets, names))
            for target, e in zip(targets, body.results, strict=True):
                if self.is_plain(e):
                    self.let(target, lane(lower(e.xreplace(names))))
        self.links(base, out)

    def links(self, base: str, out: str, at: Mapping[sp.Symbol, sp.Symbol] = NOW) -> None:
        """Add the rates of all links, one sum for each state; `at` renames the time, by default to that of a stage."""
        eq, terms = self.equations, dict[str, list[Expression]]()
        staged = {real(n): real(prefix(base) + n) for n in self.state} | dict(at)
        for link, edge in eq.linked():
            for s, e in zip(eq.node_at(link[0]).state, edge.rhs, strict=True):
                term = e.xreplace(eq.at_link(link, edge)).xreplace(staged)
                if term != 0:
                    terms.setdefault(f"{prefix(out)}{s.name}_{link[0] + 1}", []).append(lower(term))
        for target, parts in terms.items():
            self.let(target, plus(Name(target), *parts))
        self.rows(base, out, at)

    def rows(self, base: str, out: str, at: Mapping[sp.Symbol, sp.Symbol]) -> None:
        """Add the rates of the rows of parts that links join; parts of one shape have equal statements."""
        for part in self.equations.parts:
            template = part.template
            if template not in self.part_bodies:
                self.part_bodies[template] = share([e for e in template.added if e != 0], self.supply)
            targets = [f"{prefix(out)}{self.state[k]}" for k in part.places]
            states = {s: real(f"{prefix(base)}{e}") for s, e in part.at.items() if e.name in self.state}
            rates = {s: real(target) for s, target in zip(template.rates, targets, strict=True) if s is not None}
            body = self.part_bodies[template].at({**part.at, **states, **rates, **at})
            self.put(*assigned(body))
            pushed = (target for target, e in zip(targets, template.added, strict=True) if e != 0)
            # all x are known before the first rate changes
            self.put(*(let(f"added_{target}", lower(e)) for target, e in zip(pushed, body.results, strict=True)))
            pushed = (target for target, e in zip(targets, template.added, strict=True) if e != 0)
            self.put(*(let(target, plus(Name(target), Name(f"added_{target}"))) for target in pushed))

    # -- linearisation ----------------------------------------------------------------------------------------

    def linearise(self) -> None:
        """Compute right-hand side, Jacobian and time derivative at the start, and the factors of shift*M - J."""
        if self.method.inexact:
            self.mass.refuse(f"integrator {self.method.name}")
        eq, results = self.equations, self.linear_nodes()
        entries = self.mass.at_start(self.jacobian(results))
        self.steps = plan(len(self.state), set(entries) | self.mass.coupled)
        self.factors = write_factors(self.steps, entries, tuple(self.state), self.mass.entries)
        self.note(f"factors of {'shift*M - J' if self.mass.entries else 'shift - J'}")
        self.put(*self.factors.statements)
        # partial time derivative of each state's right-hand side: terms of the node, then of its links
        self.time_slopes = {
            k: lower(results[i][f"ft_{s.name}"])
            for i, places in enumerate(eq.places)
            for k, s in zip(places, eq.node_at(i).state, strict=True)
        }
        for k, e in eq.link_time_derivative():
            self.time_slopes[k] = lower(e) if self.time_slopes[k] == ZERO else plus(self.time_slopes[k], lower(e))

    def linear_nodes(self) -> list[dict[str, sp.Expr]]:
        """Write right-hand side, Jacobian and time derivative of each node at the start; return results by name."""
        eq = self.equations
        self.note("right-hand side, Jacobian and time derivative at the start")
        self.timed("t", self.wanted([blocks.linear for blocks in self.kinds]))
        # later stages overwrite the time terms, so copy those that are results
        plain = [e for blocks in self.kinds for e in blocks.linear.results if self.is_plain(e)]
        overwritten = self.wanted([blocks.rhs for blocks in self.kinds]) & {s for e in plain for s in e.free_symbols}
        copies = {s: real(f"at_{s.name}") for s in sorted(overwritten, key=lambda s: s.name)}
        self.put(*(let(copy.name, s.name) for s, copy in copies.items()))
        results: list[dict[str, sp.Expr]] = []
        for i, kind in enumerate(eq.kind_of):
            state, body, at = eq.node_at(i).state, self.kinds[kind].linear, self.at(i, "y")
            keys = linearised(state)[: len(body.results)]
            names = [f"{key}_{i + 1}" for key in keys]
            self.put(*self.node_call("node_linear", kind, body, names, at))
            values = {}
            for k, (key, name, e) in enumerate(zip(keys, names, body.results, strict=True)):
                # a rate needs a variable, because links add to it; a plain entry of J needs none
                if self.is_plain(e) and k < len(state):
                    self.let(name, lane(lower(e.xreplace(at))))
                values[key] = (e.xreplace(at) if self.is_plain(e) else real(name)).xreplace(copies)
            results.append(values)
        self.links("y", "f", {})
        return results

    def jacobian(self, results: list[dict[str, sp.Expr]]) -> Entries:
        """Return the non-zero entries of the Jacobian: those of nodes by name, plus those of links."""
        eq = self.equations
        entries: Entries = {}
        for i, places in enumerate(eq.places):
            state = eq.node_at(i).state
            for row, r in zip(places, state, strict=True):
                for column, c in zip(places, state, strict=True):
                    entries[row, column] = results[i][entry(r, c)]
        # a W-method (`inexact`) drops the entries between different nodes, so that each node is eliminated separately
        node = {k: i for i, places in enumerate(eq.places) for k in places}
        for key, e in eq.link_jacobian():
            if node[key[0]] == node[key[1]] or not self.method.inexact:
                entries[key] = entries.get(key, sp.S.Zero) + e
        entries = {key: e for key, e in entries.items() if e != 0}
        if not eq.parts:
            return entries
        # The unknowns of rows in links are nested in every entry, which written out would fill the memory.
        body = share(list(entries.values()), self.supply)
        self.put(*assigned(body))
        return dict(zip(entries, body.results, strict=True))

    # -- stages -----------------------------------------------------------------------------------------------

    def advance(self, i: int) -> None:
        m = self.method
        for name in self.state:
            if m.implicit:
                self.let(f"u_{name}", stage_state(m.a[i], m.a[i - 1], name))
            elif i >= m.stages and m.a[i] == m.b:  # a stage of the dense output at the new state
                self.let(f"u_{name}", f"n_{name}")
            else:
                self.let(f"u_{name}", Name(name) + self.increment(m.a[i], self.stages(name, i)))

    def solve(self, i: int) -> None:
        m = self.method
        if not m.implicit:
            self.mass.explicit("u" if i else "y", f"k{i + 1}")
            return
        sums = {name: linear(m.big_c[i], self.stages(name, i)) for name in self.state} if i > 0 else {}
        coupled = self.mass.stage_terms(sums, i)
        for slot, name in enumerate(self.state):
            terms = [coupled.get(name, Name(f"f_{name}"))]
            if i > 0 and name not in coupled:
                terms.append(ProductExpr((Name("rate"), sums[name])))
            self.let(f"r_{name}", plus(*terms, *self.time_slope(i, self.time_slopes[slot])))
        rights, results = ({k: f"{p}_{name}" for k, name in enumerate(self.state)} for p in ("r", f"k{i + 1}"))
        self.put(*write_solve(self.steps, self.factors, rights, results))

    # -- end --------------------------------------------------------------------------------------------------

    def finish(self) -> None:
        m = self.method
        self.note("new state and error")
        errors: list[Expression] = []  # of the first error estimate, by state
        for name in self.state:
            values = self.stages(name, m.stages)
            by_rates = Name(name) + self.increment(m.b, values)
            self.let(f"n_{name}", stage_state(m.b, m.a[-1], name) if m.implicit else by_rates)
            errors.append(self.increment(m.e[0], values))
        if m.dense_error:
            self.put(*(let(f"e_{name}", e) for name, e in zip(self.state, errors, strict=True)))
            errors = [Name(f"e_{name}") for name in self.state]
        # the dense output, and the extra stages that only the dense output needs
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
        # the largest error; a maximum may drop NaN, a sum keeps NaN: `total`
        first, *others = terms = [Name(f"e_{name}") for name in self.state]
        self.let("total", plus(*terms))
        self.let("error", first)
        self.put(*(let("error", call("maximum", "error", term)) for term in others))
        self.put(Return((Name("error") + 0.0 * Name("total"),), "NaN or infinite where any estimate is"))

    def stiff_errors(self) -> None:
        """Raise the error of each state to that of its dense output, which stiffness does not damp."""
        self.note("the dense output has errors of its own where the state is stiff")
        last = self.method.dense[-1]
        for slot, name in enumerate(self.state):
            pivot, mass = self.factors.inverse[slot], self.mass.entries.get((slot, slot), sp.S.One)
            if pivot != Name("reach"):
                self.let(f"f_{name}", times(lower(mass), Name("shift") * pivot))
                value = linear(last, self.stages(name, len(last)))
                self.let(f"e_{name}", self.stiff_error(f"e_{name}", value, Name(f"f_{name}")))


def stage_state(row: Sequence[float], previous: Sequence[float], name: str) -> Expression:
    """Return y + sum a_j k_j; if both rows of `a` agree, as previous stage state plus the last k."""
    names = [f"k{j + 1}_{name}" for j in range(len(row))]
    if len(previous) > 0 and tuple(row) == (*previous, 1.0):
        return Name(f"u_{name}") + names[-1]
    return linear(row, names, name)

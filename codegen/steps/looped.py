"""The statements of a step for a large network: loops over nodes and links around the same node functions.

The text has the same size for any number of nodes; it is compiled anew for each only because that number is a constant.
Nodes of several kinds have a loop for each kind, and their links one for each pair of kinds (codegen/places.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from ..program.expressions import Expression, Load, Name, Product, call, linear, negative, plus, scaled
from ..program.lowering import lower
from ..program.passes import Body
from ..program.statements import Assign, If, Return, Statement, accumulate, let, store, whole
from .linearise import entry
from .looped_mass import LoopMass, filled
from .mass import Block
from .places import Joint, Kind, Places, link_ends, named
from .program import Program, names
from .rosenbrock import scales, time_term
from .step import StepWriter, function_name, lane

__all__ = ["LoopWriter"]


class LoopWriter:
    """Writes a step in loops; `w` supplies the naming and the node functions, `elimination` the order of the pivots."""

    def __init__(self, w: StepWriter, elimination: Program) -> None:
        self.w, self.method, self.places, self.elimination = w, w.method, Places(w.equations), elimination
        self.mass = LoopMass(self)
        stages = len(w.method.c)
        bases = [*(f"K{j + 1}" for j in range(stages)), "STATE", "SLOPE", "TIME_SLOPE", "MATRIX"]
        self.base = {name: vector(i) for i, name in enumerate(bases)} | self.mass.bases(len(bases) - 1)

    def write(self) -> None:
        """Write the step."""
        w = self.w
        w.put(*(whole(name, place) for name, place in self.base.items()))
        w.put(Assign(names(w.equations), Name("graph"), whole=True))
        w.parameters(but={f"{name}_{i + 1}" for name in w.equations.varied for i in range(w.equations.n)})
        if self.method.implicit:
            self.rosenbrock()
        else:
            self.explicit()

    # -- pieces -----------------------------------------------------------------------------------------------

    def node_call(self, function: str, kind: Kind, body: Body, found: Sequence[str]) -> list[Statement]:
        """The call of a node function on the symbols of the template; plain results among those `found` are left out."""
        pairs = [(name, e) for name, e in zip(found, body.results, strict=True) if not self.w.is_plain(e)]
        given = (s.name for s in self.w.arguments(body, [e for _, e in pairs]))
        value = call(function_name(function, kind.number), *given)
        return [Assign(tuple(name for name, _ in pairs), value)] if pairs else []

    def slopes(self, base: str, out: str) -> None:
        """The right-hand side of all nodes at a state, links included."""
        for kind in self.places.kinds:
            self.node_slopes(kind, base, out)
        self.links(base, out)

    def node_slopes(self, kind: Kind, base: str, out: str) -> None:
        """The right-hand side of the nodes of one kind."""
        body = self.w.kinds[kind.number].rhs
        left = [f"f_{s.name}" for s in kind.node.state]
        found = self.places.read(kind.node, base) + self.places.own(body) + self.node_call("node", kind, body, left)
        for c, (name, e) in enumerate(zip(left, body.results, strict=True)):
            value = lane(lower(e)) if self.w.is_plain(e) else Name(name)
            found.append(store("dense", plus(Name(out), self.places.place(c)), value))
        self.w.put(kind.span.over(found))

    def links(self, base: str, out: str, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes, where `out` says where, and on demand to the matrix."""
        for joint in self.places.joints:
            edge = joint.edge
            inertia = [e for block in edge.inertia for row in block for e in row] if jacobian else []
            found = self.link(joint, base, (*edge.rhs, *inertia))
            for c, e in enumerate(edge.rhs if out else ()):
                if e != 0:
                    found.append(self.add(out, self.places.place(c), lower(e.xreplace(named(joint)))))
            if jacobian:
                found += self.matrix_of_link(joint)
            self.w.put(joint.span.over(found))

    def link(self, joint: Joint, base: str, used: tuple[sp.Expr, ...], states: bool = True) -> list[Statement]:
        """The ends of a link, its weight, the parameters that `used` uses, and the states of both ends."""
        read = self.places.read
        found = link_ends(joint.edge) + self.places.own(Body((), used))
        if states:
            found += read(joint.target, base, "_here", "i") + read(joint.source, base, "_there", "j")
        return found

    def add(self, base: str, place: Expression, value: Expression) -> Statement:
        """A statement that adds to a group of the workspace."""
        return accumulate("dense", plus(Name(base), place), value)

    def matrix_of_link(self, joint: Joint) -> list[Statement]:
        """What a link adds to shift*M - J."""
        found, swap = self.mass.rates_of_link(joint), named(joint)
        for block, slot in zip(self.mass.jacobian(joint), ("here_slot", "there_slot"), strict=True):
            found += self.entries(block, slot, swap)
        for block, slot in zip(joint.edge.inertia, ("here_slot", "there_slot"), strict=False):
            found += self.entries(block, slot, swap, lambda e: scaled("shift", e))
        return found

    def entries(
        self,
        block: Block,
        slot: str,
        swap: dict[sp.Symbol, sp.Symbol],
        change: Callable[[Expression], Expression] = negative,
        matrix: str = "MATRIX",
    ) -> list[Statement]:
        """Statements that subtract the entries of a block from the matrix, or add what another `change` makes of them."""
        return [
            self.add(matrix, self.places.entry(slot, a, b), change(lower(e.xreplace(swap))))
            for a, row in enumerate(block)
            for b, e in enumerate(row)
            if e != 0
        ]

    # -- Rosenbrock -------------------------------------------------------------------------------------------

    def rosenbrock(self) -> None:
        """Linearise, factorise, and one solve for each stage."""
        w, m = self.w, self.method
        w.put(*scales(m.gamma))
        self.linearise()
        self.mass.factorise()
        for i in range(m.stages):
            self.stage(i)
        self.finish(m.b, [linear(row, self.stages(m.stages)) for row in m.e])

    def stages(self, count: int) -> list[str]:
        """Names of the loaded stage values of one state variable."""
        return [f"k{j + 1}" for j in range(count)]

    def linearise(self) -> None:
        """Slopes, matrix shift - J and time slopes at the start."""
        w, kinds = self.w, self.places.kinds
        w.note("right-hand side, shift - J and time derivative at the start")
        w.timed("t", w.wanted([blocks.linear for blocks in w.kinds]))
        w.put(*filled("MATRIX", Name("shift")))
        slopes = [w.kinds[kind.number].linear.results[-len(kind.node.state) :] for kind in kinds]
        moving = [[e != 0 for e in own] for own in slopes]
        self.timed_rows = [any(map(any, moving))] if self.places.mixed else moving[0]
        for kind in kinds:
            self.node_linear(kind)
        self.links("y", "" if self.mass.at_start() else "SLOPE", jacobian=True)

    def node_linear(self, kind: Kind) -> None:
        """Slopes, matrix entries and time slopes of the nodes of one kind."""
        w, body, state = self.w, self.w.kinds[kind.number].linear, kind.node.state
        size, place = len(state), self.places.place
        names = [f"f_{r.name}" for r in state] + [entry(r, c) for r in state for c in state]
        names += [f"ft_{r.name}" for r in state]
        found = self.places.read(kind.node, "y") + self.places.own(body)
        found += self.node_call("node_linear", kind, body, names)
        named = [e if w.is_plain(e) else sp.Symbol(k, real=True) for k, e in zip(names, body.results, strict=True)]
        for c in range(size):
            found.append(store("dense", plus(Name("SLOPE"), place(c)), lane(lower(named[c]))))
            if self.timed_rows[0 if self.places.mixed else c]:
                slope = lane(lower(named[size + size * size + c]))
                found.append(store("dense", plus(Name("TIME_SLOPE"), place(c)), slope))
        block = tuple(tuple(named[size + a * size : size + (a + 1) * size]) for a in range(size))
        w.put(kind.span.over(found + self.entries(block, "node_slot", {})))

    def stage(self, i: int) -> None:
        """State, slopes, right-hand side and solve of one stage."""
        w, m = self.w, self.method
        w.note(f"stage {i + 1}")
        if i > 0:
            self.state_of(m.a[i])
            w.stage_time(i, first=1)
            self.slopes("STATE", "SLOPE")
            self.mass.rates_of_stage(i)
        for row, (span, place) in enumerate(self.places.rows):
            found: list[Statement] = []
            terms: list[Expression] = [Load("dense", plus(Name("SLOPE"), place))]
            if i > 0:
                found += self.load_stages(place, m.big_c[i])
                more, terms = self.mass.known(place, terms[0], linear(m.big_c[i], self.stages(i)))
                found += more
            if m.d[i] != 0.0 and self.timed_rows[row]:
                terms.append(time_term(m.d[i], Load("dense", plus(Name("TIME_SLOPE"), place))))
            w.put(span.over([*found, store("dense", plus(Name(f"K{i + 1}"), place), plus(*terms))]))
        if i > 0:
            self.mass.carried(i)
        self.mass.solve(f"K{i + 1}", "SLOPE")

    def load_stages(self, place: Expression, row: Sequence[float]) -> list[Statement]:
        """Load the stage values of a state variable that a row of coefficients uses."""
        used = [j + 1 for j, weight in enumerate(row) if weight != 0.0]
        return [let(f"k{j}", Load("dense", plus(Name(f"K{j}"), place))) for j in used]

    def increment(self, row: Sequence[float]) -> Expression:
        """What a row of coefficients adds to the state at the start."""
        total = linear(row, self.stages(len(row)))
        return total if self.method.implicit else Product((Name("h"), total))

    def state_of(self, row: Sequence[float]) -> None:
        """The state of a stage: y + sum a_j k_j, the sum times h for explicit methods."""
        for span, place in self.places.rows:
            found = [*self.load_stages(place, row), let("old", Load("y", place))]
            found.append(store("dense", plus(Name("STATE"), place), Name("old") + self.increment(row)))
            self.w.put(span.over(found))

    def finish(self, weights: Sequence[float], errors: list[Expression]) -> None:
        """New state, dense output and error."""
        w, m = self.w, self.method
        w.note("new state, error and dense output")
        w.put(let("error", 0.0 * Name("h")), let("total", 0.0 * Name("h")))
        for span, place in self.places.rows:
            found = [*self.load_stages(place, [1.0] * len(m.c)), let("old", Load("y", place))]
            found += [let("new", Name("old") + self.increment(weights)), store("y_new", place, "new")]
            found += [let("e", call("scaled", self.error(errors), "old", "new", "rtol", "atol"))]
            found += [let("total", Name("total") + "e"), let("error", call("maximum", "error", "e"))]
            for j, row in enumerate(m.dense):
                at = plus(j * Name("DIMENSION"), place)
                value = lane(linear(row, self.stages(len(row))))
                scale = value if m.implicit else Product((Name("h"), value))
                found.append(If(Name("DENSE"), (store("dense", at, scale),)))
            w.put(span.over(found))
        w.put(Return((Name("error") + 0.0 * Name("total"),), "NaN or infinite where any estimate is"))

    def error(self, errors: list[Expression]) -> Expression:
        """The error estimate of one state variable, from one or two embedded methods."""
        if len(errors) == 1:
            return errors[0] if self.method.implicit else Product((Name("h"), errors[0]))
        return call("pair", *errors, "h")

    # -- explicit ---------------------------------------------------------------------------------------------

    def explicit(self) -> None:
        """Stages, those that serve the dense output alone too."""
        w, m = self.w, self.method
        self.mass.opening()
        for i in range(len(m.c)):
            w.note(f"stage {i + 1}")
            if i > 0:
                self.state_of(m.a[i])
            w.stage_time(i, first=0)
            base = "STATE" if i else "y"
            self.slopes(base, f"K{i + 1}")
            self.mass.explicit(base, f"K{i + 1}")
        self.finish(m.b, [linear(row, self.stages(len(row))) for row in m.e])


def vector(number: int) -> Expression:
    """Where a vector of the workspace begins."""
    return Name("DENSE_ROWS") * "DIMENSION" + number * Name("DIMENSION")

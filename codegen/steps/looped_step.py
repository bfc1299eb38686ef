"""The statements of a step for a large network: loops over nodes and links around the same node functions.

The text has the same size for any number of nodes; it is compiled anew for each only because that number is a constant.
Nodes of several kinds have a loop for each kind, and their links one for each pair of kinds (codegen/steps/places.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Block

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, Product, Value, call, linear, negative, plus, scaled
from ..program.lowering import lower
from ..program.passes import real
from ..program.statements import (
    Assign,
    Do,
    Function,
    If,
    Return,
    Role,
    Statement,
    accumulate,
    let,
    mentioned,
    store,
    targets,
    whole,
)
from .blocks import NodeBlocks
from .fields import LinkSums, link_sums, mean_fields
from .mass_solve import added_masses, momentum_slopes, turned_masses
from .places import Joint, NodeKindLayout, link_ends, named, places, span
from .safe_names import NAMES
from .sparse_plan import SparsePlan, block_pattern
from .step import NOW, StepWriter, lane, linearised

SLOTS = ("here_slot", "there_slot")
"""The arrays that say where the entries of a link's blocks stand, by its target and by its source."""

STATES, PLACE = span("i", "DIMENSION"), Name("i")
"""A loop over all states, for what is done to each alike, and the place of a state."""

GROUPS = {"f": "SLOPE"}
"""What vectors of slopes are called in memory, besides those of stages, K1, K2, …"""


class LoopedStep(StepWriter):
    """Keeps its vectors in the workspace behind the dense output; `elimination` has the order of the pivots."""

    def __init__(
        self, equations: Equations, kinds: Sequence[NodeBlocks], method: Integrator, elimination: SparsePlan
    ) -> None:
        super().__init__(equations, kinds, method)
        self.places, self.elimination, self.fields = places(equations), elimination, mean_fields(equations)
        self.sums, self.joints = list[LinkSums](), list(self.places.joints)
        if not method.implicit:  # the matrix of an implicit step needs both ends of each link anyway
            self.sums, self.joints = link_sums(equations, self.places.joints)
        self.mass = LoopMass(self)

    def opening(self) -> None:
        """Name the parts of the workspace, load the parameters that all nodes share."""
        stages = [f"K{j + 1}" for j in range(len(self.method.c))]
        vectors = [*stages, "STATE", "SLOPE", "TIME_SLOPE", "MATRIX"]
        base = {name: vector(i) for i, name in enumerate(vectors)}
        if self.solves:
            base["ENTRIES"] = Name("DIMENSION") + "column.size"
            base |= self.mass.bases(base["MATRIX"] + self.matrices)
        if self.sums or any(field.alike for field in self.fields):
            base["FIELD"] = base["MATRIX"] + self.matrices if self.solves else base["MATRIX"]
        self.put(Assign(NAMES, Name("graph"), whole=True))
        self.put(*(whole(name, place) for name, place in base.items()))
        self.parameters(skipped=self.equations.single)
        if not self.method.implicit:
            self.mass.opening()

    @property
    def matrices(self) -> Expression:
        """The length of the matrix, with its factors where these stand apart."""
        return Name("ENTRIES") if self.elimination.exact else 2 * Name("ENTRIES")

    # -- right-hand side --------------------------------------------------------------------------------------

    def slopes(self, base: str, out: str) -> None:
        """Compute the right-hand side at one vector of states into another, by a function that all stages call."""
        given = self.given
        states = Name("y") if base == "y" else call("address", "dense", Name("STATE") * "WIDTH")
        self.put(Do(call("slopes", states, "dense", GROUPS.get(out, out.upper()), *given)))

    @cached_property
    def given(self) -> list[str]:
        """What that function, which is written here, is given besides states, workspace, and place of the slopes."""
        with self.apart() as body:
            for kind in self.places.kinds:
                self.node_slopes(kind, "y", "out")
            self.links("y", "out")
            kept = 0
            for field in self.fields:
                self.put(*field.statements(self.places, "y", "out", kept))
                kept += len(field.alike)
            for links in self.sums:
                self.put(*links.statements(self.places, "y", "out", kept))
                kept += links.kept
        needed = mentioned(body)
        given = [name for name in ("h", "p", *targets(self.statements), "weights") if name in needed]
        about = "Write the right-hand side at the states y behind the place `out` of the workspace."
        self.functions.append(Function("slopes", ("y", "dense", "out", *given), about, tuple(body), Role.CALLED))
        return given

    def node_slopes(self, kind: NodeKindLayout, base: str, out: str) -> None:
        """The right-hand side of the nodes of one kind."""
        body = self.kinds[kind.number].rhs
        left = [f"f_{s.name}" for s in kind.node.state]
        found = self.places.read(kind.node, base) + self.places.own(body.symbols)
        found += self.node_call("node", kind.number, body, left, {})
        for c, (name, e) in enumerate(zip(left, body.results, strict=True)):
            value = lane(lower(e)) if self.is_plain(e) else Name(name)
            found.append(store("dense", plus(Name(out), self.places.place(c)), value))
        self.put(kind.span.over(found))

    def links(self, base: str, out: str, start: bool = False, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes, where `out` says where, in a stage or at the `start` of the step,
        and on demand to the matrix and to the time slopes.
        """
        for joint in self.joints:
            edge = joint.edge
            inertia = [e for block in edge.inertia for row in block for e in row] if jacobian else []
            found, swap = self.link(joint, base, (*edge.rhs, *inertia)), named(joint) | ({} if start else NOW)
            for c, e in enumerate(edge.rhs if out else ()):
                if e != 0:
                    found.append(self.add(out, self.places.place(c), lower(e.xreplace(swap))))
            if jacobian:
                found += self.matrix_of_link(joint)
                slopes = ((c, e) for c, e in enumerate(edge.time_derivative()) if e != 0)
                found += [self.add("TIME_SLOPE", self.places.place(c), lower(e.xreplace(swap))) for c, e in slopes]
            self.put(joint.span.over(found))

    def link(self, joint: Joint, base: str, used: tuple[sp.Expr, ...], states: bool = True) -> list[Statement]:
        """The ends of a link, its weight, the parameters that `used` uses, and the states of both ends."""
        read, symbols = self.places.read, {s for e in used for s in e.free_symbols}
        found = [*link_ends(joint.edge, joint.edge.weight.name), *self.places.of_link(joint.edge, symbols)]
        if states:
            found += read(joint.target, base, "_here", "i") + read(joint.source, base, "_there", "j")
        return found

    def add(self, base: str, place: Expression, value: Expression) -> Statement:
        """A statement that adds to a group of the workspace."""
        return accumulate("dense", plus(Name(base), place), value)

    def matrix_of_link(self, joint: Joint) -> list[Statement]:
        """What a link adds to shift*M - J."""
        found, swap = self.mass.rates_of_link(joint), named(joint)
        for block, slot in zip(self.mass.jacobian(joint), SLOTS, strict=True):
            found += self.entries(block, slot, swap)
        for block, slot in zip(joint.edge.inertia, SLOTS, strict=False):
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
            self.add(matrix, self.places.entry(slot, a, b), change(lower(block[a][b].xreplace(swap))))
            for a, b in block_pattern(block)
        ]

    # -- linearisation ----------------------------------------------------------------------------------------

    def linearise(self) -> None:
        """Slopes, matrix shift*M - J and time slopes at the start, and the factors of the matrix."""
        kinds = self.places.kinds
        self.note("right-hand side, shift - J and time derivative at the start")
        self.timed("t", self.wanted([blocks.linear for blocks in self.kinds]))
        self.put(*filled("MATRIX", Name("shift")))
        slopes = [self.kinds[kind.number].linear.results[-len(kind.node.state) :] for kind in kinds]
        slopes += [joint.edge.time_derivative() for joint in self.places.joints]
        self.timed_rows = {self.places.row_of(c) for own in slopes for c, e in enumerate(own) if e != 0}
        for kind in kinds:
            self.node_linear(kind)
        self.links("y", "" if self.mass.at_start() else "SLOPE", start=True, jacobian=True)
        self.mass.turn()
        self.mass.factorise()

    def node_linear(self, kind: NodeKindLayout) -> None:
        """Slopes, matrix entries and time slopes of the nodes of one kind."""
        body, state = self.kinds[kind.number].linear, kind.node.state
        size, place = len(state), self.places.place
        names, found = linearised(state), [*self.places.read(kind.node, "y"), *self.places.own(body.symbols)]
        found += self.node_call("node_linear", kind.number, body, names, {})
        named = [e if self.is_plain(e) else real(k) for k, e in zip(names, body.results, strict=True)]
        for c in range(size):
            found.append(store("dense", plus(Name("SLOPE"), place(c)), lane(lower(named[c]))))
            if self.places.row_of(c) in self.timed_rows:
                slope = lane(lower(named[size + size * size + c]))
                found.append(store("dense", plus(Name("TIME_SLOPE"), place(c)), slope))
        block = tuple(tuple(named[size + a * size : size + (a + 1) * size]) for a in range(size))
        found += self.entries(block, "node_slot", {})
        found += self.entries(added_masses(kind.node), "node_slot", {}, lambda e: scaled("shift", e))
        self.put(kind.span.over(found))

    # -- stages -----------------------------------------------------------------------------------------------

    def advance(self, i: int) -> None:
        """Compute the state of stage i > 0: y + sum a_j k_j, the sum times h for explicit methods."""
        row = self.method.a[i]
        found = [*self.load_stages(PLACE, row), let("old", Load("y", PLACE))]
        value = Name("old") + self.increment(row, self.stages(len(row)))
        self.put(STATES.over([*found, store("dense", Name("STATE") + PLACE, value)]))

    def solve(self, i: int) -> None:
        """Turn the slopes of stage i into its rates."""
        m = self.method
        if not m.implicit:
            self.mass.explicit("STATE" if i else "y", f"K{i + 1}")
            return
        if i > 0:
            self.mass.rates_of_stage(i)
        for row, (rows, place) in enumerate(self.places.rows):
            found: list[Statement] = []
            terms: list[Expression] = [Load("dense", plus(Name("SLOPE"), place))]
            if i > 0:
                found += self.load_stages(place, m.big_c[i])
                more, terms = self.mass.known(place, terms[0], linear(m.big_c[i], self.stages(i)))
                found += more
            if row in self.timed_rows:
                terms += self.time_slope(i, Load("dense", plus(Name("TIME_SLOPE"), place)))
            self.put(rows.over([*found, store("dense", plus(Name(f"K{i + 1}"), place), plus(*terms))]))
        if i > 0:
            self.mass.carried(i)
        self.mass.solve(f"K{i + 1}", "SLOPE")

    def stages(self, count: int) -> list[str]:
        """Names of the loaded stage values of one state variable."""
        return [f"k{j + 1}" for j in range(count)]

    def load_stages(self, place: Expression, row: Sequence[float]) -> list[Statement]:
        """Load the stage values of a state variable that a row of coefficients uses."""
        used = [j + 1 for j, weight in enumerate(row) if weight != 0.0]
        return [let(f"k{j}", Load("dense", plus(Name(f"K{j}"), place))) for j in used]

    def finish(self) -> None:
        """Compute the new state, the error and the dense output; stages that serve this alone run if DENSE."""
        m = self.method
        if len(m.c) > m.stages:
            with self.apart() as stages:
                for i in range(m.stages, len(m.c)):
                    self.stage(i)
            self.put(If(Name("DENSE"), tuple(stages)))
        self.note("new state, error and dense output")
        self.put(let("error", 0.0 * Name("h")), let("total", 0.0 * Name("h")))
        if m.dense_error and self.equations.inertial:
            with self.apart() as masses:
                self.mass.gather("y", "MASS")
            self.put(If(Name("DENSE"), tuple(masses)))
        loops = self.places.measured
        if len({period for *_, period in loops}) == 1:
            self.put(STATES.over(self.end_of(PLACE, loops[0][2])))
        else:
            self.put(*(loop.over([whole("k", at), *self.end_of(Name("k"), period)]) for loop, at, period in loops))
        self.put(Return((Name("error") + 0.0 * Name("total"),), "NaN or infinite where any estimate is"))

    def end_of(self, place: Expression, period: float | None) -> list[Statement]:
        """Compute the new value, the error and the dense output of the state at a place."""
        m, values = self.method, self.stages(len(self.method.c))
        found = [*self.load_stages(place, [1.0] * m.stages), let("old", Load("y", place))]
        found += [let("new", Name("old") + self.increment(m.b, values)), store("y_new", place, "new")]
        if len(m.e) == 1:
            found += [let("estimate", self.increment(m.e[0], values)), *self.stiff_errors(values, place)]
        found += [*self.embedded(values), let("estimate", self.scaled_error("estimate", "old", "new", period))]
        found += [let("total", Name("total") + "estimate"), let("error", call("maximum", "error", "estimate"))]
        dense: list[Statement] = self.load_stages(place, [float(i >= m.stages) for i in range(len(m.c))])
        for j, row in enumerate(m.dense):
            dense.append(store("dense", j * Name("DIMENSION") + place, self.dense_value(row, values)))
        return [*found, If(Name("DENSE"), tuple(dense))]

    def stiff_errors(self, values: Sequence[str], place: Expression) -> list[Statement]:
        """Raise the error of a state with a large pivot to that of the dense output."""
        m = self.method
        if not m.dense_error:
            return []
        factors = Name("MATRIX") if self.elimination.exact else Name("MATRIX") + "ENTRIES"
        share = Name("shift") * Load("dense", factors + place)
        share = share * Load("dense", Name("MASS") + place) if self.equations.inertial else share
        return [If(Name("DENSE"), (let("estimate", self.stiff_error("estimate", linear(m.dense[-1], values), share)),))]


def vector(number: int) -> Expression:
    """Where a vector of the workspace begins."""
    return Name("DENSE_ROWS") * "DIMENSION" + number * Name("DIMENSION")


class LoopMass:
    """What a looped step writes about M; where M is the identity, nothing but the solution of each stage."""

    def __init__(self, writer: LoopedStep) -> None:
        self.writer, self.equations = writer, writer.equations
        self.inertial, self.constant = self.equations.inertial, self.equations.constant_mass
        self.joints = [joint for joint in writer.places.joints if joint.edge.inertia]
        self.heavy = [kind for kind in writer.places.kinds if kind.node.inertia]

    def bases(self, start: Expression) -> dict[str, Expression]:
        """Where a Rosenbrock step keeps M, and the rates at its start if M varies."""
        if not self.inertial or not self.writer.method.implicit:
            return {}
        return {"MASS": start} if self.constant else {"RATES": start, "MASS": start + "DIMENSION"}

    # -- linear algebra ---------------------------------------------------------------------------------------

    @property
    def apart(self) -> Value:
        """How far behind the matrix its factors stand."""
        return 0 if self.writer.elimination.exact else "ENTRIES"

    def factorise(self, matrix: str = "MATRIX") -> None:
        """Factorise a matrix; STATE is lost."""
        arrays = ("order", "place", "row_start", "after_start", "column")
        self.writer.put(Do(call("factorise", "dense", matrix, self.apart, "STATE", *arrays)))

    def solve(self, vector: str, scratch: str, matrix: str = "MATRIX") -> None:
        """Solve in place for a vector; `scratch` and STATE are lost."""
        arrays = ("order", "row_start", "after_start", "column")
        self.writer.put(Do(call("solve", "dense", matrix, self.apart, vector, scratch, "STATE", *arrays)))

    def assemble(self, base: str, matrix: str) -> None:
        """M at a state, factorised; STATE is lost."""
        self.gather(base, matrix)
        self.factorise(matrix)

    def gather(self, base: str, matrix: str) -> None:
        """M at a state."""
        w = self.writer
        w.put(*filled(matrix, 1.0 + 0.0 * Name("h")))

        def added(block: Block, end: int | None, swap: dict[sp.Symbol, sp.Symbol]) -> list[Statement]:
            return w.entries(block, "node_slot" if end is None else SLOTS[end], swap, lambda e: e, matrix)

        self.blocks(base, added)

    def blocks(
        self, base: str, made: Callable[[Block, int | None, dict[sp.Symbol, sp.Symbol]], list[Statement]]
    ) -> None:
        """What is `made` of the blocks of M - 1: those of nodes, and those of links by either end, 0 or 1."""
        for kind in self.heavy:
            added = added_masses(kind.node)
            self.writer.put(kind.span.over([*self.node(kind, added, base), *made(added, None, {})]))
        for joint in self.joints:
            ends = [s for end, block in enumerate(joint.edge.inertia) for s in made(block, end, named(joint))]
            self.writer.put(joint.span.over([*self.link(joint, base), *ends]))

    def link(self, joint: Joint, base: str) -> list[Statement]:
        """What the inertia of a link is made of."""
        used = tuple(e for block in joint.edge.inertia for row in block for e in row)
        return self.writer.link(joint, base, used, states=not self.constant)

    def node(self, kind: NodeKindLayout, used: Block, base: str) -> list[Statement]:
        """What some masses of a node are made of: its states and its own parameters."""
        w, symbols = self.writer, {s for row in used for e in row for s in e.free_symbols}
        states = [] if kind.node.constant_inertia else w.places.read(kind.node, base)
        return [*states, *w.places.own(symbols)]

    # -- explicit methods -------------------------------------------------------------------------------------

    def opening(self) -> None:
        """What an explicit step does at first: M, factorised, where it is constant."""
        if self.inertial and self.constant:
            self.assemble("y", "MATRIX")

    def explicit(self, base: str, out: str) -> None:
        """Turn the right-hand sides of a stage into rates."""
        if self.inertial:
            if not self.constant:
                self.assemble(base, "MATRIX")
            self.solve(out, "SLOPE")

    # -- Rosenbrock methods -----------------------------------------------------------------------------------

    def at_start(self) -> bool:
        """The rates at the start, where M depends on the state; returns whether the links are in SLOPE by now."""
        if self.constant:
            return False
        w = self.writer
        w.links("y", "SLOPE", start=True)
        self.assemble("y", "MASS")
        copied = store("dense", Name("RATES") + "k", Load("dense", Name("SLOPE") + "k"))
        w.put(span("k", "DIMENSION").over([copied]))
        self.solve("RATES", "K1", "MASS")
        return True

    def turn(self) -> None:
        """Add d(M F)/dy of the nodes at fixed F to the matrix."""
        w = self.writer
        for kind in self.heavy:
            rates = [real(f"g_{s.name}") for s in kind.node.state]
            turned = turned_masses(kind.node, rates)
            if turned:
                found = [*self.node(kind, turned, "y"), *w.places.read(kind.node, "RATES", prefix="g_")]
                w.put(kind.span.over(found + w.entries(turned, "node_slot", {}, lambda e: e)))

    def rates_of_link(self, joint: Joint) -> list[Statement]:
        """Load the rates at both ends of a link whose inertia depends on them."""
        if self.constant or not joint.edge.inertia:
            return []
        read = self.writer.places.read
        return [
            *read(joint.target, "RATES", "_here", "i", prefix="g_"),
            *read(joint.source, "RATES", "_there", "j", prefix="g_"),
        ]

    def jacobian(self, joint: Joint) -> tuple[Block, Block]:
        """df/dy - d(M F)/dy at fixed F of one link, by its target and by its source."""
        edge = joint.edge
        own = (edge.jacobian_here(), edge.jacobian_there())
        if self.constant or not edge.inertia:
            return own
        ends = ((joint.target, "_here"), (joint.source, "_there"))
        rates = tuple(tuple(real(f"g_{s.name}{suffix}") for s in node.state) for node, suffix in ends)
        turned = momentum_slopes(edge, *rates)
        here, there = (
            tuple(tuple(a - b for a, b in zip(*rows, strict=True)) for rows in zip(*blocks, strict=True))
            for blocks in zip(own, turned, strict=True)
        )
        return here, there

    def rates_of_stage(self, i: int) -> None:
        """Turn the right-hand sides in SLOPE into rates, where M depends on the state."""
        if not self.constant:
            self.assemble("STATE", "MASS")
            self.solve("SLOPE", f"K{i + 1}", "MASS")

    def known(
        self, place: Expression, slope: Expression, total: Expression
    ) -> tuple[list[Statement], list[Expression]]:
        """Statements and the terms of what a stage has on its right-hand side besides the inertia of the links.

        `total` is the sum of earlier stages; what M multiplies is left in STATE: that sum, or with it the rates.
        """
        terms = [slope, Product((Name("rate"), total))]
        kept = plus(Name("STATE"), place)
        if not self.inertial:
            return [], terms
        if self.constant:
            return [store("dense", kept, total)], terms
        return [let("new", plus(*terms)), store("dense", kept, "new")], [Name("new")]

    def carried(self, i: int) -> None:
        """Add (M - 1) s to stage i, s what `known` has left in STATE, times the rate where that is a sum of stages."""
        places, rate = self.writer.places, [Name("rate")] if self.constant else []

        def pushed(block: Block, end: int | None, swap: dict[sp.Symbol, sp.Symbol]) -> list[Statement]:
            found = []
            for a, b in block_pattern(block):
                load = Load("dense", plus(Name("STATE"), places.place(b, "j" if end else "i")))
                value = Product((*rate, lower(block[a][b].xreplace(swap)), load))
                found.append(self.writer.add(f"K{i + 1}", places.place(a), value))
            return found

        self.blocks("y", pushed)


def filled(matrix: str, diagonal: Expression) -> list[Statement]:
    """A matrix with equal entries on its diagonal and zeros elsewhere."""
    parts = ((span("k", "DIMENSION"), diagonal), (span("k", "ENTRIES", "DIMENSION"), 0.0 * Name("h")))
    return [part.over([store("dense", Name(matrix) + "k", value)]) for part, value in parts]

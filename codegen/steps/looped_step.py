"""Write the step of a large network: loops over nodes and links that call the functions of nodes.

The text has the same length for any number of nodes. The number of nodes is a constant in the text, so each size is
compiled once. Nodes of several kinds have a loop for each kind; their links have a loop for each pair of kinds
(codegen/steps/places.py).

All vectors are parts of the array `dense`, the workspace. They follow the rows of the dense output:

    K1, K2, …                   rates of the stages; for explicit methods these are the right-hand sides
    STATE                       state of a stage, and scratch memory of the linear algebra
    SLOPE, TIME_SLOPE           right-hand side of a stage; its partial time derivative at the start
    MATRIX                      shift*M - J or M: diagonal, then ENTRIES - DIMENSION others; incomplete factors follow
    RATES, MASS                 rates at the start and M, where a Rosenbrock step needs them
    FIELD                       functions of the sources of mean fields, sums over links, by node
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Block

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, ProductExpr, Value, call, linear, negative, plus, scaled
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
    let,
    mentioned,
    store,
    targets,
    whole,
)
from .blocks import NodeBlocks
from .fields import LinkSums, link_sums, mean_fields
from .mass_solve import added_masses, momentum_slopes, turned_masses
from .places import Joint, NodeKindLayout, StateLayout, add_to, load_from, named, span, store_in
from .safe_names import NAMES
from .sparse_plan import SparsePlan, block_pattern
from .step import NOW, StepWriter, lane, linearised

# The arrays that hold the matrix slots of a link's two blocks: derivatives by the target's states, by the source's.
SLOTS = ("here_slot", "there_slot")
STATES, PLACE = span("i", "DIMENSION"), Name("i")  # the loop over all states, and the index of a state in the loop
# The vector in the workspace for each name that a written-out step uses; k1, k2, … of stages become K1, K2, …
GROUPS = {"f": "SLOPE"}


class LoopedStep(StepWriter):
    """Write a step whose vectors lie in the workspace; `elimination` (SparsePlan) holds the order of the pivots."""

    def __init__(
        self, equations: Equations, kinds: Sequence[NodeBlocks], method: Integrator, elimination: SparsePlan
    ) -> None:
        super().__init__(equations, kinds, method)
        self.places, self.elimination, self.fields = StateLayout(equations), elimination, mean_fields(equations)
        self.sums, self.joints = list[LinkSums](), list(self.places.joints)
        if not method.implicit:  # a Rosenbrock step loops over the links in any case, for the matrix
            self.sums, self.joints = link_sums(equations, self.places.joints)
        self.mass = LoopMass(self)

    # -- memory -----------------------------------------------------------------------------------------------

    def opening(self) -> None:
        """Name the parts of the workspace and load the parameters that all nodes share."""
        # vectors with one entry for each state lie one after another behind the dense output
        vectors = [*(f"K{j + 1}" for j in range(len(self.method.c))), "STATE", "SLOPE", "TIME_SLOPE", "MATRIX"]
        starts: dict[str, Expression] = {
            name: Name("DENSE_ROWS") * "DIMENSION" + i * Name("DIMENSION") for i, name in enumerate(vectors)
        }
        # `behind` is the end of the workspace so far: behind the matrix and, if incomplete, its factors
        behind = starts["MATRIX"]
        if self.solves:
            starts["ENTRIES"] = Name("DIMENSION") + "column.size"
            behind = behind + (Name("ENTRIES") if self.elimination.exact else 2 * Name("ENTRIES"))
            if self.method.implicit and self.equations.inertial:
                constant = self.equations.constant_mass
                starts |= {"MASS": behind} if constant else {"RATES": behind, "MASS": behind + "DIMENSION"}
        if self.sums or any(field.alike for field in self.fields):
            starts["FIELD"] = behind
        self.put(Assign(NAMES, Name("graph"), whole=True))
        self.put(*(whole(name, place) for name, place in starts.items()))
        self.parameters(skipped=self.equations.single)
        if not self.method.implicit:
            self.mass.opening()

    @property
    def workspace(self) -> int:
        """Number of registers in the workspace; `opening` names the parts."""
        eq, implicit, elimination = self.equations, self.method.implicit, self.elimination
        size = (len(self.method.c) + 3) * eq.dimension
        size += eq.n * (sum(len(field.alike) for field in self.fields) + sum(links.kept for links in self.sums))
        matrix = elimination.entries if elimination.exact else 2 * elimination.entries
        size += matrix * (implicit + eq.inertial)
        return size + (eq.dimension if implicit and eq.inertial and not eq.constant_mass else 0)

    # -- right-hand side --------------------------------------------------------------------------------------

    def slopes(self, base: str, out: str) -> None:
        """Write a call of the function `slopes`: the right-hand side at the states in `base`, stored in `out`."""
        constants = self.slope_constants
        states = Name("y") if base == "y" else call("address", "dense", Name("STATE") * "WIDTH")
        self.put(Do(call("slopes", states, "dense", GROUPS.get(out, out.upper()), *constants)))

    @cached_property
    def slope_constants(self) -> list[str]:
        """Write the function `slopes`; return the arguments behind states, workspace and position of the slopes."""
        with self.apart() as body:
            for kind in self.places.kinds:
                self.node_slopes(kind, "y", "out")
            self.links("y", "out")
            rows = 0  # rows of FIELD in use
            for field in self.fields:
                self.put(*field.statements(self.places, "y", "out", rows))
                rows += len(field.alike)
            for links in self.sums:
                self.put(*links.statements(self.places, "y", "out", rows))
                rows += links.kept
        # arguments of the function: the variables of the step that the body uses
        needed = mentioned(body)
        constants = [name for name in ("h", "p", *targets(self.statements), "weights") if name in needed]
        about = "Write the right-hand side at the states y behind the place `out` of the workspace."
        self.functions.append(Function("slopes", ("y", "dense", "out", *constants), about, tuple(body), Role.CALLED))
        return constants

    def node_slopes(self, kind: NodeKindLayout, base: str, out: str) -> None:
        """Compute the right-hand side of all nodes of one kind."""
        body = self.kinds[kind.number].rhs
        names = [f"f_{s.name}" for s in kind.node.state]
        loop = self.places.read(kind.node, base) + self.places.own(body.symbols)
        loop += self.node_call("node", kind.number, body, names, {})
        for c, (name, e) in enumerate(zip(names, body.results, strict=True)):
            value = lane(lower(e)) if self.is_plain(e) else Name(name)
            loop.append(store_in(out, self.places.place(c), value))
        self.put(kind.span.over(loop))

    def links(self, base: str, out: str, start: bool = False, jacobian: bool = False) -> None:
        """Add the rates of each link to the vector `out`, unless `out` is empty."""
        # `start`: at the time of the start of the step, not of a stage. `jacobian`: also subtract each link's Jacobian
        # entries from the matrix, and add each link's time derivatives to TIME_SLOPE.
        place = self.places.place
        for joint in self.joints:
            edge, swap = joint.edge, named(joint) | ({} if start else NOW)
            inertia = [e for block in edge.inertia for row in block for e in row] if jacobian else []
            loop = self.link(joint, base, (*edge.rhs, *inertia))
            rates = edge.rhs if out else ()
            loop += [add_to(out, place(c), lower(e.xreplace(swap))) for c, e in enumerate(rates) if e != 0]
            if jacobian:
                loop += self.matrix_of_link(joint)
                times = ((c, e) for c, e in enumerate(edge.time_derivative()) if e != 0)
                loop += [add_to("TIME_SLOPE", place(c), lower(e.xreplace(swap))) for c, e in times]
            self.put(joint.span.over(loop))

    def link(self, joint: Joint, base: str, used: Sequence[sp.Expr], states: bool = True) -> list[Statement]:
        """Load ends and weight of a link, the parameters in `used`, and with `states` the states of both ends."""
        read, symbols = self.places.read, {s for e in used for s in e.free_symbols}
        loads = [*self.places.ends(joint.edge, joint.edge.weight.name), *self.places.of_link(joint.edge, symbols)]
        if states:
            loads += read(joint.target, base, "_here", "i") + read(joint.source, base, "_there", "j")
            loads += read(joint.source, base, "_beyond", "k_beyond") if joint.edge.beyond else []
        return loads

    # -- linearisation ----------------------------------------------------------------------------------------

    def linearise(self) -> None:
        """Compute right-hand side, matrix shift*M - J and time slopes at the start, and factorise the matrix."""
        kinds = self.places.kinds
        self.note("right-hand side, shift - J and time derivative at the start")
        self.timed("t", self.wanted([blocks.linear for blocks in self.kinds]))
        self.put(*filled("MATRIX", Name("shift")))
        # skip states whose right-hand side does not contain the time
        slopes = [self.kinds[kind.number].linear.results[-len(kind.node.state) :] for kind in kinds]
        slopes += [joint.edge.time_derivative() for joint in self.places.joints]
        self.timed_rows = {self.places.row_of(c) for row in slopes for c, e in enumerate(row) if e != 0}
        for kind in kinds:
            self.node_linear(kind)
        self.links("y", "" if self.mass.at_start() else "SLOPE", start=True, jacobian=True)
        self.mass.turn()
        self.mass.factorise()

    def node_linear(self, kind: NodeKindLayout) -> None:
        """Compute slopes, matrix entries and time slopes of the nodes of one kind."""
        body, state = self.kinds[kind.number].linear, kind.node.state
        size, place, names = len(state), self.places.place, linearised(state)
        loop = [*self.places.read(kind.node, "y"), *self.places.own(body.symbols)]
        loop += self.node_call("node_linear", kind.number, body, names, {})
        # the results are `size` rates, size*size entries of J row by row, and `size` time derivatives
        results = [e if self.is_plain(e) else real(name) for name, e in zip(names, body.results, strict=True)]
        for c in range(size):
            loop.append(store_in("SLOPE", place(c), lane(lower(results[c]))))
            if self.places.row_of(c) in self.timed_rows:
                loop.append(store_in("TIME_SLOPE", place(c), lane(lower(results[size + size * size + c]))))
        block = tuple(tuple(results[size + a * size : size + (a + 1) * size]) for a in range(size))
        loop += self.entries(block, "node_slot", {})
        loop += self.entries(added_masses(kind.node), "node_slot", {}, lambda e: scaled("shift", e))
        self.put(kind.span.over(loop))

    def matrix_of_link(self, joint: Joint) -> list[Statement]:
        """Add the two blocks of a link to shift*M - J."""
        swap = named(joint)
        loop, blocks = self.mass.jacobian(joint)
        for block, slot in zip(blocks, SLOTS, strict=True):
            loop += self.entries(block, slot, swap)
        for block, slot in zip(joint.edge.inertia, SLOTS, strict=False):
            loop += self.entries(block, slot, swap, lambda e: scaled("shift", e))
        return loop

    def entries(
        self,
        block: Block,
        slot: str,
        swap: dict[sp.Symbol, sp.Symbol],
        change: Callable[[Expression], Expression] = negative,
        matrix: str = "MATRIX",
    ) -> list[Statement]:
        """Add change(entry) to the matrix for each non-zero entry of a block; by default `change` negates."""
        return [
            add_to(matrix, self.places.entry(slot, a, b), change(lower(block[a][b].xreplace(swap))))
            for a, b in block_pattern(block)
        ]

    # -- stages -----------------------------------------------------------------------------------------------

    def advance(self, i: int) -> None:
        """Compute the state of stage i > 0: y + sum a_j k_j, or y + h sum a_j k_j for explicit methods."""
        row = self.method.a[i]
        loop = [*self.load_stages(PLACE, row), let("old", Load("y", PLACE))]
        value = Name("old") + self.increment(row, self.stages(len(row)))
        self.put(STATES.over([*loop, store_in("STATE", PLACE, value)]))

    def solve(self, i: int) -> None:
        m = self.method
        if not m.implicit:
            # K already holds the right-hand side f; with a mass matrix, solve M k = f
            self.mass.explicit("STATE" if i else "y", f"K{i + 1}")
            return
        if i > 0:
            self.mass.rates_of_stage(i)
        # right-hand side of the linear equations: f + (1/h) sum C_ij k_j + d_i h f_t for each state
        for row, (rows, place) in enumerate(self.places.rows):
            loop: list[Statement] = []
            terms: list[Expression] = [load_from("SLOPE", place)]
            if i > 0:
                loop += self.load_stages(place, m.big_c[i])
                kept, terms = self.mass.stage_terms(place, terms[0], linear(m.big_c[i], self.stages(i)))
                loop += kept
            if row in self.timed_rows:
                terms += self.time_slope(i, load_from("TIME_SLOPE", place))
            self.put(rows.over([*loop, store_in(f"K{i + 1}", place, plus(*terms))]))
        if i > 0:
            self.mass.carried(i)
        self.mass.solve(f"K{i + 1}", "SLOPE")

    def stages(self, count: int) -> list[str]:
        """Return the names of the rates k_1 … k_count of one state after they are loaded."""
        return [f"k{j + 1}" for j in range(count)]

    def load_stages(self, place: Expression, row: Sequence[float]) -> list[Statement]:
        """Load the rates k_j of one state for which the row of coefficients is not zero."""
        return [let(f"k{j}", load_from(f"K{j}", place)) for j, weight in enumerate(row, start=1) if weight != 0.0]

    # -- end --------------------------------------------------------------------------------------------------

    def finish(self) -> None:
        m = self.method
        # extra stages that only the dense output needs
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
        # use one loop over all states, unless some states are angles with a period
        loops = self.places.measured
        if len({period for *_, period in loops}) == 1:
            self.put(STATES.over(self.end_of(PLACE, loops[0][2])))
        else:
            self.put(*(loop.over([whole("k", at), *self.end_of(Name("k"), period)]) for loop, at, period in loops))
        self.put(Return((Name("error") + 0.0 * Name("total"),), "NaN or infinite where any estimate is"))

    def end_of(self, place: Expression, period: float | None) -> list[Statement]:
        """Compute the new value, the error and the dense output of one state."""
        m, values = self.method, self.stages(len(self.method.c))
        loop = [*self.load_stages(place, [1.0] * m.stages), let("old", Load("y", place))]
        loop += [let("new", Name("old") + self.increment(m.b, values)), store("y_new", place, "new")]
        if len(m.e) == 1:
            loop.append(let("estimate", self.increment(m.e[0], values)))
        if m.dense_error:
            # in stiff components a large pivot damps the error of the state, but not the error of the dense output
            share = Name("shift") * load_from("MATRIX", place if self.elimination.exact else Name("ENTRIES") + place)
            share = share * load_from("MASS", place) if self.equations.inertial else share
            raised = let("estimate", self.stiff_error("estimate", linear(m.dense[-1], values), share))
            loop.append(If(Name("DENSE"), (raised,)))
        loop += [*self.embedded(values), let("estimate", self.scaled_error("estimate", "old", "new", period))]
        # a maximum may drop NaN, a sum keeps NaN: `total` makes the step fail then
        loop += [let("total", Name("total") + "estimate"), let("error", call("maximum", "error", "estimate"))]
        dense: list[Statement] = self.load_stages(place, [float(i >= m.stages) for i in range(len(m.c))])
        for j, row in enumerate(m.dense):
            dense.append(store("dense", j * Name("DIMENSION") + place, self.dense_value(row, values)))
        return [*loop, If(Name("DENSE"), tuple(dense))]


class LoopMass:
    """Write the terms of a mass matrix M in a looped step, and all solves of linear equations."""

    # The head of codegen/steps/mass_solve.py states the equations that a step solves.

    def __init__(self, writer: LoopedStep) -> None:
        self.writer = writer
        self.inertial, self.constant = writer.equations.inertial, writer.equations.constant_mass
        self.joints = [joint for joint in writer.places.joints if joint.edge.inertia]
        self.heavy = [kind for kind in writer.places.kinds if kind.node.inertia]
        # exact factors overwrite the matrix; incomplete factors are stored behind the matrix
        self.apart: Value = 0 if writer.elimination.exact else "ENTRIES"

    # -- linear algebra: codegen/driver/sparse.py -------------------------------------------------------------

    def factorise(self, matrix: str = "MATRIX") -> None:
        """Factorise a matrix; STATE is overwritten."""
        arrays = ("order", "place", "row_start", "after_start", "column")
        self.writer.put(Do(call("factorise", "dense", matrix, self.apart, "STATE", *arrays)))

    def solve(self, vector: str, scratch: str, matrix: str = "MATRIX") -> None:
        """Replace a vector by the solution for this right-hand side; `scratch` and STATE are overwritten."""
        arrays = ("order", "row_start", "after_start", "column")
        self.writer.put(Do(call("solve", "dense", matrix, self.apart, vector, scratch, "STATE", *arrays)))

    def assemble(self, base: str, matrix: str) -> None:
        """Compute M at the states in `base` and factorise M; STATE is overwritten."""
        self.gather(base, matrix)
        self.factorise(matrix)

    def gather(self, base: str, matrix: str) -> None:
        """Compute M at the states in `base`."""
        w = self.writer

        def added(block: Block, end: int | None, swap: dict[sp.Symbol, sp.Symbol]) -> list[Statement]:
            return w.entries(block, "node_slot" if end is None else SLOTS[end], swap, lambda e: e, matrix)

        w.put(*filled(matrix, 1.0 + 0.0 * Name("h")))
        self.blocks(base, added)

    def blocks(
        self, base: str, use: Callable[[Block, int | None, dict[sp.Symbol, sp.Symbol]], list[Statement]]
    ) -> None:
        """Loop over the blocks of M - 1; `use` writes the code for a block of a node or of a link's end 0 or 1."""
        w = self.writer
        for kind in self.heavy:
            block = added_masses(kind.node)
            w.put(kind.span.over([*self.node(kind, block, base), *use(block, None, {})]))
        for joint in self.joints:
            inertia = [e for block in joint.edge.inertia for row in block for e in row]
            loads = w.link(joint, base, inertia, states=not self.constant)
            ends = [s for end, block in enumerate(joint.edge.inertia) for s in use(block, end, named(joint))]
            w.put(joint.span.over([*loads, *ends]))

    def node(self, kind: NodeKindLayout, used: Block, base: str) -> list[Statement]:
        """Load the states and parameters of a node that occur in a block."""
        w, symbols = self.writer, {s for row in used for e in row for s in e.free_symbols}
        states = [] if kind.node.constant_inertia else w.places.read(kind.node, base)
        return [*states, *w.places.own(symbols)]

    # -- explicit methods: M rates = f ------------------------------------------------------------------------

    def opening(self) -> None:
        """Factorise M once a step, if M is constant."""
        if self.inertial and self.constant:
            self.assemble("y", "MATRIX")

    def explicit(self, base: str, out: str) -> None:
        """Solve M F = f: replace the right-hand side f of a stage by the rates F."""
        if self.inertial:
            if not self.constant:
                self.assemble(base, "MATRIX")
            self.solve(out, "SLOPE")

    # -- Rosenbrock methods: (shift M - J) k = M (F + rate sum c k) -------------------------------------------

    def at_start(self) -> bool:
        """If M varies, compute the rates F at the start and return True: SLOPE then contains the rates of the links."""
        if self.constant:
            return False
        w = self.writer
        w.links("y", "SLOPE", start=True)
        self.assemble("y", "MASS")
        w.put(span("k", "DIMENSION").over([store_in("RATES", Name("k"), load_from("SLOPE", Name("k")))]))
        self.solve("RATES", "K1", "MASS")
        return True

    def turn(self) -> None:
        """Add the nodes' part of d(M F)/dy, F fixed, to the matrix."""
        w = self.writer
        for kind in self.heavy:
            turned = turned_masses(kind.node, [real(f"g_{s.name}") for s in kind.node.state])
            if turned:
                loads = [*self.node(kind, turned, "y"), *w.places.read(kind.node, "RATES", prefix="g_")]
                w.put(kind.span.over(loads + w.entries(turned, "node_slot", {}, lambda e: e)))

    def jacobian(self, joint: Joint) -> tuple[list[Statement], tuple[Block, Block]]:
        """Return statements that load the rates F of a link, and df/dy - d(M F)/dy, F fixed, by target and source."""
        edge, read = joint.edge, self.writer.places.read
        blocks = (edge.jacobian_here(), edge.jacobian_there())
        if self.constant or not edge.inertia:
            return [], blocks
        ends = ((joint.target, "_here", "i"), (joint.source, "_there", "j"))
        loads = [load for node, suffix, index in ends for load in read(node, "RATES", suffix, index, prefix="g_")]
        here, there = (tuple(real(f"g_{s.name}{suffix}") for s in node.state) for node, suffix, _ in ends)
        slopes = momentum_slopes(edge, here, there)
        by_target, by_source = (
            tuple(tuple(a - b for a, b in zip(*rows, strict=True)) for rows in zip(*pair, strict=True))
            for pair in zip(blocks, slopes, strict=True)
        )
        return loads, (by_target, by_source)

    def rates_of_stage(self, i: int) -> None:
        """If M varies, replace the right-hand side of a stage in SLOPE by the rates F."""
        if not self.constant:
            self.assemble("STATE", "MASS")
            self.solve("SLOPE", f"K{i + 1}", "MASS")

    def stage_terms(
        self, place: Expression, slope: Expression, total: Expression
    ) -> tuple[list[Statement], list[Expression]]:
        """Return the terms of F + rate*total with total = sum c k, and the statements that must precede them."""
        # `carried` reads a vector from STATE: `total` if M is constant, since M F = f is known; F + rate*total if M
        # varies.
        terms = [slope, ProductExpr((Name("rate"), total))]
        if not self.inertial:
            return [], terms
        if self.constant:
            return [store_in("STATE", place, total)], terms
        return [let("new", plus(*terms)), store_in("STATE", place, "new")], [Name("new")]

    def carried(self, i: int) -> None:
        """Add (M - 1) s to the right-hand side of stage i; s is STATE, times `rate` if M is constant."""
        places, rate = self.writer.places, [Name("rate")] if self.constant else []

        def pushed(block: Block, end: int | None, swap: dict[sp.Symbol, sp.Symbol]) -> list[Statement]:
            terms = []
            for a, b in block_pattern(block):
                load = load_from("STATE", places.place(b, "j" if end else "i"))
                value = ProductExpr((*rate, lower(block[a][b].xreplace(swap)), load))
                terms.append(add_to(f"K{i + 1}", places.place(a), value))
            return terms

        self.blocks("y", pushed)


def filled(matrix: str, diagonal: Expression) -> list[Statement]:
    """Set all diagonal entries of a matrix to one value and all other entries to zero."""
    parts = ((span("k", "DIMENSION"), diagonal), (span("k", "ENTRIES", "DIMENSION"), 0.0 * Name("h")))
    return [part.over([store_in(matrix, Name("k"), value)]) for part, value in parts]

"""The statements of a step for a large network: loops over nodes and links around the same node functions.

The text has the same size for any number of nodes; it is compiled anew for each only because that number is a constant.
Nodes of several kinds have a loop for each kind, and their links one for each pair of kinds (codegen/places.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ..program.passes import Body
from ..program.printers import show
from .linearise import entry
from .looped_mass import LoopMass
from .places import Joint, Kind, Places, named
from .program import Program, names
from .rosenbrock import term
from .step import StepWriter, combine, function_name

__all__ = ["LoopWriter"]


class LoopWriter:
    """Writes a step in loops; `w` supplies the naming and the node functions, `elimination` the order of the pivots."""

    def __init__(self, w: StepWriter, elimination: Program) -> None:
        self.w, self.method, self.places, self.elimination = w, w.method, Places(w.equations), elimination
        self.mass = LoopMass(self)
        stages = len(w.method.c)
        bases = [*(f"K{j + 1}" for j in range(stages)), "STATE", "SLOPE", "TIME_SLOPE", "MATRIX"]
        self.base = {name: f"DENSE_ROWS*DIMENSION + {i}*DIMENSION" for i, name in enumerate(bases)}
        self.base |= self.mass.bases(len(bases) - 1)

    def lines(self) -> list[str]:
        """All statements of the step."""
        w = self.w
        w.put(*(f"{name} = {text}" for name, text in self.base.items()))
        w.put(f"{', '.join(names(w.equations))} = graph")
        w.parameters(but={f"{name}_{i + 1}" for name in w.equations.varied for i in range(w.equations.n)})
        if self.method.implicit:
            self.rosenbrock()
        else:
            self.explicit()
        return w.lines

    # -- pieces -----------------------------------------------------------------------------------------------

    def loop(self, head: str, lines: Sequence[str]) -> None:
        """A for loop."""
        self.w.put(head, *(f"    {line}" for line in lines))

    def node_call(self, function: str, kind: Kind, body: Body) -> tuple[str, list[sp.Expr]]:
        """The call of a node function on the symbols of the template, and which results it returns."""
        coded = [e for e in body.results if not self.w.is_plain(e)]
        given = ", ".join(s.name for s in self.w.arguments(body, coded))
        return f"{function_name(function, kind.number)}({given})", coded

    def slopes(self, base: str, out: str) -> None:
        """The right-hand side of all nodes at a state, links included."""
        for kind in self.places.kinds:
            self.node_slopes(kind, base, out)
        self.links(base, out)

    def node_slopes(self, kind: Kind, base: str, out: str) -> None:
        """The right-hand side of the nodes of one kind."""
        body = self.w.kinds[kind.number].rhs
        call, coded = self.node_call("node", kind, body)
        lines = self.places.read(kind.node, base) + self.places.own(body)
        left = [f"f_{s.name}" for s in kind.node.state]
        if coded:
            found = ", ".join(n for n, e in zip(left, body.results, strict=True) if not self.w.is_plain(e))
            lines.append(f"{found} = {call}")
        for c, (name, e) in enumerate(zip(left, body.results, strict=True)):
            value = (show(e) if not e.is_number else f"broadcast({show(e)}, WIDTH)") if self.w.is_plain(e) else name
            lines.append(f"store(dense, {out} + {self.places.place(c)}, {value})")
        self.loop(kind.head, lines)

    def links(self, base: str, out: str, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes, where `out` says where, and on demand to the matrix."""
        for joint in self.places.joints:
            edge = joint.edge
            inertia = [e for block in edge.inertia for row in block for e in row] if jacobian else []
            lines = self.link(joint, base, (*edge.rhs, *inertia))
            for c, e in enumerate(edge.rhs if out else ()):
                if e != 0:
                    lines.append(self.add(f"{out} + {self.places.place(c)}", f"+ {show(e.xreplace(named(joint)))}"))
            if jacobian:
                lines += self.matrix_of_link(joint)
            self.loop(joint.head, lines)

    def link(self, joint: Joint, base: str, used: tuple[sp.Expr, ...], states: bool = True) -> list[str]:
        """The ends of a link, its weight, the parameters that `used` uses, and the states of both ends."""
        read = self.places.read
        lines = self.places.ends(joint.edge) + self.places.own(Body((), used))
        if states:
            lines += read(joint.target, base, "_here", "i") + read(joint.source, base, "_there", "j")
        return lines

    def add(self, place: str, value: str) -> str:
        """A statement that adds to a group of the workspace; the value begins with its sign."""
        return f"store(dense, {place}, load(dense, {place}, WIDTH) {value})"

    def matrix_of_link(self, joint: Joint) -> list[str]:
        """What a link adds to shift*M - J."""
        lines, swap = self.mass.rates_of_link(joint), named(joint)
        for block, slot in zip(self.mass.jacobian(joint), ("here_slot", "there_slot"), strict=True):
            lines += self.entries(block, slot, swap)
        for block, slot in zip(joint.edge.inertia, ("here_slot", "there_slot"), strict=False):
            lines += self.entries(block, slot, swap, "+ shift*")
        return lines

    def entries(
        self,
        block: Sequence[Sequence[sp.Expr]],
        slot: str,
        swap: dict[sp.Symbol, sp.Symbol],
        sign: str = "- ",
        matrix: str = "MATRIX",
    ) -> list[str]:
        """Statements that subtract the entries of a block from the matrix, or add them by another `sign`."""
        lines = []
        for a, row in enumerate(block):
            for b, e in enumerate(row):
                if e != 0:
                    value = show(e.xreplace(swap))
                    value = f"({value})" if sign != "+ " and e.is_Add else value
                    lines.append(self.add(f"{matrix} + {self.places.entry(slot, a, b)}", sign + value))
        return lines

    # -- Rosenbrock -------------------------------------------------------------------------------------------

    def rosenbrock(self) -> None:
        """Linearise, factorise, and one solve for each stage."""
        w, m = self.w, self.method
        w.put(f"reach = h*{m.gamma!r}", "shift = 1.0/reach", f"rate = shift*{m.gamma!r}")
        self.linearise()
        self.mass.factorise()
        for i in range(m.stages):
            self.stage(i)
        self.finish(m.b, [combine(row, self.stages(m.stages)) for row in m.e], m.a[-1])

    def stages(self, count: int) -> list[str]:
        """Names of the loaded stage values of one state variable."""
        return [f"k{j + 1}" for j in range(count)]

    def linearise(self) -> None:
        """Slopes, matrix shift - J and time slopes at the start."""
        w, kinds = self.w, self.places.kinds
        w.put("# right-hand side, shift - J and time derivative at the start")
        w.timed("t", w.wanted([blocks.linear for blocks in w.kinds]))
        self.loop("for k in range(DIMENSION):", ["store(dense, MATRIX + k, shift)"])
        self.loop("for k in range(DIMENSION, ENTRIES):", ["store(dense, MATRIX + k, 0.0*h)"])
        slopes = [w.kinds[kind.number].linear.results[-len(kind.node.state) :] for kind in kinds]
        moving = [[e != 0 for e in own] for own in slopes]
        self.timed_rows = [any(map(any, moving))] if self.places.mixed else moving[0]
        for kind in kinds:
            self.node_linear(kind)
        self.links("y", "" if self.mass.at_start() else "SLOPE", jacobian=True)

    def node_linear(self, kind: Kind) -> None:
        """Slopes, matrix entries and time slopes of the nodes of one kind."""
        w, body, state = self.w, self.w.kinds[kind.number].linear, [s.name for s in kind.node.state]
        size, place = len(state), self.places.place
        call, coded = self.node_call("node_linear", kind, body)
        found = [f"f_{r}" for r in state] + [entry(r, c) for r in kind.node.state for c in kind.node.state]
        found += [f"ft_{r}" for r in state]
        lines = self.places.read(kind.node, "y") + self.places.own(body)
        if coded:
            left = [name for name, e in zip(found, body.results, strict=True) if not w.is_plain(e)]
            lines.append(f"{', '.join(left)} = {call}")
        named = [e if w.is_plain(e) else sp.Symbol(k, real=True) for k, e in zip(found, body.results, strict=True)]
        for c in range(size):
            lines.append(f"store(dense, SLOPE + {place(c)}, {_lane(named[c])})")
            slope = named[size + size * size + c]
            if self.timed_rows[0 if self.places.mixed else c]:
                lines.append(f"store(dense, TIME_SLOPE + {place(c)}, {_lane(slope)})")
        block = [named[size + a * size : size + (a + 1) * size] for a in range(size)]
        self.loop(kind.head, lines + self.entries(block, "node_slot", {}))

    def stage(self, i: int) -> None:
        """State, slopes, right-hand side and solve of one stage."""
        w, m = self.w, self.method
        w.put(f"# stage {i + 1}")
        if i > 0:
            self.state_of(m.a[i], "", "")
            w.stage_time(i, first=1)
            self.slopes("STATE", "SLOPE")
            self.mass.rates_of_stage(i)
        for row, (head, place) in enumerate(self.places.rows):
            lines, text = [], f"load(dense, SLOPE + {place}, WIDTH)"
            if i > 0:
                lines += self.load_stages(place, m.big_c[i])
                total = f"({combine(m.big_c[i], self.stages(i))})"
                more, text = self.mass.known(place, text, total)
                lines += more
            if m.d[i] != 0.0 and self.timed_rows[row]:
                text += term(m.d[i], f"load(dense, TIME_SLOPE + {place}, WIDTH)", tidy=False)
            self.loop(head, [*lines, f"store(dense, K{i + 1} + {place}, {text})"])
        if i > 0:
            self.mass.carried(i)
        self.mass.solve(f"K{i + 1}", "SLOPE")

    def load_stages(self, place: str, row: Sequence[float]) -> list[str]:
        """Load the stage values of a state variable that a row of coefficients uses."""
        used = [j for j, weight in enumerate(row) if weight != 0.0]
        return [f"k{j + 1} = load(dense, K{j + 1} + {place}, WIDTH)" for j in used]

    def state_of(self, row: Sequence[float], before: str, behind: str) -> None:
        """The state of a stage: y + (sum a_j k_j), the sum scaled for explicit methods."""
        for head, place in self.places.rows:
            total = combine(row, self.stages(len(row)))
            lines = [*self.load_stages(place, row), f"old = load(y, {place}, WIDTH)"]
            self.loop(head, [*lines, f"store(dense, STATE + {place}, old + {before}({total}){behind})"])

    def finish(self, weights: Sequence[float], errors: list[str], last: Sequence[float], scale: str = "") -> None:
        """New state, dense output and error."""
        w, m = self.w, self.method
        w.put("# new state, error and dense output", "error = 0.0*h", "total = 0.0*h")
        for head, place in self.places.rows:
            lines = [*self.load_stages(place, [1.0] * len(m.c)), f"old = load(y, {place}, WIDTH)"]
            lines += [
                f"new = old + {scale}({combine(weights, self.stages(len(weights)))})",
                f"store(y_new, {place}, new)",
            ]
            lines += [f"e = scaled({self.error(errors, scale)}, old, new, rtol, atol)"]
            lines += ["total = total + e", "error = maximum(error, e)"]
            for j, row in enumerate(m.dense):
                lines.append("if DENSE:")
                value = combine(row, self.stages(len(row))) or "broadcast(0.0, WIDTH)"
                lines.append(f"    store(dense, {j}*DIMENSION + {place}, {scale}({value}))")
            self.loop(head, lines)
        w.put("return error + 0.0*total  # NaN or infinite where any estimate is")

    def error(self, errors: list[str], scale: str) -> str:
        """The error estimate of one state variable, from one or two embedded methods."""
        if len(errors) == 1:
            return f"{scale}({errors[0]})"
        return f"pair({errors[0]}, {errors[1]}, h)"

    # -- explicit ---------------------------------------------------------------------------------------------

    def explicit(self) -> None:
        """Stages, and those that serve the dense output alone under their flag."""
        w, m = self.w, self.method
        self.mass.opening()
        for i in range(len(m.c)):
            w.put(f"# stage {i + 1}")
            if i > 0:
                self.state_of(m.a[i], "h*", "")
            w.stage_time(i, first=0)
            base = "STATE" if i else "y"
            self.slopes(base, f"K{i + 1}")
            self.mass.explicit(base, f"K{i + 1}")
        self.finish(m.b, [combine(row, self.stages(len(row))) for row in m.e], (), "h*")


def _lane(e: sp.Expr) -> str:
    """The text of a value that is stored: numbers become lanes."""
    return f"broadcast({show(e)}, WIDTH)" if e.is_number else show(e)

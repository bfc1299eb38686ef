"""The statements of a step for a large network: loops over nodes and links around the same node functions.

The text has the same size for any number of nodes; it is compiled anew for each only because that number is a constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from synchain.models.equations import Edge

from .blocks import Body
from .linearise import entry
from .printer import show
from .rosenbrock import term
from .sparse import NAMES, program
from .step import StepWriter, combine

__all__ = ["LoopWriter"]


class LoopWriter:
    """Writes a step in loops; `w` supplies the naming and the node functions."""

    def __init__(self, w: StepWriter) -> None:
        self.w, self.method, self.node = w, w.method, w.equations.node
        self.state = [s.name for s in self.node.state]
        stages = len(w.method.c)
        names = [*(f"K{j + 1}" for j in range(stages)), "STATE", "SLOPE", "TIME_SLOPE", "MATRIX"]
        self.base = {name: f"DENSE_ROWS*DIMENSION + {i}*DIMENSION" for i, name in enumerate(names)}

    def lines(self) -> list[str]:
        """All statements of the step."""
        w = self.w
        w.put(*(f"{name} = {text}" for name, text in self.base.items()))
        w.put(f"{', '.join(NAMES)} = graph")
        w.parameters(but={f"{name}_{i + 1}" for name in w.equations.varied for i in range(w.equations.n)})
        if self.method.kind == "rosenbrock":
            self.rosenbrock()
        else:
            self.explicit()
        return w.lines

    # -- pieces -----------------------------------------------------------------------------------------------

    def loop(self, head: str, lines: Sequence[str]) -> None:
        """A for loop."""
        self.w.put(head, *(f"    {line}" for line in lines))

    def read(self, base: str, suffix: str = "", index: str = "i") -> list[str]:
        """Load the state of one node from an array or a part of the workspace."""
        array, offset = ("y", "") if base == "y" else ("dense", f"{base} + ")
        return [
            f"{name}{suffix} = load({array}, {offset}{c}*NODES + {index}, WIDTH)" for c, name in enumerate(self.state)
        ]

    def own(self, body: Body) -> list[str]:
        """Load the parameters that a node has for itself, those that a body uses."""
        eq = self.w.equations
        used = {s.name for s in body.symbols}
        slots = {name: eq.dimension + eq.parameters.index(f"{name}_1") for name in eq.varied if name in used}
        return [f"{name} = load(p, {slot} + i, WIDTH)" for name, slot in slots.items()]

    def node_call(self, function: str, body: Body) -> tuple[str, list[sp.Expr]]:
        """The call of a node function on the symbols of the template, and which results it returns."""
        coded = [e for e in body.results if not self.w.is_plain(e)]
        return f"{function}({', '.join(s.name for s in self.w.arguments(body, coded))})", coded

    def slopes(self, base: str, out: str) -> None:
        """The right-hand side of all nodes at a state, links included."""
        body = self.w.blocks.rhs
        call, coded = self.node_call("node", body)
        lines = self.read(base) + self.own(body)
        names = [f"f_{name}" for name in self.state]
        if coded:
            left = ", ".join(n for n, e in zip(names, body.results, strict=True) if not self.w.is_plain(e))
            lines.append(f"{left} = {call}")
        for c, (name, e) in enumerate(zip(names, body.results, strict=True)):
            value = (show(e) if not e.is_number else f"broadcast({show(e)}, WIDTH)") if self.w.is_plain(e) else name
            lines.append(f"store(dense, {out} + {c}*NODES + i, {value})")
        self.loop("for i in range(NODES):", lines)
        self.links(base, out)

    def links(self, base: str, out: str, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes and, on demand, to the matrix."""
        edge = self.w.equations.edge
        if edge is None or not self.w.equations.links:
            return
        names = {**dict(zip(edge.here, self._suffixed("_here"), strict=True))}
        names |= dict(zip(edge.there, self._suffixed("_there"), strict=True))
        lines = self.ends(edge)
        lines += self.own(Body((), edge.rhs))
        lines += self.read(base, "_here", "i") + self.read(base, "_there", "j")
        for c, e in enumerate(edge.rhs):
            if e != 0:
                place = f"{out} + {c}*NODES + i"
                lines.append(f"store(dense, {place}, load(dense, {place}, WIDTH) + {show(e.xreplace(names))})")
        if jacobian:
            for block, slot in ((edge.jacobian_here(), "here_slot"), (edge.jacobian_there(), "there_slot")):
                lines += self._entries(block, slot, "target.size", "e", names)
            for block, slot in zip(edge.inertia, ("here_slot", "there_slot"), strict=False):
                lines += self._entries(block, slot, "target.size", "e", names, "+ shift*")
        self.loop("for e in range(target.size):", lines)

    def ends(self, edge: Edge) -> list[str]:
        """The two ends of a link and its weight."""
        return ["i, j = target[e], source[e]", f"{edge.weight.name} = weights[e]"]

    def masses(self, edge: Edge) -> None:
        """M as the matrix, factorised: what an explicit step solves with."""
        self.loop("for k in range(DIMENSION):", ["store(dense, MATRIX + k, 1.0 + 0.0*h)"])
        self.loop("for k in range(DIMENSION, ENTRIES):", ["store(dense, MATRIX + k, 0.0*h)"])
        lines = self.ends(edge) + self.own(_inertia(edge))
        for block, slot in zip(edge.inertia, ("here_slot", "there_slot"), strict=True):
            lines += self._entries(block, slot, "target.size", "e", {}, "+ ")
        self.loop("for e in range(target.size):", lines)
        self.factorise()

    def factorise(self) -> None:
        """Factorise the matrix."""
        self.apart = "0" if program(self.w.equations).exact else "ENTRIES"
        self.w.put(f"factorise(dense, MATRIX, {self.apart}, STATE, order, place, row_start, after_start, column)")

    def solve(self, i: int) -> None:
        """Solve for the values of stage i in place."""
        self.w.put(f"solve(dense, MATRIX, {self.apart}, K{i + 1}, SLOPE, STATE, order, row_start, after_start, column)")

    def carried(self, edge: Edge, i: int) -> None:
        """Add rate (M - 1) s to stage i, s the sum of earlier stages in STATE."""
        lines = self.ends(edge) + self.own(_inertia(edge))
        for block, index in zip(edge.inertia, "ij", strict=True):
            for a, row in enumerate(block):
                place = f"K{i + 1} + {a}*NODES + i"
                for b, e in enumerate(row):
                    if e != 0:
                        term = f"rate*({show(e)})*load(dense, STATE + {b}*NODES + {index}, WIDTH)"
                        lines.append(f"store(dense, {place}, load(dense, {place}, WIDTH) + {term})")
        self.loop("for e in range(target.size):", lines)

    def _suffixed(self, suffix: str) -> list[sp.Symbol]:
        return [sp.Symbol(f"{name}{suffix}", real=True) for name in self.state]

    def _entries(
        self,
        block: Sequence[Sequence[sp.Expr]],
        slot: str,
        length: str,
        index: str,
        names: dict[sp.Symbol, sp.Symbol],
        sign: str = "- ",
    ) -> list[str]:
        """Statements that subtract the entries of a block from the matrix, or add them by another `sign`."""
        lines = []
        for a, row in enumerate(block):
            for b, e in enumerate(row):
                if e != 0:
                    place = f"MATRIX + {slot}[{a * len(self.state) + b}*{length} + {index}]"
                    value = show(e.xreplace(names))
                    value = f"({value})" if sign != "+ " and e.is_Add else value
                    lines.append(f"store(dense, {place}, load(dense, {place}, WIDTH) {sign}{value})")
        return lines

    # -- Rosenbrock -------------------------------------------------------------------------------------------

    def rosenbrock(self) -> None:
        """Linearise, factorise, and one solve for each stage."""
        w, m = self.w, self.method
        w.put(f"reach = h*{m.gamma!r}", "shift = 1.0/reach", f"rate = shift*{m.gamma!r}")
        self.linearise()
        self.factorise()
        for i in range(m.stages):
            self.stage(i)
        self.finish(m.b, [combine(row, self.stages(m.stages)) for row in m.e], m.a[-1])

    def stages(self, count: int) -> list[str]:
        """Names of the loaded stage values of one state variable."""
        return [f"k{j + 1}" for j in range(count)]

    def linearise(self) -> None:
        """Slopes, matrix shift - J and time slopes at the start."""
        w, body = self.w, self.w.blocks.linear
        size = len(self.state)
        w.put("# right-hand side, shift - J and time derivative at the start")
        w.timed("t", w.wanted([body]))
        self.loop("for k in range(DIMENSION):", ["store(dense, MATRIX + k, shift)"])
        self.loop("for k in range(DIMENSION, ENTRIES):", ["store(dense, MATRIX + k, 0.0*h)"])
        call, coded = self.node_call("node_linear", body)
        kinds = [f"f_{r}" for r in self.state] + [entry(r, c) for r in self.node.state for c in self.node.state]
        kinds += [f"ft_{r}" for r in self.state]
        lines = self.read("y") + self.own(body)
        if coded:
            left = [kind for kind, e in zip(kinds, body.results, strict=True) if not w.is_plain(e)]
            lines.append(f"{', '.join(left)} = {call}")
        named = [e if w.is_plain(e) else sp.Symbol(k, real=True) for k, e in zip(kinds, body.results, strict=True)]
        for c in range(size):
            lines.append(f"store(dense, SLOPE + {c}*NODES + i, {_lane(named[c])})")
            slope = named[size + size * size + c]
            if slope != 0:
                lines.append(f"store(dense, TIME_SLOPE + {c}*NODES + i, {_lane(slope)})")
        block = [named[size + a * size : size + (a + 1) * size] for a in range(size)]
        self.loop("for i in range(NODES):", lines + self._entries(block, "node_slot", "NODES", "i", {}))
        self.timed_rows = [c for c in range(size) if named[size + size * size + c] != 0]
        self.links("y", "SLOPE", jacobian=True)

    def stage(self, i: int) -> None:
        """State, slopes, right-hand side and solve of one stage."""
        w, m = self.w, self.method
        w.put(f"# stage {i + 1}")
        if i > 0:
            self.state_of(m.a[i], "", "")
            w.stage_time(i, first=1)
            self.slopes("STATE", "SLOPE")
        heavy = w.equations.edge if w.equations.inertial and i > 0 else None
        for c in range(len(self.state)):
            lines, text = [], f"load(dense, SLOPE + {c}*NODES + i, WIDTH)"
            if i > 0:
                lines += self.load_stages(c, m.big_c[i])
                total = f"({combine(m.big_c[i], self.stages(i))})"
                if heavy is not None:
                    lines.append(f"store(dense, STATE + {c}*NODES + i, {total})")
                text += f" + rate*{total}"
            if m.d[i] != 0.0 and c in self.timed_rows:
                text += term(m.d[i], f"load(dense, TIME_SLOPE + {c}*NODES + i, WIDTH)", tidy=False)
            self.loop("for i in range(NODES):", [*lines, f"store(dense, K{i + 1} + {c}*NODES + i, {text})"])
        if heavy is not None:
            self.carried(heavy, i)
        self.solve(i)

    def load_stages(self, c: int, row: Sequence[float]) -> list[str]:
        """Load the stage values of state variable c that a row of coefficients uses."""
        used = [j for j, weight in enumerate(row) if weight != 0.0]
        return [f"k{j + 1} = load(dense, K{j + 1} + {c}*NODES + i, WIDTH)" for j in used]

    def state_of(self, row: Sequence[float], before: str, behind: str) -> None:
        """The state of a stage: y + (sum a_j k_j), the sum scaled for explicit methods."""
        for c in range(len(self.state)):
            total = combine(row, self.stages(len(row)))
            lines = [*self.load_stages(c, row), f"old = load(y, {c}*NODES + i, WIDTH)"]
            self.loop(
                "for i in range(NODES):",
                [*lines, f"store(dense, STATE + {c}*NODES + i, old + {before}({total}){behind})"],
            )

    def finish(self, weights: Sequence[float], errors: list[str], last: Sequence[float], scale: str = "") -> None:
        """New state, dense output and error."""
        w, m = self.w, self.method
        w.put("# new state, error and dense output", "error = 0.0*h", "total = 0.0*h")
        for c in range(len(self.state)):
            count = len(m.c)
            lines = self.load_stages(c, [1.0] * count)
            lines += [f"old = load(y, {c}*NODES + i, WIDTH)"]
            lines += [
                f"new = old + {scale}({combine(weights, self.stages(len(weights)))})",
                f"store(y_new, {c}*NODES + i, new)",
            ]
            lines += [f"e = scaled({self.error(errors, scale)}, old, new, rtol, atol)"]
            lines += ["total = total + e", "error = maximum(error, e)"]
            for j, row in enumerate(m.dense):
                place = f"{j}*DIMENSION + {c}*NODES + i"
                lines.append("if DENSE:")
                value = combine(row, self.stages(len(row))) or "broadcast(0.0, WIDTH)"
                lines.append(f"    store(dense, {place}, {scale}({value}))")
            self.loop("for i in range(NODES):", lines)
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
        heavy = w.equations.edge if w.equations.inertial else None
        if heavy is not None:
            self.masses(heavy)
        for i in range(len(m.c)):
            w.put(f"# stage {i + 1}")
            if i > 0:
                self.state_of(m.a[i], "h*", "")
            w.stage_time(i, first=0)
            self.slopes("STATE" if i else "y", f"K{i + 1}")
            if heavy is not None:
                self.solve(i)
        self.finish(m.b, [combine(row, self.stages(len(row))) for row in m.e], (), "h*")


def _inertia(edge: Edge) -> Body:
    """The entries of a link's inertia as results."""
    return Body((), tuple(e for block in edge.inertia for row in block for e in row))


def _lane(e: sp.Expr) -> str:
    """The text of a value that is stored: numbers become lanes."""
    return f"broadcast({show(e)}, WIDTH)" if e.is_number else show(e)

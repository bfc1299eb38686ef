"""The mass matrix of a large network in loops: its entries from the links, its elimination by the program of the network.

What is solved, and why no system in M is solved where M is constant, says codegen/mass.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import sympy as sp

from ..integrators import Integrator
from ..program.printers import show
from .mass import Mass, momentum_slopes
from .places import Joint, Places, named
from .program import Program
from .step import StepWriter

__all__ = ["LoopMass"]

Block = tuple[tuple[sp.Expr, ...], ...]
SLOTS = ("here_slot", "there_slot")


class Loops(Protocol):
    """What a looped step offers to those that write about M."""

    w: StepWriter
    method: Integrator
    places: Places
    elimination: Program

    def loop(self, head: str, lines: Sequence[str]) -> None:
        """A for loop."""

    def link(self, joint: Joint, base: str, used: tuple[sp.Expr, ...], states: bool = True) -> list[str]:
        """The ends of a link, its weight, the parameters that `used` uses, and the states of both ends."""

    def links(self, base: str, out: str, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes and on demand to the matrix."""

    def add(self, place: str, value: str) -> str:
        """A statement that adds to a group of the workspace."""

    def entries(
        self,
        block: Block,
        slot: str,
        swap: dict[sp.Symbol, sp.Symbol],
        sign: str = "- ",
        matrix: str = "MATRIX",
    ) -> list[str]:
        """Statements that subtract the entries of a block from the matrix, or add them by another `sign`."""


class LoopMass:
    """What a looped step writes about M; where M is the identity, nothing but the solution of each stage."""

    def __init__(self, writer: Loops) -> None:
        self.writer, self.equations = writer, writer.w.equations
        self.inertial, self.constant = self.equations.inertial, Mass(self.equations).constant
        self.joints = [joint for joint in writer.places.joints if joint.edge.inertia]
        self.apart = ""

    def bases(self, before: int) -> dict[str, str]:
        """Where a Rosenbrock step keeps the rates at its start and M in a stage, behind so many vectors and the matrix."""
        if self.constant or not self.writer.method.implicit:
            return {}
        matrix = "ENTRIES" if self.writer.elimination.exact else "2*ENTRIES"
        start = f"DENSE_ROWS*DIMENSION + {before}*DIMENSION + {matrix}"
        return {"RATES": start, "MASS": f"{start} + DIMENSION"}

    # -- linear algebra ---------------------------------------------------------------------------------------

    def factorise(self, matrix: str = "MATRIX") -> None:
        """Factorise a matrix; STATE is lost."""
        self.apart = "0" if self.writer.elimination.exact else "ENTRIES"
        self.writer.w.put(
            f"factorise(dense, {matrix}, {self.apart}, STATE, order, place, row_start, after_start, column)"
        )

    def solve(self, vector: str, scratch: str, matrix: str = "MATRIX") -> None:
        """Solve in place for a vector; `scratch` and STATE are lost."""
        self.writer.w.put(
            f"solve(dense, {matrix}, {self.apart}, {vector}, {scratch}, STATE, order, row_start, after_start, column)"
        )

    def assemble(self, base: str, matrix: str) -> None:
        """M at a state, factorised; STATE is lost."""
        w = self.writer
        w.loop("for k in range(DIMENSION):", [f"store(dense, {matrix} + k, 1.0 + 0.0*h)"])
        w.loop("for k in range(DIMENSION, ENTRIES):", [f"store(dense, {matrix} + k, 0.0*h)"])
        for joint in self.joints:
            lines = self.link(joint, base)
            for block, slot in zip(joint.edge.inertia, SLOTS, strict=True):
                lines += w.entries(block, slot, named(joint), "+ ", matrix)
            w.loop(joint.head, lines)
        self.factorise(matrix)

    def link(self, joint: Joint, base: str) -> list[str]:
        """What the inertia of a link is made of."""
        used = tuple(e for block in joint.edge.inertia for row in block for e in row)
        return self.writer.link(joint, base, used, states=not self.constant)

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
        w.links("y", "SLOPE")
        self.assemble("y", "MASS")
        w.loop("for k in range(DIMENSION):", ["store(dense, RATES + k, load(dense, SLOPE + k, WIDTH))"])
        self.solve("RATES", "K1", "MASS")
        return True

    def rates_of_link(self, joint: Joint) -> list[str]:
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
        rates = tuple(tuple(sp.Symbol(f"g_{s.name}{suffix}", real=True) for s in node.state) for node, suffix in ends)
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

    def known(self, place: str, slope: str, total: str) -> tuple[list[str], str]:
        """Statements and the text of what a stage has on its right-hand side besides the inertia of the links.

        `total` is the sum of earlier stages; what M multiplies is left in STATE: that sum, or with it the rates.
        """
        text = f"{slope} + rate*{total}"
        if not self.inertial:
            return [], text
        if self.constant:
            return [f"store(dense, STATE + {place}, {total})"], text
        return [f"new = {text}", f"store(dense, STATE + {place}, new)"], "new"

    def carried(self, i: int) -> None:
        """Add (M - 1) s to stage i, s what `known` has left in STATE, times the rate where that is a sum of stages."""
        rate = "rate*" if self.constant else ""
        w = self.writer
        for joint in self.joints:
            lines = self.link(joint, "y")
            for block, index in zip(joint.edge.inertia, "ij", strict=True):
                for a, row in enumerate(block):
                    for b, e in enumerate(row):
                        if e != 0:
                            inertia = show(e.xreplace(named(joint)))
                            load = f"load(dense, STATE + {w.places.place(b, index)}, WIDTH)"
                            lines.append(w.add(f"K{i + 1} + {w.places.place(a)}", f"+ {rate}({inertia})*{load}"))
            w.loop(joint.head, lines)

"""The mass matrix of a large network in loops: its entries from the links, its elimination by the program of the network.

What is solved, and why no system in M is solved where M is constant, says codegen/mass.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import sympy as sp

from ..integrators import Integrator
from ..program.expressions import Expression, Load, Name, Product, Value, call, negative, plus
from ..program.lowering import lower
from ..program.statements import Do, Statement, let, store
from .mass import Block, Mass, momentum_slopes
from .places import Joint, Places, named, span
from .program import Program
from .step import StepWriter

__all__ = ["LoopMass", "filled"]

SLOTS = ("here_slot", "there_slot")


class Loops(Protocol):
    """What a looped step offers to those that write about M."""

    w: StepWriter
    method: Integrator
    places: Places
    elimination: Program

    def link(self, joint: Joint, base: str, used: tuple[sp.Expr, ...], states: bool = True) -> list[Statement]:
        """The ends of a link, its weight, the parameters that `used` uses, and the states of both ends."""

    def links(self, base: str, out: str, jacobian: bool = False) -> None:
        """Add what each link contributes to the slopes and on demand to the matrix."""

    def add(self, base: str, place: Expression, value: Expression) -> Statement:
        """A statement that adds to a group of the workspace."""

    def entries(
        self,
        block: Block,
        slot: str,
        swap: dict[sp.Symbol, sp.Symbol],
        change: Callable[[Expression], Expression] = negative,
        matrix: str = "MATRIX",
    ) -> list[Statement]:
        """Statements that subtract the entries of a block from the matrix, or add what another `change` makes of them."""


class LoopMass:
    """What a looped step writes about M; where M is the identity, nothing but the solution of each stage."""

    def __init__(self, writer: Loops) -> None:
        self.writer, self.equations = writer, writer.w.equations
        self.inertial, self.constant = self.equations.inertial, Mass(self.equations).constant
        self.joints = [joint for joint in writer.places.joints if joint.edge.inertia]

    def bases(self, before: int) -> dict[str, Expression]:
        """Where a Rosenbrock step keeps the rates at its start and M in a stage, behind so many vectors and the matrix."""
        if self.constant or not self.writer.method.implicit:
            return {}
        matrix = Name("ENTRIES") if self.writer.elimination.exact else 2 * Name("ENTRIES")
        start = Name("DENSE_ROWS") * "DIMENSION" + before * Name("DIMENSION") + matrix
        return {"RATES": start, "MASS": start + "DIMENSION"}

    # -- linear algebra ---------------------------------------------------------------------------------------

    @property
    def apart(self) -> Value:
        """How far behind the matrix its factors stand."""
        return 0 if self.writer.elimination.exact else "ENTRIES"

    def factorise(self, matrix: str = "MATRIX") -> None:
        """Factorise a matrix; STATE is lost."""
        arrays = ("order", "place", "row_start", "after_start", "column")
        self.writer.w.put(Do(call("factorise", "dense", matrix, self.apart, "STATE", *arrays)))

    def solve(self, vector: str, scratch: str, matrix: str = "MATRIX") -> None:
        """Solve in place for a vector; `scratch` and STATE are lost."""
        arrays = ("order", "row_start", "after_start", "column")
        self.writer.w.put(Do(call("solve", "dense", matrix, self.apart, vector, scratch, "STATE", *arrays)))

    def assemble(self, base: str, matrix: str) -> None:
        """M at a state, factorised; STATE is lost."""
        w = self.writer
        w.w.put(*filled(matrix, 1.0 + 0.0 * Name("h")))
        for joint in self.joints:
            found = self.link(joint, base)
            for block, slot in zip(joint.edge.inertia, SLOTS, strict=True):
                found += w.entries(block, slot, named(joint), lambda e: e, matrix)
            w.w.put(joint.span.over(found))
        self.factorise(matrix)

    def link(self, joint: Joint, base: str) -> list[Statement]:
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
        copied = store("dense", Name("RATES") + "k", Load("dense", Name("SLOPE") + "k"))
        w.w.put(span("k", "DIMENSION").over([copied]))
        self.solve("RATES", "K1", "MASS")
        return True

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
        w, rate = self.writer, [Name("rate")] if self.constant else []
        for joint in self.joints:
            found = self.link(joint, "y")
            for block, index in zip(joint.edge.inertia, "ij", strict=True):
                for a, row in enumerate(block):
                    for b, e in enumerate(row):
                        if e != 0:
                            load = Load("dense", plus(Name("STATE"), w.places.place(b, index)))
                            value = Product((*rate, lower(e.xreplace(named(joint))), load))
                            found.append(w.add(f"K{i + 1}", w.places.place(a), value))
            w.w.put(joint.span.over(found))


def filled(matrix: str, diagonal: Expression) -> list[Statement]:
    """A matrix with equal entries on its diagonal and zeros elsewhere."""
    parts = ((span("k", "DIMENSION"), diagonal), (span("k", "ENTRIES", "DIMENSION"), 0.0 * Name("h")))
    return [part.over([store("dense", Name(matrix) + "k", value)]) for part, value in parts]

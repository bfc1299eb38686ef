"""The equations of a node as straight-line blocks, sorted by how often they run.

Terms that contain only parameters run once a step. Terms that contain the time but no state run once for each stage
time. Terms that contain the state run once for each node and stage.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from synchain.models.mechanics.components import TIME, Node

from ..program.lowering import lower
from ..program.passes import Hoist, Names, StraightLine, real, share
from ..program.statements import Statement, let


@dataclass(frozen=True, slots=True)
class NodeBlocks:
    """The blocks of one kind of node."""

    # `constants`: assignments that run once a step. `timed`: assignments that run once for each stage time. `rhs`
    # computes d(state)/dt. `linear` computes d(state)/dt, the Jacobian row by row and the partial time derivative.
    # Results that are symbols or numbers need no code.

    constants: tuple[tuple[sp.Symbol, sp.Expr], ...]
    timed: tuple[tuple[sp.Symbol, sp.Expr], ...]
    rhs: StraightLine
    linear: StraightLine


def analyse(node: Node, names: Names, varied: Iterable[str] = ()) -> NodeBlocks:
    """Split the equations of a node. Parameters in `varied` have a value for each node and count as states."""
    size = len(node.state)
    entries = [e for row in node.jacobian() for e in row]
    outputs = [*node.rhs, *entries, *node.time_derivative()]
    moving = frozenset(node.state) | {real(name) for name in varied}
    # name the parts without a state: functions of time and parameters
    waves = Hoist(moving, names.fresh("hoisted_"), frozenset({TIME}))
    outputs = [waves.apply(e) for e in outputs]
    # name the parts without state and time, both in the remaining expressions and in the time terms
    steady = Hoist(moving | {TIME} | set(waves.table.values()), names.fresh("fixed_"))
    timed = {symbol: steady.apply(e) for e, symbol in waves.table.items() if e.has(TIME)}
    fixed = {symbol: e for e, symbol in waves.table.items() if not e.has(TIME)}
    fixed |= {symbol: e for e, symbol in steady.table.items()}
    # short names: p0, p1, … for constants, w0, w1, … for time terms
    short = dict(zip(fixed, names.fresh("p"), strict=False)) | dict(zip(timed, names.fresh("w"), strict=False))
    inner = names.fresh("z")
    rhs = share([e.xreplace(short) for e in outputs[:size]], inner)
    linear = share([e.xreplace(short) for e in outputs], inner)
    return NodeBlocks(
        constants=tuple((short[s], e) for s, e in fixed.items()),
        timed=tuple((short[s], e.xreplace(short)) for s, e in timed.items()),
        rhs=rhs,
        linear=linear,
    )


def assigned(body: StraightLine) -> list[Statement]:
    return [let(s.name, lower(e)) for s, e in body.statements]

"""From expressions to blocks of statements: what depends on parameters alone, on time, and on the state is parted.

A block of the first kind runs once a step, one of the second once for each stage time, the third once for each node
and stage.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import sympy as sp

from synchain.models.mechanics.components import TIME, Node

from ..program.passes import Hoist, Names, StraightLine, real, share


@dataclass(frozen=True, slots=True)
class NodeBlocks:
    """One node, sorted by how often its parts must run.

    `constants` and `timed` are statements; `rhs` gives d(state)/dt; `linear` gives rhs, then the entries of the Jacobian
    row by row, then the partial time derivative.  Results may be plain symbols or numbers: those need no code.
    """

    constants: tuple[tuple[sp.Symbol, sp.Expr], ...]
    timed: tuple[tuple[sp.Symbol, sp.Expr], ...]
    rhs: StraightLine
    linear: StraightLine


def analyse(node: Node, names: Names, varied: Iterable[str] = ()) -> NodeBlocks:
    """Part the equations of a node into constants, time terms and state terms.

    What depends on parameters with a value for each node, `varied`, is computed with the state.
    """
    size = len(node.state)
    entries = [e for row in node.jacobian() for e in row]
    outputs = [*node.rhs, *entries, *node.time_derivative()]
    moving = frozenset(node.state) | {real(name) for name in varied}
    waves = Hoist(moving, names.fresh("hoisted_"), frozenset({TIME}))
    outputs = [waves.apply(e) for e in outputs]
    steady = Hoist(moving | {TIME} | set(waves.table.values()), names.fresh("fixed_"))
    timed: dict[sp.Symbol, sp.Expr] = {}
    fixed: dict[sp.Symbol, sp.Expr] = {}
    for e, symbol in waves.table.items():
        (timed if e.has(TIME) else fixed)[symbol] = e
    timed = {symbol: steady.apply(e) for symbol, e in timed.items()}
    constants = {**fixed, **{s: e for e, s in steady.table.items()}}
    rename = _number(list(constants), names.fresh("p")) | _number(list(timed), names.fresh("w"))
    inner = names.fresh("z")
    rhs = share([e.xreplace(rename) for e in outputs[:size]], inner)
    linear = share([e.xreplace(rename) for e in outputs], inner)
    return NodeBlocks(
        constants=tuple((rename[s], e) for s, e in constants.items()),
        timed=tuple((rename[s], e.xreplace(rename)) for s, e in timed.items()),
        rhs=rhs,
        linear=linear,
    )


def _number(symbols: list[sp.Symbol], supply: Iterator[sp.Symbol]) -> dict[sp.Symbol, sp.Symbol]:
    """New names in one numbering for symbols that came from two tables."""
    return {symbol: next(supply) for symbol in symbols}

"""The statements of a step that linearise the equations at its start."""

from __future__ import annotations

import sympy as sp

from ..program.expressions import ZERO, Call, Expression, Name, call, plus
from ..program.lowering import lower
from ..program.statements import Assign, let
from .step import StepWriter

__all__ = ["entry", "linearise", "write_bound"]


def linearise(w: StepWriter) -> list[dict[str, sp.Expr]]:
    """Write right-hand side and Jacobian at the start, and the time derivative where the method wants it.

    Returns what stands for each, by node.
    """
    eq = w.equations
    implicit = w.method.implicit
    w.note(f"right-hand side{', Jacobian and time derivative' if implicit else ' and Jacobian'} at the start")
    function = "node_linear" if implicit else "node_local"
    w.timed("t", w.wanted([w.first_of(blocks) for blocks in w.kinds]))
    kept = keep_times(w)
    own: list[dict[str, sp.Expr]] = []
    for i in range(eq.n):
        states, body = eq.node_at(i).state, w.first_of(w.of(i))
        kinds = [f"f_{r}" for r in states] + [entry(r, c) for r in states for c in states]
        kinds += [f"ft_{r}" for r in states] if implicit else []
        coded = [e for e in body.results if not w.is_plain(e)]
        named = {kind: sp.Symbol(f"{kind}_{i + 1}", real=True) for kind in kinds}
        at = w.at(i, "")
        plain = {kind: e.xreplace(at) for kind, e in zip(kinds, body.results, strict=True) if w.is_plain(e)}
        if coded:
            left = tuple(named[kind].name for kind in kinds if kind not in plain)
            w.put(Assign(left, w.call(function, body, coded, i, "")))
        w.put(*(let(named[kind].name, lower(plain[kind])) for kind in kinds[: len(states)] if kind in plain))
        own.append({kind: plain.get(kind, named[kind]).xreplace(kept) for kind in kinds})
    w.links("", "f_")
    return own


def keep_times(w: StepWriter) -> dict[sp.Symbol, sp.Symbol]:
    """Keep time terms that stand for themselves in the linearisation, where stages give these names other values."""
    plain = {s for blocks in w.kinds for e in w.first_of(blocks).results if w.is_plain(e) for s in e.free_symbols}
    moved = w.wanted([blocks.rhs for blocks in w.kinds]) & plain
    kept = {s: sp.Symbol(f"at_{s.name}", real=True) for s in sorted(moved, key=lambda s: s.name)}
    w.put(*(let(there.name, here.name) for here, there in kept.items()))
    return kept


def entry(r: sp.Symbol, c: sp.Symbol) -> str:
    """The name of d(rhs of r)/dc: j_vx, and j_speed_by_place where letters run together."""
    return f"j_{r.name}{c.name}" if len(r.name) == len(c.name) == 1 else f"j_{r.name}_by_{c.name}"


def write_bound(w: StepWriter, own: list[dict[str, sp.Expr]]) -> None:
    """Write `bound`, above the absolute value of the eigenvalues at the start of the step.

    In second-order form (rates of positions are the velocities) an eigenvalue solves z**2 = z D + K, hence
    |z| <= |D| + sqrt|K| in any norm; otherwise the largest row sum is taken.
    """
    eq = w.equations
    w.mass.refuse("a step that bounds the eigenvalues")
    first_kind = eq.nodes[0]
    half = len(first_kind.state) // 2
    positions_move = len(first_kind.state) % 2 == 0 and first_kind.rhs[:half] == first_kind.state[half:]
    second_order = positions_move and not eq.mixed
    slow: list[list[Expression]] = []
    fast: list[list[Expression]] = []
    links, places, rows = list(eq.link_jacobian()), eq.places, []
    for i in range(eq.n):
        state = eq.node_at(i).state
        first = half if second_order else 0
        rows += [(places[i][a], i, a, r) for a, r in enumerate(state[first:], start=first)]
    for row, i, _, r in sorted(rows, key=lambda found: found[0]):
        state = eq.node_at(i).state
        parts = {b: [size(own[i][entry(r, c)])] for b, c in enumerate(state)}
        for (at, column), e in links:
            if at == row:
                parts[0 if eq.mixed else column // eq.n].append(size(e))
        columns = list(parts.items())
        slow.append([t for b, sizes in columns if second_order and b < half for t in sizes if t != ZERO])
        fast.append([t for b, sizes in columns if not second_order or b >= half for t in sizes if t != ZERO])
    w.note("a bound of the eigenvalues")
    w.let("bound", largest(fast))
    if any(slow):
        w.let("bound", Name("bound") + call("sqrt", largest(slow)))


def size(e: sp.Expr) -> Expression:
    """The absolute value."""
    return lower(sp.Abs(e)) if e.is_number else call("absolute", lower(e))


def largest(rows: list[list[Expression]]) -> Expression:
    """The largest of some sums, zero without any; equal ones count once."""
    first, *others = list(dict.fromkeys(plus(*row) for row in rows if row)) or [ZERO]
    if not others and not any(isinstance(part, Call) for part in first.walk()):
        return call("broadcast", first, "WIDTH")
    found = first
    for other in others:
        found = call("maximum", found, other)
    return found

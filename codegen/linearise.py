"""The statements of a step that linearise the equations at its start."""

from __future__ import annotations

import sympy as sp

from .printer import show
from .step import StepWriter

__all__ = ["entry", "linearise", "write_bound"]


def linearise(w: StepWriter) -> list[dict[str, sp.Expr]]:
    """Write right-hand side and Jacobian at the start, and the time derivative where the method wants it.

    Returns what stands for each, by node.
    """
    eq, body = w.equations, w.first_body
    implicit = body is w.blocks.linear
    state = [s.name for s in eq.node.state]
    kinds = [f"f_{r}" for r in state] + [entry(r, c) for r in eq.node.state for c in eq.node.state]
    kinds += [f"ft_{r}" for r in state] if implicit else []
    coded = [e for e in body.results if not w.is_plain(e)]
    w.put(f"# right-hand side{', Jacobian and time derivative' if implicit else ' and Jacobian'} at the start")
    function = "node_linear" if implicit else "node_local"
    w.timed("t", w.wanted(body.results, body))
    own: list[dict[str, sp.Expr]] = []
    for i in range(eq.n):
        at = {s: sp.Symbol(f"{s.name}_{i + 1}", real=True) for s in eq.node.state}
        named = {kind: sp.Symbol(f"{kind}_{i + 1}", real=True) for kind in kinds}
        plain = {kind: e.xreplace(at) for kind, e in zip(kinds, body.results, strict=True) if w.is_plain(e)}
        if coded:
            left = ", ".join(named[kind].name for kind in kinds if kind not in plain)
            w.put(f"{left} = {w.call(function, body, coded, i, '')}")
        w.put(*(f"{named[kind]} = {show(plain[kind])}" for kind in kinds[: len(state)] if kind in plain))
        own.append({kind: plain.get(kind, named[kind]) for kind in kinds})
    w.links("", "f_")
    return own


def entry(r: sp.Symbol, c: sp.Symbol) -> str:
    """The name of d(rhs of r)/dc: j_vx, and j_speed_by_place where letters run together."""
    return f"j_{r.name}{c.name}" if len(r.name) == len(c.name) == 1 else f"j_{r.name}_by_{c.name}"


def write_bound(w: StepWriter, own: list[dict[str, sp.Expr]]) -> None:
    """Write `bound`, above the absolute value of the eigenvalues at the start of the step.

    In second-order form (rates of positions are the velocities) an eigenvalue solves z**2 = z D + K, hence
    |z| <= |D| + sqrt|K| in any norm; otherwise the largest row sum is taken.
    """
    state, n = w.equations.node.state, w.equations.n
    half = len(state) // 2
    second_order = len(state) % 2 == 0 and tuple(w.equations.node.rhs[:half]) == tuple(state[half:])
    slow: list[list[str]] = []
    fast: list[list[str]] = []
    links = list(w.equations.link_jacobian())
    for a, r in enumerate(state[half:] if second_order else state, start=half if second_order else 0):
        for i in range(n):
            parts = {b: [size(own[i][entry(r, c)])] for b, c in enumerate(state)}
            for (row, column), e in links:
                if row == a * n + i:
                    parts[column // n].append(size(e))
            columns = list(parts.items())
            slow.append([t for b, texts in columns if second_order and b < half for t in texts if t])
            fast.append([t for b, texts in columns if not second_order or b >= half for t in texts if t])
    w.put("# a bound of the eigenvalues")
    damping, stiffness = largest(fast), largest(slow)
    w.put(f"bound = {damping or 'broadcast(0.0, WIDTH)'}")
    if stiffness:
        w.put(f"bound = bound + sqrt({stiffness})")


def size(e: sp.Expr) -> str:
    """The text of an absolute value; empty for zero."""
    if e == 0:
        return ""
    return show(sp.Abs(e)) if e.is_number else f"absolute({show(e)})"


def largest(rows: list[list[str]]) -> str:
    """The text of the largest of some sums; equal ones once."""
    sums = list(dict.fromkeys(" + ".join(row) for row in rows if row))
    if not sums:
        return ""
    text = sums[0] if "(" in "".join(sums[:1]) or len(sums) > 1 else f"broadcast({sums[0]}, WIDTH)"
    for other in sums[1:]:
        text = f"maximum({text}, {other})"
    return text

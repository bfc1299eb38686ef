"""The text that decides between stick and slip: what a kernel must know of each contact at a state."""

from __future__ import annotations

import sympy as sp

from synchain.models.contact import SLIP
from synchain.models.equations import TIME, Equations

from .blocks import Names
from .printer import show

__all__ = ["write_pushes"]

HEAD = '''
@njit(error_model='numpy', forceinline=True)
def pushes(t, y, p, out):
    """For each contact: sliding velocity, ground's velocity, accelerations under static friction both ways, in slip."""
'''.strip()


def write_pushes(equations: Equations, names: Names) -> str:
    """The function `pushes`: writes six groups of NODES numbers, in the order of its docstring."""
    contact, n = equations.node.contact, equations.n
    if contact is None:
        return ""
    columns: list[list[sp.Expr]] = [[] for _ in range(6)]
    for i in range(n):
        at = equations.at_node(i)
        here = {sp.Symbol(f"{equations.node.state[1].name}_{i + 1}", real=True): contact.speed.xreplace(at)}
        links = _links(equations, i).xreplace(here)
        columns[0].append(contact.sliding.xreplace(at))
        columns[1].append(contact.speed.xreplace(at))
        forces = (contact.up, contact.down, contact.pushed, contact.pulled)
        for column, e in zip(columns[2:], forces, strict=True):
            column.append(e.xreplace(at) + links)
    results = [e for column in columns for e in column]
    statements, reduced = sp.cse(results, symbols=names.fresh("z"), order="canonical")
    used = set().union(*(e.free_symbols for e in reduced), *(e.free_symbols for _, e in statements))
    lines = [f"{name} = load(y, {k}, WIDTH)" for k, name in enumerate(equations.state) if _in(name, used)]
    lines += [
        f"{name} = load(p, {len(equations.state) + k}, WIDTH)"
        for k, name in enumerate(equations.parameters)
        if _in(name, used)
    ]
    lines += [f"{s} = {show(e)}" for s, e in statements]
    for k, e in enumerate(reduced):
        text = show(e.xreplace({TIME: sp.Symbol("t")}))
        lines.append(f"store(out, {k}, {f'broadcast({text}, WIDTH)' if e.is_number else text})")
    return "\n".join([HEAD, *(f"    {line}" for line in lines)])


def _links(equations: Equations, i: int) -> sp.Expr:
    """The force of the links on node i as if it slipped."""
    if equations.edge is None:
        return sp.S.Zero
    mode = sp.Symbol(f"{SLIP.name}_{i + 1}", real=True)
    total = sp.Add(
        *(equations.edge.rhs[1].xreplace(equations.at_link(link)) for link in equations.links if link[0] == i)
    )
    return total.xreplace({mode: sp.S.One})


def _in(name: str, used: set[sp.Symbol]) -> bool:
    return sp.Symbol(name, real=True) in used

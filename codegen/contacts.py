"""The text that decides between stick and slip: what a kernel must know of each contact at a state."""

from __future__ import annotations

import sympy as sp

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
    contacts = [found for i in range(equations.n) if (found := equations.contact_at(i)) is not None]
    if not contacts:
        return ""
    rows = [(c.sliding, c.speed, c.up, c.down, c.pushed, c.pulled) for c in contacts]
    results = [e for column in zip(*rows, strict=True) for e in column]
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


def _in(name: str, used: set[sp.Symbol]) -> bool:
    return sp.Symbol(name, real=True) in used

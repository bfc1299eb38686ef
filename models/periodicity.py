"""After which time the right-hand side of a driven network repeats itself."""

from __future__ import annotations

import sympy as sp

from .equations import TIME, Equations

__all__ = ["angular_frequency"]


def angular_frequency(equations: Equations) -> sp.Expr | None:
    """The angular frequency of the drive: the right-hand side has the period 2 pi over its absolute value.

    None where time does not occur, or occurs other than in sines and cosines whose frequencies are whole multiples of one
    among them, or where nodes have frequencies of their own.  Time may also not occur in the coupling.
    """
    found: set[sp.Expr] = set()
    for e in (e for node in equations.nodes for e in node.rhs):
        rest = e.replace(lambda a: isinstance(a, sp.sin | sp.cos) and a.has(TIME), lambda a: _note(a, found))
        if rest.has(TIME):
            return None
    if any(e.has(TIME) for edge in equations.edges for e in edge.rhs):
        return None
    own = {sp.Symbol(name, real=True) for name in equations.varied}
    if any(frequency.free_symbols & own for frequency in found):
        return None
    for candidate in sorted(found, key=sp.default_sort_key):
        if all(sp.cancel(other / candidate).is_Integer for other in found):
            return candidate
    return None


def _note(wave: sp.Expr, found: set[sp.Expr]) -> sp.Expr:
    """Collect the frequency of a sine or cosine of a t + b; anything else is left in place."""
    slope = sp.diff(wave.args[0], TIME)
    if slope.has(TIME):
        return wave
    found.add(slope)
    return sp.Symbol("wave")

"""Which names a kernel uses for the user's symbols: their own, unless the kernel needs that word itself."""

from __future__ import annotations

import builtins
import keyword

import sympy as sp

from synchain.models.equations import TIME, Edge, Equations, Node

from . import elementary, lanes

__all__ = ["RESERVED", "tidy"]

RESERVED = frozenset(
    {"t", "h", "y", "y_new", "dense", "shift", "reach", "rate", "error", "size", "rtol", "atol", "node", "node_linear",
     "step", "section", "theta", "now", "njit", "p", "drive"}
    | set(keyword.kwlist) | set(dir(builtins)) | set(elementary.__all__) | set(lanes.__all__)
)  # fmt: skip
"""Words of the generated code; a user's symbol of that name gets an underscore behind it."""

PREFIXES = (
    "m_",
    "l_",
    "inv_",
    "k1",
    "k2",
    "k3",
    "k4",
    "k5",
    "k6",
    "k7",
    "k8",
    "k9",
    "u_",
    "f_",
    "r_",
    "at_",
    "ft_",
    "n_",
)


def tidy(equations: Equations) -> Equations:
    """Return the same equations with symbols that the generated code can use as names."""
    node, edge = equations.node, equations.edge
    symbols = {*node.state, *node.parameters}
    if edge is not None:
        symbols |= {*edge.here, *edge.there, *edge.parameters, edge.weight}
    taken = {s.name for s in symbols}
    swap = {s: sp.Symbol(_free(s.name, taken), real=True) for s in sorted(symbols, key=str) if _clashes(s.name)}
    swap = {s: new for s, new in swap.items() if s != TIME}
    if not swap:
        return equations
    node = Node(_all(node.state, swap), _all(node.rhs, swap), _all(node.parameters, swap))
    if edge is not None:
        edge = Edge(
            _all(edge.here, swap), _all(edge.there, swap), edge.weight.xreplace(swap),
            _all(edge.rhs, swap), _all(edge.parameters, swap),
        )  # fmt: skip
    return Equations(node, edge, equations.n, equations.links)


def _all(expressions: tuple, swap: dict) -> tuple:
    return tuple(e.xreplace(swap) for e in expressions)


def _clashes(name: str) -> bool:
    return name in RESERVED or not name.isidentifier() or name.startswith(PREFIXES) or name.startswith("__")


def _free(name: str, taken: set[str]) -> str:
    plain = "".join(c if c.isalnum() or c == "_" else "_" for c in name) or "symbol"
    plain = f"s_{plain}" if plain[0].isdigit() or plain[0] == "_" else plain
    while plain in taken or _clashes(plain):
        plain += "_"
        if plain.startswith(PREFIXES):
            plain = f"user_{plain}"
    return plain

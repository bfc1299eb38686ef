"""Which names a kernel uses for the user's symbols: their own, unless the kernel needs that word itself."""

from __future__ import annotations

import builtins
import keyword
import re
import unicodedata

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.passes import real
from ..simd import elementary, lanes, special

NAMES = (
    "target", "source", "node_slot", "here_slot", "there_slot", "order", "place", "row_start", "after_start", "column",
    "where",
)  # fmt: skip
"""What the arrays of a program are called, in the order in which a kernel takes them."""

RESERVED = frozenset(
    {"i", "j", "k", "e", "old", "new", "graph", "weights", "pair", "factorise", "solve", "slopes", "NODES", "DIMENSION",
     "DENSE_ROWS", "FIELD",
     "ENTRIES", "STATE", "SLOPE", "TIME_SLOPE", "MATRIX", *(f"K{i}" for i in range(1, 32)),
     "MASS", "RATES", "where", "t", "h", "y", "y_new", "dense",
     "shift", "reach", "rate", "error", "size", "rtol", "atol", "node", "node_linear",
     "bank", "estimate", "step", "section", "theta", "now",
     "njit", "p", "drive", "scaled", "inside", "total", "e3", "e5", "np", "math",
     "WIDTH", "DENSE", "LANES", "MODE_SIZE", "STRENGTHS", "SHARED", "shared", "steady", "moving", "bent", "lag",
     "strengths", "which", "mode_step", "march", "pushes", "out", "network", "release",
     "after", "modes", "dims", "slope", "values"}
    | set(NAMES)
    | set(keyword.kwlist) | set(dir(builtins)) | set(elementary.__all__) | set(lanes.__all__) | set(special.__all__)
)  # fmt: skip
"""Words of the generated code; a user's symbol of that name gets an underscore behind it."""

PREFIXES = (
    "m_", "l_", "pivot_", "inv_", "k1", "k2", "k3", "k4", "k5", "k6", "k7", "k8", "k9", "u_", "f_", "r_", "at_", "ft_", "n_", "j_",
    "e_", "_", "along_", "value_", "bend_", "steady_", "g_", "mass_", "sum_", *(f"node{k}" for k in range(2, 10)),
)  # fmt: skip

SUFFIXES = ("_here", "_there", "_first")

NUMBERED = re.compile(r"_\d+$")
"""The end of a name that numbers a node: x_1 is x of the first one."""


def tidy(equations: Equations) -> Equations:
    """Return the same equations with symbols that the generated code can use as names."""
    nodes, edges = equations.nodes, equations.edges
    weights = {edge.weight for edge in edges}
    own = {s for node in nodes for s in (*node.state, *node.parameters)}
    states = {s for node in nodes for s in node.state}
    shown = own | weights | {s for edge in edges for s in edge.parameters}
    taken = {s.name for s in shown} | {s.name for edge in edges for s in (*edge.here, *edge.there)}
    swap: dict[sp.Symbol, sp.Symbol] = {}
    for s in sorted(shown, key=str):
        numbered = s in states or s.name in equations.differing
        if _clashes(s.name) or (numbered and NUMBERED.search(s.name)):
            name = _free(s.name, taken)
            taken.add(name)
            swap[s] = real(name)
    in_links = dict(swap)  # within an edge this name means the weight
    for weight in sorted(weights & own, key=str):
        in_links[weight] = real(_free(f"{weight.name}_of_link", taken))
    if not in_links:
        return equations
    return equations.map_templates(
        lambda node: node.map(lambda e: e.xreplace(swap)), lambda edge: edge.map(lambda e: e.xreplace(in_links)), swap
    )


def _clashes(name: str) -> bool:
    """True for words of the generated code and for names that Python would not read as they are written."""
    written = name.isidentifier() and unicodedata.normalize("NFKC", name) == name
    return name in RESERVED or not written or name.startswith(PREFIXES) or name.endswith(SUFFIXES)


def _free(name: str, taken: set[str]) -> str:
    plain = "".join(c if f"a{c}".isidentifier() else "_" for c in unicodedata.normalize("NFKC", name)) or "symbol"
    if not plain.isidentifier() or plain.startswith("_"):
        plain = f"s_{plain}"
    elif f"{plain}_".startswith(PREFIXES):
        plain = f"user_{plain}"
    while plain in taken or _clashes(plain) or NUMBERED.search(plain):
        plain += "_"
    return plain

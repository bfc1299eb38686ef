"""Rename the user's symbols for a kernel, if generated code or Python uses the same name."""

from __future__ import annotations

import builtins
import keyword
import re
import unicodedata

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.passes import real
from ..simd import elementary, lanes, special

# The arrays of a sparse plan, in the order in which a kernel takes them.
NAMES = (
    "target", "source", "node_slot", "here_slot", "there_slot", "order", "place", "row_start", "after_start", "column",
    "where",
)  # fmt: skip

# Names that generated code uses; an underscore is appended to a user's symbol of the same name.
RESERVED = frozenset(
    {"i", "j", "k", "e", "old", "new", "graph", "weights", "pair", "factorise", "solve", "slopes", "NODES", "DIMENSION",
     "DENSE_ROWS", "FIELD",
     "ENTRIES", "STATE", "SLOPE", "TIME_SLOPE", "MATRIX", *(f"K{i}" for i in range(1, 32)),
     "MASS", "RATES", "where", "t", "h", "y", "y_new", "dense",
     "shift", "reach", "rate", "error", "size", "rtol", "atol", "node", "node_linear",
     "bank", "estimate", "step", "section", "theta", "now",
     "njit", "p", "drive", "scaled", "inside", "total", "e3", "e5", "np", "math",
     "WIDTH", "DENSE", "LANES", "MODE_SIZE", "STRENGTHS", "SHARED", "shared", "steady", "moving", "bent", "lag",
     "strengths", "which", "mode_step", "march", "pushes", "out", "network", "saltate", "row", "before",
     "after", "modes", "dims", "slope", "values", "strike"}
    | set(NAMES)
    | set(keyword.kwlist) | set(dir(builtins)) | set(elementary.__all__) | set(lanes.__all__) | set(special.__all__)
)  # fmt: skip

# Prefixes of names that steps form from names of states: k2_x_1, u_x_1, j_vx_1, …
PREFIXES = (
    "m_", "l_", "pivot_", "inv_", "k1", "k2", "k3", "k4", "k5", "k6", "k7", "k8", "k9", "u_", "f_", "r_", "at_", "ft_", "n_", "j_",
    "e_", "_", "along_", "value_", "bend_", "steady_", "g_", "mass_", "sum_", *(f"node{k}" for k in range(2, 10)),
)  # fmt: skip

# Suffixes of states at the target and at the sources of a link, and at the first node.
SUFFIXES = ("_here", "_there", "_beyond", "_first")
NUMBERED = re.compile(r"_\d+$")  # matches a suffix that numbers a node: x_1 is the state x of the first node


def tidy(equations: Equations) -> Equations:
    """Return the same equations with symbols that the generated code can use as names."""
    nodes, edges = equations.nodes, equations.edges
    states = {s for node in nodes for s in node.state}
    of_nodes = states | {s for node in nodes for s in node.parameters}
    weights = {edge.weight for edge in edges}
    shown = of_nodes | weights | {s for edge in edges for s in edge.parameters}
    taken = {s.name for s in shown} | {s.name for edge in edges for end in edge.end_states for s in end}
    swap: dict[sp.Symbol, sp.Symbol] = {}
    for s in sorted(shown, key=str):
        # a user's symbol x_1 would clash with state x of the first node
        numbered = s in states or s.name in equations.differing
        if _clashes(s.name) or (numbered and NUMBERED.search(s.name)):
            swap[s] = real(_free(s.name, taken))
            taken.add(swap[s].name)
    # if a link's weight has the name of a node's symbol, rename the weight, in links only
    in_links = swap | {s: real(_free(f"{s.name}_of_link", taken)) for s in sorted(weights & of_nodes, key=str)}
    if not in_links:
        return equations
    return equations.map_templates(
        lambda node: node.map(lambda e: e.xreplace(swap)), lambda edge: edge.map(lambda e: e.xreplace(in_links)), swap
    )


def _clashes(name: str) -> bool:
    """Return True for names of generated code, and for names that Python cannot read or would normalise."""
    readable = name.isidentifier() and unicodedata.normalize("NFKC", name) == name
    return name in RESERVED or not readable or name.startswith(PREFIXES) or name.endswith(SUFFIXES)


def _free(name: str, taken: set[str]) -> str:
    """Return a similar name that neither clashes nor is taken."""
    plain = "".join(c if f"a{c}".isidentifier() else "_" for c in unicodedata.normalize("NFKC", name)) or "symbol"
    if not plain.isidentifier() or plain.startswith("_"):
        plain = f"s_{plain}"
    elif f"{plain}_".startswith(PREFIXES):
        plain = f"user_{plain}"
    while plain in taken or _clashes(plain) or NUMBERED.search(plain):
        plain += "_"
    return plain

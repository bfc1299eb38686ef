"""Oscillators, links, graphs, scenes and lists of shipped models that tests of several rooms share."""

from __future__ import annotations

import os
from fractions import Fraction

import numpy as np
import sympy as sp
from parts import is_lagrangian

from synchain import Field, Parameter, Rates, Scene
from synchain.graphs import Topology, chain, from_edges, from_matrix
from synchain.models.definitions.definition import COUPLING, OSCILLATOR
from synchain.models.graphs.families import family
from synchain.models.graphs.families import names as families
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.inputs.plugin_files import load, names
from synchain.models.mechanics.oscillator import Coordinate, FieldModel, LagrangianModel, Oscillator

FUZZ_SECONDS = float(os.environ.get("SYNCHAIN_FUZZ_SECONDS", "0"))
"""How long each fuzz test draws models or files; 0 draws a fixed number of them."""


def real(name: str) -> sp.Symbol:
    return sp.Symbol(name, real=True)


# -- shipped models ------------------------------------------------------------------------------------------

LAGRANGIAN = [name for name in names(OSCILLATOR) if is_lagrangian(name)]
FORCES = [name for name in names(COUPLING) if not load(COUPLING, name).kinetic]
"""Couplings without inertia; tests/models/dynamics/test_inertia.py has the others."""

CLOSED = [name for name in families() if family(name).spectrum]
"""Families of graphs with a closed form of their spectrum."""

UNDIRECTED = [name for name in families() if not family(name).directed]

# -- graphs --------------------------------------------------------------------------------------------------

WEIGHTED = from_matrix([["-5/2", 2, "1/2"], [2, -2, 0], ["1/2", 0, "-1/2"]], "weighted")
UNEVEN = from_edges([(0, 1, "1/2"), (1, 2, 3), (2, 3), (3, 0), (0, 2, "2/7")])


def nameless_one_way_ring(n: int) -> Topology:
    """Return the links of `one_way_ring` under a name that has no closed form."""
    return Topology("one-way ring", n, tuple((i, (i + 1) % n, Fraction(1)) for i in range(n)))


def floats(graph: Topology) -> np.ndarray:
    """Return the matrix (n, n) of a graph."""
    return np.array([[float(x) for x in row] for row in graph.rows])


# -- nodes, links and scenes ---------------------------------------------------------------------------------

VAN_DER_POL = Field({"x": "v", "v": "mu*(1 - x**2)*v - x"}, parameters={"mu": 1.0})

PHASE = Field({"theta": "omega"}, parameters={"omega": 0})
LAGGING = Rates({"theta": "K*W*sin(theta_j - theta_i - lag)"}, {"K": 1, "lag": 0})
"""Kuramoto's coupling with a lag."""

ROTOR = Oscillator("phase", FrozenDict({"p": Parameter(0.3, "1", "frequency")}), FieldModel(("theta",), (real("p"),)))

_U, _V = real("u"), real("v")
BODY = Oscillator(
    "body",
    FrozenDict({"m": Parameter(1.0, "1", "mass", positive=True)}),
    LagrangianModel((Coordinate("x", "u"), Coordinate("y", "v")), real("m") * (_U**2 + _V**2) / 2, sp.S.Zero, (sp.S.Zero,) * 2),
)  # fmt: skip
"""A free body in the plane."""

PAIR = Scene(oscillator="harmonic", topology=chain(2), transient=1, window=1)
"""Two harmonic oscillators for two periods: kernels and runs that cost least."""


# -- trees of values -----------------------------------------------------------------------------------------


def paths(tree: object, at: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    """Return the keys that lead to each value of nested tables and lists."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [at, *(path for key, value in items for path in paths(value, (*at, key)))]

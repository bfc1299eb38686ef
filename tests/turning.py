"""Networks of which some states are angles."""

from __future__ import annotations

import functools
from fractions import Fraction

import numpy as np
import sympy as sp
from samples import real

import synchain as sc
from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations, Layer
from synchain.models.mechanics.components import Edge, Node

TURNS = 10_000


@functools.cache
def network(name: str) -> Equations:
    """Phases, pendulums, or pendulums in a ring with oscillators whose x is no angle."""
    if name == "phases":
        push = sc.Rates({"q": "W*(sin(q_j - q_i) + cos(q_j/2))"})
        return sc.Scene(sc.Field({"q": "1 + sin(q)/2"}), push, sc.graphs.ring(4)).equations
    x, v, x_there, v_there, w = real("x", "v", "x_there", "v_there", "weight")
    turning = Node((x, v), (v + 3 * sp.sin(x), -sp.sin(x) / 1000), ())  # so that x has larger errors than v
    swinging = Node((x, v), (v, -x / 1000), ())
    torsion = Edge((x, v), (x_there, v_there), w, (sp.S.Zero, w * sp.sin(x_there - x) / 1000), ())
    friction = Edge((x, v), (x_there, v_there), w, (sp.S.Zero, w * (v_there - v) / 1000), ())
    links = tuple(sorted((*ends, Fraction(1)) for i in range(4) for ends in ((i, (i + 1) % 4), ((i + 1) % 4, i))))
    if name == "pendulums":
        return Equations.of_equal_nodes(turning, torsion, 4, links)
    edges = tuple(((a, b), friction) for a in (0, 1) for b in (0, 1))
    return Equations((turning, swinging), (0, 1, 0, 1), (Layer(edges, links),))


NETWORKS = ("phases", "pendulums", "mixed")


def starts(equations: Equations) -> tuple[np.ndarray, np.ndarray]:
    """A state whose angles are larger than their periods, and the same one many turns further."""
    dice, periods = np.random.default_rng(5), periods_of_states(equations)
    turns = np.array([period or 0.0 for period in periods])
    near = dice.uniform(0.3, 0.9, equations.dimension) + turns
    assert 0 < np.count_nonzero(turns) <= equations.dimension
    return near, near + TURNS * turns

r"""
Symmetric nodes synchronise from afar
=====================================

Nicosia, Valencia, Chavez, Díaz-Guilera & Latora, Physical Review Letters 110, 174102 (2013).

Phases with a frustration α obey :math:`\dot\theta_i = \omega + \sum_j A_{ij} \sin(\theta_j - \theta_i - \alpha)`.  They
cannot all be equal if nodes have different numbers of links.  Nodes that a symmetry exchanges become equal, although no
link joins them: the difference of their phases is zero.

We use another graph, with seven nodes.  Nodes 1 and 5 are mirror images, and so are nodes 2 and 4.  Nodes 3 and 6 are
not mirror images, although they have two common neighbours.  Their phases differ.
"""

import numpy as np
import sympy as sp

import synchain as sc

theta, alpha = sp.symbols("theta alpha")
phase = sc.Field({theta: 1})
i, j, W = sc.ends(phase)
frustrated = sc.Rates({i.theta: W * sp.sin(j.theta - i.theta - alpha)}, {alpha: 0.5})
graph = sc.graphs.from_edges([(1, 2), (2, 3), (3, 4), (4, 5), (2, 6), (4, 6), (6, 7)])
start = {"theta": np.random.default_rng(1).uniform(-1, 1, 7).tolist()}
scene = sc.Scene(phase, frustrated, graph, initial=start, transient=0, window=200, time_unit="time")
result = sc.run(scene.replace(record=("trajectory",), samples=401))
end = result.states("end")
symmetric = sc.graphs.orbital_partitions(graph)[-1].classes
reproduction = sc.results.Reproduction(
    {
        "phase of node 5 − phase of node 1": (0, end[4] - end[0], 1e-6),
        "phase of node 4 − phase of node 2": (0, end[3] - end[1], 1e-6),
        "pairs that a symmetry exchanges": (2, 7 - len(set(symmetric)), 0),
    }
)
print(reproduction)
result.plot(kind="time")

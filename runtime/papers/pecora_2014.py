"""
Symmetries of eleven nodes make clusters
========================================

Pecora et al., Nature Communications 5, 4079 (2014).

The graphs of Fig. 1 are complete graphs of eleven nodes without some links.  Two of these graphs have 32 and 5760
symmetries.  The symmetries define 5 and 3 clusters.  In the first graph, two clusters are intertwined: they lose their
synchrony together, while other clusters may remain synchronous.

The paper couples optical maps in discrete time.  Clusters, and the intertwined pairs among them, depend only on the
graph. The figure shows the exponents for Lorenz oscillators (10, 28, 2) with links x → x at σ = 0.86.  The two
intertwined clusters lose their synchrony.  The cluster of nodes 4 and 6 remains synchronous.
"""

import synchain as sc

pairs = {(i, j) for j in range(2, 12) for i in range(1, j)}
first = sc.graphs.from_edges(sorted(pairs - {(1, 5), (2, 7), (3, 9), (5, 11), (8, 10), (10, 11)}))
second = sc.graphs.from_edges(sorted(pairs - {(3, 4), (4, 5), (4, 9), (5, 9), (3, 10), (4, 10)}))
coarsest, other = (sc.graphs.orbital_partitions(graph)[-1] for graph in (first, second))
together = [sorted(set(block.cluster_of)) for block in coarsest.blocks if len(set(block.cluster_of)) > 1]
reproduction = sc.results.Reproduction(
    {
        "clusters of the first graph": (5, max(coarsest.classes) + 1, 0),
        "clusters of the second graph": (3, max(other.classes) + 1, 0),
        "intertwined clusters of the first": (2, sum(map(len, together)), 0),
    }
)
print(reproduction)

lorenz = sc.Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
scene = sc.Scene(lorenz, "x->x", first, parameters={"sigma": 0.86}, time_unit="time")
state = sc.cluster_exponents(scene, coarsest, periods=1000, precision=0.01)
print(state)
state.plot()

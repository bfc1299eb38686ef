"""
Clusters on the way to synchrony
================================

Bayani et al., Nature Communications 15, 4955 (2024).

Ten Lorenz oscillators (10, 28, 2) have links x → x.  As the coupling grows, some nodes synchronise before all do.  Two
nodes join at the strength at which the last mode that separates them begins to decay.  Fig. 3 contains the strengths of
three steps.  As a check, the exponents of each cluster state are computed along its own motion.  They pass zero within
15 % of the predicted strengths.

The graph is built from the printed eigenvalues 6, 4 and 1.  Our weights have three digits, so the exact eigenvalues are
6.003, 4.003 and 1.
"""

import synchain as sc

lorenz = sc.Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
group = [1, 1, 1, 2, 2, 2, 3, 3, 3, 3]
weight = {(1, 1): 0.1, (1, 2): 0.1, (1, 3): 0.1, (2, 2): 0.529, (2, 3): 0.529, (3, 3): 1.029}
network = sc.graphs.from_edges([(i + 1, j + 1, weight[group[i], group[j]]) for j in range(10) for i in range(j)])
scene = sc.Scene(lorenz, "x->x", network, parameters={"sigma": 4}, time_unit="time")
sequence = sc.transition(scene, starts=1)
found = [step.strength for step in sequence.steps]
confirmed = sequence.verify(0.15).verdicts.count("confirmed")

reproduction = sc.results.Reproduction(
    {
        "nodes 7 to 10 join at": (1.220, found[0], 0.015),
        "nodes 4 to 6 join at": (1.8305, found[1], 0.02),
        "nodes 1 to 3 join at": (7.322, found[2], 0.07),
        "confirmed by exponents": (3, confirmed, 0),
    }
)
print(reproduction)
sequence.plot()

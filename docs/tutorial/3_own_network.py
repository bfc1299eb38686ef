r"""
Your own network
================

Two things decide whether a network can synchronise.  The master stability function of the oscillator must be
negative in a range of strengths.  The eigenvalues of the graph must fit into this range (Pecora & Carroll,
*Phys. Rev. Lett.* 80, 2109 (1998)).
"""

# %%
# A graph
# -------
# Define a graph by a family and a number of nodes, a list of edges, a matrix, a file, or a graph of networkx.
# Weights and eigenvalues are exact.
import synchain as sc

friends = sc.graphs.from_edges([(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 5), (5, 3)])
print(friends.spectrum)

# %%
# The graph above is two triangles joined by a bridge.  Here are two other graphs.  Their eigenvalues are exact too,
# and can be evaluated to any number of digits.
print(sc.graphs.star(6).spectrum)
print(sc.graphs.cartesian(sc.graphs.ring(5), sc.graphs.chain(3)).spectrum.largest)

# %%
# The oscillator
# --------------
# For Rössler's oscillator, coupled in x, modes decay in a bounded range of strengths.
import numpy as np

scene = sc.Scene(oscillator="rossler", coupling="x->x", topology=friends, record=("sync_error",))
function = sc.msf(scene, np.linspace(0.0, 6.0, 121), starts=2, periods=400, precision=5e-3)
((low, high),) = function.intervals
print(f"modes decay for α from {low:.2f} to {high:.2f}: a factor of {high / low:.0f}")

# %%
# A graph can synchronise if the ratio of its largest to its smallest non-zero eigenvalue is less than this factor.
graphs = {
    "two triangles": friends,
    "chain(12)": sc.graphs.chain(12),
    "star(12)": sc.graphs.star(12),
    "ring(12)": sc.graphs.ring(12),
}
for name, graph in graphs.items():
    found = sc.msf(scene.replace(topology=graph), function.alpha, starts=2, periods=400, precision=5e-3).windows
    words = f"σ from {found[0].low:.3f} to {found[0].high:.3f}" if found else "never"
    ratio = graph.spectrum[-1].value / graph.spectrum[1].value
    print(f"{name:15} ratio {ratio:5.1f}: {words}")

# %%
# Compare with a simulation
# -------------------------
# The figure shows the lower end of the window of the two triangles, by simulation of all six oscillators.  The
# predicted window is grey.
import matplotlib.pyplot as plt

(window,) = function.windows
start = {"x": [1.0, 1.1, 0.9, 1.2, 0.8, 1.05]}
sweep = scene.replace(initial=start, transient=1000, window=200, time_unit="time")
result = sc.run(sweep, sigma=np.linspace(0.2, 1.0, 33))

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(result.sigma, result.sync_error + 1e-16, ".-")
axes.axvspan(window.low, 1.0, color="grey", alpha=0.2)
axes.set(xlabel="σ", ylabel="synchronisation error")
plt.show()

# %%
# Nodes that differ
# -----------------
# In a laboratory, no two oscillators are equal.  A parameter may have a different value for each node.  The
# synchronisation error is then small, but not zero.
unequal = sweep.replace(parameters={"a": [0.2, 0.201, 0.199, 0.2005, 0.1995, 0.2]})
print(f"error at σ = 0.7: {float(sc.run(unequal, sigma=0.7).sync_error):.3f}")

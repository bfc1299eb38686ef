r"""
A network of one's own
======================

Which of your networks can synchronise is decided by two things: the oscillator, whose master
stability function is negative in some range of strengths, and the graph, whose eigenvalues must all
fit into it (Pecora & Carroll, *Phys. Rev. Lett.* 80, 2109 (1998)).
"""

# %%
# A graph
# -------
# A graph is a family with a number of nodes, a list of edges, a matrix, a file, or a graph of
# networkx.  Weights are exact, and so is the spectrum.
import synchain as sc

friends = sc.graphs.from_edges([(0, 1), (1, 2), (2, 0), (2, 3), (3, 4), (4, 5), (5, 3)])
print(friends.spectrum)

# %%
# Two triangles joined by a bridge have the eigenvalues of a graph with that much symmetry; other
# graphs have algebraic numbers, which are exact too and evaluate to any number of digits.
print(sc.graphs.star(6).spectrum)
print(sc.graphs.cartesian(sc.graphs.ring(5), sc.graphs.chain(3)).spectrum.largest)

# %%
# The oscillator
# --------------
# Rössler's oscillator, coupled in x, has a bounded range.
import numpy as np

scene = sc.Scene(oscillator="rossler", coupling="x->x", topology=friends, record=("sync_error",))
function = sc.msf(scene, np.linspace(0.0, 6.0, 121), starts=2, periods=400, precision=5e-3)
((low, high),) = function.intervals
print(f"modes decay for α from {low:.2f} to {high:.2f}: a factor of {high / low:.0f}")

# %%
# A graph can synchronise if the ratio of its largest to its smallest non-zero eigenvalue is less.
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
# Try it
# ------
# The lower end of the window of the two triangles, by simulation of all six oscillators.  Beyond
# the upper end this oscillator runs away from its attractor, which the exponent cannot know.
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
# No two oscillators of a laboratory are equal.  A parameter may have one value for each node; the
# error then does not vanish, it becomes small.
unequal = sweep.replace(parameters={"a": [0.2, 0.201, 0.199, 0.2005, 0.1995, 0.2]})
print(f"error at σ = 0.7: {float(sc.run(unequal, sigma=0.7).sync_error):.3f}")

"""
Bursting neurons count the signals that reach them
==================================================

Belykh, de Lange & Hasler, Physical Review Letters 94, 188101 (2005).

Hindmarsh-Rose neurons (2.8, 1.6, 5, 9, 0.001) have chemical synapses of the strength g.  The stability of synchrony
depends only on the number k of signals that each neuron receives, and not on other properties of the graph.  The
threshold of g k is therefore one number.

The paper states this for any graph.  We compute the thresholds of three graphs with one, two and three signals.  At
g k = 1.285 the synchronous motion itself changes, and the exponents of all modes jump from 0.1 to below zero.  The
graph therefore has little influence.  Both kinds of motion coexist between 1.277 and 1.286, so the thresholds differ by
this amount.  A pair is an exception: its only mode decays from g = 1.25 on.
"""

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import synchain as sc

x, y, z, g = sp.symbols("x y z g")
neuron = sc.Field(
    {x: 2.8 * x**2 - x**3 - y - z, y: 4.4 * x**2 - y, z: 0.001 * (9 * x + 5 - z)}, initial={"x": -0.5, "y": 1, "z": 4}
)
i, j, W = sc.ends(neuron)
synapse = sc.Rates({i.x: -g * W * (i.x - 2) / (1 + sp.exp(-10 * (j.x + 0.25)))}, {g: 1})
graphs = {"one-way ring of 5": (1, sc.graphs.one_way_ring(5)), "ring of 8": (2, sc.graphs.ring(8))}
graphs["all pairs of 4"] = 3, sc.graphs.complete(4)
found = {}
for name, (k, graph) in graphs.items():
    scene = sc.Scene(neuron, synapse, graph, time_unit="time")
    found[name] = k * sc.critical(scene, "g", (1.26 / k, 1.32 / k), starts=1, periods=1000).value
first = found["one-way ring of 5"]
reproduction = sc.results.Reproduction(
    {f"g k of {name} over the one-way ring": (1, found[name] / first, 0.01) for name in ("ring of 8", "all pairs of 4")}
)
print(reproduction)
strengths = np.linspace(1.27, 1.3, 7)
modes = [sc.exponents(scene, gk * np.array([0.5, 1.0]), g=gk / 3, starts=1, periods=1000).exponent for gk in strengths]
plt.legend(plt.plot(strengths, modes), ["γ = -k/2", "γ = -k"])
plt.axhline(0, color="black", linewidth=0.5)
plt.gca().set(xlabel="g k", ylabel="exponent of a mode")

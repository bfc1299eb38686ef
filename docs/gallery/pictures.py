r"""
Pictures of a network
=====================

This example shows the plots of one run and one master stability function: time series, phase portrait, space-time map,
the network, its eigenvalues, and its modes on the curve of exponents. The nodes are FitzHugh-Nagumo oscillators
(FitzHugh, Biophys. J. 1, 445 (1961)) in a small-world graph (Watts & Strogatz, Nature 393, 440 (1998)).
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

network = sc.graphs.small_world(24, p="1/5", seed=1)
start = {"x": {"low": -1, "high": 1}, "y": {"low": -0.5, "high": 0.5}}
settings = {"transient": 0, "window": 120, "time_unit": "time", "record": ["trajectory"], "initial": start}
scene = sc.Scene("fitzhugh_nagumo", "x->x", network, **settings)
result = sc.run(scene, sigma=0.02)
function = sc.msf(scene, np.linspace(0, 0.5, 51), periods=200)

# %%
# Check
# -----
# SciPy gives the same final states.
from scipy.integrate import solve_ivp

G = np.zeros((24, 24))
for target, source, weight in network.links:
    G[target, source] = weight
G -= np.diag(G.sum(axis=1))


def rates(t, s):
    x, y = s.reshape(2, 24)
    return np.concatenate([3 * (y + x - x**3 / 3 - 0.4) + 0.02 * G @ x, -(x - 0.7 + 0.8 * y) / 3])


reference = solve_ivp(rates, (0, 120), scene.y0, "DOP853", rtol=1e-12, atol=1e-13)
difference = abs(result.states("end") - reference.y[:, -1]).max()
print(f"largest difference of a state from SciPy {difference:.0e}")
assert difference < 1e-6

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(2, 3, figsize=(11, 6), layout="constrained")
for ax, kind in zip(axes.flat, ["time", "phase", "space", "network"]):
    result.plot(ax, kind=kind)
network.spectrum.plot(axes[1, 1])
function.plot(axes[1, 2], sigma=0.02)
plt.show()

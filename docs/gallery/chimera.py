r"""
Chimera of two populations
==========================

In a chimera state, one population of oscillators synchronises and an equal population does not (Abrams, Mirollo,
Strogatz & Wiley, Phys. Rev. Lett. 101, 084103 (2008)).  The phases obey

.. math::
   \dot\theta_i = \sum_j K_{ij} \sin(\theta_j - \theta_i - \pi/2 + \beta), \qquad
   K_{ij} = \begin{cases} \mu/n & \text{in one population}\\ \nu/n & \text{otherwise} \end{cases}

with :math:`\mu + \nu = 1`, :math:`\mu - \nu = A`.  If the phases are distributed by a Poisson kernel at the start, they
always are (Ott & Antonsen, Chaos 18, 037113 (2008)).  Two complex order parameters then describe the motion.
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

n, A, beta = 48, 0.2, 0.1
theta, K, lag = sp.symbols("theta K lag")
phase = sc.Field({theta: 0})
i, j, W = sc.ends(phase)
sine = sc.Rates({i.theta: K * W * sp.sin(j.theta - i.theta - lag)}, {K: 1 / n, lag: sp.N(sp.pi / 2 - beta)})
weights = [[(1 + A) / 2, (1 - A) / 2], [(1 - A) / 2, (1 + A) / 2]]
edges = [(a, b, weights[a // n][b // n]) for a in range(2 * n) for b in range(a)]
kernel = np.exp(2j * np.pi * (np.arange(n) + 0.5) / n)
start = np.concatenate([np.full(n, -0.1), np.angle((0.7 + kernel) / (1 + 0.7 * kernel))])
settings = {"transient": 0, "window": 200, "time_unit": "time", "record": ("trajectory",), "samples": 401}
scene = sc.Scene(phase, sine, sc.graphs.from_edges(edges), initial={"theta": start.tolist()}, rtol=1e-7, **settings)
result = sc.run(scene)

# %%
# Check
# -----
# SciPy integrates the order parameters by the equations of Ott and Antonsen.
from scipy.integrate import solve_ivp


def rates(t, z):
    field = np.array(weights) @ z * np.exp(-1j * (np.pi / 2 - beta))
    return (field - field.conj() * z**2) / 2


times = result.time.values
theory = abs(solve_ivp(rates, (0, 200), [np.exp(-0.1j), 0.7 + 0j], "DOP853", times, rtol=1e-10, atol=1e-12).y)
r = abs(np.exp(1j * result.states("trajectory")).reshape(-1, 2, n).mean(axis=2)).T
difference = abs(r - theory).max()
print(f"r = {r[0, -1]:.6f} and {r[1, -1]:.6f}; difference from the theory {difference:.0e}")
assert difference < 1e-4
assert r[0, -1] > 0.999
assert r[1].max() < 0.9

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
left.plot(times, r[0], label="population 1")
left.plot(times, r[1], label="population 2")
left.plot(times[::10], theory[1, ::10], "k.", label="population 2, theory")
left.set(xlabel="time", ylabel="order parameter", ylim=(0, 1.05))
left.legend()
right.plot(np.angle(np.exp(1j * (result.states("end") - result.end.values.flat[0]))), ".")
right.set(xlabel="number of the oscillator", ylabel="phase relative to the first")
plt.show()

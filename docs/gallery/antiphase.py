r"""
Two oscillators that push each other apart
==========================================

.. math:: \ddot x_i = (1 - x_i^2)\, \dot x_i - x_i - k\, (\dot x_j - \dot x_i)

Two van der Pol oscillators have a cycle in phase and a cycle in antiphase.  A network is called stable by the
multipliers of all its states: the cycle in phase is that of one oscillator, and unstable across.  Both are
followed in the strength k and change roles at k = 0 (coupled van der Pol oscillators: Storti & Rand, Int. J.
Non-Linear Mech. 17, 143 (1982)).
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

node = sc.Field({"x": "v", "v": "(1 - x**2)*v - x"})
push = sc.Rates({"v": "-k*W*(v_j - v_i)"}, {"k": 0.3})
pair = sc.Scene(node, push, sc.graphs.chain(2), initial={"x": 2, "v": 0}, transient=50)
together = sc.periodic_orbit(pair)
apart = sc.periodic_orbit(pair.replace(initial={"x": [2, -1], "v": 0}))
for orbit in (together, apart):
    print(f"T = {orbit.period:.12f}, {orbit.verdict}")
in_phase = sc.follow(together, "k", within=(-0.3, 0.5), direction="both")
antiphase = sc.follow(apart, "k", within=(-0.3, 0.5), direction="both")

# %%
# Check
# -----
# Along itself the cycle in phase does not feel k; across, the coupling adds the divergence 2k: by Liouville's
# formula the product of the two multipliers across is that along times exp(2 k T).
along, across = together.multipliers[1].real, np.prod(together.across).real
difference = abs(across / along * np.exp(-2 * 0.3 * together.period) - 1)
assert difference < 1e-8
assert abs(apart.period - 7.196573966960774) < 1e-11

# %%
# Figure
# ------
# Periods of both branches: full lines are stable.
import matplotlib.pyplot as plt

_, axes = plt.subplots()
for branch, colour in ((in_phase, "tab:blue"), (antiphase, "tab:orange")):
    periods = np.array([orbit.period for orbit in branch])
    axes.plot(branch.values, np.where(branch.stable, periods, np.nan), colour)
    axes.plot(branch.values, np.where(branch.stable, np.nan, periods), colour, linestyle=":")
axes.set(xlabel="k", ylabel="period")
plt.show()

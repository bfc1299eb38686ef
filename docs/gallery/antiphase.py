r"""
Two oscillators that push each other apart
==========================================

.. math:: \ddot x_i = (1 - x_i^2)\, \dot x_i - x_i - k\, (\dot x_j - \dot x_i)

Two coupled van der Pol oscillators have a cycle in phase and a cycle in antiphase.  The links push the oscillators
apart.  The cycle in phase is then unstable, and the cycle in antiphase is stable.  Both cycles are continued in the
strength k.  They exchange their stability at k = 0 (Storti & Rand, Int. J. Non-Linear Mech. 17, 143 (1982)).
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
# The coupling does not change the cycle in phase.  For differences of the oscillators, it adds the divergence 2k.  By
# Liouville's formula, the product of the two transversal multipliers is exp(2 k T) times that of a single oscillator.
along, across = together.multipliers[1].real, np.prod(together.across).real
difference = abs(across / along * np.exp(-2 * 0.3 * together.period) - 1)
assert difference < 1e-8
assert abs(apart.period - 7.196573966960774) < 1e-11

# %%
# Figure
# ------
# The figure shows the periods of both branches.  Solid lines are stable, dotted lines unstable.
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
for branch, colour, name in ((in_phase, "tab:blue", "in phase"), (antiphase, "tab:orange", "antiphase")):
    periods = np.array([orbit.period for orbit in branch])
    axes.plot(branch.values, np.where(branch.stable, periods, np.nan), colour, label=f"{name}, stable")
    axes.plot(branch.values, np.where(branch.stable, np.nan, periods), colour, linestyle=":", label=f"{name}, unstable")
axes.set(xlabel="strength k of the links", ylabel="period")
axes.legend()
plt.show()

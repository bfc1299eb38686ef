r"""
Shares of five cycles, and of a machine that locks
==================================================

Stender & Hoffmann, Nonlinear Dynamics 107, 1451 (2022).

The program bSTAB counts the attractors that random starts reach.  This script repeats two of its cases.  The first is
Duffing's oscillator :math:`\ddot x = -0.08 \dot x - x^3 + 0.2 \cos t` on [-1, 1] × [-0.5, 1].  It has five cycles,
which differ in their largest x.  The second is a machine at a grid, :math:`\ddot\theta = 0.5 - 0.1 \dot\theta -
\sin\theta`, on [-π, π] × [-10, 10].  It locks or rotates.

bSTAB used 10 000 random starts.  We use a grid of 3600 starts.  Four standard errors of the random starts count as
agreement.
"""

import numpy as np

import synchain as sc

middles = (np.arange(60) + 0.5) / 60
duffing = sc.Field({"x": "v", "v": "-0.08*v - x**3 + 0.2*cos(t)"})
scene = sc.Scene(duffing, topology=sc.graphs.chain(1), time_unit="time", transient=600, window=100)
tops = {"period 1, small": (0, 0.3), "period 1, large": (1, 2), "period 2": (0.5, 0.63), "its mirror image": (0.63, 1)}
tops["period 3"] = (0.3, 0.5)
cycles = {name: f"maximum(x) > {low} and maximum(x) < {high}" for name, (low, high) in tops.items()}
image = sc.basin(scene, attractors=cycles, x_1=2 * middles - 1, v_1=1.5 * middles - 0.5)
swing = sc.Field({"theta": "v", "v": "0.5 - 0.1*v - sin(theta)"})
machine = sc.Scene(swing, topology=sc.graphs.chain(1), time_unit="time", transient=200, window=20)
ends = {"locked": "rest", "rotating": "mean(v) > 2.5"}
locked = sc.basin(machine, attractors=ends, theta_1=np.pi * (2 * middles - 1), v_1=20 * middles - 10)

printed = [0.2027, 0.495, 0.0288, 0.0257, 0.2478, 0.152]
found = [*image.shares.sel(attractor=list(tops)).values, locked.shares.sel(attractor="locked").item()]
claims = {k: (p, q, 0.04 * np.sqrt(p * (1 - p))) for k, p, q in zip([*tops, "locked"], printed, found, strict=True)}
reproduction = sc.results.Reproduction(claims)
print(reproduction)
image.plot()

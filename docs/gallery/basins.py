r"""
Basins of a machine
===================

The phase of a machine at a grid of fixed frequency obeys :math:`\ddot\theta = P - \alpha\dot\theta - K\sin\theta`.
The machine locks to the grid, or it rotates at about :math:`P/\alpha`.  The start decides which of the two happens.
The share of starts that lock is called basin stability (Menck, Heitzig, Marwan & Kurths, Nature Physics 9, 89 (2013)).
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

swing = sc.Field({"theta": "v", "v": "P - alpha*v - K*sin(theta)"}, parameters={"P": 0.5, "alpha": 0.1, "K": 1})
machine = sc.Scene(swing, topology=sc.graphs.chain(1), transient=200, window=20)
known = {"locked": "rest", "rotating": "mean(v) > P/alpha/2"}
angles, speeds = np.linspace(-np.pi, np.pi, 161), np.linspace(-10, 10, 161)
image = sc.basin(machine, attractors=known, theta_1=angles, v_1=speeds)
region = {"theta": (-np.pi, np.pi), "v": (-10, 10)}
swept = sc.basin(machine, attractors=known, samples=500, ranges=region, P=np.linspace(0, 1.1, 12))

# %%
# Check
# -----
# Stender & Hoffmann, Nonlinear Dyn. 107, 1451 (2022), print 0.152 at P = 0.5.  Without power all starts lock, and above
# P = K there is no equilibrium.
print(image)
locked = swept.shares.sel(attractor="locked")
difference = abs(float(image.shares.sel(attractor="locked")) - 0.152)
assert difference < 0.002
assert locked[0] == 1
assert (locked[swept.data.P > 1] == 0).all()

# %%
# Figure
# ------
import matplotlib.pyplot as plt

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
image.plot(left)
swept.plot(right)
plt.show()

r"""
Newton's cradle
===============

Five equal balls hang side by side as pendula :math:`\ddot x_k = -x_k`.  At rest, neighbours are a small distance
:math:`\delta` apart.  The first ball is pulled aside and released.  In an impact with the restitution e, a moving ball
transfers :math:`\tfrac12(1+e)` of its speed to a ball at rest.  If a ball passes its rest position with the speed s,
the next ball therefore receives

.. math:: s' = \tfrac12 (1 + e) \sqrt{s^2 - \delta^2} \quad\text{after the time}\quad \arcsin(\delta/s).

Impulses between neighbours do not move the centre of mass, so it always swings as one pendulum.  Impacts reduce the
relative motion to about :math:`\delta`.  The five balls then swing together, with a fifth of the amplitude.
"""

# %%
# Model and run
# -------------
# The stop is an event of the link.  Ball i is the ball with the smaller number.
import numpy as np
import sympy as sp

import synchain as sc

x, v, e, delta = sp.symbols("x v e delta")
ball = sc.Lagrangian(T=v**2 / 2, V=x**2 / 2, coordinates={x: v})
i, j, _ = sc.ends(ball)
contact = sc.Potential(0, {e: 0.9, delta: 0.01}, events=[sc.Stop(delta + j.x - i.x, restitution=e)])
start = {"x": [-1, 0, 0, 0, 0], "v": 0.0}
settings = {"transient": 0, "window": 60, "samples": 4000, "time_unit": "time", "rtol": 1e-12, "atol": 1e-13}
records = ["trajectory", "events"]
scene = sc.Scene(ball, contact, sc.graphs.chain(5), initial=start, record=records, **settings)
result = sc.run(scene)

# %%
# Check
# -----
# The speeds after the first four impacts are compared with the formula.  The centre of mass is compared at all times.
times, speed, time = [], 1.0, np.pi / 2
for _ in range(4):
    time += np.arcsin(0.01 / speed)
    speed = 1.9 / 2 * np.sqrt(speed**2 - 0.01**2)
    times.append(time)
impacts = result.events.event_time.values
centre = result.trajectory.sel(component="x").mean("node")
difference = max(abs(impacts[:4] - times).max(), abs(centre + np.cos(result.time) / 5).max())
print(f"{impacts.size} impacts, the last at t = {impacts[-1]:.1f}; largest difference {difference:.0e}")
assert difference < 1e-9

# %%
# Figure
# ------
# The figure shows the displacements of the balls, one above the other.
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(9, 4), layout="constrained")
for k, displacement in enumerate(result.trajectory.sel(component="x").transpose("node", ...).values):
    axes.plot(result.time, displacement + 1.2 * k, color=f"C{k}", linewidth=1)
axes.set(xlabel="t", ylabel="displacement", yticks=[1.2 * k for k in range(5)], yticklabels=range(1, 6))
plt.show()

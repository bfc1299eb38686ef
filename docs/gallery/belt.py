r"""
Masses on a moving belt
=======================

Five masses on a belt stick, move with the belt, and slip back. Springs join each mass to the wall and to its
neighbours. The friction coefficient falls with the sliding speed from :math:`\mu_s` to :math:`\mu_k`, so rest is
unstable. Stick and slip are exact (contact ``"set-valued"``).

The check uses the closed form for a single mass with constant sliding friction. In the phase plane, slip is a circular
arc around :math:`(\varepsilon\mu_k, 0)`. It begins at :math:`(\varepsilon\mu_s, \vartheta_b)` (Galvanetto & Bishop,
J. Sound Vib. 213, 1 (1998)).
"""

# %%
# Model and run
# -------------
import synchain as sc

settings = {"contact": "set-valued", "record": ["trajectory"], "transient": 0, "time_unit": "time"}
undriven = {"u": 0, "epsilon": 1, "theta_b": 0.2}
start = {"x": [0.3, 0.1, -0.2, 0.4, 0.0]}
scene = sc.Scene("friction", "spring", sc.graphs.chain(5), parameters=undriven, initial=start, window=40, **settings)
result = sc.run(scene, sigma=0.3)

# %%
# Check
# -----
# One mass is compared with the closed form.  Its friction coefficient drops from static to kinetic at the start of
# slip.
import numpy as np

law = sc.friction_law("mu_k*sign(w)", {"mu_s": 0.3, "mu_k": 0.15}, static="mu_s")
model = {"topology": sc.graphs.chain(1), "parameters": undriven, "initial": {"x": 0.5}, "samples": 200_001}
alone = sc.run(sc.Scene("friction", friction=law, window=30, **model, **settings))
x, v = (alone.trajectory.sel(component=name).values[50_000:, 0] for name in "xv")
radius = np.hypot(1 * (0.3 - 0.15), 0.2)
extremes = np.array([v.min(), v.max(), x.min(), x.max()])
difference = abs(extremes - [-radius, 0.2, 0.15 - radius, 0.15 + radius]).max()
print(f"least velocity {v.min():.9f}; closed form {-radius:.9f}; difference {difference:.0e}")
assert difference < 1e-6

# %%
# Figure
# ------
# Orange masses stick to the belt, blue masses slip. In the phase portrait, stick is the line :math:`v = \vartheta_b`.
import matplotlib.pyplot as plt

motion = result.animate(seconds=8, fps=12)
plt.show()

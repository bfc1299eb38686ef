r"""
The Pleiades
============

Seven stars with masses 1 to 7 attract each other in the plane, and several pairs come close.  This is the
problem PLEI of Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I* (Springer,
1993).  The Test Set for Initial Value Problem Solvers (Mazzia & Magherini, University of Bari, release 2.4 (2008))
contains the positions at t = 3.
"""

# %%
# Model and run
# -------------
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import synchain as sc

x, y = dynamicsymbols("x y")
m = sp.Symbol("m", positive=True)
star = sc.Lagrangian(m * (x.diff() ** 2 + y.diff() ** 2) / 2, parameters={m: 1}, coordinates=(x, y))
i, j, W = sc.ends(star)
gravity = sc.Potential(-W * i.m * j.m / sp.sqrt((i.x - j.x) ** 2 + (i.y - j.y) ** 2))
initial = {
    "x": [3, 3, -1, -3, 2, -2, 2],
    "y": [3, -3, 2, 0, 0, -4, 4],
    "v_x": [0, 0, 0, 0, 0, 1.75, -1.5],
    "v_y": [0, 0, 0, -1.25, 1, 0, 0],
}
settings = {
    "transient": 0,
    "window": 3,
    "time_unit": "time",
    "record": ("trajectory",),
    "samples": 1501,
    "integrator": "cash_karp",
}
parameters = {"m": list(range(1, 8))}
scene = sc.Scene(star, gravity, sc.graphs.complete(7), parameters=parameters, initial=initial, rtol=1e-11, **settings)
result = sc.run(scene)

# %%
# Check
# -----
import numpy as np

published = """
    0.3706139143970502  3.237284092057233 -3.222559032418324  0.6597091455775310
    0.3425581707156584  1.562172101400631 -0.7003092922212495
    -3.943437585517392 -3.271380973972550  5.225081843456543 -2.590612434977470
    1.198213693392275 -0.2429682344935824  1.091449240428980"""
found = result.states("end")[:14]
difference = abs(found - np.array(published.split(), dtype=float)).max()
print(f"{int(result.steps)} steps, largest error of the positions {difference:.0e}")
assert difference < 1e-7

# %%
# Figure
# ------
import matplotlib.pyplot as plt

figure, axes = plt.subplots(figsize=(6, 5), layout="constrained")
for k in range(7):
    path = result.trajectory.sel(node=k + 1)
    axes.plot(path.sel(component="x"), path.sel(component="y"), linewidth=1, label=f"m = {k + 1}")
axes.set(xlabel="x", ylabel="y", aspect="equal")
figure.legend(loc="outside right upper")
plt.show()

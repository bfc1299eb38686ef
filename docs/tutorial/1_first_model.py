r"""
A first model
=============

In five minutes: define an oscillator, connect several, run them, plot the result.
"""

# %%
# One oscillator
# --------------
# An oscillator is a Lagrangian: kinetic energy T, potential energy V, and the forces Q that have no
# energy.  This one is van der Pol's with a cubic spring and a drive.  Each constant is a parameter
# with a default value.
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import synchain as sc

x, t = dynamicsymbols("x"), dynamicsymbols._t
v = x.diff(t)
mu, beta, u, omega = sp.symbols("mu beta u omega")

node = sc.Lagrangian(
    T=v**2 / 2,
    V=x**2 / 2 + beta * x**4 / 4,
    Q={x: mu * (1 - x**2) * v + u * sp.cos(omega * t)},
    parameters={mu: 0.2, beta: 1, u: 0.5, omega: 0.9},
)

# %%
# The program checks a model when you define it, so you see errors at once.
try:
    sc.Lagrangian(T=v**2 / 2, V=x**2 / 2 + beta * x**4 / 4)
except ValueError as error:
    print(error)

# %%
# A network
# ---------
# A scene connects nodes by a link and a graph.  The program derives the equations of motion and
# simulates exactly these.
start = {"x": [1.2, 0.8, 0.4, 0.0]}
scene = sc.Scene(node, "spring", sc.graphs.ring(4), initial=start, record=("sync_error", "trajectory"), samples=801)
print(sc.export.text(scene.equations))
print("parameters:", scene.parameters)

# %%
# A run
# -----
# ``sigma`` is the stiffness of the springs.  A number sets a parameter.  To change any other setting,
# use ``replace``.  Here we skip the transient and record twelve drive periods.  The first run
# compiles a kernel in some seconds; later runs load it from a cache.
import matplotlib.pyplot as plt

result = sc.run(scene.replace(transient=0, window=12), sigma=0.05)
print(result.message)

_, axes = plt.subplots(figsize=(7, 3), layout="constrained")
result.trajectory.sel(component="x").plot.line(x="time", ax=axes)
axes.set(title="", xlabel="time", ylabel="x")
plt.show()

# %%
# A sweep
# -------
# A sequence makes an axis.  All cells run at once, several to a core.  The error is the mean
# distance of the oscillators from each other, once the transient is over.
import numpy as np

settled = scene.replace(transient=100, window=20)
sweep = sc.run(settled, sigma=np.linspace(0, 0.03, 31), u=[0.0, 0.5])
print(sweep.message)

_, axes = plt.subplots(figsize=(7, 3), layout="constrained")
sweep.sync_error.plot(ax=axes, hue="u", marker=".", yscale="log")
plt.show()

# %%
# What ran
# --------
# The kernel is Python that can be read.
print("\n".join(sc.kernel(scene.replace(parameters={"sigma": 0.05})).source.splitlines()[:9]))

# %%
# The next lesson asks where such a network synchronises, and answers before it simulates.

r"""
A first model
=============

This lesson takes five minutes. It defines an oscillator, connects four of them, runs the network and plots the result.
"""

# %%
# One oscillator
# --------------
# An oscillator is defined by its Lagrangian: kinetic energy T, potential energy V, and forces Q without a
# potential.  This example is van der Pol's oscillator with a cubic spring and a drive.  Each constant is a
# parameter with a default value.
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
# ``sigma`` is the stiffness of the springs.  Pass a number to set a parameter.  To change any other setting,
# use ``replace``.  Here we skip the transient and record twelve drive periods.  The first run
# compiles a kernel in a few seconds; later runs load it from a cache.
import matplotlib.pyplot as plt

result = sc.run(scene.replace(transient=0, window=12), sigma=0.05)
print(result.message)

figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(result.time, result.trajectory.sel(component="x"), label=[f"node {k}" for k in range(1, 5)])
axes.set(xlabel="time", ylabel="x")
figure.legend(loc="outside upper right", ncols=4)
plt.show()

# %%
# A sweep
# -------
# Pass a sequence to sweep a parameter.  The runs of a sweep are called cells.  They run in parallel, several
# on each core.  The synchronisation error is the mean distance of the oscillators after the transient.
import numpy as np

settled = scene.replace(transient=100, window=20)
sweep = sc.run(settled, sigma=np.linspace(0, 0.03, 31), u=[0.0, 0.5])
print(sweep.message)

_, axes = plt.subplots(figsize=(7, 3), layout="constrained")
for amplitude in sweep.u.values:
    axes.semilogy(sweep.sigma, sweep.sync_error.sel(u=amplitude) + 1e-16, ".-", label=f"u = {amplitude}")
axes.set(xlabel="stiffness σ", ylabel="synchronisation error")
axes.legend()
plt.show()

# %%
# The generated program
# ---------------------
# The kernel is a Python program that you can read.
print("\n".join(sc.kernel(scene.replace(parameters={"sigma": 0.05})).source.splitlines()[:9]))

# %%
# The next lesson predicts where a network synchronises, and compares the prediction with a simulation.

r"""
A relay in a loop
=================

A relay drives a chain of three lags.  It switches at the zeros of their output,

.. math:: \dot x_1 = u - x_1, \quad \dot x_2 = x_1 - x_2, \quad \dot x_3 = x_2 - x_3, \quad
   u = -\operatorname{sgn} x_3 .

Matrix exponentials give the limit cycle in closed form (Åström, in Adaptive Control, Filtering, and Signal Processing
(Springer, 1995)).  Small deviations jump at each switch.  Five such loops, joined in a ring by :math:`x_1`,
synchronise."""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

loop = sc.Field(
    {"x1": "-sign(x3) - x1", "x2": "x1 - x2", "x3": "x2 - x3"},
    contact="set-valued",
    initial={"x1": -0.7, "x2": -0.3, "x3": 0.01},
)
scene = sc.Scene(loop, "x1->x1", sc.graphs.ring(5), rtol=1e-11, time_unit="time")
orbit = sc.periodic_orbit(scene.lone)
function = sc.msf(scene, np.linspace(0, 3, 31), precision=1e-4)
starts = {"x1": [1, -1, 0.5, -0.5, 0], "x2": 0, "x3": 0.1}
result = sc.run(scene.replace(initial=starts, transient=0, window=30, record=["trajectory"]), sigma=0.15)

# %%
# Check
# -----
# On the cycle, :math:`x(h) = -x(0)` holds after half a period h.  This h is the first zero of :math:`x_3`.  The
# multipliers are the eigenvalues of the square of S exp(A h), with the saltation matrix S of a switch.
from scipy.linalg import expm
from scipy.optimize import brentq

A, b = np.array([[-1.0, 0, 0], [1, -1, 0], [0, 1, -1]]), np.array([1.0, 0, 0])


def at_switch(h):
    """The state of the symmetric cycle just after the relay switches to -1."""
    return np.linalg.solve(np.eye(3) + expm(A * h), np.linalg.solve(A, (expm(A * h) - np.eye(3)) @ b))


half = brentq(lambda h: at_switch(h)[2], 1, 3, xtol=1e-15)
before = A @ at_switch(half) + b  # the rates at u = 1, just before
saltation = np.eye(3) - 2 * np.outer(b, [0, 0, 1]) / before[2]
exact = np.sort(np.linalg.eigvals(saltation @ expm(A * half)) ** 2)[::-1]
difference = max(abs(orbit.period - 2 * half), abs(np.sort(orbit.multipliers.real)[::-1] - exact).max())
print(f"period {orbit.period:.12f}, multipliers {orbit.multipliers.real}, difference {difference:.0e}")
assert difference < 1e-10
# The links act between the switches.
modes = [saltation @ expm((A - alpha * np.diag([1, 0, 0])) * half) for alpha in function.alpha]
exponents = [np.log(abs(np.linalg.eigvals(each)).max()) / half for each in modes]
deviation = abs(function.exponent - exponents).max()
print(f"exponents differ by {deviation:.0e}")
assert deviation < 1e-11

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
left.plot(result.time, result.trajectory.sel(component="x3"))
left.set(xlabel="t", ylabel="output of the five loops")
function.plot(ax=right)
plt.show()

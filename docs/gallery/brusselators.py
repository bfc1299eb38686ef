r"""
Patterns on a ring of Brusselators
==================================

.. math:: \dot x = 2 - (B + 1)x + x^2 y + \tfrac{1}{10} L x, \qquad \dot y = B x - x^2 y + L y

Six cells of the Brusselator form a ring (Prigogine & Lefever, J. Chem. Phys. 48, 1695 (1968)).  At the uniform state
x = 2, y = B/2, each mode of the ring has a Jacobian of size 2 × 2.  It depends on the eigenvalue λ of the mode.  A
branch point occurs where its determinant vanishes.  The program finds the branch points with their modes, and continues
the patterns that begin there, stable or not.
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

cell = sc.Field({"x": "2 - (B + 1)*x + x**2*y", "y": "B*x - x**2*y"}, parameters={"B": 2})
flow = sc.Rates({"x": "D*W*(x_j - x_i)/10", "y": "D*W*(y_j - y_i)"}, {"D": 1})
scene = sc.Scene(cell, flow, sc.graphs.ring(6), initial={"x": 2, "y": 1})
uniform = sc.follow(sc.equilibrium(scene), "B", to=5.6)
patterns = [
    sc.follow(point, "B", within=(2, 5.6), vector=k)
    for point in uniform.points["branch point"]
    for k in range(len(point.vectors))
]
for point in uniform.bifurcations:
    print(f"{point.kind} at B = {point.value:.6f}: {point.mode}")

# %%
# Check
# -----
# The determinant of the 2 × 2 Jacobian of a mode vanishes at the branch points.  Its trace vanishes at the Hopf point.


def determinant(B, eigenvalue):
    block = np.array([[B - 1 - eigenvalue / 10, 4], [-B, -4 - eigenvalue]])
    return np.linalg.det(block)


errors = [determinant(point.value, mode) for point, mode in zip(uniform.points["branch point"], (4, 3, 1))]
difference = max(map(abs, (*errors, uniform.points["Hopf"][0].value - 5)))
print(f"difference {difference:.0e}")
assert difference < 1e-11

# %%
# Figure
# ------
# Solid lines are stable.  Only one pattern is stable where it begins: the alternating pattern, which begins first.
import matplotlib.pyplot as plt

axes = sc.diagram(uniform, *patterns).plot(y="x_1")
axes.set_ylim(0, 5)
plt.show()

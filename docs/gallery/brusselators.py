r"""
Patterns on a ring of Brusselators
==================================

.. math:: \dot x = 2 - (B + 1)x + x^2 y + \tfrac{1}{10} L x, \qquad \dot y = B x - x^2 y + L y

At the uniform state x = 2, y = B/2 of six cells (Prigogine & Lefever, J. Chem. Phys. 48, 1695 (1968)) each mode of the
ring, with the eigenvalue λ of its Laplacian -L, has a block of two by two.  The branch points, where a determinant
vanishes, are found with multiplicity and mode, and the patterns that are born there are followed, stable or not.
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
# The determinant of the block of mode λ vanishes at the branch points, its trace at the Hopf point.


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
# Full lines are stable.  Of all patterns only the checkerboard, born first, is stable at once.
import matplotlib.pyplot as plt

axes = sc.diagram(uniform, *patterns).plot(y="x_1")
axes.set_ylim(0, 5)
plt.show()

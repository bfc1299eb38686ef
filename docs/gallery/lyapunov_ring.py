r"""
All Lyapunov exponents of a ring
================================

Sixteen Stuart-Landau oscillators in a ring move in phase.  Their equations are a discrete complex Ginzburg-Landau
equation (Aranson & Kramer, Rev. Mod. Phys. 74, 99 (2002)).  In the rotating frame, each mode of the ring obeys an
equation with a constant 2 × 2 matrix.  The real parts of the eigenvalues are the 32 exponents of the network.  The
running averages show how long an average must be to separate exponents that are almost equal.
"""

# %%
# Model and run
# -------------
from sympy import symbols

import synchain as sc

x, y, b, kappa = symbols("x y b kappa")
squares = x**2 + y**2
node = sc.Field({x: x - y - squares * (x - y / 2), y: y + x - squares * (y + x / 2)}, initial={x: 1, y: 0})
i, j, W = sc.ends(node)
link = {i.x: kappa * W * (j.x - i.x - b * (j.y - i.y)), i.y: kappa * W * (j.y - i.y + b * (j.x - i.x))}
ring = sc.Scene(node, sc.Rates(link, {kappa: 0.3, b: -1}), sc.graphs.ring(16))
found = sc.lyapunov_spectrum(ring, rtol=1e-10, transient=60, periods=64)

# %%
# Check
# -----
# Half of the exponents are separated after the transient.  The sum of all is the divergence, 16 (2 - 4 - 1.2).
import numpy as np

strengths = 0.3 * (2 - 2 * np.cos(2 * np.pi * np.arange(16) / 16))
modes = [np.linalg.eigvals([[-2 - k, -k], [-1 + k, -k]]).real for k in strengths]
exact = np.sort(np.ravel(modes))[::-1]
difference = max(abs(found.exponent - exact)[:16].max(), abs(found.exponent.sum() + 51.2))
print(f"largest {found.exponent[0]:.1e}, second {found.exponent[1]:.10f}, difference {difference:.0e}")
assert difference < 1e-8

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
left.plot(np.arange(1, 33), found.exponent, "o", markersize=4, label="network")
left.plot(np.arange(1, 33), exact, "k+", label="modes")
left.set(xlabel="number", ylabel="Lyapunov exponent")
left.legend(fontsize="small")
found.plot(ax=right)
plt.show()

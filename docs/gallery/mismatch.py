r"""
An ensemble of unequal oscillators
==================================

If the parameters of synchronised oscillators differ slightly, the oscillators move nearly alike.  To first order, the
error is proportional to the spread of the parameters (Sorrentino & Porfiri, arXiv:1102.1709).  Van der Pol oscillators
in a ring have :math:`\mu_i = 1 + s\,d_i` with normally distributed :math:`d_i`.  Twenty networks are drawn, and each is
run with five sizes s.
"""

# %%
# Model and run
# -------------
import numpy as np
from sympy import symbols

import synchain as sc

n = 5
x, v, s, d = symbols("x v s d")
node = sc.Field({x: v, v: (1 + s * d) * (1 - x**2) * v - x}, parameters={s: 0, d: 0})
scene = sc.Scene(
    node,
    "x->v",
    sc.graphs.ring(n),
    parameters={"sigma": 0.5},
    initial={"x": [2, 1.9, 1.8, 2.1, 2.2], "v": 0},
    record=("sync_error",),
    transient=300,
    window=20,
    time_unit="time",
    rtol=1e-10,
)
sizes = np.geomspace(1e-4, 1e-2, 5)
result = sc.run(scene, s=sizes, realisations=20, draws={"d": sc.draw.normal(0, 1)}, rng=7)

# %%
# Check
# -----
# The last network is compared with SciPy.  The slope of the error over the size must be 1.
from scipy.integrate import solve_ivp

drawn = np.array([result.data[f"d_{k + 1}"].values[-1] for k in range(n)])


def rates(t, y):
    x, v = y[:n], y[n:]
    pull = np.roll(x, 1) + np.roll(x, -1) - 2 * x
    return np.concatenate([v, (1 + sizes[-1] * drawn) * (1 - x**2) * v - x + 0.5 * pull])


begin = [2, 1.9, 1.8, 2.1, 2.2, *[0] * n]
end = solve_ivp(rates, (0, 320), begin, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
difference = abs(result.states("end")[-1, -1] - end).max()
slopes = np.log(result.sync_error[1] / result.sync_error[0]) / np.log(sizes[1] / sizes[0])
print(f"difference from SciPy {difference:.0e}")
print(f"slopes at small sizes from {slopes.values.min():.4f} to {slopes.values.max():.4f}")
assert difference < 1e-7
np.testing.assert_allclose(slopes, 1, atol=0.01)

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.loglog(sizes, result.sync_error, color="C0", linewidth=0.5, alpha=0.5)
mean, spread = result.sync_error.mean("realisation"), result.sync_error.std("realisation")
axes.errorbar(sizes, mean, spread, fmt="ko", label="mean and spread")
axes.set(xlabel="size s of the deviations", ylabel="synchronisation error")
axes.legend()
plt.show()

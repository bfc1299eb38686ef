r"""
Kuramoto's transition
=====================

.. math:: \dot\theta_i = \omega_i + \frac{K}{n}\sum_j \sin(\theta_j - \theta_i)

With natural frequencies of a Lorentzian distribution of half width Δ, the order parameter
:math:`r = |\sum_j e^{i\theta_j}|/n` of infinitely many phases is :math:`\sqrt{1 - K_c/K}` above
:math:`K_c = 2Δ` (Acebrón, Bonilla, Pérez Vicente, Ritort & Spigler, Rev. Mod. Phys. 77,
137 (2005)).
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

n, width = 60, 0.5
theta, omega, K = sp.symbols("theta omega K")
phase = sc.Field({theta: omega}, parameters={omega: 0})
i, j, W = sc.ends(phase)
sine = sc.Rates({i.theta: K * W / n * sp.sin(j.theta - i.theta)}, {K: 1})
frequencies = width * np.tan(np.pi / 2 * (2 * np.arange(n) - n + 1) / (n + 1))
phases = 2 * np.pi * np.random.default_rng(1).random(n)
scene = sc.Scene(
    phase,
    sine,
    sc.complete(n),
    parameters={"omega": frequencies.tolist()},
    initial={"theta": phases.tolist()},
    record=("trajectory",),
    transient=0,
    window=60,
    time_unit="time",
    samples=241,
)
result = sc.run(scene, K=np.linspace(0.25, 4, 8))

# %%
# Check
# -----
# One run against SciPy, and r against the theory for infinitely many.
from scipy.integrate import solve_ivp


def rates(t, y):
    z = np.exp(1j * y).mean()
    return frequencies + float(result.K[-1]) * (z * np.exp(-1j * y)).imag


end = solve_ivp(rates, (0, 60), phases, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
difference = abs(result.states("end")[-1] - end).max()
print(f"difference from SciPy {difference:.0e}")
assert difference < 1e-5
r = abs(np.exp(1j * result.states("trajectory")[:, 120:]).mean(axis=2)).mean(axis=1)
theory = np.sqrt(np.maximum(0, 1 - 2 * width / result.K.values))
print(np.round(r - theory, 3))
assert abs(r - theory)[result.K.values > 1.5].max() < 0.05

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
strengths = np.linspace(0.1, 4, 400)
axes.plot(strengths, np.sqrt(np.maximum(0, 1 - 2 * width / strengths)), label="infinitely many")
axes.plot(result.K, r, "o", label=f"n = {n}")
axes.set(xlabel="K", ylabel="r")
axes.legend()
plt.show()

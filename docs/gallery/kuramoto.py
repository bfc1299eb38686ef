r"""
Kuramoto's transition
=====================

.. math:: \dot\theta_i = \omega_i + \frac{K}{n}\sum_j \sin(\theta_j - \theta_i)

The natural frequencies have a Lorentzian distribution g of half width γ.  For infinitely many phases, the order
parameter :math:`r = |\sum_j e^{i\theta_j}|/n` is :math:`\sqrt{1 - K_c/K}` above :math:`K_c = 2/(\pi g(0)) = 2γ`
(Kuramoto, Chemical Oscillations, Waves, and Turbulence, Springer 1984; Strogatz, Physica D 143, 1 (2000)).  The
coupling is a mean field, so the time of a step is proportional to n, not to n².
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

n, gamma, realisations = 300, 0.5, 8
theta, omega, K = sp.symbols("theta omega K")
phase = sc.Field({theta: omega}, parameters={omega: 0})
i, j, W = sc.ends(phase)
sine = sc.Rates({i.theta: K * W * sp.sin(j.theta - i.theta)}, {K: 1})
scene = sc.Scene(
    phase,
    sine,
    sc.graphs.weighted(sc.graphs.complete(n), f"1/{n}"),
    initial={"theta": {"low": 0, "high": 6.283, "rng": 1}},
    record=(),
    observe={"r": sc.observe.mean(abs(sc.observe.nodes.mean(sp.exp(sp.I * theta))))},
    transient=20,
    window=20,
    time_unit="time",
    integrator="dop853",
    rtol=1e-5,
)
draws = {"omega": sc.draw.lorentzian(0, gamma)}
result = sc.run(scene, K=[0.5, 1, 1.5, 2, 3, 4], realisations=realisations, draws=draws, rng=1)

# %%
# Check
# -----
# One cell is compared with SciPy.  The order parameter is compared with the theory for infinitely many phases, in units
# of the standard errors over the realisations.
from scipy.integrate import solve_ivp

cell = result.data.isel(K=-1, realisation=0)
frequencies = np.array([float(cell[f"omega_{k + 1}"]) for k in range(n)])


def rates(t, y):
    z = np.exp(1j * y).mean()
    return frequencies + float(cell.K) * (z * np.exp(-1j * y)).imag


short = sc.run(scene.replace(transient=0, window=2, rtol=1e-9, observe=None, parameters={"omega": frequencies, "K": 4}))
end = solve_ivp(rates, (0, 2), scene.y0, "DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
difference = abs(short.states("end") - end).max()
print(f"difference from SciPy {difference:.0e}")
assert difference < 1e-6
strengths, r = result.K.values, result.r.values.mean(axis=1)
error = result.r.values.std(axis=1, ddof=1) / np.sqrt(realisations)
theory = np.sqrt(np.maximum(0, 1 - 2 * gamma / strengths))
print(np.round((r - theory) / error, 1), "standard errors from the theory")
above = strengths >= 2
assert (abs(r - theory) < 4 * error + 1 / n**0.5)[above].all()
assert r[0] < 0.15 < theory[-1] < r[-1] + 0.05

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
line = np.linspace(0.1, 4, 400)
axes.plot(line, np.sqrt(np.maximum(0, 1 - 2 * gamma / line)), label="theory, n → ∞")
axes.errorbar(strengths, r, error, fmt="o", capsize=3, label=f"n = {n}, {realisations} realisations")
axes.set(xlabel="strength K", ylabel="order parameter r")
axes.legend()
plt.show()

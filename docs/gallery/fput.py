r"""
Energy of a Fermi-Pasta-Ulam-Tsingou ring
=========================================

Sixteen masses in a ring, joined by springs with a quadratic part,

.. math::
   H = \sum_i \frac{p_i^2}{2} + \frac{r_i^2}{2} + \alpha\frac{r_i^3}{3}, \qquad r_i = q_{i+1} - q_i,

start in the mode with the longest wave (Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955); Ford,
Phys. Rep. 213, 271 (1992)).
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

n = 16
wave = 1.0 * np.sin(2 * np.pi * np.arange(n) / n)
scene = sc.Scene(
    oscillator="mass",
    coupling="fput",
    topology=sc.graphs.ring(n),
    parameters={"sigma": 1, "fput_alpha": 0.25},
    initial={"x": wave.tolist(), "v": 0},
    record=("trajectory",),
    transient=0,
    window=1000,
    time_unit="time",
    samples=2001,
    rtol=1e-10,
)
result = sc.run(scene)

# %%
# Check
# -----
# The energy H is constant, and SciPy gives the same final state.
from scipy.integrate import solve_ivp


def energy(y):
    r = np.roll(y[:, :n], -1, axis=1) - y[:, :n]
    return (y[:, n:] ** 2 / 2 + r**2 / 2 + 0.25 * r**3 / 3).sum(axis=1)


def rates(t, y):
    r = np.roll(y[:n], -1) - y[:n]
    pull = r + 0.25 * r**2
    return np.concatenate([y[n:], pull - np.roll(pull, 1)])


y = result.states("trajectory")
drift = np.ptp(energy(y)) / energy(y)[0]
end = solve_ivp(rates, (0, 1000), np.concatenate([wave, 0 * wave]), "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
difference = abs(result.states("end") - end).max()
print(f"drift of the energy {drift:.0e}, difference from SciPy {difference:.0e}")
assert drift < 1e-9
assert difference < 1e-9

# %%
# Figure
# ------
# The energy moves from the first linear mode to its harmonics and returns.
import matplotlib.pyplot as plt

frequency = 2 * np.sin(np.pi * np.arange(1, 5) / n)
q, p = (np.fft.fft(part, axis=1)[:, 1:5] for part in (y[:, :n], y[:, n:]))
modes = (abs(p) ** 2 + frequency**2 * abs(q) ** 2) / n
figure, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
axes.plot(result.time, modes, label=[f"mode {k}" for k in range(1, 5)])
axes.set(xlabel="time", ylabel="energy of the mode")
figure.legend(loc="outside upper right", ncols=4)
plt.show()

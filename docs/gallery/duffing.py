r"""
Duffing's resonance curve
=========================

The resonance curve of :math:`\ddot x = -x - \beta x^3 - \delta\dot x + u\cos\omega t` has two stable branches in a
range of frequencies.  Sweeps with rising and falling frequency therefore give different amplitudes (Duffing (1918);
Kovacic & Brennan, *The Duffing Equation* (Wiley, 2011), chapter 5).
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

frequencies = np.linspace(0.5, 2.5, 81)
scene = sc.Scene(
    oscillator="duffing",
    parameters={"delta": 0.1, "beta": 1, "u": 0.3},
    axes={"omega": frequencies},
    record=("trajectory",),
    transient=100,
    window=1,
    samples=201,
)
upwards = sc.run(scene.replace(continuation="up"))
downwards = sc.run(scene.replace(continuation="down"))

# %%
# Check
# -----
# SciPy starts from the first sample of a cell and gives the same amplitude.
from scipy.integrate import solve_ivp

up, down = (abs(result.trajectory.sel(component="x", node=1)).max("sample").values for result in (upwards, downwards))
difference = 0
for result in (upwards, downwards):
    for k in (10, 40, 70):
        w, times = frequencies[k], result.time.values[k]

        def rates(t, y):
            return [y[1], -y[0] - y[0] ** 3 - 0.1 * y[1] + 0.3 * np.cos(w * t)]

        start = result.states("trajectory")[k, 0]
        y = solve_ivp(rates, times[[0, -1]], start, "DOP853", times, rtol=1e-10, atol=1e-12).y
        difference = max(difference, abs(result.states("trajectory")[k] - y.T).max())
print(f"largest amplitude: {up.max():.3f} upwards at ω = {frequencies[up.argmax()]:.3f}, {down.max():.3f} downwards")
print(f"difference from SciPy {difference:.0e}")
assert difference < 1e-6
assert up.max() > 1.5 * down.max()

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
axes.plot(frequencies, up, label="frequency rising")
axes.plot(frequencies, down, "--", label="frequency falling")
axes.set(xlabel="ω", ylabel="largest |x|")
axes.legend()
plt.show()

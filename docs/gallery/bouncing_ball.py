r"""
A ball on a shaken table
========================

A ball falls on a table that moves as :math:`A \sin 2\pi t`.  Each impact multiplies the relative speed by the
restitution e.  The motion with one bounce per period is stable up to the amplitude

.. math::
   A\,\omega^2/g = \sqrt{\pi^2\Big(\frac{1-e}{1+e}\Big)^2 + \frac{4(1+e^2)^2}{(1+e)^4}},

at which a multiplier passes −1.  Above, the period doubles repeatedly (Tufillaro, Abbott & Reilly, An Experimental
Approach to Nonlinear Dynamics and Chaos, Addison-Wesley (1992), chapter 1; Luo & Han, Nonlinear Dyn. 10, 1 (1996)).
"""

# %%
# Model and run
# -------------
# Time begins near the top of a flight.  The section records one point per period of the drive, from sixteen
# starts for each amplitude.
import numpy as np
import sympy as sp

import synchain as sc

y, v, t, A, e = sp.symbols("y v t A e")
table = A * sp.sin(2 * sp.pi * (t + sp.Rational(5, 8)))
ball = sc.Lagrangian(
    T=v**2 / 2,
    V=y,
    coordinates={y: v},
    parameters={A: 0.0125, e: 0.8},
    events=[sc.Stop(y - table, restitution=e)],
)
scene = sc.Scene(ball, topology=sc.graphs.chain(1), initial={"y": [0.135]}, record=())
amplitudes = np.linspace(0.022, 0.034, 241)
strobe = {"strobe": sc.Section("sin(2*pi*t)", "rising", keep="y_1")}
starts = {"y": sc.draw.uniform(0.14, 0.16), "v": sc.draw.uniform(-0.05, 0.05)}
swept = scene.replace(sections=strobe, transient=400, window=32)
result = sc.run(swept, A=amplitudes, realisations=16, draws=starts, rng=1)

# %%
# Check
# -----
# The product of the multipliers must be e².  At the published amplitude, one of them must be −1.
orbit = sc.periodic_orbit(scene, 1)
phase = np.arccos((1 - 0.8) / (1 + 0.8) / 2 / (2 * np.pi * 0.0125))
trace = 1 + 0.8**2 - 1.8**2 * 0.0125 * (2 * np.pi) ** 2 * np.sin(phase)
difference = abs(np.poly(orbit.multipliers) - [1, -trace, 0.64]).max()
doubling = np.hypot(np.pi * 0.2 / 1.8, 2 * 1.64 / 1.8**2) / (2 * np.pi) ** 2
least = sc.periodic_orbit(scene, 1, A=doubling).multipliers.real.min()
difference = max(difference, abs(least + 1))
print(f"at A = {doubling:.9f} the least multiplier is {least:.12f}; largest difference {difference:.0e}")
assert difference < 1e-8

# %%
# Figure
# ------
# The grey line is the published amplitude.  The three separate points show another attractor of three periods.
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(8, 4), layout="constrained")
heights = result.strobe.transpose("A", ...).values.reshape(len(amplitudes), -1)
axes.plot(amplitudes, heights, ".", markersize=1, color="C0", alpha=0.2)
axes.axvline(doubling, color="grey", linewidth=0.8)
axes.set(xlabel="amplitude A of the table", ylabel="height of the ball, once a period")
plt.show()

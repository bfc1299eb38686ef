r"""
Swing equation of the IEEE 14-bus grid
======================================

The voltage angles of a power grid without losses obey

.. math::
   M\ddot\theta_i = P_i - D\dot\theta_i - \sum_j \frac{V_i V_j}{X_{ij}} \sin(\theta_i - \theta_j)

(Filatrella, Nielsen & Pedersen, Eur. Phys. J. B 61, 485 (2008)).  Voltages, reactances and powers
are those of the IEEE 14-bus test case (Power Systems Test Case Archive, University of Washington;
as in MATPOWER: Zimmerman, Murillo-Sánchez & Thomas, IEEE Trans. Power Syst. 26, 12 (2011)), in
units of 100 MVA.  The test case contains no inertia and no damping.  Here they are equal for all buses.
"""

# %%
# Model and run
# -------------
import numpy as np
from sympy import Symbol, cos, symbols

import synchain as sc

grid = """1-2 .05917 1-5 .22304 2-3 .19797 2-4 .17632 2-5 .17388 3-4 .17103 4-5 .04211
    4-7 .20912 4-9 .55618 5-6 .25202 6-11 .1989 6-12 .25581 6-13 .13027 7-8 .17615 7-9 .11001
    9-10 .0845 9-14 .27038 10-11 .19207 12-13 .19988 13-14 .34802"""
lines = grid.split()
volts = [1.06, 1.045, 1.01, 1.019, 1.02, 1.07, 1.062, 1.09, 1.056, 1.051, 1.057, 1.055, 1.05, 1.036]
power = np.array([0, 18.3, -94.2, -47.8, -7.6, -11.2, 0, 0, -29.5, -9, -3.5, -6.1, -13.5, -14.9]) / 100
power[0] = -power.sum()  # the slack bus, without losses
ends = [tuple(int(bus) - 1 for bus in line.split("-")) for line in lines[::2]]
edges = [(a, b, round(volts[a] * volts[b] / float(x), 6)) for (a, b), x in zip(ends, lines[1::2])]
theta, rate, P, D = symbols("theta rate P D")
said = {"coordinates": {theta: rate}, "parameters": {P: 0, D: 0.3}}
bus = sc.Lagrangian(T=rate**2 / 2, V=-P * theta, R=D * rate**2 / 2, **said)
i, j, W = sc.ends(bus)
line = sc.Potential(-Symbol("b") * W * cos(i.theta - j.theta), {"b": 1})
settings = {"transient": 0, "window": 60, "time_unit": "time", "record": ("trajectory",), "samples": 1201}
start = {"theta": 0, "rate": 0}
scene = sc.Scene(bus, line, sc.graphs.from_edges(edges), parameters={"P": power.tolist()}, initial=start, **settings)
result = sc.run(scene)

# %%
# Check
# -----
# SciPy gives the same final state.  The final angles agree with Newton's method.  They differ by less than 1.5° from
# the listed angles of the test case, whose lines have losses.
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

B = np.zeros((14, 14))
for a, b, weight in edges:
    B[a, b] = B[b, a] = weight


def surplus(angles):
    return power - (B * np.sin(angles[:, None] - angles)).sum(axis=1)


def rates(t, y):
    return np.concatenate([y[14:], surplus(y[:14]) - 0.3 * y[14:]])


end = solve_ivp(rates, (0, 60), np.zeros(28), "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
difference = abs(result.states("end") - end).max()
assert difference < 1e-6
rest = fsolve(lambda angles: surplus(np.append(0, angles))[1:], np.zeros(13), xtol=1e-12)
found = np.degrees(result.states("end")[1:14] - result.states("end")[0])
np.testing.assert_allclose(found, np.degrees(rest), atol=0.05)
listed = -np.array([4.98, 12.72, 10.33, 8.78, 14.22, 13.37, 13.36, 14.94, 15.1, 14.79, 15.07, 15.16, 16.04])
print(f"difference from SciPy {difference:.0e}")
print(f"from the listed angles {abs(found - listed).max():.1f}° at most")
assert abs(found - listed).max() < 1.5

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
angles = result.trajectory.sel(component="theta")
axes.plot(result.time, np.degrees(angles - angles.isel(node=0))[:, 1:])
axes.plot(np.full(13, 60), listed, "k.", label="listed, with losses")
axes.set(xlabel="time", ylabel="angle to bus 1 in degrees", ylim=(-28, 2))
axes.legend()
plt.show()

r"""
Your own observables and sections
=================================

Kuramoto's phases with inertia (Tanaka, Lichtenberg & Oishi, Phys. Rev. Lett. 78, 2104 (1997)),

.. math::
   \ddot\theta_i = P_i - D\dot\theta_i + \frac{K}{n}\sum_j \sin(\theta_j - \theta_i) ,

are the model.  Five observables and sections are defined by expressions: the order parameter, the mean frequency of
each node, the spread of the velocities, the largest kinetic energy, and the times at which the fastest phase overtakes
the slowest.  The kernel integrates them with the accuracy of its steps.  It stores no trajectory.
"""

# %%
# Model and run
# -------------
import numpy as np
from sympy import I, cos, exp, sin, symbols
from sympy.physics.mechanics import dynamicsymbols

import synchain as sc

n, powers = 10, [-1.0, -0.75, -0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.75, 1.0]
theta, (P, D, K) = dynamicsymbols("theta"), symbols("P D K")
v = theta.diff()
rotor = sc.Lagrangian(v**2 / 2, -P * theta, R=D * v**2 / 2, parameters={P: 0, D: 0.5})
i, j, W = sc.ends(rotor)
link = sc.Potential(-K / n * W * cos(i.theta - j.theta), {K: 1})
observe = {
    "r": sc.observe.mean(abs(sc.observe.nodes.mean(exp(I * theta)))),
    "frequency": sc.observe.mean(sc.observe.rate(theta)),
    "spread": sc.observe.mean(sc.observe.nodes.std(v)),
    "energy": sc.observe.maximum(sc.observe.nodes.sum(v**2 / 2)),
}
lap = sc.Section(sin((sc.observe.nodes[n](theta) - sc.observe.nodes[1](theta)) / 2), "both", keep=(v,))
times = {"time_unit": "time", "transient": 50, "window": 100, "rtol": 1e-11}
start = {"theta": np.linspace(0, 3, n).tolist(), "v": 0}
watched = {"observe": observe, "sections": {"lap": lap}, "record": ()}
scene = sc.Scene(rotor, link, sc.graphs.complete(n), parameters={"P": powers}, initial=start, **times, **watched)
result = sc.run(scene, K=np.linspace(0.1, 3, 30))

# %%
# Check
# -----
# SciPy integrates one run together with the integrals of r and of the spread.  It finds the same times of overtaking.
from scipy.integrate import solve_ivp

case = result.data.isel(K=11)


def overtaking(t, y):
    return np.sin((y[n - 1] - y[0]) / 2)


def rates(t, y):
    x, v = y[:n], y[n : 2 * n]
    z = np.exp(1j * x).mean()
    return np.concatenate([v, powers - 0.5 * v + float(case.K) * (z * np.exp(-1j * x)).imag, [abs(z), v.std()]])


options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12, "max_step": 0.03}
begin = np.concatenate([start["theta"], np.zeros(n)])
settled = solve_ivp(rates, (0, 50), np.append(begin, [0, 0]), **options).y[: 2 * n, -1]
solution = solve_ivp(rates, (50, 150), np.append(settled, [0, 0]), events=overtaking, **options)
end, laps = solution.y[:, -1], solution.t_events[0]
energy = (solution.y[n : 2 * n] ** 2 / 2).sum(axis=0).max()
found = {
    "r": abs(case.r - end[-2] / 100),
    "spread": abs(case.spread - end[-1] / 100),
    "frequency": abs(case.frequency - (end[:n] - settled[:n]) / 100).max(),
    "times of laps": abs(case.lap_time[: len(laps)] - laps).max(),
}
print(f"K = {float(case.K):.1f}, {int(case.lap_count)} laps")
for name, value in found.items():
    print(f"{name:14} difference from SciPy {float(value):.0e}")
difference = max(map(float, found.values()))
top = float(abs(case.energy - energy))  # the largest value at the points of a rule of integration
print(f"{'energy':14} difference from SciPy {top:.0e}")
assert difference < 1e-7
assert top < 1e-3
assert int(case.lap_count) == len(laps)

# %%
# Figure
# ------
# All phases lock at the same strength: their mean frequencies become equal, and the order parameter jumps.
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left.plot(result.K, result.r, "o-", label="order parameter r")
left.plot(result.K, result.spread, "s-", label="spread of the velocities")
left.set(xlabel="strength K", ylabel="average over the window")
left.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, fontsize="small")
right.plot(result.K, result.frequency, ".-", linewidth=0.8)
right.set(xlabel="strength K", ylabel="mean frequency of each node")
plt.show()

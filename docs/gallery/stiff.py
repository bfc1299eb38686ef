r"""
Three stiff classics
====================

Van der Pol's oscillator with :math:`\mu = 1000`, Robertson's reaction and the Oregonator are the
problems VDPOL, ROBER and OREGO of the Test Set for Initial Value Problem Solvers (Mazzia &
Magherini, University of Bari, release 2.4 (2008)).  The Test Set contains their final states.  It uses the time
:math:`t/\mu` for VDPOL.  Here, the time unit of ROBER is 100.
"""

# %%
# Model and run
# -------------
import sympy as sp

import synchain as sc

x, v, a, b, c = sp.symbols("x v a b c")
oregonator = {
    a: 77.27 * (b + a * (1 - 8.375e-6 * a - b)),
    b: (c - (1 + a) * b) / 77.27,
    c: 0.161 * (a - c),
}
robertson = {
    a: 100 * (-0.04 * a + 1e4 * b * c),
    b: 100 * (0.04 * a - 1e4 * b * c - 3e7 * b**2),
    c: 100 * 3e7 * b**2,
}
problems = {
    "van der Pol": ({x: v, v: 1000 * (1 - x**2) * v - x}, [2, 0], 2000),
    "Robertson": (robertson, [1, 0, 0], 1e9),
    "Oregonator": (oregonator, [1, 2, 3], 360),
}
settings = {"transient": 0, "time_unit": "time", "integrator": "rodas5p", "rtol": 1e-9, "atol": 1e-16}
results = {}
for name, (rates, start, end) in problems.items():
    initial = dict(zip(map(str, rates), start))
    scene = sc.Scene(sc.Field(rates), initial=initial, window=end, record=("trajectory",), samples=4001, **settings)
    results[name] = sc.run(scene)

# %%
# Check
# -----

published = {
    "van der Pol": [1.706167732170483, -0.8928097010247975e-3],
    "Robertson": [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050],
    "Oregonator": [0.1000814870318523e1, 0.1228178521549917e4, 0.1320554942846706e3],
}
difference = 0
for name, result in results.items():
    error = abs(result.states("end") / published[name] - 1).max()
    print(f"{name:12} {int(result.steps)} steps, largest relative error {error:.1e}")
    difference = max(difference, error)
assert difference < 1e-6

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, panels = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
for axes, (name, result) in zip(panels, results.items()):
    y = result.states("trajectory")
    axes.plot(result.time[1:], y[1:] / abs(y).max(axis=0), label=result.component.values.tolist())
    axes.set(title=name, xlabel="time")
    axes.legend()
panels[0].set_ylabel("states / largest value")
panels[1].set_xscale("log")
plt.show()

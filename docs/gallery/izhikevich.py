r"""
Neurons that fire and are reset
===============================

Izhikevich's neuron (IEEE Trans. Neural Netw. 14, 1569 (2003)),

.. math:: \dot v = 0.04 v^2 + 5v + 140 - u + I, \qquad \dot u = 0.02(0.2 v - u),

fires when v reaches 30.  Then v is set to −65, and u increases by 8.  Gap junctions join forty neurons with different
currents in a ring.  The record of events contains the time and the neuron of each spike.
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

neuron = sc.Field(
    {"v": "v**2/25 + 5*v + 140 - u + I", "u": "(v/5 - u)/50"},
    parameters={"I": 10},
    initial={"v": -65, "u": -13},
    events=[sc.Reset("v - 30", {"v": "-65", "u": "u + 8"})],
)
junction = sc.Rates({"v": "g*W*(v_j - v_i)"}, {"g": 0.1})
settings = {"transient": 0, "time_unit": "time", "record": ["events"], "rtol": 1e-10}
n, rng = 40, np.random.default_rng(1)
currents = list(10 + rng.uniform(-1, 1, n))
scene = sc.Scene(neuron, junction, sc.graphs.ring(n), parameters={"I": currents}, window=600, **settings)
start = list(rng.uniform(-70, -40, n))
result = sc.run(scene.replace(initial={"v": start}), g=[0, 0.1])

# %%
# Check
# -----
# The spikes of one neuron are compared with Taylor series in 40 digits.  The first spikes of the ring are compared with
# SciPy, which restarts at each spike.
from scipy.integrate import solve_ivp

one = sc.run(sc.Scene(neuron, topology=sc.graphs.chain(1), window=200, **settings))
exact = [3.12705530387698, 26.2260246341484, 71.0570973282096, 115.869510996278, 160.681924664374]
difference = abs(one.events.event_time.values.ravel() - exact).max()


def rates(t, y):
    v, u = y.reshape(2, n)
    links = 0.1 * (np.roll(v, 1) + np.roll(v, -1) - 2 * v)
    return np.append(v**2 / 25 + 5 * v + 140 - u + currents + links, (v / 5 - u) / 50)


def fires(t, y):
    return y[:n].max() - 30


fires.terminal, fires.direction = True, 1
t, y, spikes = 0, np.append(start, np.full(n, -13)), []
while t < 50:
    part = solve_ivp(rates, (t, 50), y, "DOP853", events=fires, rtol=1e-11, atol=1e-11)
    t, y = part.t[-1], part.y[:, -1]
    k = y[:n].argmax()
    if t < 50:
        spikes.append(t)
        y[k], y[n + k] = -65, y[n + k] + 8
found = result.events.sel(g=0.1)
difference = max(difference, abs(found.event_time.values.ravel()[: len(spikes)] - spikes).max())
print(f"{len(spikes)} spikes of the ring; largest difference {difference:.0e}")
assert difference < 1e-7

# %%
# Figure
# ------
# Top: without junctions.  Bottom: with junctions.
import matplotlib.pyplot as plt

_, panels = plt.subplots(2, 1, figsize=(9, 5), sharex=True, layout="constrained")
for panel, g in zip(panels, (0, 0.1)):
    spikes = result.events.sel(g=g)
    panel.plot(spikes.event_time, spikes.event_node, ".", markersize=3)
    panel.set(ylabel="neuron", title=f"g = {g}")
panel.set(xlabel="t in ms")
plt.show()

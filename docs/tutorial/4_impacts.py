r"""
Friction, impacts and resets
============================

Some motions change suddenly: a body sticks, a ball hits the floor, a neuron fires.  Such a change is an *event*.
The program locates each event to rounding and changes the motion there.  It also computes how small deviations
change at the event, so that stability is exact too.
"""

# %%
# A block on a shaken plate
# -------------------------
# Dry friction drags a block along with a plate of velocity :math:`\sin t`,
# :math:`\ddot x = 0.8\,f(\sin t - \dot x)` with :math:`f = \operatorname{sgn}`.  With ``contact="set-valued"``
# the block sticks exactly.  Friction then holds the block, up to the force 0.8.
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import synchain as sc

x, v, t, w = sp.symbols("x v t w")
block = sc.Lagrangian(
    T=v**2 / 2,
    Q={x: 0.8 * sc.friction(sp.sin(t) - v)},
    coordinates={x: v},
    friction=sp.sign(w),
    contact="set-valued",
)
alone = {"topology": sc.graphs.chain(1), "transient": 0, "time_unit": "time", "record": ["trajectory", "events"]}
result = sc.run(sc.Scene(block, window=12, **alone))
print(result.events.event_time.values.round(4))
print(result.events.event_after.values)

# %%
# Each event sets the *mode* of the contact: 0 if the block sticks, else the sign of the sliding velocity.  The
# block begins to slip when the acceleration of the plate reaches 0.8, for the first time at
# :math:`\pi - \arcsin 0.6 = 2.4981`.
velocity, mode = (result.trajectory.sel(component=name) for name in ("v", "slip"))

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(result.time, np.sin(result.time), color="grey", label="plate")
axes.plot(result.time, velocity, label="block slips")
axes.plot(result.time, velocity.where(mode == 0), linewidth=3, label="block sticks")
axes.set(xlabel="t", ylabel="velocity")
axes.legend()
plt.show()

# %%
# A ball that comes to rest
# -------------------------
# A *stop* is a gap that cannot become negative.  When the gap reaches zero, its rate changes sign and is multiplied
# by the coefficient of restitution.  A ball bounces infinitely often in a finite time.  The program lets it rest when
# the remaining bounces are smaller than the tolerance.
y, g, e = sp.symbols("y g e")
ball = sc.Lagrangian(
    T=v**2 / 2,
    V=g * y,
    coordinates={y: v},
    parameters={g: 9.81, e: 0.8},
    events=[sc.Stop(y, restitution=e)],
)
drop = sc.Scene(ball, initial={"y": [1.0]}, window=5, **alone)
result = sc.run(drop, e=[0.5, 0.7, 0.8])
ends = (1 + result.e) / (1 - result.e) * np.sqrt(2 / 9.81)
for restitution, events, end in zip(result.e.values, result.events.event_time.values, ends.values):
    times = events[np.isfinite(events)]
    print(f"e = {restitution}: {times.size} impacts, the last at {times[-1]:.6f}; in theory at rest from {end:.6f} on")

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for restitution in result.e.values:
    one = result.sel(e=restitution)
    axes.plot(one.time, one.trajectory.sel(component="y"), label=f"e = {restitution}")
axes.set(xlabel="t", ylabel="height")
axes.legend()
plt.show()

# %%
# A neuron that is reset
# ----------------------
# A *reset* sets states to new values when a function, the guard, crosses zero upwards.  This leaky neuron integrates
# a current and fires at the voltage 1.  Its spikes lock to the period of the current.
V = sp.Symbol("V")
current = 1.2 + 0.3 * sp.sin(2 * sp.pi * t / 1.7)
neuron = sc.Field({V: current - V}, events=[sc.Reset(V - 1, {V: 0})])
locked = sc.Scene(neuron, window=17, initial={"V": [0.3]}, **alone)
result = sc.run(locked)
print("spikes, in periods of the current:", (result.events.event_time.values / 1.7).round(4))
orbit = sc.periodic_orbit(locked.replace(transient=50), 1)
print(f"multiplier {orbit.multipliers[0].real:.12f}: a deviation shrinks by this factor in each period")

# %%
# Synchrony through impacts
# -------------------------
# Four driven oscillators, joined by springs in a ring, hit stops.  A small deviation jumps at each impact.  The jump
# is the same at each node, so the network splits into modes, as a smooth network does.
hits = sc.Lagrangian(
    T=v**2 / 2,
    V=x**2 / 2,
    Q={x: sp.cos(sp.Rational(5, 2) * t)},
    coordinates={x: v},
    initial={x: 0.1},
    events=[sc.Stop(x, restitution=0.8)],
)
scene = sc.Scene(hits, "spring", sc.graphs.ring(4), record=["sync_error"])
function = sc.msf(scene, np.linspace(0, 6, 121))
print("decay for α in", function.intervals)
for window in function.windows:
    print(f"four synchronise for σ from {window.low:.4f} to {window.high:.4f}")

# %%
# The simulation of all four agrees.
near = scene.replace(initial={"x": [0.1, 0.101, 0.1, 0.099]}, transient=300, window=20)
result = sc.run(near, sigma=np.linspace(0.01, 1.5, 75))

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(result.sigma, result.sync_error + 1e-16, ".-")
for window in function.windows:
    axes.axvspan(window.low, window.high, color="grey", alpha=0.2)
axes.set(xlabel="σ", ylabel="synchronisation error")
plt.show()

# %%
# A limit
# -------
# A damper acts on velocities, and an impact changes the velocity.  With such links, the result would depend on the
# order in which equal oscillators are hit.  The master stability function then raises an error.  A simulation supports
# such links.
try:
    sc.msf(scene.replace(coupling="damper"), [0, 0.1])
except ValueError as problem:
    print(problem)

# %%
# :doc:`Impacts, resets and sliding </impacts>` and :doc:`stick-slip </exact-friction>` explain the mathematics,
# the scene files and the limits.

r"""
A brake pad with two patches
============================

A pad on springs touches a belt with two patches, at the distances :math:`\pm\tfrac12` from its centre.  It has the
displacement x, the angle :math:`\varphi` and the energies

.. math:: T = \tfrac12\dot x^2 + \tfrac1{10}\dot\varphi^2, \qquad V = \tfrac12 x^2 + \varphi^2,

The patches slide with the velocities :math:`w = \vartheta_b - \dot x \mp \tfrac12\dot\varphi`.  The friction
coefficient falls with the speed from 1 to 1/2.  Friction on the patch with more load turns the pad, and the patches
stick and slip at different times.  If the loads are equal and the pad is not turned, it moves like a block: both
patches stick and slip at the same time.
"""

# %%
# Model and run
# -------------
# The program computes the forces of the contacts on x and on the rotation by virtual work.
import sympy as sp

import synchain as sc

x, phi, v, om, N, delta, belt = sp.symbols("x phi v om N delta theta_b")
more = sc.Friction(belt - v - om / 2, load=N * (1 + delta))
less = sc.Friction(belt - v + om / 2, load=N * (1 - delta))
pad = sc.Lagrangian(
    T=v**2 / 2 + om**2 / 10,
    V=x**2 / 2 + phi**2,
    coordinates={x: v, phi: om},
    friction="exponential",
    contact="set-valued",
    events=[more, less],
    parameters={N: 0.5, delta: 0.4, belt: 0.2},
)
settings = {"topology": sc.graphs.chain(1), "transient": 0, "window": 60, "time_unit": "time", "rtol": 1e-11}
settings |= {"parameters": {"mu_s": 1, "mu_k": 0.5, "a": 2}, "record": ["trajectory", "events"]}
scene = sc.Scene(pad, **settings)
result = sc.run(scene)
equal = sc.run(scene, delta=0)

# %%
# Check
# -----
# A pad with equal patches is compared with a block with one contact.
block = sc.Lagrangian(
    v**2 / 2, x**2 / 2, {x: sc.friction(belt - v)}, coordinates={x: v}, friction="exponential", parameters={belt: 0.2}
)
single = sc.run(sc.Scene(block, contact="set-valued", **settings))
path, turned = equal.trajectory.sel(component="x").values, equal.trajectory.sel(component="phi").values
difference = max(abs(path - single.trajectory.sel(component="x").values).max(), abs(turned).max())
print(f"{single.events.event_time.size} times of stick and slip of the block; the pad differs by {difference:.0e}")
assert difference < 1e-9

# %%
# Figure
# ------
# Top: velocities of the patches.  A patch that sticks moves with the belt.  Bottom: times of stick.
import matplotlib.pyplot as plt

velocity, spin, *modes = (
    result.trajectory.sel(component=name).values.ravel() for name in ("v", "om", "slip1", "slip2")
)
_, axes = plt.subplots(figsize=(9, 3.6), layout="constrained")
for k, (sign, name) in enumerate([(1, "more load"), (-1, "less load")]):
    axes.plot(result.time, velocity + sign * spin / 2, color=f"C{k}", label=name)
    low = -0.7 - 0.08 * k
    axes.fill_between(result.time, low, low + 0.06, where=modes[k] == 0, color=f"C{k}")
axes.set(xlabel="t", ylabel="velocity of the patch")
axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
plt.show()

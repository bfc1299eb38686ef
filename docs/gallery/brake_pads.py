r"""
Brake pads that squeal or slide
===============================

A disc with the speed :math:`v_d` drags a pad on springs along,

.. math::
   \ddot x = -x - 2\xi\dot x + \mu(v_d - \dot x), \qquad
   \mu(w) = \Big(\mu_k + (\mu_s - \mu_k) e^{-a|w|}\Big)\operatorname{sgn} w .

The pad slides steadily, or it sticks and slips.  Both motions are stable in a range of speeds.  The program bSTAB
counted how many of 5000 random starts end in steady sliding (Stender & Hoffmann, Nonlinear Dyn. 107, 1451 (2022)).  In
a ring of weakly coupled pads, single pads can squeal (Papangelo, Hoffmann, Grolet, Stender & Ciavarella, J. Sound Vib.
417, 56 (2018)).  Stick is exact here (contact ``"set-valued"``).
"""

# %%
# Model and run
# -------------
import numpy as np
from sympy import symbols
from sympy.physics.mechanics import dynamicsymbols

import synchain as sc

x, (disc, xi) = dynamicsymbols("x"), symbols("v_d xi")
v = x.diff()
pad = sc.Lagrangian(
    T=v**2 / 2,
    V=x**2 / 2,
    R=xi * v**2,
    Q={x: sc.friction(disc - v)},
    friction="exponential",
    contact="set-valued",
    parameters={disc: 1.5, xi: 0.05},
)
law = {"mu_s": 1, "mu_k": 0.5, "a": 2}
settings = {"observe": {"speed": sc.observe.maximum(abs(v))}, "record": (), "time_unit": "time"}
one = sc.Scene(pad, parameters=law, transient=400, window=100, rtol=1e-6, **settings)
speeds = [1.175, 1.25, 1.325, 1.4, 1.475, 1.55, 1.625, 1.7, 1.775, 1.85]
starts = {"x": sc.draw.uniform(-2, 2), "v": sc.draw.uniform(0, 2)}
basins = sc.run(one, v_d=speeds, realisations=1000, draws=starts, rng=1)
n = 12
joined = law | {"sigma": 0.02}
ring = sc.Scene(pad, "spring", sc.graphs.ring(n), parameters=joined, transient=200, window=20, rtol=1e-10, **settings)
pushed = sc.run(ring, realisations=n + 1, draws={"x": [[2] * k + [0.5] * (n - k) for k in range(n + 1)]})

# %%
# Check
# -----
# The shares agree with those of bSTAB within four standard errors.  One ring is compared with SciPy, which restarts at
# every start and end of stick.
from scipy.integrate import solve_ivp

published = np.array([0.0132, 0.08, 0.1478, 0.213, 0.2776, 0.3544, 0.4202, 0.4922, 0.5678, 1])
share = (basins.speed < 0.2).mean("realisation").values[:, 0]
error = np.sqrt(published * (1 - published) * (1 / 5000 + 1 / 1000))
print("sliding:  ", np.round(share, 3))
print("published:", np.round(published, 3))
assert np.all(abs(share - published) <= 4 * error)


def drag(y):
    """The force on each pad besides friction."""
    x, v = y.reshape(2, n)
    return -x - 0.1 * v + 0.02 * (np.roll(x, 1) + np.roll(x, -1) - 2 * x)


def rates(t, y):
    return np.concatenate([y[n:], np.where(sticks, 0, drag(y) + 0.5 + 0.5 * np.exp(-2 * (1.5 - y[n:])))])


def left(t, y):
    """What is left until the next pad lets go, or is caught: static friction is at most 1."""
    held = 1 + drag(y)
    return np.where(sticks, held, np.where(held > 1e-9, 1.5 - y[n:], 1)).min()


left.terminal, left.direction = True, -1
k, t, sticks, y = 3, 0, np.zeros(n, bool), np.array([2.0] * 3 + [0.5] * (n - 3) + [0.0] * n)
while t < 220:
    part = solve_ivp(rates, (t, 220), y, "DOP853", events=left, rtol=1e-11, atol=1e-12, max_step=0.1)
    t, y = part.t[-1], part.y[:, -1]
    sticks = (y[n:] > 1.5 - 1e-9) & (drag(y) > 1e-9 - 1)
    y[n:][sticks] = 1.5
difference = abs(pushed.states("end")[k][: 2 * n] - y).max()
print(f"a ring in which {k} pads were pushed: difference from SciPy {difference:.0e}")
assert difference < 1e-8

# %%
# Figure
# ------
# Left: one pad.  Right: rings in which zero to all pads were pushed at the start, and the pads that squeal at the end.
import matplotlib.pyplot as plt

_, (left_axes, right_axes) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left_axes.errorbar(speeds, share, np.sqrt(share * (1 - share) / 1000), fmt="o", label="1000 starts")
left_axes.plot(speeds, published, "k_", markersize=14, label="bSTAB, 5000 starts")
left_axes.set(xlabel="speed of the disc", ylabel="share that ends in steady sliding")
left_axes.legend()
image = right_axes.pcolormesh(np.arange(1, n + 1), np.arange(n + 1), pushed.speed, cmap="Blues")
plt.colorbar(image, label="largest speed")
right_axes.set(xlabel="pad", ylabel="pads that were pushed")
plt.show()

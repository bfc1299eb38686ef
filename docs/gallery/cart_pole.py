r"""
A cart and its pendulum come to rest
====================================

A pendulum hangs from a cart, and a spring holds the cart.  Dry friction acts at the wheels, with the load N, and in the
joint of the pendulum, with the load J.  The energies are

.. math:: T = \tfrac12 v^2 + \tfrac14(v^2 + 2 v\omega\cos\vartheta + \omega^2), \qquad
   V = \tfrac12 x^2 - \tfrac12\cos\vartheta .

Both contacts stick and slip, and each contact changes the force at the other.  The motion ends after a finite time, at
any point of the rectangle :math:`|x| \le N`, :math:`|\sin\vartheta| \le 2J`.  In this rectangle, friction can hold cart
and pendulum (Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter
5). With smoothed friction, the cart would creep to the point of least energy.
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

x, th, v, om, w, N, J = sp.symbols("x th v om w N J")
cart = sc.Lagrangian(
    T=v**2 / 2 + (v**2 + 2 * v * om * sp.cos(th) + om**2) / 4,
    V=x**2 / 2 - sp.cos(th) / 2,
    coordinates={x: v, th: om},
    friction=sp.sign(w),
    contact="set-valued",
    events=[sc.Friction(-v, load=N), sc.Friction(-om, load=J)],
    parameters={N: 0.1, J: 0.05},
)
start = {"x": [1.0], "th": [2.0]}
one = sc.Scene(cart, topology=sc.graphs.chain(1), initial=start, transient=0, window=30, time_unit="time", rtol=1e-11)
motion = sc.run(one.replace(record=["trajectory", "events"]))
draws = {"x": sc.draw.uniform(-2, 2), "th": sc.draw.uniform(-2, 2), "v": sc.draw.uniform(-1, 1)}
many = sc.run(one.replace(record=(), window=100, rtol=1e-8), realisations=2000, draws=draws, rng=1)

# %%
# Check
# -----
# All motions end at rest in the rectangle.  One motion is compared with SciPy, which restarts at each event.  At each
# event, the check tries all sets of sticking contacts and selects the set that agrees with the forces.
from itertools import product

from scipy.integrate import solve_ivp

x_end, th_end, *rest = many.end.transpose("component", ...).values[..., 0]
assert np.abs(rest).max() < 1e-12  # velocities, and modes: 0 is stick
assert np.all(abs(x_end) <= 0.1)
assert np.all(abs(np.sin(th_end)) <= 0.1)

load = np.array([0.1, 0.05])


def forces(y):
    """The mass matrix, and the forces besides friction."""
    c, s = np.cos(y[1]), np.sin(y[1])
    return np.array([[1.5, c / 2], [c / 2, 0.5]]), np.array([-y[0] + s * y[3] ** 2 / 2, -s / 2])


def motion_of(y, modes):
    """The accelerations, and the friction of each contact relative to its load; mode 0 is stick."""
    mass, force = forces(y)
    slips, a = modes != 0, np.zeros(2)
    a[slips] = np.linalg.solve(mass[np.ix_(slips, slips)], (force - load * modes)[slips])
    return a, (force - mass @ a) / load


def decided(y, modes):
    """The modes after an event at which contacts have no velocity."""
    still = abs(y[2:]) < 1e-9
    for choice in sorted(product((0, 1, -1), repeat=2), key=np.count_nonzero):
        new = np.where(still, choice, modes)
        a, held = motion_of(y, new)
        if np.all(~still | np.where(new == 0, abs(held) < 1 + 1e-12, a * new > 0)):
            return new


def gaps(t, y):
    return np.where(modes == 0, 1 + 1e-11 - abs(motion_of(y, modes)[1]), y[2:] * modes + 1e-11).min()


gaps.terminal, gaps.direction = True, -1
y, modes, t, times = np.array([1.0, 2.0, 0, 0]), np.zeros(2), 0.0, []
modes = decided(y, modes)
while t < 30 and modes.any():
    part = solve_ivp(
        lambda t, y: [*y[2:], *motion_of(y, modes)[0]],
        (t, 30),
        y,
        "DOP853",
        events=gaps,
        rtol=1e-12,
        atol=1e-13,
        max_step=0.05,
    )
    t, y = part.t[-1], part.y[:, -1]
    y[2:][abs(y[2:]) < 1e-9] = 0
    modes = decided(y, modes)
    times.append(t)
found = motion.events.event_time.values
difference = abs(np.unique(found.round(7)) - np.round(times, 7)).max() + abs(motion.states("end")[:4] - y).max()
print(f"{len(times)} times of events, rest at x = {y[0]:.9f}, θ = {y[1]:.9f}; difference {difference:.0e}")
assert difference < 1e-6

# %%
# Figure
# ------
# Left: one motion.  Vertical lines mark where a contact begins to stick or to slip.  Right: end points of 2000 motions.
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for name in ("x", "th"):
    left.plot(motion.time, motion.trajectory.sel(component=name), label={"x": "x", "th": "θ"}[name])
left.vlines(found, -1.5, -1.3, color="black", linewidth=0.8)
left.set(xlabel="t", ylim=(-1.5, 2.1))
left.legend()
right.plot(x_end, np.angle(np.exp(1j * th_end)), ".", markersize=2)
right.add_patch(plt.Rectangle((-0.1, -np.arcsin(0.1)), 0.2, 2 * np.arcsin(0.1), fill=False))
right.set(xlabel="x at rest", ylabel="θ at rest, less whole turns", xticks=[-0.1, 0, 0.1])
plt.show()

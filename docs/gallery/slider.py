r"""
A slider for a parameter
========================

Two Duffing oscillators, :math:`\ddot x_i = -\delta \dot x_i + x_i - x_i^3 + u\cos\omega t +
\sigma(x_j - x_i)`, have phase portraits that a slider of Matplotlib changes.  Each move of the slider integrates 200
units of time and redraws the figure.  To move the slider, run the file on a desktop.  This page shows the figure after
one move.
"""

# %%
# Model and run
# -------------
import time

import numpy as np

import synchain as sc

duffing = sc.Field(
    {"x": "v", "v": "-delta*v + x - x**3 + u*cos(omega*t)"},
    parameters={"delta": 0.25, "u": 0.4, "omega": 1},
    initial={"x": 1, "v": 0},
)
scene = sc.Scene(duffing, "x->v", sc.graphs.chain(2), parameters={"sigma": 0.02}, initial={"x": [1, -0.9]})
scene = scene.replace(transient=100, window=100, time_unit="time", rtol=1e-11)
go = sc.compile(scene, vary=["u", "sigma"], t_eval=np.linspace(100, 200, 2001))
began = time.perf_counter()
portraits = [go(u=u).y for u in np.linspace(0.2, 0.35, 31)]
print(f"{1e3 * (time.perf_counter() - began) / 31:.2f} ms for each position of the slider")

# %%
# Check
# -----
# A periodic motion is compared with SciPy.  The numbers equal those of ``run`` to the last bit.
from scipy.integrate import solve_ivp


def rates(t, y):
    (a, b), (va, vb) = y.reshape(2, 2)
    drive = 0.25 * np.cos(t)
    return [va, vb, -0.25 * va + a - a**3 + drive + 0.02 * (b - a), -0.25 * vb + b - b**3 + drive + 0.02 * (a - b)]


end = go(u=0.25)
times = end.t[::100]
independent = solve_ivp(rates, (0, 200), [1, -0.9, 0, 0], "DOP853", times, rtol=1e-12, atol=1e-13).y
difference = abs(end.y[::100].reshape(-1, 4) - independent.T).max()
print(f"difference from SciPy {difference:.0e}")
assert difference < 1e-6
assert np.array_equal(sc.run(go.scene, u=0.25).trajectory.values, end.y)

# %%
# Figure
# ------
import matplotlib.pyplot as plt
from matplotlib.widgets import Slider

figure, axes = plt.subplots(figsize=(6, 5))
figure.subplots_adjust(bottom=0.22)
lines = axes.plot(end.y[:, 0], end.y[:, 1], linewidth=0.7, label=["oscillator 1", "oscillator 2"])
axes.set(xlabel="x", ylabel="v", xlim=(-1.7, 1.7), ylim=(-1.2, 1.2))
axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
slider = Slider(figure.add_axes([0.2, 0.05, 0.6, 0.05]), "u", 0.1, 0.5, valinit=0.25)


def redraw(u):
    y = go(u=u).y
    for k, line in enumerate(lines):
        line.set_data(y[:, 0, k], y[:, 1, k])
    figure.canvas.draw_idle()


slider.on_changed(redraw)
slider.set_val(0.33)
plt.show()

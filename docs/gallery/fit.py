r"""
Fit a model to data
===================

The data are the numbers of hare and lynx pelts, in thousands, that the Hudson's Bay Company bought from 1900 to 1920.
The model is that of Lotka and Volterra,

.. math::
   \dot u = (\alpha - \beta v)\,u, \quad \dot v = (-\gamma + \delta u)\,v.

Four parameters and both initial states are fitted to the logarithms of the data.  ``sc.compile`` compiles the scene to
a function of NumPy arrays, with exact derivatives for the Jacobian.  ``least_squares`` of SciPy then needs only a few
calls.  Data and estimates: B. Carpenter, *Predator-Prey Population Dynamics: the Lotka-Volterra model in Stan* (2018),
https://mc-stan.org.
"""

# %%
# Model and run
# -------------
import numpy as np
from scipy.optimize import least_squares

import synchain as sc

hares = [30, 47.2, 70.2, 77.4, 36.3, 20.6, 18.1, 21.4, 22, 25.4, 27.1]
hares += [40.3, 57, 76.6, 52.3, 19.5, 11.2, 7.6, 14.6, 16.2, 24.7]
lynxes = [4, 6.1, 9.8, 35.2, 59.4, 41.7, 19, 13, 8.3, 9.1, 7.4]
lynxes += [8, 12.3, 19.5, 45.7, 51.1, 29.7, 15.8, 9.7, 10.1, 8.6]
data, years = np.log([hares, lynxes]).T, np.arange(21)
start = {"alpha": 0.5, "beta": 0.03, "gamma": 1, "delta": 0.03, "u_1": 30, "v_1": 4}
cell = sc.Field(
    {"u": "(alpha - beta*v)*u", "v": "(-gamma + delta*u)*v"}, parameters={name: start[name] for name in [*start][:4]}
)
scene = sc.Scene(cell, initial={"u": 30, "v": 4}, transient=0, window=20)
go = sc.compile(scene, vary=start, t_eval=years, gradient=start)


def residual(q):
    return (np.log(go(**dict(zip(start, q, strict=True))).y[:, :, 0]) - data).ravel()


def jacobian(q):
    end = go(**dict(zip(start, q, strict=True)))
    return np.stack([(end.d[name] / end.y).ravel() for name in start], axis=-1)


fit = least_squares(residual, [*start.values()], jac=jacobian, x_scale=[*start.values()])


# %%
# Check
# -----
# The derivatives are compared with complex steps of a Runge-Kutta method in NumPy.  The parameters are compared with
# the means of Carpenter's posterior distribution, which have two digits.
def states(q, steps=200):
    rates = lambda y: np.array([(q[0] - q[1] * y[1]) * y[0], (-q[2] + q[3] * y[0]) * y[1]])  # noqa: E731
    path, h = [np.array(q[4:])], 1 / steps
    for _ in range(20 * steps):
        y = path[-1]
        k1 = rates(y)
        k2 = rates(y + h / 2 * k1)
        k3 = rates(y + h / 2 * k2)
        path.append(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(y + h * k3)))
    return np.array(path[::steps])


shifted = fit.x + 1e-30j * np.diag(fit.x)
independent = np.stack([np.log(states(q)).imag.ravel() / 1e-30 for q in shifted], axis=-1)
difference = abs(jacobian(fit.x) * fit.x - independent).max()
print(f"{fit.nfev} calls; largest difference of d log y / d log q: {difference:.0e}")
assert difference < 1e-6
published = {"alpha": 0.55, "beta": 0.028, "gamma": 0.80, "delta": 0.024}
for name, value in zip(published, fit.x, strict=False):
    print(f"{name} = {value:.4f}, Carpenter {published[name]}")
    assert abs(value / published[name] - 1) < 0.04

# %%
# Figure
# ------
import matplotlib.pyplot as plt

best = dict(zip(start, fit.x, strict=True))
smooth = sc.compile(scene, vary=start, t_eval=np.linspace(0, 20, 401))(**best)
_, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
for k, (name, colour) in enumerate({"hares": "tab:blue", "lynxes": "tab:red"}.items()):
    axes.plot(1900 + smooth.t, smooth.y[:, k, 0], color=colour, label=name)
    axes.plot(1900 + years, np.exp(data[:, k]), "o", color=colour, markersize=4)
axes.set(xlabel="year", ylabel="pelts in thousands", xticks=range(1900, 1921, 5), ylim=(0, None))
axes.legend()
plt.show()

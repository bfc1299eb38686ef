r"""
Bursting neurons: electrical and chemical synapses
==================================================

Hindmarsh-Rose neurons obey

.. math::
   \dot x = a x^2 - x^3 - y - z, \quad \dot y = (a + \alpha) x^2 - y, \quad
   \dot z = \mu(b x + c - z).

Chemical synapses add :math:`-g(x_i - V_s)\sum_j W_{ij}/(1 + e^{-\lambda(x_j - \Theta_s)})` to the rate of :math:`x_i`.
Belykh, de Lange & Hasler, Phys. Rev. Lett. 94, 188101 (2005), found that synchrony depends only on the number k of
signals that each neuron receives, and not on other properties of the graph.  The threshold of g k is one number.  The
second network has six neurons with two kinds of synapses: electrical synapses on a ring and chemical synapses between
all pairs.  The figure shows the region of both strengths in which they synchronise.
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

x, y, z, g, k = sp.symbols("x y z g k")
cell = sc.Field(
    {x: 2.8 * x**2 - x**3 - y - z, y: 4.4 * x**2 - y, z: 0.001 * (9 * x + 5 - z)},
    initial={x: -0.5, y: 1, z: 4},
)
i, j, W = sc.ends(cell)
pulse = 1 / (1 + sp.exp(-10 * (j.x + 0.25)))
chemical = sc.Rates({i.x: -g * W * (i.x - 2) * pulse}, {g: 0.3})
electrical = sc.Rates({i.x: k * W * (j.x - i.x)}, {k: 0.1})
start = {"x": [-0.5, 0, 0.5, 1, -1], "y": 1, "z": 0}
layers = [(electrical, sc.graphs.chain(5)), (chemical, sc.graphs.star(5))]
settings = {"transient": 0, "window": 450, "time_unit": "time", "record": ("trajectory",), "samples": 3001}
both = sc.Scene(cell, links=layers, initial=start, rtol=1e-12, **settings)
result = sc.run(both)
pair = sc.Scene(cell, chemical, sc.graphs.chain(2), time_unit="time")
modes = np.linspace(0.25, 2, 8)  # -γ/k of the modes of undirected graphs lies between 0 and 2
exponents = {gk: sc.exponents(pair, gk * modes, g=gk, starts=1, periods=2000) for gk in (1, 1.2, 1.3, 1.5)}
six = both.replace(links=[(electrical, sc.graphs.ring(6)), (chemical, sc.graphs.complete(6))], initial=None)
region = sc.plane(six, k=np.linspace(0, 1, 21), g=np.linspace(0, 0.3, 16), starts=1)

# %%
# Check
# -----
# Five neurons with two layers are compared with SciPy.  The exponent must change its sign between g k = 1.2 and 1.3 for
# the modes of all graphs.  It must change its sign in the plane too, without electrical synapses (k = 0), where each
# neuron receives five signals.
from scipy.integrate import solve_ivp

star, path = (np.array(graph.matrix, dtype=float) for graph in (sc.graphs.star(5), sc.graphs.chain(5)))
np.fill_diagonal(star, 0)


def rates(t, s):
    x, y, z = s.reshape(3, 5)
    links = 0.1 * path @ x - 0.3 * (x - 2) * (star @ (1 / (1 + np.exp(-10 * (x + 0.25)))))
    return np.concatenate([2.8 * x**2 - x**3 - y - z + links, 4.4 * x**2 - y, 0.001 * (9 * x + 5 - z)])


begin = np.concatenate([start["x"], np.full(5, 1), np.zeros(5)])
end = solve_ivp(rates, (0, 450), begin, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
difference = abs(result.states("end") - end).max()
print(f"difference from SciPy {difference:.0e}")
assert difference < 1e-7
for gk, found in exponents.items():
    print(f"g k = {gk}: exponents from {found.exponent.min():.4f} to {found.exponent.max():.4f}")
    assert np.all(np.sign(found.exponent) == (1 if gk < 1.25 else -1))
chemical_alone = region.data.exponent.sel(k=0).sel(g=[0.24, 0.26], method="nearest").values
assert chemical_alone[0] > 0 > chemical_alone[1]

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, (left, right, last) = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
left.plot(result.time, result.trajectory.sel(component="x"), linewidth=0.5)
left.set(xlabel="time", ylabel="x", title="five neurons, two layers of links")
for gk, found in exponents.items():
    right.errorbar(modes, found.exponent, found.stderr, label=f"g k = {gk}")
right.axhline(0, color="black", linewidth=0.5)
right.set(xlabel="−γ/k", ylabel="exponent", title="modes of all graphs")
right.legend()
region.plot(last).set(xlabel="electrical k", ylabel="chemical g", title="largest exponent of six neurons")
plt.show()

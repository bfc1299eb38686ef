r"""
A table of master stability functions
=====================================

A mode of strength :math:`\alpha = -\sigma\gamma` decays where the master stability function
:math:`\Lambda(\alpha)` is negative (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998)).  The shape of the function
depends on the link: a state of node j acts on a state of node i.  Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204
(2009), compare all nine links for several oscillators.  This example shows nine links of Rössler's oscillator
(a = b = 0.2, c = 9) and five of Lorenz's (10, 28, b = 2).  The zero
7.322 of Lorenz's x → x is that of Bayani et al., Nature Communications 15, 4955 (2024); the other zeros below are our
values, of longer averages.
"""

# %%
# Model and run
# -------------
import numpy as np
from sympy import symbols

import synchain as sc

x, y, z, sigma = symbols("x y z sigma")
rossler = {x: -y - z, y: x + 0.2 * y, z: 0.2 + z * (x - 9)}
lorenz = {x: 10 * (y - x), y: x * (28 - z) - y, z: x * y - 2 * z}
pairs = [a + b for a in "xyz" for b in "xyz"]


def functions(rates, alpha, links):
    node = sc.Field(rates, initial={"x": 1, "y": 1, "z": 20})
    i, j, W = sc.ends(node)
    h = {pair: symbols(f"h_{pair}") for pair in pairs}
    act = {getattr(i, b): sigma * W * sum(h[a + b] * (getattr(j, a) - getattr(i, a)) for a in "xyz") for b in "xyz"}
    coupling = sc.Rates(act, {sigma: 1, **dict.fromkeys(h.values(), 0)})
    scene = sc.Scene(node, coupling, sc.graphs.chain(2), time_unit="time")
    options = {"starts": 1, "periods": 3000, "precision": 5e-3}
    return {link: sc.msf(scene, alpha, **{f"h_{pair}": 1 for pair in link.split()}, **options) for link in links}


found = {
    "Rössler": functions(rossler, np.linspace(0, 6, 61), pairs),
    "Lorenz": functions(lorenz, np.linspace(0, 20, 61), ["xx", "xy", "yx", "yy", "zz", "xx yy zz"]),
}

# %%
# Check
# -----
# The zeros agree with these values within four standard errors.  If every state acts on itself with the same
# strength, the function must be :math:`\Lambda(0) - \alpha`.
expected = {("Rössler", "xx"): [0.189, 4.611], ("Lorenz", "xx"): [7.322], ("Lorenz", "yy"): [2.289]}
for name, table in found.items():
    for pair in table:
        words = [f"{low:.3f} to {high:.3f}" for low, high in table[pair].intervals] or ["never"]
        print(f"{name:8} {pair:8} {table[pair].kind:18} {', '.join(words)}")
for (name, pair), zeros in expected.items():
    ends, errors = found[name][pair].intervals[0], found[name][pair].uncertainties[0]
    for zero, end, error in zip(zeros, ends, errors):
        assert abs(end - zero) < 4 * error < 0.5, f"{name} {pair}: expected {zero}, found {end} ± {error}"
whole = found["Lorenz"].pop("xx yy zz")
difference = abs(whole.exponent - whole.exponent[0] + whole.alpha).max()
print(f"difference from Λ(0) - α {difference:.0e}")
assert difference < 1e-5

# %%
# Figure
# ------
# Dots are the zeros above.  Grey curves have no zero.
import matplotlib.pyplot as plt

_, panels = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for axes, (name, table) in zip(panels, found.items()):
    for pair, function in table.items():
        style = {"label": f"{pair[0]} → {pair[1]}"} if function.intervals else {"color": "grey", "alpha": 0.5}
        axes.plot(function.alpha, function.exponent, linewidth=1, **style)
    for pair in table:
        zeros = expected.get((name, pair), [])
        axes.plot(zeros, np.zeros(len(zeros)), "k.")
    axes.axhline(0, color="black", linewidth=0.5)
    axes.set(title=name, xlabel="α", ylabel="Λ", ylim=(-2.5, 2))
    axes.legend(fontsize="small")
plt.show()

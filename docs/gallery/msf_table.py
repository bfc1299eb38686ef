r"""
Master stability functions of chaotic oscillators
=================================================

A mode of strength :math:`\alpha = -\sigma\gamma` decays where the master stability function
:math:`\Lambda(\alpha)` is negative (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998)).  Huang,
Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009), tabulate its zeros: for the Rössler oscillator
(a = b = 0.2, c = 9) coupled in x the range is 0.186 to 4.614, for the Lorenz oscillator (10, 28,
b = 2) coupled in x it begins at 7.3 and has no end.
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

rossler = sc.Scene(oscillator="rossler", coupling="x->x", topology=sc.chain(2))
lorenz = sc.Scene(oscillator="lorenz", coupling="x->x", topology=sc.chain(2), parameters={"b": 2})
functions = {
    "Rössler x→x": sc.msf(rossler, np.linspace(0, 6, 121), starts=2, periods=400, precision=5e-3),
    "Lorenz x→x": sc.msf(lorenz, np.linspace(0, 20, 121), starts=2, periods=200, precision=5e-3),
}

# %%
# Check
# -----
# Every published zero lies within four standard errors, and these are small.
difference = 0
published = {"Rössler x→x": [0.186, 4.614], "Lorenz x→x": [7.3]}
for name, function in functions.items():
    ((low, high),), ((low_error, high_error),) = function.intervals, function.uncertainties
    print(f"{name}: {low:.3f} ± {low_error:.3f} to {high:.3f} ± {high_error:.3f}, {function.kind}")
    for zero, found, error in zip(published[name], (low, high), (low_error, high_error)):
        difference = max(difference, abs(found - zero))
        assert abs(found - zero) < 4 * error < 0.5, f"{name}: published {zero}, found {found} ± {error}"
assert [f.kind for f in functions.values()] == ["bounded interval", "half-line"]

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, panels = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for axes, (name, function) in zip(panels, functions.items()):
    axes.fill_between(function.alpha, function.exponent, 0, where=function.exponent < 0, alpha=0.2)
    axes.errorbar(function.alpha, function.exponent, function.stderr, linewidth=1)
    axes.plot(published[name], np.zeros(len(published[name])), "o", color="black", label="published zeros")
    axes.axhline(0, color="black", linewidth=0.5)
    axes.set(title=name, xlabel="α", ylabel="Λ")
    axes.legend()
plt.show()

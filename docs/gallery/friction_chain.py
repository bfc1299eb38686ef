r"""
The friction chain and its threshold
====================================

Four oscillators on a moving belt are joined by springs and driven at :math:`\omega = 1.15`:

.. math::
   \ddot x_i = -x_i + u\cos\omega t + \varepsilon f(\vartheta_b - \dot x_i)
   + \sigma\sum_j G_{ij} x_j .

Marszal, Saha, Jankowski & Stefański, Eur. Phys. J. Special Topics (2016), found by simulation that two oscillators
synchronise up to :math:`\sigma = 0.233`.  The master stability function predicts such thresholds for every graph from
one orbit.
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

two = sc.Scene(topology=sc.graphs.chain(2), parameters={"omega": 1.15})
four = two.replace(topology=sc.graphs.chain(4), record=("sync_error",))
function = sc.msf(two, np.linspace(0.0, 1.0, 101))
window = sc.msf(four, np.linspace(0.0, 1.0, 101)).windows[0]
result = sc.run(four, sigma=np.linspace(0.0, 0.25, 26))

# %%
# Check
# -----
# The end of the window of two oscillators is compared with the published value.  The end for four oscillators is
# compared with simulations on both sides of it.
end = function.windows[0].high
synchronous = result.sync_error.values < 1e-6
difference = abs(end - 0.233)
print(f"two: σ < {end:.4f}, published 0.233")
print(f"four: σ < {window.high:.4f}, where γ = {window.high_mode.eigenvalue.number} is lost")
assert difference < 5e-4
assert synchronous[(result.sigma > 0.03) & (result.sigma < window.high - 0.02)].all()
assert not synchronous[result.sigma > window.high + 0.01].any()

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left.plot(function.alpha, function.exponent)
left.axhline(0, color="black", linewidth=0.5)
left.set(xlabel="α = −σγ", ylabel="transversal exponent Λ")
right.semilogy(result.sigma, result.sync_error.values + 1e-16, ".-")
right.axvline(window.high, color="grey", linestyle="--")
right.set(xlabel="σ", ylabel="synchronisation error of four")
plt.show()

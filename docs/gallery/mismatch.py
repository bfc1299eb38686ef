r"""
An ensemble of unequal oscillators
==================================

Equal oscillators that synchronise become nearly equal when their parameters differ: to first order,
the error is proportional to the spread of the parameters (Sorrentino & Porfiri, arXiv:1102.1709).
Forty networks are drawn: eight sets of deviations, each in five sizes.
"""

# %%
# Model and run
# -------------
import numpy as np

import synchain as sc

n, sets, sizes = 5, 8, np.geomspace(1e-4, 1e-3, 5)
deviations = np.random.default_rng(7).standard_normal((sets, n))
mu = 1 + (sizes[:, None, None] * deviations).reshape(-1, n)
scene = sc.Scene(
    "van_der_pol",
    "spring",
    sc.ring(n),
    parameters={"sigma": 0.5},
    axes={f"mu_{k + 1}": mu[:, k] for k in range(n)},
    zipped=True,
    initial={"x": [2, 1.9, 1.8, 2.1, 2.2], "v": 0},
    record=("sync_error", "trajectory"),
    transient=500,
    window=20,
    time_unit="time",
    samples=201,
    rtol=1e-10,
)
result = sc.run(scene)

# %%
# Check
# -----
# The last network against SciPy, and the slope of the error over the size of the deviations.
from scipy.integrate import solve_ivp


def rates(t, y):
    x, v = y[:n], y[n:]
    pull = np.roll(x, 1) + np.roll(x, -1) - 2 * x
    return np.concatenate([v, mu[-1] * (1 - x**2) * v - x + 0.5 * pull])


begin = [2, 1.9, 1.8, 2.1, 2.2, *[0] * n]
end = solve_ivp(rates, (0, 520), begin, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
errors = result.sync_error.values.reshape(len(sizes), sets)
slopes = np.log(errors[-1] / errors[0]) / np.log(sizes[-1] / sizes[0])
print(f"difference from SciPy {abs(result.states('end')[-1] - end).max():.0e}")
print(f"slopes from {slopes.min():.3f} to {slopes.max():.3f}")
np.testing.assert_allclose(result.states("end")[-1], end, atol=1e-6)
np.testing.assert_allclose(slopes, 1, atol=0.01)

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
axes.loglog(sizes, errors, "o-", linewidth=0.7)
axes.set(xlabel="size of the deviations of μ", ylabel="synchronisation error")
plt.show()

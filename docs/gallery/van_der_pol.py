r"""
Van der Pol's oscillator, stiff
===============================

:math:`\ddot x = -x + \mu(1 - x^2)\dot x` with :math:`\mu = 1000` is the problem VDPOL of the Test
Set for Initial Value Problem Solvers (Mazzia & Magherini, University of Bari, release 2.4 (2008)),
which prints the state at :math:`t = 2000` in the scaled time :math:`t/\mu`.
"""

# %%
# Model and run
# -------------
from synchain.models import Scene
from synchain.runtime import run

scene = Scene(
    oscillator="van_der_pol",
    parameters={"mu": 1000},
    initial={"x": 2, "v": 0},
    record=("trajectory",),
    transient=0,
    window=2000,
    time_unit="time",
    samples=4001,
    integrator="rodas5p",
    rtol=1e-9,
)
result = run(scene)

# %%
# Check
# -----
import numpy as np

published = np.array([1.706167732170483, -0.8928097010247975e-3])
found = result.end.values
print(f"{int(result.steps)} steps, relative difference {abs(found / published - 1).max():.1e}")
np.testing.assert_allclose(found, published, rtol=1e-7)

# %%
# Figure
# ------
import matplotlib.pyplot as plt

_, axes = plt.subplots(figsize=(8, 3), layout="constrained")
axes.plot(result.trajectory_time, result.trajectory[:, 0])
axes.set(xlabel="time", ylabel="x")
plt.show()

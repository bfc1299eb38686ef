r"""
The friction chain
==================

A mass on a moving belt, held by a spring, is dragged along by dry friction until the spring pulls
it back: it sticks, slips, and oscillates by itself.  A force :math:`u\cos\omega t` drives it as
well,

.. math:: \ddot x = -x + u\cos\omega t + \varepsilon f(\vartheta_b - \dot x).

Four of these in a chain, joined by springs of stiffness :math:`\sigma`: when do they move as one?
The question is that of Marszal, Saha, Jankowski & Stefański, *Eur. Phys. J. Special Topics* (2016).
"""

# %%
# The scene
# ---------
# A scene contains all settings of a run.  Settings that you leave out have default values: the
# friction oscillator, springs, the published parameters.
import synchain as sc

scene = sc.Scene(topology=sc.graphs.chain(4), parameters={"omega": 1.15}, record=("sync_error",))
print(sc.export.text(scene.equations))

# %%
# The spectrum
# ------------
# A chain of four has four modes.  Each obeys the equation of one oscillator, coupled with the
# strength :math:`\alpha = -\sigma\gamma`, where γ is its eigenvalue.  They are exact.
for eigenvalue in scene.spectrum:
    print(eigenvalue.number, "=", eigenvalue.value)

# %%
# Stability from one orbit
# ------------------------
# The master stability function is the exponent :math:`\Lambda(\alpha)` with which a mode of
# strength α grows or decays along the synchronous motion.  It does not depend on the graph.
import matplotlib.pyplot as plt
import numpy as np

function = sc.msf(scene, np.linspace(0.0, 1.0, 101))
print("decay for α in", function.intervals, "of", function.attractors[0])

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(function.alpha, function.exponent)
axes.axhline(0.0, color="black", linewidth=0.5)
axes.set(xlabel="α", ylabel="Λ")
plt.show()

# %%
# With the eigenvalues it becomes a range of σ: all three modes must lie where Λ is negative.  The
# mode with the largest eigenvalue is the first to be lost.
(window,) = function.windows
lost = window.high_mode.eigenvalue.number
print(f"synchronous for {window.low:.4f} < σ < {window.high:.4f}; then γ = {lost} is lost")

# %%
# The simulation agrees
# ---------------------
# A sweep integrates the whole network for every σ and records the mean difference between the
# oscillators.  The first call compiles a kernel for these equations; later ones find it in a cache.

result = sc.run(scene, sigma=np.linspace(0.0, 0.25, 51))
print(result.message)

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
result.sync_error.plot(ax=axes, marker=".")
axes.axvspan(window.low, window.high, color="grey", alpha=0.2)
plt.show()

# %%
# Another drive
# -------------
# At ω = 1.40 one oscillator is chaotic, and modes need some coupling before they decay.
chaotic = sc.msf(scene, np.linspace(0.0, 1.0, 101), omega=1.40)
for low, high in chaotic.intervals:
    print(f"decay for α from {low:.3f} to {high:.3f}")
for window in chaotic.windows:
    print(f"four synchronise for σ from {window.low:.3f} to {window.high:.3f}; published: 0.153 to 0.177")

# %%
# Keep the result
# ---------------
# A result is labelled, describes itself, and opens again without the code that made it.
from pathlib import Path
from tempfile import TemporaryDirectory

with TemporaryDirectory() as folder:
    path = Path(folder, "four.nc")
    result.save(path)
    print(sc.open_result(path).data)

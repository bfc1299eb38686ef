r"""
The friction chain
==================

A spring holds a mass on a moving belt.  Dry friction drags the mass along until the spring pulls it back: it
sticks, slips, and oscillates by itself.  A force :math:`u\cos\omega t` also drives it,

.. math:: \ddot x = -x + u\cos\omega t + \varepsilon f(\vartheta_b - \dot x).

Four of these oscillators form a chain, joined by springs of stiffness :math:`\sigma`.  For which :math:`\sigma` do they
synchronise?  Marszal, Saha, Jankowski & Stefański asked this in *Eur. Phys. J. Special Topics* (2016).
"""

# %%
# The scene
# ---------
# A scene contains all settings of a run.  The defaults are the friction oscillator, springs, and the published
# parameters.
import synchain as sc

scene = sc.Scene(topology=sc.graphs.chain(4), parameters={"omega": 1.15}, record=("sync_error",))
print(sc.export.text(scene.equations))

# %%
# The spectrum
# ------------
# A chain of four has four modes.  Each mode obeys the equation of one oscillator, coupled with the
# strength :math:`\alpha = -\sigma\gamma`, where γ is its eigenvalue.  The eigenvalues are exact.
for eigenvalue in scene.spectrum:
    print(eigenvalue.number, "=", eigenvalue.value)

# %%
# Stability from one orbit
# ------------------------
# The master stability function :math:`\Lambda(\alpha)` is the growth rate of a mode of strength α along the
# synchronous motion.  A mode decays if it is negative.  The function does not depend on the graph.
import matplotlib.pyplot as plt
import numpy as np

function = sc.msf(scene, np.linspace(0.0, 1.0, 101))
print("decay for α in", function.intervals, "of", function.attractors[0])

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(function.alpha, function.exponent)
axes.axhline(0.0, color="black", linewidth=0.5)
axes.set(xlabel="strength α of a mode", ylabel="exponent Λ per unit of time")
plt.show()

# %%
# The chain is synchronous if Λ is negative for all three modes with γ < 0.  With the eigenvalues, this gives a range
# of σ.  The mode with the most negative γ becomes unstable first.
(window,) = function.windows
lost = window.high_mode.eigenvalue.number
print(f"synchronous for {window.low:.4f} < σ < {window.high:.4f}; above, the mode γ = {lost} is unstable")

# %%
# The simulation agrees
# ---------------------
# A sweep integrates the whole network for every σ and records the mean difference between the oscillators.  The
# predicted window is grey.

result = sc.run(scene, sigma=np.linspace(0.0, 0.25, 51))
print(result.message)

_, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(result.sigma, result.sync_error, ".-")
axes.axvspan(window.low, window.high, color="grey", alpha=0.2)
axes.set(xlabel="stiffness σ", ylabel="synchronisation error")
plt.show()

# %%
# Another drive
# -------------
# At ω = 1.40 the motion of one oscillator is chaotic.  Modes decay only if the coupling is strong enough.
chaotic = sc.msf(scene, np.linspace(0.0, 1.0, 101), omega=1.40)
for low, high in chaotic.intervals:
    print(f"decay for α from {low:.3f} to {high:.3f}")
for window in chaotic.windows:
    print(f"four synchronise for σ from {window.low:.3f} to {window.high:.3f}; published: 0.153 to 0.177")

# %%
# Keep the result
# ---------------
# A result has labelled axes.  The saved file describes itself, and opens without the code of the model.
from pathlib import Path
from tempfile import TemporaryDirectory

with TemporaryDirectory() as folder:
    path = Path(folder, "four.nc")
    result.save(path)
    print(sc.open_result(path).data)

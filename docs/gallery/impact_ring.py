r"""
Impact oscillators in a ring
============================

Three driven oscillators, :math:`\ddot x = -x + \cos\omega t` with :math:`\omega = 2.5`, hit stops at :math:`x = 0` and
rebound with 0.8 of their speed (Shaw & Holmes, J. Appl. Mech. 50, 849 (1983)).  Springs of stiffness σ join them in a
ring.  At each impact, a saltation matrix multiplies small deviations (Müller, Chaos Solitons Fractals 5, 1671 (1995)).
This matrix is the same at all nodes.  The ring therefore splits into modes of strength α, and there is a master
stability function.
"""

# %%
# Model and run
# -------------
import numpy as np
import sympy as sp

import synchain as sc

x, v, t, e = sp.symbols("x v t e")
node = sc.Lagrangian(
    T=v**2 / 2,
    V=x**2 / 2,
    Q={x: sp.cos(sp.Rational(5, 2) * t)},
    coordinates={x: v},
    parameters={e: 0.8},
    initial={x: 0.1},
    events=[sc.Stop(x, restitution=e)],
)
scene = sc.Scene(node, "spring", sc.graphs.ring(3), rtol=1e-11)
function = sc.msf(scene, np.linspace(0, 6, 241))
near = scene.replace(initial={"x": [0.1, 0.100001, 0.099999]}, transient=400, window=1)
result = sc.run(near, sigma=np.linspace(0.01, 2, 100))

# %%
# Check
# -----
# The orbit with one impact per period T is
# :math:`x = K(\cos(\omega t + \psi) - \cos\psi\,(\cos t + \tan\frac T2 \sin t))`, with :math:`K = 1/(1 - \omega^2)`.
# The multipliers of a mode, whose frequency between impacts is :math:`\Omega = \sqrt{1 + \alpha}`, have the
# product e² and the sum :math:`-2e\cos\Omega T + (1 + e)\cos\psi\,\sin(\Omega T)/(\Omega v^-)`.
w, restitution = 2.5, 0.8
period, tangent, scale = 2 * np.pi / w, np.tan(np.pi / w), 1 / (1 - w**2)
psi = np.arctan(-tangent * (1 - restitution) / (w * (1 + restitution)))
speed = scale * (tangent * np.cos(psi) - w * np.sin(psi))  # just before the impact
omega = np.sqrt(1 + function.alpha)
both = -2 * restitution * np.cos(omega * period)
both += (1 + restitution) * np.cos(psi) * np.sin(omega * period) / (omega * speed)
exact = [np.log(abs(np.roots([1, -each, restitution**2])).max()) / period for each in both]
difference = abs(function.exponent - exact).max()
print(f"speed before impacts {speed:.6f}; largest difference of 241 exponents from the closed form {difference:.0e}")
assert difference < 1e-7
spread = np.ptp(result.end.sel(component="x").values, axis=-1)
inside = np.any([(w.low < result.sigma) & (result.sigma < w.high) for w in function.windows], axis=0)
assert np.all((spread < 1e-9) == inside)

# %%
# Figure
# ------
# Left: the exponent of a mode.  Right: three oscillators after 400 periods, with an initial distance of 1e-6.  Grey:
# the prediction.
import matplotlib.pyplot as plt

_, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
function.plot(ax=left)
right.semilogy(result.sigma, spread + 1e-16, ".-")
for window in function.windows:
    right.axvspan(window.low, window.high, color="grey", alpha=0.2)
right.set(xlabel="σ", ylabel="largest distance at the end")
plt.show()

r"""
Chimeras that rest, breathe and breathe slowly
==============================================

Abrams, Mirollo, Strogatz & Wiley, Physical Review Letters 101, 084103 (2008).

Two populations of equal phases have links of the strength :math:`\mu = (1 + A)/2` inside each population, links of the
strength :math:`\nu = (1 - A)/2` between them, and the lag :math:`\pi/2 - \beta`, β = 0.1.  In a chimera state, one
population synchronises and the other does not.  Fig. 2 shows the order parameter r of the second population.  At A =
0.2 it becomes constant (a stable chimera).  At A = 0.28 and 0.35 it oscillates (a breathing chimera).

Our populations have 32 phases each, distributed by a Poisson kernel.  For this distribution, r obeys the equations of
the limit of infinitely many phases, which the paper studies.
"""

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import synchain as sc

n, beta, strengths = 32, 0.1, (0.2, 0.28, 0.35)
theta, K, lag = sp.symbols("theta K lag")
phase = sc.Field({theta: 0})
i, j, W = sc.ends(phase)
sine = sc.Rates({i.theta: K * W * sp.sin(j.theta - i.theta - lag)}, {K: 1 / n, lag: float(np.pi / 2 - beta)})
kernel = np.exp(2j * np.pi * (np.arange(n) + 0.5) / n)
start = {"theta": [*np.full(n, -0.1), *np.angle((0.7 + kernel) / (1 + 0.7 * kernel))]}
order = []
for A in strengths:
    links = [(a, b, (1 + A) / 2 if a // n == b // n else (1 - A) / 2) for a in range(2 * n) for b in range(a)]
    scene = sc.Scene(phase, sine, sc.graphs.from_edges(links), initial=start, transient=1000, window=400, rtol=1e-6)
    result = sc.run(scene.replace(time_unit="time", record=("trajectory",), samples=801))
    order.append(abs(np.exp(1j * result.states("trajectory")).reshape(-1, 2, n).mean(axis=2)))
varies = [float(np.ptp(r[:, 1]) > 1e-3) for r in order]
claims = {
    f"A = {A}: whether r varies": (float(A > 0.25), found, 0.0) for A, found in zip(strengths, varies, strict=True)
}
claims["order of the other population"] = (1.0, min(r[:, 0].min() for r in order), 1e-3)
reproduction = sc.results.Reproduction(claims)
print(reproduction)
for A, r in zip(strengths, order, strict=True):
    plt.plot(result.time, r[:, 1], label=f"A = {A}")
plt.gca().set(xlabel="time", ylabel="order parameter r of the second population")
plt.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=3)

r"""
The damping that steadies a power grid best
===========================================

Motter, Myers, Anghel & Nishikawa, Nature Physics 9, 191 (2013).

Small deviations from the synchronous state of equal machines separate into modes, :math:`\ddot\xi = -\alpha\xi -
\beta\dot\xi`.  The numbers α are the eigenvalues of the linearised lines.  The best damping is the β at which the
slowest mode decays fastest.  It is :math:`\beta = 2\sqrt{\alpha_2}` with the smallest non-zero eigenvalue
:math:`\alpha_2`, and the rate is then :math:`\sqrt{\alpha_2}`.

We use another grid, of six machines, and change the damping in steps of 2 %.  Below the best damping, all modes decay
at β/2.  Above it, the slowest mode is overdamped.
"""

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import synchain as sc

theta, v, P, beta, K = sp.symbols("theta v P beta K")
machine = sc.Field({theta: v, v: P - beta * v}, parameters={P: 0, beta: 1})
i, j, W = sc.ends(machine)
line = sc.Rates({i.v: K * W * sp.sin(j.theta - i.theta)}, {K: 4})
powers = {"P": [1, -1, 2, -2, 1, -1]}
grid = sc.Scene(machine, line, sc.graphs.ring(6), parameters=powers, time_unit="time")
underdamped = sc.equilibrium(grid, beta=0.1).eigenvalues
alpha = np.sort(abs(underdamped[underdamped.imag != 0]) ** 2)[0]
ratios = np.linspace(0.5, 1.5, 51)
rates = []
for ratio in ratios:
    eigenvalues = sc.equilibrium(grid, beta=float(ratio * 2 * np.sqrt(alpha))).eigenvalues
    rates.append(np.sort(eigenvalues.real)[-2])
best = int(np.argmin(rates))
reproduction = sc.results.Reproduction(
    {
        "best damping over twice the root of α₂": (1, ratios[best], 0.02),
        "rate of decay over the root of α₂": (1, -rates[best] / np.sqrt(alpha), 0.02),
    }
)
print(reproduction)
plt.plot(ratios, rates)
plt.gca().set(xlabel="damping, in units of its best value", ylabel="largest real part")

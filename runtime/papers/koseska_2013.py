r"""
Two ways in which coupled oscillators come to rest
==================================================

Koseska, Volkov & Kurths, Physics Reports 531, 173 (2013).

The review distinguishes amplitude death from oscillation death.  In amplitude death, all oscillators rest in the state
that is unstable without links.  In oscillation death, they rest in different states, which exist only with links.

Our example has both: two Stuart-Landau oscillators of the frequencies ω = 2 and 10, with links x → x of the strength K.
The common state of rest is stable from a Hopf point on.  It ends in a branch point, from which two stable states with
unlike signs of x start.  There the determinant of the Jacobian is zero, which has the closed form
:math:`K = (1 + \omega_1^2)(1 + \omega_2^2)/(2 + \omega_1^2 + \omega_2^2)`.  Our number is compared with it.
"""

import numpy as np

import synchain as sc

frequencies = np.array([2, 10])
rates = {"x": "(1 - x**2 - y**2)*x - w*y", "y": "(1 - x**2 - y**2)*y + w*x"}
oscillator = sc.Field(rates, parameters={"w": 1}, initial={"x": 0, "y": 0})
link = sc.Rates({"x": "K*W*(x_j - x_i)"}, {"K": 1})
pair = sc.Scene(oscillator, link, sc.graphs.chain(2), parameters={"w": frequencies.tolist()})
common = sc.follow(sc.equilibrium(pair), "K", to=10)
(end,) = common.points["branch point"]
apart = sc.follow(end, "K", to=10)
beyond = [branch.stable[branch.values > end.value + 1e-9] for branch in (common, apart)]
squares = 1 + frequencies**2
states = np.array([apart[0].state, apart[-1].state])
reproduction = sc.results.Reproduction(
    {
        "strength at which amplitude death ends": (np.prod(squares) / np.sum(squares), end.value, 1e-9),
        "Hopf points below, one for each oscillator": (2, len(common.points["Hopf"]), 0),
        "stable common states beyond": (0, np.sum(beyond[0]), 0),
        "states of oscillation death": (2, len(np.unique(states.round(6), axis=0)), 0),
        "sign of the product of both x": (-1, np.sign(states[0, 0] * states[0, 1]), 0),
        "stable share of these states": (1, np.mean(beyond[1]), 0),
    }
)
print(reproduction)
sc.diagram(common, apart).plot(y="x_2")

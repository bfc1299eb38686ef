"""
Rest and rhythm of a column of the cortex
=========================================

Grimbert & Faugeras, Neural Computation 18, 3052 (2006).

A column of the cortex has three populations of neurons (Jansen & Rit, Biological Cybernetics 73, 357 (1995)): pyramidal
cells, excitatory interneurons and inhibitory interneurons.  The paper continues the equilibrium in the input p.  The
branch has two folds and three Hopf points.  Cycles from the second to the third Hopf point are the alpha rhythm.

The published numbers are those of AUTO-07p in P. Clusella's tutorial (github.com/pclus/auto-tutorial, *Jansen-Rit*):
inputs and excitatory potentials of both folds and of the first Hopf point.  All agree to the printed digits.
"""

import synchain as sc

sigmoid = "5/(1 + exp(0.56*(6 - {})))".format
rates = {"y0": "u0", "y1": "u1", "y2": "u2"}
rates["u0"] = f"325*{sigmoid('(y1 - y2)')} - 200*u0 - 10000*y0"
rates["u1"] = f"325*(p + 108*{sigmoid('(135*y0)')}) - 200*u1 - 10000*y1"
rates["u2"] = f"37125*{sigmoid('(135*y0/4)')} - 100*u2 - 2500*y2"
column = sc.Field(rates, parameters={"p": -60}, initial=dict.fromkeys(rates, 0))
rest = sc.follow(sc.equilibrium(sc.Scene(column)), "p", to=400)
high, low = rest.points["fold"]
first, second, third = rest.points["Hopf"]
alpha = sc.follow(second, "p", to=400)
reproduction = sc.results.Reproduction(
    {
        "input at the upper fold": (113.586, high.value, 5e-4),
        "excitatory potential there": (6.21929, high.solution.state[1], 5e-6),
        "input at the lower fold": (-41.3014, low.value, 5e-5),
        "excitatory potential there, too": (13.3511, low.solution.state[1], 5e-5),
        "input at the first Hopf point": (-12.1475, first.value, 5e-5),
        "excitatory potential at the first Hopf point": (16.0292, first.solution.state[1], 5e-5),
        "input where the alpha rhythm ends, over that of the third Hopf point": (
            1,
            alpha.bifurcations[-1].value / third.value,
            1e-6,
        ),
    }
)
print(reproduction)
sc.diagram(rest, alpha).plot(y="maximum(y1 - y2)")

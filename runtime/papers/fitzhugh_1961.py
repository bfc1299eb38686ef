r"""
Between which currents a nerve fires
====================================

FitzHugh, Biophysical Journal 1, 445 (1961).

The equilibrium of :math:`\dot x = c(y + x - x^3/3 + z),\ \dot y = -(x - a + by)/c` with a = 0.7, b = 0.8 and c = 3
loses its stability if the trace of the Jacobian is zero.  This gives :math:`x^2 = 1 - b/c^2` and the frequency
:math:`\sqrt{1 - b^2/c^2}`.  The nerve fires between two currents z, which have a closed form.  Our numbers are compared
with it.

One branch of cycles joins both Hopf points.  It turns at folds outside of the Hopf points, so rest and firing coexist
near both currents.  The equations are invariant under x → -x, y → 2a/b - y, z → -2a/b - z, so the folds have equal
distances from the Hopf points.
"""

import numpy as np

import synchain as sc

a, b, c = 0.7, 0.8, 3
rates = {"x": f"{c}*(y + x - x**3/3 + z)", "y": f"-(x - {a} + {b}*y)/{c}"}
nerve = sc.Scene(sc.Field(rates, parameters={"z": 0}, initial={"x": 1.2, "y": -0.6}))
rest = sc.follow(sc.equilibrium(nerve), "z", to=-2)
firing = sc.follow(rest.points["Hopf"][0], "z", within=(-2, 0))
x = np.sqrt(1 - b / c**2) * np.array([1, -1])
currents = x**3 / 3 - x - (a - x) / b
folds = sorted(fold.value for fold in firing.points["fold"])
claims = {
    f"current at {name}": (current, hopf.value, 1e-9)
    for name, current, hopf in zip(("the first Hopf point", "the last"), currents, rest.points["Hopf"], strict=True)
}
claims["frequency there"] = (np.sqrt(1 - b**2 / c**2), rest.points["Hopf"][0].frequency, 1e-9)
claims["folds of cycles"] = (2, len(folds), 0)
claims["distance of both folds from the Hopf points, ratio"] = (
    1,
    (folds[1] - currents[0]) / (currents[1] - folds[0]),
    1e-6,
)
reproduction = sc.results.Reproduction(claims)
print(reproduction)
sc.diagram(rest, firing).plot(y="maximum(x)")

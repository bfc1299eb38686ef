"""
Links on triangles synchronise as links on edges
================================================

Gambuzza et al., Nature Communications 12, 1255 (2021).

Links of three ends have a generalised Laplacian.  With "natural" coupling, a link on a triangle equals a link on an
edge if its two sources are equal.  Modes then obey the same master stability function for triangles and edges.  If all
N nodes are joined, the Laplacian of the triangles is N − 2 times the Laplacian of the edges.  Triangles therefore need
a strength that is N − 2 times smaller.

This script uses five Rössler oscillators (0.2, 0.2, 9) with cubic links.  It computes both functions.
"""

import numpy as np

import synchain as sc

rossler = sc.Field({"x": "-y - z", "y": "x + 0.2*y", "z": "0.2 + z*(x - 9)"}, initial={"x": 1, "y": 1, "z": 1})
edges = sc.Scene(rossler, sc.Rates({"x": "p*W*(x_j**3 - x_i**3)"}, {"p": 1e-3}), sc.graphs.complete(5))
three = sc.Rates({"x": "q*W*(x_j**2*x_k - x_i**3)"}, {"q": 1e-3})
triangles = sc.Scene(rossler, three, sc.graphs.triangles(sc.graphs.complete(5)))
strengths = np.linspace(0, 0.1, 41)
pair, triad = (sc.msf(each, strengths, starts=1, periods=1500, precision=5e-3) for each in (edges, triangles))
difference = float(abs(pair.exponent - triad.exponent).max())
reproduction = sc.results.Reproduction(
    {
        "eigenvalue of triangles over that of edges": (
            3,
            abs(triangles.spectrum.values[-1] / edges.spectrum.values[-1]),
            0,
        ),
        "threshold of edges over that of triangles": (3, pair.windows[0].low / triad.windows[0].low, 0.3),
        "difference of the two functions": (0, difference, 0.02),
    }
)
print(reproduction)
pair.plot()

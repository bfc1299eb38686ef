"""The first Lyapunov coefficient of a Hopf point.

With A q = i w q, <q, q> = 1, and the second and third derivatives B and C of the rates (Kuznetsov, Elements of Applied
Bifurcation Theory, 3rd ed. (Springer, 2004), equation (5.39)):

    l = Re <p, C(q, q, q*) - 2 B(q, A^-1 B(q, q*)) + B(q*, (2iw - A)^-1 B(q, q))> / (2 w).

B and C are exact: templates are differentiated along one direction; two directions follow by polarisation.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .equilibria import Equilibria
from .equilibrium import bordered


def first_lyapunov_coefficient(problem: Equilibria, z: np.ndarray, vector: np.ndarray, frequency: float) -> float:
    """Return the coefficient of a Hopf point; NaN if the mass matrix depends on the state."""
    network = problem.network
    if not network.constant_mass:
        return float("nan")
    state, _, values = problem.split(z)
    second, third = (network.along(order).at(values) for order in (2, 3))
    network = network.at(values)
    jacobian, mass = network.jacobian(state), network.mass(state)
    mass = sparse.eye_array(len(state), format="csc") if mass is None else mass

    def quadratic(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return B(u, v) of real vectors: four times it is B(u + v, u + v) - B(u - v, u - v)."""
        plus, minus = (second.rates(np.append(state, w)) for w in (u + v, u - v))
        return np.asarray(0.25 * (plus - minus))

    def cubic(u: np.ndarray) -> np.ndarray:
        return third.rates(np.append(state, u))

    def bilinear(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        real = quadratic(u.real, v.real) - quadratic(u.imag, v.imag)
        return np.asarray(real + 1j * (quadratic(u.real, v.imag) + quadratic(u.imag, v.real)))

    # Right and left eigenvectors, y* M q = 1.
    q = vector / np.linalg.norm(vector)
    matrix = sparse.csc_array(jacobian - (1j * frequency * (1.0 + 1e-11)) * mass)
    solver = splu(matrix)
    y = q.copy()
    for _ in range(4):
        y = solver.solve(y, trans="H")
        y /= np.linalg.norm(y)
    y /= np.conj(y.conj() @ (mass @ q))
    a, b = q.real, q.imag
    # C(q, q, q*) = C(a,a,a) + C(a,b,b) + i (C(a,a,b) + C(b,b,b)).
    plus, minus, aaa, bbb = cubic(a + b), cubic(a - b), cubic(a), cubic(b)
    thrice = aaa + (plus + minus - 2.0 * aaa) / 6.0 + 1j * ((plus - minus - 2.0 * bbb) / 6.0 + bbb)
    around = bilinear(q, q.conj()).real
    right = np.append(around, np.zeros(len(problem.shifts)))
    mean = splu(sparse.csc_array(bordered(jacobian, problem.ones))).solve(right)
    double = splu(sparse.csc_array(2j * frequency * mass - jacobian)).solve(bilinear(q, q))
    terms = thrice - 2.0 * bilinear(q, mean[: len(state)].astype(complex)) + bilinear(q.conj(), double)
    return float((y.conj() @ terms).real / (2.0 * frequency))

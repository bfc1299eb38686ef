"""Eigenvalues of products of matrices, such as the propagators of the segments of an orbit."""

from __future__ import annotations

import math

import numpy as np

SPREAD = 1e10  # largest ratio of the eigenvalues of a product that are found from the product itself (a choice)


def product_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the eigenvalues (n,) of the product M_m … M_1 of matrices (m, n, n), small ones too.

    The eigenvalues of the block-cyclic matrix of the M_i are the m-th roots of those of the product, m of each; the
    roots in one sector of the plane are one of each. Sources: Watkins, SIAM Rev. 47, 3 (2005).
    """
    m, n, _ = matrices.shape
    product = np.linalg.multi_dot([np.eye(n), *matrices[::-1], np.eye(n)]) if n else np.zeros((0, 0))
    values = np.linalg.eigvals(product)
    if m == 1 or not n or np.abs(values).max() < SPREAD * np.abs(values).min():
        return values
    cyclic = np.zeros((m * n, m * n), matrices.dtype)
    for i in range(m):
        cyclic[(i + 1) % m * n : (i + 1) % m * n + n, i * n : i * n + n] = matrices[i]
    roots = np.linalg.eigvals(cyclic)
    # The sector begins in the widest gap between the angles of the roots, taken modulo the sector.
    angles = np.sort(np.angle(roots) % (2.0 * math.pi / m))
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * math.pi / m))
    first = angles[int(gaps.argmax())] + 0.5 * float(gaps.max())
    inside = (np.angle(roots) - first) % (2.0 * math.pi) < 2.0 * math.pi / m
    return np.asarray(roots[inside] ** m)


def null_vectors(matrices: np.ndarray, value: complex, count: int) -> np.ndarray:
    """Return orthonormal vectors (n, count) that the product of matrices (m, n, n) multiplies by a value."""
    product = np.linalg.multi_dot([np.eye(matrices.shape[1]), *matrices[::-1], np.eye(matrices.shape[1])])
    number = value if abs(value.imag) > 0.0 else value.real
    rows = np.linalg.svd(product - number * np.eye(len(product)))[2]
    return np.asarray(rows[len(rows) - count :].conj().T)

"""Eigenvalues of the linearised equations of a network.

If all nodes are alike and links act by a Laplacian L, the Jacobian at equal states is A (x) I - H (x) L.  Its eigenvalues
are those of A - lambda_k H for the eigenvalues lambda_k of L: small matrices for a network of any size.  Any other
network of up to DENSE states takes one dense matrix.  Of larger ones a few eigenvalues nearest to zero are computed.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, splu

from synchain.models.dynamics.equations import Equations

DENSE = 2000  # most states of which all eigenvalues are computed: their dense matrix has 32 MB (a choice)
FEW = 12  # number of eigenvalues of larger networks, unless `count` is given (a choice)
SMALL = 64  # most states of which matrices are dense (a choice)
# Few eigenvalues are computed around this point, in units of the largest entry of J; 0 is an eigenvalue of each
# shift.
ASIDE = 1e-6
BLOCKS = 1e-11  # largest difference between a Jacobian and its blocks, relative to its largest entry (a choice)


def eigenvalues(jacobian: sparse.csc_array, mass: sparse.csc_array | None, count: int | None = None) -> np.ndarray:
    """Return eigenvalues of M^-1 J, in any order: all up to DENSE states, or the `count` nearest to zero."""
    size = jacobian.shape[0]
    if count is None and size > DENSE:
        count = FEW
    if count is None or count >= size - 1:  # Arnoldi's method gives size - 2 at most
        return np.asarray(linalg.eigvals(jacobian.toarray(), None if mass is None else mass.toarray()))
    # Arnoldi's method on (J - a M)^-1 M: its largest eigenvalues 1/(lambda - a) belong to those nearest to a.
    mass = sparse.eye_array(size, format="csc") if mass is None else mass
    aside = ASIDE * float(abs(jacobian).max())
    solver = splu(jacobian - aside * mass)
    inverse = LinearOperator((size, size), matvec=lambda v: solver.solve(mass @ v), dtype=float)
    try:
        largest = eigs(inverse, count, v0=1.0 + np.arange(size) % 7, return_eigenvectors=False)
    except ArpackNoConvergence:
        raise ArithmeticError(
            f"eigenvalues: the {count} nearest to zero of {size} did not converge; ask for another count"
        ) from None
    return np.asarray(aside + 1.0 / largest)


def eigenvalue_condition(matrix: np.ndarray, values: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return how far errors of a matrix (n, n), relative to sizes of its entries, move some eigenvalues: |y|'S|x|/|y* x|.

    No unit of a state enters.  Source: Higham & Higham, SIAM J. Matrix Anal. Appl. 20, 493 (1998), section 3.
    """
    numbers, left, right = linalg.eig(matrix, left=True)
    nearest = np.abs(numbers[:, None] - values).argmin(axis=0)
    left, right = left[:, nearest], right[:, nearest]
    moved = (np.abs(left) * (sizes @ np.abs(right))).sum(axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(moved / np.abs((left.conj() * right).sum(axis=0)))


class ModeBlocks:
    """The eigenvalues of a network of equal nodes by small blocks, one for each mode of its graph."""

    def __init__(self, equations: Equations) -> None:
        (layer,) = equations.layers
        self.n, self.components = equations.n, len(equations.node.state)
        links = [*layer.links]
        rows, columns = np.array([i for i, _, _ in links], dtype=int), np.array([j for _, j, _ in links], dtype=int)
        weights = np.array([float(weight) for _, _, weight in links])
        adjacency = sparse.csr_array((weights, (rows, columns)), (self.n, self.n))
        degrees = np.asarray(adjacency.sum(axis=1)).ravel()
        self.laplacian = sparse.csr_array(sparse.diags_array(degrees) - adjacency)
        self.link = (int(rows[0]), int(columns[0]), float(adjacency[rows[0], columns[0]]), float(degrees[rows[0]]))

    @classmethod
    def of(cls, equations: Equations) -> ModeBlocks | None:
        """Return the blocks of a network, None if its links or masses allow none."""
        alike = not equations.mixed and not equations.differing and not equations.inertial
        return cls(equations) if alike and len(equations.layers) == 1 and equations.link_count else None

    @cached_property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues (n,) and eigenvectors (n, n) of the Laplacian, ascending; real if it is symmetric."""
        matrix = self.laplacian.toarray()
        if np.array_equal(matrix, matrix.T):
            values, vectors = linalg.eigh(matrix)
            values[np.abs(values) < 1e-13 * np.abs(values).max()] = 0.0
            return values, vectors
        values, vectors = linalg.eig(matrix)
        order = np.lexsort((values.imag, values.real))
        return values[order], vectors[:, order]

    @cached_property
    def numbers(self) -> np.ndarray:
        """Number (n,) of the distinct eigenvalue of each mode: 0 for that of equal states."""
        values = self.spectrum[0]
        apart = np.abs(np.diff(values)) > 1e-9 * max(1.0, float(np.abs(values).max()))
        return np.concatenate([[0], np.cumsum(apart)])

    def matrices(self, jacobian: sparse.csc_array) -> tuple[np.ndarray, np.ndarray] | None:
        """Return A and H (components, components) of a Jacobian A (x) I - H (x) L, None if it has another form."""
        i, j, weight, degree = self.link
        rows, places = jacobian.tocsr(), self.n * np.arange(self.components)
        at_target, at_source = (rows[places + i][:, places + k].toarray() for k in (i, j))
        coupling = at_source / weight
        own, limit = at_target + degree * coupling, BLOCKS * abs(jacobian).max()
        if jacobian.shape[0] <= SMALL:
            rebuilt = np.kron(own, np.eye(self.n)) - np.kron(coupling, self.laplacian.toarray())
            return (own, coupling) if np.abs(jacobian.toarray() - rebuilt).max() <= limit else None
        sparse_parts = sparse.kron(own, sparse.eye_array(self.n)) - sparse.kron(coupling, self.laplacian)
        return (own, coupling) if abs(jacobian - sparse_parts).max() <= limit else None

    def values(self, jacobian: sparse.csc_array) -> tuple[np.ndarray, np.ndarray] | None:
        """Return all eigenvalues and the mode of each, None if the Jacobian has no blocks."""
        matrices = self.matrices(jacobian)
        if matrices is None:
            return None
        own, coupling = matrices
        values = np.linalg.eigvals(own - self.spectrum[0][:, None, None] * coupling)
        return values.ravel().astype(complex), np.repeat(np.arange(self.n), self.components)

    def condition(self, jacobian: sparse.csc_array, mode: int, value: complex) -> float:
        """Return the condition of an eigenvalue of the block of a mode."""
        (own, coupling), eigenvalue = self.matrices(jacobian) or (np.eye(1), np.eye(1)), self.spectrum[0][mode]
        degree = self.link[3]
        # Own slopes and those of links may cancel.
        sizes = np.abs(own - degree * coupling) + (abs(degree) + abs(eigenvalue)) * np.abs(coupling)
        return float(eigenvalue_condition(own - eigenvalue * coupling, np.array([value]), sizes)[0])

    def text(self, mode: int) -> str:
        """Describe a mode: its number, signs of a simple one on few nodes, eigenvalue."""
        values, vectors = self.spectrum
        number, eigenvalue = self.numbers[mode], values[mode]
        signs = ""
        if (self.numbers == number).sum() == 1 and self.n <= 12:
            vector = (vectors[:, mode] / vectors[np.abs(vectors[:, mode]).argmax(), mode]).real
            signs = " ".join("0" if abs(x) < 1e-9 else "+" if x > 0 else "-" for x in vector) + ", "
        shown = eigenvalue.real if abs(eigenvalue.imag) < 1e-12 else eigenvalue
        return f"mode {number} of the graph, {signs}eigenvalue {shown:.10g}"

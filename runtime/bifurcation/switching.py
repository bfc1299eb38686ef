"""Directions of the branches that leave a branch point.

The equations R(z) = 0 of a problem have two null vectors at a simple branch point: the tangent t of the branch that is
known, and w.  The tangent a t + w of the other branch solves the algebraic bifurcation equation
2 a u R_zz t w + u R_zz w w = 0 with the left null vector u (Keller).

In a network with symmetry the null space of the Jacobian at a branch point is mapped to itself by the automorphisms of the graph.  By the
equivariant branching lemma there is a branch along each line of the null space that is the fixed space of a group of
automorphisms.  Lines that an automorphism maps to each other give images of one branch: one line of each class is
returned.  At a Hopf point a shift in time changes the phase of an eigenvector, so that lines which automorphisms map to
themselves up to a phase count as well: rotating and standing waves of a ring.

Sources: Keller, in Rabinowitz (ed.), Applications of Bifurcation Theory (Academic Press, 1977), pages 359-384; Golubitsky, Stewart & Schaeffer, Singularities and Groups in Bifurcation Theory, volume 2 (Springer, 1988),
theorems XIII.3.2 and XVI.4.1.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.automorphisms import automorphisms

from ..results.labels import States
from .arclength import STALLED, Point
from .problems import BranchProblem, Matrix

# Largest graphs of which automorphisms are listed, and most automorphisms (choices).
MOST_NODES, MOST_AUTOMORPHISMS = 60, 2000
MOST_SPACES = 300  # most fixed spaces that are intersected (a choice)
# Distance at which second derivatives are measured beside a branch point, in the metric of a problem (a choice).
STEP = 1e-3
# Singular values that count as zero and the shift of inverse iteration, relative to a scale of the entries; most null
# vectors of a sparse matrix (choices).
NULL, SHIFT, MOST_VECTORS = 1e-6, 1e-12, 12
SAME = 1e-6  # largest difference of vectors of one line, and of a state and its image (a choice)


def permutations_of(scene: Scene) -> list[np.ndarray]:
    """Return the permutations of states (states,) under which the equations stay the same, the identity first."""
    equations = scene.equations
    identity = np.arange(equations.dimension)
    alike = not equations.mixed and not equations.differing and len(equations.layers) == 1
    if not alike or scene.n > MOST_NODES:
        return [identity]
    try:
        found = automorphisms([scene.topology], MOST_AUTOMORPHISMS)
    except ValueError:  # too many
        return [identity]
    rows, columns = States.of(scene).rows, States.of(scene).columns
    return [rows * equations.n + np.array(each)[columns] for each in found]


def directions(scene: Scene, state: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Return one vector (k, states) for each class of branches.

    Shapes: basis (states, m), orthonormal; real null vectors, or complex eigenvectors of a Hopf point.
    """
    if basis.shape[1] == 1:
        return basis.T
    scale = float(np.abs(state).max()) or 1.0
    kept = [p for p in permutations_of(scene) if np.abs(state[p] - state).max() <= SAME * scale]
    # The automorphisms act on the space by orthogonal, or unitary, matrices (m, m).
    actions = {tuple(np.round(each, 6).ravel()): each for each in (basis.conj().T @ basis[p] for p in kept)}
    queue = [space for each in actions.values() for space in _fixed(each) if 0 < space.shape[1] < basis.shape[1]]
    distinct: list[np.ndarray] = []
    while queue and len(distinct) < MOST_SPACES:
        space = queue.pop()
        projector = space @ space.conj().T
        if any(np.abs(projector - other @ other.conj().T).max() < SAME for other in distinct):
            continue
        queue += [common for other in distinct if (common := _common(space, other)).shape[1] > 0]
        distinct.append(space)
    lines: list[np.ndarray] = []
    for space in distinct:
        if space.shape[1] == 1:
            line = space[:, 0]
            images = (each @ line for each in actions.values())
            if not any(abs(abs(np.vdot(image, known)) - 1.0) < SAME for image in images for known in lines):
                lines.append(line)
    return np.array([basis @ line for line in lines]) if lines else basis.T


def leave(problem: BranchProblem, vector: np.ndarray, known: np.ndarray) -> Point | None:
    """Return a problem's point with the tangent of the branch that crosses a known one there; None if none crosses.

    Shapes: vector (n,), change of the first states along the new branch; known (n + 1,), the tangent of the known one: of
    the first states and of the parameter.
    """
    weights = problem.weights
    measured = weights > 0.0
    units = 1.0 / np.where(measured, weights, 1.0)
    places = [*range(len(vector)), -1]

    def slopes(z: np.ndarray) -> Matrix:
        return problem.linearise(z)[1] * units

    # All slopes of a single state vanish at its branch point: their change in a unit of length is a scale, too.
    matrix = slopes(problem.point)
    scale = max(abs(matrix).max(), abs(slopes(problem.point + STEP * units * measured) - matrix).max() / STEP)
    left, right = null_spaces(matrix, scale)
    if right.shape[1] < 2:  # a branch point along another parameter is none along this one
        return None

    def completed(part: np.ndarray) -> np.ndarray:
        """Return the null vector with some first states and parameter, of length 1."""
        whole = right @ np.linalg.lstsq(right[places], part / units[places])[0]
        return np.asarray(whole / np.linalg.norm(whole[measured]))

    tangent, other = completed(known), completed(np.append(vector, 0.0))
    if (
        abs(other[measured] @ tangent[measured]) > 1.0 - SAME
    ):  # the known branch was born here: the other goes on with p
        other = right @ right[-1]
    other -= (other[measured] @ tangent[measured]) * tangent
    other /= np.linalg.norm(other[measured])
    plus, minus = (slopes(problem.point + h * units * other) for h in (STEP, -STEP))
    mixed, square = (left.T @ ((plus @ v - minus @ v) / (2.0 * STEP)) for v in (tangent, other))
    share = 0.5 * float(mixed @ square) / float(mixed @ mixed or 1.0)
    new = other - share * tangent
    size = float(np.linalg.norm(new[measured]))
    return Point(problem.point, units * new / size, 0, crossing=units * tangent)


def in_family(problem: BranchProblem, z: np.ndarray) -> bool:
    """Return whether a solution is one of many at its parameter, as under a conserved quantity."""
    units = np.where(problem.weights > 0.0, 1.0 / np.where(problem.weights > 0.0, problem.weights, 1.0), 1.0)
    residual, matrix = problem.linearise(z)
    if not isinstance(matrix, np.ndarray):
        return False
    right = null_spaces(matrix * units, float(abs(matrix * units).max()))[1]
    if right.shape[1] < 2:
        return False
    # Along a null vector that keeps the parameter there is a solution at a distance; at a branch point there is none.
    along = right @ np.linalg.svd(right[-1:])[2][-1]
    point = z + STEP * units * along
    for _ in range(4):
        try:
            residual, matrix = problem.linearise(point)
        except ArithmeticError:
            return False
        rows = np.vstack([(matrix * units)[:, :-1], along[:-1]])
        point = point + units * np.append(np.linalg.lstsq(rows, np.append(-residual, 0.0))[0], 0.0)
    return bool(np.all(np.abs(problem.linearise(point)[0]) <= STALLED * problem.noise(point)))


def null_spaces(matrix: Matrix, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return orthonormal bases of the left (size, k) and right (size + 1, k + 1) null space of a matrix (size, size + 1)."""
    if isinstance(matrix, np.ndarray):
        left, sizes, rows = np.linalg.svd(matrix)
        null = sizes < NULL * scale
        return left[:, null], np.vstack([rows[:-1][null], rows[-1]]).T
    # Inverse iteration for the smallest singular values, with a row of zeros below the matrix.
    size = matrix.shape[1]
    square = sparse.csc_array(sparse.vstack([matrix, sparse.csc_array((1, size))]))
    solver = splu(sparse.csc_array(square + SHIFT * scale * sparse.eye_array(size)))
    left = np.random.default_rng(0).normal(size=(size, min(MOST_VECTORS, size)))
    for _ in range(4):
        right = np.linalg.qr(solver.solve(left))[0]
        left = np.linalg.qr(solver.solve(right, trans="T"))[0]
    null = np.linalg.norm(square @ right, axis=0) < NULL * scale
    return left[:-1, null], right[:, null]


def _fixed(action: np.ndarray) -> list[np.ndarray]:
    """Return orthonormal bases (m, k) of the vectors that a matrix leaves unchanged; if it is unitary, up to a phase."""
    values = np.ones(1) if np.isrealobj(action) else np.linalg.eigvals(action)
    spaces = []
    for k, value in enumerate(values):
        if np.all(np.abs(values[:k] - value) > SAME):  # a shift in time makes up for the phase of an oscillation
            _, sizes, rows = np.linalg.svd(action - value * np.eye(len(action)))
            spaces.append(rows[sizes < SAME].conj().T)
    return spaces


def _common(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis of the intersection of two spaces."""
    _, sizes, rows = np.linalg.svd(one.conj().T @ other)
    return np.asarray(other @ rows[: len(sizes)][sizes > 1.0 - SAME].conj().T)

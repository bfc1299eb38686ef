"""Directions of the branches that leave a branch point of a network with symmetry.

The null space of the Jacobian at a branch point is mapped to itself by the automorphisms of the graph.  By the
equivariant branching lemma there is a branch along each line of the null space that is the fixed space of a group of
automorphisms.  Lines that an automorphism maps to each other give images of one branch: one line of each class is
returned.  At a Hopf point a shift in time changes the phase of an eigenvector, so that lines which automorphisms map to
themselves up to a phase count as well: rotating and standing waves of a ring.

Source: Golubitsky, Stewart & Schaeffer, Singularities and Groups in Bifurcation Theory, volume 2 (Springer, 1988),
theorems XIII.3.2 and XVI.4.1.
"""

from __future__ import annotations

import numpy as np

from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.automorphisms import automorphisms

from ..results.labels import States

MOST_NODES, MOST_AUTOMORPHISMS = 60, 2000
"""Largest graphs of which automorphisms are listed, and most automorphisms (choices)."""

MOST_SPACES = 300
"""Most fixed spaces that are intersected (a choice)."""

SAME = 1e-6
"""Largest difference of vectors of one line, and of a state and its image (a choice)."""


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

"""The transversal modes of a network: eigenvalue, multiplicity, and how far each oscillator takes part."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.spectra.eigenvalue import Eigenvalue
from synchain.models.spectra.jordan import geometric_multiplicity

__all__ = ["NetworkMode", "has_loose_parts", "transversal_modes"]

VECTOR_LIMIT = 2000
"""Most nodes for which an eigenvector is computed: the matrix is dense."""


@dataclass(frozen=True, slots=True)
class NetworkMode:
    """One distinct non-zero eigenvalue of a network.

    `number` is its place in the spectrum, 0 the synchronous motion, every eigenvalue counted as often as it occurs.
    """

    graph: Topology = field(repr=False)
    number: int
    eigenvalue: Eigenvalue

    @property
    def size(self) -> float:
        """|gamma| as a float."""
        return abs(self.eigenvalue.value)

    @property
    def multiplicity(self) -> int:
        """How often the eigenvalue occurs (algebraic multiplicity)."""
        return self.eigenvalue.multiplicity

    @property
    def defective(self) -> bool:
        """True where there are fewer independent eigenvectors than the multiplicity says, by an exact rank."""
        return geometric_multiplicity(self.graph, self.eigenvalue) < self.multiplicity

    @property
    def vector(self) -> np.ndarray:
        """An eigenvector (n,) of unit length whose largest entry is positive; complex where the eigenvalue is.

        Of a multiple eigenvalue it is the one that stands out most at a single oscillator (the first of equals).
        Raises ValueError for more than VECTOR_LIMIT nodes.
        """
        n = self.graph.n
        if n > VECTOR_LIMIT:
            raise ValueError(f"eigenvector of {self.graph.name}({n}): expected at most {VECTOR_LIMIT} nodes")
        shifted = np.array([[float(x) for x in row] for row in self.graph.rows]) - self.eigenvalue.value * np.eye(n)
        independent = geometric_multiplicity(self.graph, self.eigenvalue)
        basis = np.linalg.svd(shifted)[2][n - independent :].conj().T
        weight = np.sum(np.abs(basis) ** 2, axis=1)
        column = basis @ basis[int(np.argmax(weight >= weight.max() - 1e-9))].conj()
        return np.asarray(column / np.linalg.norm(column))


def transversal_modes(graph: Topology) -> tuple[NetworkMode, ...]:
    """The modes of a network other than 0, in the order of its spectrum."""
    found, number = [], 0
    for eigenvalue in graph.spectrum.eigenvalues:
        if eigenvalue.value != 0:
            found.append(NetworkMode(graph, number, eigenvalue))
        number += eigenvalue.multiplicity
    return tuple(found)


def has_loose_parts(graph: Topology) -> bool:
    """True where 0 is a multiple eigenvalue: parts of the network that nothing couples to each other."""
    return graph.spectrum.zeros > 1

"""The transversal modes of a network: eigenvalues, multiplicities and eigenvectors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.spectra.eigenvalue import Eigenvalue
from synchain.models.spectra.jordan import geometric_multiplicity

# Most nodes for which an eigenvector is computed (a choice); the matrix is dense and then takes 32 MB.
VECTOR_LIMIT = 2000


@dataclass(frozen=True, slots=True)
class NetworkMode:
    """A distinct non-zero eigenvalue of a network."""

    graph: Topology = field(repr=False)
    number: int  # index in the spectrum, counted with multiplicities; 0 is the synchronous motion
    eigenvalue: Eigenvalue  # eigenvalue gamma

    def __repr__(self) -> str:
        return f"NetworkMode({self.number}, gamma = {self.eigenvalue})"

    @property
    def size(self) -> float:
        return abs(self.eigenvalue.value)

    @property
    def multiplicity(self) -> int:
        return self.eigenvalue.multiplicity

    @property
    def defective(self) -> bool:
        """True if there are fewer independent eigenvectors than the multiplicity (exact rank)."""
        return geometric_multiplicity(self.graph, self.eigenvalue) < self.multiplicity

    @property
    def vector(self) -> np.ndarray:
        """Unit eigenvector (n,) whose largest entry is positive; complex if the eigenvalue is."""
        # For a multiple eigenvalue, return the vector that is most localised at a single oscillator; of equally
        # localised vectors, the vector at the first oscillator.
        n = self.graph.n
        if n > VECTOR_LIMIT:
            raise ValueError(f"eigenvector of {self.graph.name}({n}): expected at most {VECTOR_LIMIT} nodes")
        # Basis of the null space of G - gamma I: the right singular vectors of the smallest singular values.
        shifted = np.array([[float(x) for x in row] for row in self.graph.rows]) - self.eigenvalue.value * np.eye(n)
        independent = geometric_multiplicity(self.graph, self.eigenvalue)
        basis = np.linalg.svd(shifted)[2][n - independent :].conj().T
        # Project the unit vector of each node onto the null space; choose the node with the longest projection.
        weight = np.sum(np.abs(basis) ** 2, axis=1)
        column = basis @ basis[int(np.argmax(weight >= weight.max() - 1e-9))].conj()
        return np.asarray(column / np.linalg.norm(column))


def transversal_modes(graph: Topology) -> tuple[NetworkMode, ...]:
    """Return the modes of a network with an eigenvalue other than 0."""
    modes, number = [], 0
    for eigenvalue in graph.spectrum.eigenvalues:
        if eigenvalue.value != 0:
            modes.append(NetworkMode(graph, number, eigenvalue))
        number += eigenvalue.multiplicity
    return tuple(modes)


def defective_rows(graph: Topology) -> list[tuple[str, str]]:
    """Return a row for each defective eigenvalue: the growth t^p e^(lambda t) of errors, for the exponent lambda."""
    powers = [(e, e.blocks[0][0] - 1 if e.blocks else 0) for e in graph.spectrum.defective]
    return [("defective", f"gamma = {e}: growth t{f'^{p}' if p > 1 else ''} e^(lambda t)") for e, p in powers]


def has_loose_parts(graph: Topology) -> bool:
    """Return True if 0 is a multiple eigenvalue: some parts of the network are not connected."""
    return graph.spectrum.zeros > 1

"""Multipliers of the differences within clusters, along an orbit of the quotient network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy import linalg

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import Variation, mode
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import with_numbers
from ..stability.motion import Turns
from ..stability.orbits import OrbitProblem
from ..stability.transversal_modes import transversal_modes
from .flow import TOLERANCE, Flow, flow_of
from .products import null_vectors, product_eigenvalues

WHOLE = "differences within clusters"  # the block of all differences, where they do not split into modes of the graph


@dataclass(slots=True)
class Transversal:
    """The differences within clusters: by the modes of the graph, or of the whole network."""

    scene: Scene
    classes: tuple[int, ...]
    labels: tuple[str, ...]  # of the blocks; the mode of the graph, with its eigenvalue
    gamma: np.ndarray  # (blocks, layers): eigenvalues of the modes; empty where the whole network is integrated
    multiplicity: np.ndarray  # (blocks,)
    whole: Flow | None = field(default=None, repr=False)

    @classmethod
    def of(cls, scene: Scene, classes: tuple[int, ...]) -> Transversal | None:
        """Return the differences within clusters; None if every cluster has one node."""
        if len(set(classes)) == len(classes):
            return None
        if len(set(classes)) == 1:
            try:
                modes = transversal_modes(scene)
                gamma = np.array([mode.values for mode in modes])
                if gamma.ndim > 2:
                    raise ValueError("layers that do not commute")
                labels = tuple(f"eigenvalue {', '.join(f'{value:.10g}' for value in mode.values)}" for mode in modes)
                one = cls(scene, classes, labels, gamma, np.array([m.multiplicity for m in modes]))
                _mode(without_drive(scene.equations, scene.parameters), bool(np.iscomplexobj(gamma)))
                return one
            except ValueError:  # links without common modes
                pass
        return cls(scene, classes, (WHOLE,), np.zeros((0, 0)), np.ones(1, dtype=int))

    def multipliers(
        self, values: Mapping[str, float], states: np.ndarray, period: float, scale: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return multipliers (k,) and their blocks (k,) along an orbit of the quotient. Shapes: states (m, n)."""
        m = len(states)
        if not len(self.gamma):
            within = product_eigenvalues(self._of_whole(values, states, period)[0])
            return within, np.zeros(len(within), dtype=int)
        slips = np.zeros((m, len(self.scene.components) - states.shape[1]))
        problem, starts = self._problem(values, np.hstack([states, slips]), period, scale)
        propagators, logarithms = problem.propagators(problem.integrator(starts), 1.0 / m)
        matrices = propagators * np.exp(logarithms)[..., None, None]
        numbers = [product_eigenvalues(matrices[:, k]) for k in range(len(self.gamma))]
        blocks = np.repeat(np.arange(len(self.gamma)), self.multiplicity)
        return np.concatenate([numbers[k] for k in blocks]), np.repeat(blocks, states.shape[1])

    def _problem(
        self, values: Mapping[str, float], states: np.ndarray, period: float, scale: np.ndarray
    ) -> tuple[OrbitProblem, np.ndarray]:
        """Return the orbits of one node with all modes, and their starts with slip states."""
        changed = {name: value for name, value in values.items() if value != self.scene.parameters[name]}
        scene = with_numbers(self.scene, changed, rtol=TOLERANCE, atol=None)
        equations = without_drive(scene.equations, scene.parameters)
        variation = _mode(equations, bool(np.iscomplexobj(self.gamma)))
        turns = Turns(period, np.pad(scale, (0, states.shape[1] - len(scale))), "period")
        alpha = -self.gamma if self.gamma.shape[1] > 1 else -self.gamma[:, 0]
        problem = OrbitProblem.of(scene, variation, alpha, states, len(variation.orbit.node.continuous), 1, turns)
        return problem, problem.with_slip_states(states)

    def vectors(
        self, values: Mapping[str, float], states: np.ndarray, period: float, value: complex, count: int
    ) -> np.ndarray:
        """Return directions (states, count) within clusters that a period multiplies by a value, orthonormal."""
        matrices, differences = self._of_whole(values, states, period)
        return np.asarray(differences @ null_vectors(matrices, value, count))

    def text(self, block: int) -> str:
        """Describe a block."""
        return self.labels[block]

    def _of_whole(
        self, values: Mapping[str, float], states: np.ndarray, period: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integrate all deviations of the network; return the propagators (m, k, k) of differences within clusters, and
        their basis (states, k).
        """
        equations = without_drive(self.scene.equations, dict(values))
        copies = expansion(equations, self.classes, states.shape[1])
        if self.whole is None:
            self.whole = flow_of(self.scene, equations, (), copies @ states[0])
        m = len(states)
        scale = np.maximum(np.abs(copies @ states.T).max(axis=1), 1e-3)
        image = self.whole.linearise(values, states @ copies.T, np.full(m, period / m), scale)
        differences = linalg.qr(copies)[0][:, copies.shape[1] :]
        return differences.T @ image.propagators @ differences, differences


@lru_cache(maxsize=32)
def _mode(equations: Equations, plane: bool) -> Variation:
    return mode(equations, plane, by_weight=True)


def expansion(equations: Equations, classes: tuple[int, ...], size: int) -> np.ndarray:
    """Return the matrix (states, size) that copies the states of clusters to their nodes, slip states left out."""
    count = len(set(classes))
    if count == len(classes):
        return np.eye(size)
    components = size // count
    copies = np.zeros((len(equations.nodes[0].state) * equations.n, size))
    for node, places in enumerate(equations.places):
        for component in range(components):
            copies[places[component], component * count + classes[node]] = 1.0
    return copies[: components * equations.n]

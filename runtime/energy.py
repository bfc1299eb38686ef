"""Energy and power of the states of a run, and how well a trajectory keeps the balance of the two."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import cumulative_simpson

from synchain.models.energy import Energy, energy
from synchain.models.equations import TIME
from synchain.models.scene import Scene
from synchain.models.scene_checks import known_keys, number, table

from .rows import numbers

__all__ = ["EnergyFunction", "energy_function"]

Array = np.ndarray
Formula = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class EnergyFunction:
    """The energy of a scene's network as functions of state arrays (…, dimension), in state order; all non-dimensional.

    One formula for a node and one for a link are applied to all of them at once, so that large networks and long
    trajectories cost array operations alone.  `parameters` replace numbers of the scene by others.
    """

    scene: Scene
    exact: Energy
    formulas: tuple[Formula, Formula, Formula, Formula]

    def __call__(self, states: Array, t: Array | float = 0.0, parameters: Mapping[str, float] | None = None) -> Array:
        """Return the energy (…) of the states at times (…) or at one time."""
        return self._sum(self.formulas[0], self.formulas[1], states, t, parameters)

    def power(self, states: Array, t: Array | float = 0.0, parameters: Mapping[str, float] | None = None) -> Array:
        """Return the power (…) that forces and the explicit time feed into the network."""
        return self._sum(self.formulas[2], self.formulas[3], states, t, parameters)

    def imbalance(self, t: Array, states: Array, parameters: Mapping[str, float] | None = None) -> Array:
        """Return E(t) - E(t_0) - (integral of the power) of a trajectory: states (samples, dimension) at times t (samples).

        The integral is Simpson's rule on the samples, so its own error falls with the third power of their distance, at
        every other sample with the fourth.  Raises ValueError for fewer than three samples.
        """
        if np.ndim(t) != 1 or len(t) < 3:
            raise ValueError(f"imbalance: found {np.size(t)} samples; expected at least three; raise samples")
        found = self(states, t, parameters)
        work = cumulative_simpson(self.power(states, t, parameters), x=t, initial=0.0)
        return np.asarray(found - found[0] - work)

    def _sum(
        self, node: Formula, link: Formula, states: Array, t: Array | float, parameters: Mapping[str, float] | None
    ) -> Array:
        n, values = self.scene.n, dict(self.scene.parameters)
        if parameters is not None:
            known_keys("parameters", table("parameters", parameters), values)
            values |= {name: number(name, value) for name, value in parameters.items()}
        constants = [values[name] for name in self.exact.equations.parameters]
        parts = numbers("states", states)
        size = len(self.scene.y0)
        if parts.ndim < 1 or parts.shape[-1] != size:
            raise ValueError(f"states: found an array of shape {parts.shape}; expected rows of {size} numbers")
        parts = parts.reshape(*parts.shape[:-1], -1, n)
        components = [parts[..., c, :] for c in range(parts.shape[-2])]
        time = numbers("t", t)[..., None]
        total = np.broadcast_to(node(time, *components, *constants), components[0].shape).sum(axis=-1)
        pairs = self.exact.pairs
        if pairs:
            here, there = (np.array([pair[end] for pair in pairs]) for end in (0, 1))
            ends = [part[..., end] for end in (here, there) for part in components]
            weights = np.array([float(pair[2]) for pair in pairs])
            total = total + np.broadcast_to(link(weights, *ends, *constants), ends[0].shape).sum(axis=-1)
        return np.asarray(total)


def energy_function(scene: Scene) -> EnergyFunction:
    """Return the compiled energy of a scene's network; ValueError as `synchain.models.energy.energy`."""
    exact = energy(scene)
    equations = exact.equations
    symbols = sp.symbols(equations.parameters, real=True)
    states = (TIME, *equations.node.state, *symbols)
    ends: tuple[sp.Symbol, ...] = symbols
    if equations.edge is not None:
        ends = (equations.edge.weight, *equations.edge.here, *equations.edge.there, *symbols)
    made = [
        sp.lambdify(arguments, e, modules="numpy", cse=True)
        for arguments, e in (
            (states, exact.node), (ends, exact.link), (states, exact.node_power), (ends, exact.link_power),
        )
    ]  # fmt: skip
    return EnergyFunction(scene, exact, (made[0], made[1], made[2], made[3]))

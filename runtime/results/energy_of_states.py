"""Energy and power at the states of a run, and the error of the energy balance along a trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from scipy.integrate import cumulative_simpson

from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.checks import check_keys, check_number, check_table
from synchain.models.mechanics.components import TIME
from synchain.models.networks.energy_terms import EnergyTerms, Share
from synchain.models.scenes.energy import energy_terms
from synchain.models.scenes.scene import Scene, check_scene

from ..support.arrays import numbers

Array = np.ndarray
Formula = Callable[..., np.ndarray | float]
Values = Mapping[str, float] | None


@dataclass(frozen=True, slots=True)
class _Members:
    """The `count` nodes or links of one kind."""

    formulas: tuple[Formula, Formula]  # energy and power as functions of (t or weight, states, parameters)
    weights: Array | None  # (count,): weights of links; None for nodes
    states: list[Array]  # for each argument (count,): indices of states; for a link first of targets, then of sources
    parameters: list[str | list[str]]  # for each argument: one name in the scene, or a name for each member

    def total(self, power: bool, states: Array, t: Array, values: Mapping[str, float]) -> Array:
        """Return the sum over all members. Shapes: states (…, dimension), t (…, 1); returns (…)."""
        arguments = [states[..., indices] for indices in self.states]  # (…, count) each
        numbers = [values[p] if isinstance(p, str) else np.array([values[name] for name in p]) for p in self.parameters]
        terms = self.formulas[power](t if self.weights is None else self.weights, *arguments, *numbers)
        return np.asarray(np.broadcast_to(terms, arguments[0].shape).sum(axis=-1))


@dataclass(frozen=True, slots=True)
class EnergyFunction:
    """The energy of a scene's network for states (…, dimension) in the order of the equations."""

    # All numbers are non-dimensional. One formula is applied to all nodes of a kind at once, and one to all links of a
    # kind, so that large networks and long trajectories cost only array operations. `parameters` replace parameter
    # values of the scene.

    scene: Scene
    exact: EnergyTerms
    groups: tuple[_Members, ...]

    def __call__(self, states: Array, t: Array | float = 0.0, parameters: Values = None) -> Array:
        return self._sum(False, states, t, parameters)

    def power(self, states: Array, t: Array | float = 0.0, parameters: Values = None) -> Array:
        """Return the power (…) that forces and the explicit time dependence feed into the network."""
        return self._sum(True, states, t, parameters)

    def imbalance(self, t: Array, states: Array, parameters: Values = None) -> Array:
        """Return E(t) - E(t_0) - (integral of the power) of a trajectory: states (samples,
        dimension) at times t (samples).

        The integral is computed by Simpson's rule on the samples.  For a smooth power the error of the quadrature falls
        with the third power of the sampling interval, and at every other sample with the fourth.  For a power that
        jumps, as with `sign` in a force, the error falls with the first power.  For the accuracy of `rtol` record the
        mean of the power as an observable of the run (docs/models.md).  Raises ValueError for fewer than three samples.
        """
        if np.ndim(t) != 1 or len(t) < 3:
            raise ValueError(f"imbalance: found {np.size(t)} samples; expected at least three; raise samples")
        stored = self(states, t, parameters)
        work = cumulative_simpson(self.power(states, t, parameters), x=t, initial=0.0)
        return np.asarray(stored - stored[0] - work)

    def _sum(self, power: bool, states: Array, t: Array | float, parameters: Values) -> Array:
        values = dict(self.scene.parameters)
        if parameters is not None:
            check_keys("parameters", check_table("parameters", parameters), values)
            values |= {name: check_number(name, value) for name, value in parameters.items()}
        rows, time, size = numbers("states", states), numbers("t", t)[..., None], len(self.scene.y0)
        if rows.ndim < 1 or rows.shape[-1] != size:
            raise ValueError(f"states: found an array of shape {rows.shape}; expected rows of {size} numbers")
        return np.asarray(sum(group.total(power, rows, time, values) for group in self.groups))


def energy_function(scene: Scene) -> EnergyFunction:
    """Return the compiled energy of a scene's network; raise ValueError as
    `synchain.models.scenes.energy.energy` does.

    See Also
    --------
    synchain.energy_terms
    synchain.run

    Examples
    --------
    >>> import synchain as sc
    >>> energy = sc.energy_function(sc.Scene("harmonic"))
    >>> float(energy([[1.0, 0.0]])[0])
    0.5
    """
    exact = energy_terms(check_scene(scene))
    equations, places = exact.equations, exact.equations.places  # places[i]: indices of the states of node i
    groups = []
    for kind, (share, node) in enumerate(zip(exact.nodes, equations.nodes, strict=True)):
        members = [i for i, k in enumerate(equations.kind_of) if k == kind]
        states = list(np.array([places[i] for i in members]).T)
        names = _names(equations, node.parameters, members)
        groups.append(_Members(_compiled(share, (TIME, *node.state, *node.parameters)), None, states, names))
    for kind, (share, edge) in enumerate(zip(exact.links, equations.edges, strict=True)):
        pairs = [pair for pair, number in exact.pairs if number == kind]  # (target, source, weight)
        if pairs:
            targets, sources = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
            states = [s for end in (targets, sources) for s in np.array([places[i] for i in end]).T]
            # A link has parameters of its target, of its source (renamed in the formula), and numbered ones.
            renamed, original = [s for s, _ in edge.theirs], [s for _, s in edge.theirs]
            names = _names(equations, edge.parameters, targets) + _names(equations, original, sources)
            for k, s in enumerate(edge.parameters):
                if s.name in equations.numbered:
                    names[k] = [equations.numbered[s.name].name(s.name, pair) for pair in pairs]
            formulas = _compiled(share, (edge.weight, *edge.here, *edge.there, *edge.parameters, *renamed))
            groups.append(_Members(formulas, np.array([float(pair[2]) for pair in pairs]), states, names))
    return EnergyFunction(scene, exact, tuple(groups))


def _names(equations: Equations, symbols: Sequence[sp.Symbol], nodes: Sequence[int]) -> list[str | list[str]]:
    """Return for each parameter one name for all `nodes`, or a list with a name for each node."""
    return [[f"{s.name}_{i + 1}" for i in nodes] if s.name in equations.varied else s.name for s in symbols]


def _compiled(share: Share, arguments: Sequence[sp.Symbol]) -> tuple[Formula, Formula]:
    """Return energy and power as functions of arrays."""
    energy, power = (sp.lambdify(arguments, e, modules="numpy", cse=True) for e in (share.energy, share.power))
    return energy, power

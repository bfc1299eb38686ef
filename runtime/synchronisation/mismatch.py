"""Predict the synchronisation error of nearly equal nodes: one driven mode for each eigenvalue of the graph.

Let the nodes of a network differ a little in some parameters p, with the mean values p0. To first order the deviations
from the mean motion s' = F(s, p0) separate by the eigenspaces of G. With the projection P of an eigenspace,

    deviations = sum over eigenvalues and parameters of P (p - p0) z(t),    z' = (DF - alpha H) z + dF/dp,

where alpha = -sigma gamma as in the master stability function. The mean squares of z along the motion are integrated
for each eigenvalue (`mismatch`); the deviations grow without bound where the transversal exponent is not negative.

Source: Sun, Bollt & Nishikawa, EPL 85, 60011 (2009).
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
import sympy as sp
import xarray as xr

from synchain.models.definitions.inline import Field
from synchain.models.dynamics.synchrony import synchronous_node
from synchain.models.dynamics.variational import source_slopes
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.oscillator import Oscillator
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset
from ..stability.exponents import exponents
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from ..sweeps.run import run

ALPHA = "mode_strength"
"""Name of the strength of a mode in the scene of driven modes."""

NEGLIGIBLE = 1e-12
"""Modes are left out if their mismatch is below this share of the largest one."""


@dataclass(frozen=True, slots=True, repr=False)
class Mismatch(Labelled):
    """Deviations of nearly equal nodes from their mean, to first order.

    Parameters
    ----------
    scene : Scene
        The network with its differing parameters.
    component : tuple of str
        Names of the states of a node.
    gamma : ndarray, shape (modes,)
        Eigenvalue of each driven mode. An eigenvalue has several modes if several parameters differ.
    size : ndarray, shape (modes,)
        Norm of the mismatch in the mode.
    response : ndarray, shape (modes, components)
        Root mean square of the mode, driven by a mismatch of norm 1; infinite if the mode is unstable.
    exponent : ndarray, shape (modes,)
        Largest transversal exponent of the mode.
    stderr : ndarray, shape (modes,)
        Standard errors of `exponent`.

    See Also
    --------
    synchain.run
    """

    scene: Scene
    component: tuple[str, ...]
    gamma: np.ndarray
    size: np.ndarray
    response: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """Root mean square (components,) over nodes and time of the deviations from the mean of all nodes."""
        return np.asarray(np.sqrt(((self.size[:, None] * self.response) ** 2).sum(axis=0) / self.scene.n))

    @property
    def data(self) -> xr.Dataset:
        """Responses over the modes, and the predicted deviations."""
        return dataset(
            {
                "size": (("mode",), self.size, "norm of the mismatch in the mode"),
                "response": (("mode", "component"), self.response, "root mean square for a mismatch of norm 1"),
                "exponent": (("mode",), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("mode",), self.stderr, "standard error of the exponent"),
                "deviation": (("component",), self.deviation, "predicted root mean square of deviations"),
            },
            {"gamma": ("mode", self.gamma), "component": list(self.component)},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """The predicted deviations, and the mode with the largest part in them."""
        parts = self.size * np.sqrt((self.response**2).sum(axis=1))
        worst = int(np.argmax(parts))
        decay = with_error(self.exponent[worst], self.stderr[worst])
        deviations = (f"{name} {x:.4g}" for name, x in zip(self.component, self.deviation, strict=True))
        return (
            ("scene", repr(self.scene)),
            ("deviations", ", ".join(deviations)),
            ("largest part", f"gamma = {self.gamma[worst]:.6g}, exponent {decay}"),
        )

    def simulated(self) -> np.ndarray:
        """Run the network; return the root mean square (components,) of deviations that `deviation` predicts."""
        observe = {f"{name}_square": f"mean(({name} - nodes.mean({name}))**2)" for name in self.component}
        result = run(self.scene.replace(record=(), observe=observe), show_progress=False)
        return np.sqrt([float(result.data[name].mean()) for name in observe])


def mismatch(
    scene: Scene,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Mismatch:
    """Predict the synchronisation error of nodes that differ a little in some parameters.

    Parameters
    ----------
    scene : Scene
        Network with parameters that differ from node to node, and one undirected layer of links. Transient and window
        of the scene are those of the averages.
    workers, executor, show_progress, progress
        As for `run`.
    parameters : mapping, optional
        Values of parameters that replace those of the scene, also as keywords.

    Returns
    -------
    Mismatch
        Its `deviation` is the prediction, to first order in the mismatch.

    Raises
    ------
    ValueError
        If all nodes are equal, if the graph is directed, not connected or has several layers, if nodes are of several
        kinds or stick by set-valued friction, or if a link that acts between equal states contains a differing
        parameter.

    See Also
    --------
    msf : Computes the exponents of the modes.

    References
    ----------
    Sun, Bollt & Nishikawa, EPL 85, 60011 (2009).

    Examples
    --------
    >>> import synchain as sc
    >>> node = sc.Field({"x": "a - x"}, parameters={"a": 1})
    >>> pair = sc.Scene(node, "x->x", sc.graphs.chain(2), parameters={"a": [0.9, 1.1], "sigma": 0.5})
    >>> round(float(sc.mismatch(pair).deviation[0]), 8)  # 0.1/(1 + 2 sigma)
    0.05
    """
    Execution(workers, executor, show_progress, progress)  # refuses wrong options before the exponents are computed
    scene = Given(mismatch, parameters, more).scene(scene)
    equal, values = _mean_scene(scene)
    names = tuple(values)
    gamma, vectors = _modes(scene, np.array([values[name] for name in names]))
    size = np.linalg.norm(vectors, axis=1)
    alpha = -equal.parameters[equal.strength] * gamma

    # Exponents tell which modes stay bounded.
    found = exponents(equal, np.unique(alpha), starts=1, workers=workers, show_progress=False)
    place = np.searchsorted(np.unique(alpha), alpha)
    exponent, stderr = found.exponent[place], found.stderr[place]

    # The driven modes along the mean motion: one cell for each mode, all with the same motion.
    node, components = driven_mode(equal, names)
    axes = {
        ALPHA: alpha,
        **{f"{name}_mismatch": column for name, column in zip(names, (vectors / size[:, None]).T, strict=True)},
    }
    start = {name: column[0] for name, column in equal.initial.items()}
    observe = {f"{name}_square": f"mean({name}_deviation**2)" for name in components}
    cells = equal.replace(
        oscillator=node, friction="default", contact=None, coupling=None, topology=None,
        parameters={name: value for name, value in equal.parameters.items() if name in node.parameters},
        initial=start, record=(), observe=observe, axes=axes, zipped=True,
    )  # fmt: skip
    result = run(cells, workers=workers, executor=executor, show_progress=show_progress, progress=progress)
    squares = np.stack([np.asarray(result.data[name]).reshape(len(gamma)) for name in observe], axis=-1)
    response = np.where((exponent < -2.0 * stderr)[:, None], np.sqrt(squares), np.inf)
    return Mismatch(scene, components, gamma, size, response, exponent, stderr)


def driven_mode(scene: Scene, names: tuple[str, ...]) -> tuple[Oscillator, tuple[str, ...]]:
    """Return an oscillator of a node and one mode that mismatches drive, and the names of the node's states."""
    equations = scene.equations
    node, (slope,) = synchronous_node(equations), source_slopes(equations)
    swap = {s: sp.Symbol(f"{s.name}_deviation", real=True) for s in node.state}
    alpha, deviations = sp.Symbol(ALPHA, real=True), sp.Matrix(list(swap.values()))
    drive = sp.zeros(len(node.state), 1)
    for name in names:
        p = sp.Symbol(name, real=True)
        drive += sp.Symbol(f"{name}_mismatch", real=True) * sp.Matrix([e.diff(p) for e in node.rhs])
    rates = (sp.Matrix(node.jacobian()) - alpha * slope) * deviations + drive
    table = {**dict(zip(node.state, node.rhs, strict=True)), **dict(zip(swap.values(), rates, strict=True))}
    used = {s for e in table.values() for s in e.free_symbols} - {*table, sp.Symbol("t", real=True)}
    defaults = {s: scene.parameters.get(s.name, 0.0) for s in sorted(used, key=lambda s: s.name)}
    return Field(table, parameters=defaults), tuple(s.name for s in node.state)


def _mean_scene(scene: Scene) -> tuple[Scene, dict[str, np.ndarray]]:
    """Return the scene with the mean of each differing parameter, and the deviations (n,) from the means."""
    equations = check_scene(scene).equations
    equations.expect_alike("mismatch", varied_too=True)
    if not equations.varied or not equations.link_count:
        what = "links" if equations.varied else "parameters that differ from node to node"
        raise ValueError(f"mismatch: found no {what}; expected some, e.g. parameters={{'a': [0.9, 1.1]}} on chain(2)")
    equations.expect_exact_links("mismatch")
    if equations.sticks:
        raise ValueError("mismatch: found set-valued friction; expected smooth contacts; use contact 'atan'")
    for edge in equations.edges:
        own = {s.name for s in edge.parameters} | {parameter.name for _, parameter in edge.theirs}
        shared = sorted(own & set(equations.varied))
        if shared and not edge.diffusive:
            raise ValueError(
                f"mismatch: a link between equal states contains {shared[0]}, which differs; expected links that vanish "
                "there, or without it"
            )
    columns = {
        name: np.array([scene.parameters[str(NodeName(name, i))] for i in range(scene.n)]) for name in equations.varied
    }
    single = {str(NodeName(name, i)) for name in columns for i in range(scene.n)}
    shared_values = {name: value for name, value in scene.parameters.items() if name not in single}
    means = {name: float(column.mean()) for name, column in columns.items()}
    equal = scene.replace(parameters={**shared_values, **means})
    return equal, {name: column - means[name] for name, column in columns.items()}


def _modes(scene: Scene, mismatches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues (modes,) and mismatches (modes, parameters) of modes, from mismatches (parameters, n)."""
    graph = scene.model.linked[0][1]
    if graph.asymmetry or graph.components > 1:
        problem = graph.asymmetry or f"{graph.components} parts"
        raise ValueError(f"mismatch: found {problem} in {graph.name}({graph.n}); expected a connected undirected graph")
    # Eigenvalues of a symmetric matrix descend like the exact spectrum, whose multiplicities split the eigenvectors.
    vectors = np.linalg.eigh(np.array(graph.rows, dtype=float))[1][:, ::-1]
    gamma, parts, first = [], [], 0
    for eigenvalue in graph.spectrum:
        inside = vectors[:, first : first + eigenvalue.multiplicity]
        first += eigenvalue.multiplicity
        if eigenvalue.value == 0:
            continue
        # Independent directions of the mismatches in this eigenspace, each with its weights of the parameters.
        sizes, weights = np.linalg.svd(inside.T @ mismatches.T, full_matrices=False)[1:]
        parts += list(sizes[:, None] * weights)
        gamma += [float(eigenvalue.value.real)] * len(sizes)
    table = np.array(parts).reshape(-1, len(mismatches))
    norms = np.linalg.norm(table, axis=1)
    kept = norms > NEGLIGIBLE * np.abs(mismatches).max(initial=0.0)
    return np.array(gamma)[kept], table[kept]

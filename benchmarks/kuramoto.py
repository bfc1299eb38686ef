"""What a node costs in a step of first-order Kuramoto phases: on a sparse random graph, and by mean
field.

Frequencies are normal with standard deviation 1/2, starts random on the circle, K = 2; the weights
are one over the mean number of links of a node, and one over n.  The time is the processor time of
the kernel alone, one cell in a scalar kernel; end states are compared with SciPy's DOP853.  Every
row has a fresh process, so that its peak of memory is its own.
"""

from __future__ import annotations

import time

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import weighted
from synchain.models.graphs.topology import Topology
from synchain.models.interactions.coupling import Rates
from synchain.models.interactions.ends import ends
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.plan import Planner
from synchain.runtime.engines.scene_kernels import kernel
from synchain.runtime.engines.step_control import control_of

from .scaling import apart, peak_memory

COLUMNS = (
    "graph",
    "n",
    "links",
    "integrator",
    "steps",
    "processor seconds",
    "microseconds per node and step",
    "difference from SciPy",
    "peak MB",
)
DEGREE = 10
"""Mean number of links of a node of the sparse graph."""

CASES = (("erdos_renyi", 10_000), ("complete", 10_000), ("complete", 1_000_000))
QUICK = (("erdos_renyi", 40), ("complete", 40))

Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes small networks."""
    return [
        apart(network_row, name, n, method)
        for name, n in (QUICK if quick else CASES)
        for method in ("dop853", "taylor")
    ]


def graph_of(name: str, n: int) -> Topology:
    """Return the graph of a row, with its weights."""
    if name == "complete":
        return weighted(topology(name, n), f"1/{n}")
    return weighted(topology(name, n, p=f"{DEGREE}/{n - 1}", seed=1), f"1/{DEGREE}")


def scene_of(name: str, n: int, method: str) -> Scene:
    """Return the phases of a row."""
    theta, omega, strength = sp.symbols("theta omega K")
    phase = Field({theta: omega}, parameters={omega: 0})
    here, there, weight = ends(phase)
    sine = Rates({here.theta: strength * weight * sp.sin(there.theta - here.theta)}, {strength: 1})
    dice = np.random.default_rng(1)
    return Scene(
        phase,
        sine,
        graph_of(name, n),
        parameters={"omega": dice.normal(0.0, 0.5, n), "K": 2.0},
        initial={"theta": dice.uniform(0.0, 2.0 * np.pi, n)},
        record=(),
        transient=0.0,
        window=5.0,
        time_unit="time",
        integrator=method,
        rtol=1e-8,
    )


def network_row(name: str, n: int, method: str) -> Row:
    """Run one network once; the kernel is compiled before."""
    scene = scene_of(name, n, method)
    compiled, planner = kernel(scene, 1, reduce=False), Planner(scene)
    one, buffers = planner.rows(np.arange(1)), Buffers.empty(1, n, room=0, samples=0)
    control = control_of(planner, False)
    begin = time.process_time()
    compiled.drive(0, 1, one.start, one.numbers, one.spans, control, *buffers.arrays())
    seconds = time.process_time() - begin
    steps = int(buffers.counts[0, 1:3].sum())
    memory = peak_memory()
    far = float(abs(buffers.end[0] - _by_scipy(scene)).max())
    links = scene.topology.link_count
    return (name, n, links, method, steps, seconds, seconds / (steps * n) * 1e6, far, memory)


def _by_scipy(scene: Scene) -> np.ndarray:
    """The end states by SciPy and NumPy."""
    graph, strength = scene.topology, scene.parameters["K"]
    frequencies = np.array([scene.parameters[f"omega_{i + 1}"] for i in range(scene.n)])
    listed = () if graph.all_to_all is not None else graph.links
    target, source = (np.array([link[side] for link in listed], int) for side in (0, 1))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        if graph.all_to_all is not None:
            mean = np.exp(1j * y).mean()
            return np.asarray(frequencies + strength * (mean * np.exp(-1j * y)).imag)
        felt = np.bincount(target, np.sin(y[source] - y[target]), scene.n)
        return np.asarray(frequencies + strength / DEGREE * felt)

    found = solve_ivp(rates, (0.0, scene.window), scene.y0, "DOP853", rtol=1e-10, atol=1e-10)
    return np.asarray(found.y[:, -1])

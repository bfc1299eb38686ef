"""The energy balance of a run: what forces have done is integrated as one more state of every
oscillator.
"""

from __future__ import annotations

import math

import numpy as np
import sympy as sp

from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.machine_code.compile import load
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Edge, Node
from synchain.models.mechanics.lagrangian import total_derivative
from synchain.models.networks.energy_terms import EnergyTerms
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.plan import plan
from synchain.runtime.engines.step_control import control_array, tolerances
from synchain.runtime.results.energy_of_states import energy_function
from synchain.runtime.support.status import Status


def energy_residual(scene: Scene, end: np.ndarray) -> float:
    """(E(end) - E(0) - W) / max(|E(0)|, |E(end)|, 1) of a network, W the work of its drives and of
    friction.

    Where no power is fed in or lost W is zero and `end` (dimension,) is the end state; else the
    equations are integrated again with the work, at the scene's tolerance. NaN where that did not
    finish.
    """
    twin, numbers = _with_energy(scene)
    function = energy_function(twin)
    cells = plan(scene)
    first, work = cells.start[0], 0.0
    if not function.exact.conservative:
        end, work = _worked(scene, function.exact)
    dimension = len(twin.y0)
    before, after = (
        float(function(state[:dimension], t, numbers)) for state, t in ((first, 0.0), (end, float(cells.spans[0, 1])))
    )
    return (after - before - work) / max(abs(before), abs(after), 1.0)


def _with_energy(scene: Scene) -> tuple[Scene, dict[str, float]]:
    """A scene with the same energy that has one, and the numbers to put in: smoothed, and with
    springs for "x->v".
    """
    if scene.equations.sticks:
        return scene.replace(contact="atan", initial={name: scene.initial[name] for name in ("x", "v")}), {}
    if str(scene.coupling) == "x->v" and scene.equations.links:
        return scene.replace(coupling="spring", sigma=0.0), {"sigma": scene.parameters["sigma"]}
    return scene, {}


def _worked(scene: Scene, exact: EnergyTerms) -> tuple[np.ndarray, float]:
    """End state and work of an integration of both; NaN where it did not finish."""
    n, integrator = scene.n, scene.integrator
    whole = _with_work(scene.equations, exact)
    cells = plan(scene)
    start = np.hstack([cells.start, np.zeros((1, n))])
    rtol, atol = (float(own[0]) for own in tolerances(scene, scene.equations, cells.numbers))
    control = control_array(rtol, atol, math.inf, scene.max_steps)
    buffers = Buffers.empty(1, whole.dimension, 0, 0)
    load(emit(whole, integrator, Recording(()))).drive(
        0, 1, start, cells.numbers, cells.spans, control, *buffers.arrays()
    )
    if buffers.counts[0, 0] != Status.FINISHED:
        return np.full(whole.dimension, math.nan), math.nan
    return buffers.end[0, :-n], math.fsum(buffers.end[0, -n:])


def _with_work(equations: Equations, exact: EnergyTerms) -> Equations:
    """The same network with the work done on each oscillator as its last state."""
    node, edge, share = equations.node, equations.edge, exact.nodes[0]
    if any(share.power != 0 for share in exact.links):
        raise ValueError("the balance is for springs; found links that lose energy")
    work, here, there = (sp.Symbol(f"work{end}", real=True) for end in ("", "_i", "_j"))
    power = share.power
    if node.events:  # the force of friction in stick is whatever holds the body
        x, v = node.state[:2]
        power = total_derivative(share.energy, (x,), (v,), (node.rhs[1],))
    single = Node((*node.state, work), (*node.rhs, power), node.parameters, node.events)
    if edge is not None:
        rates = (*edge.rhs, _link_power(node, edge))
        edge = Edge((*edge.here, here), (*edge.there, there), edge.weight, rates, edge.parameters)
    return Equations.of_equal_nodes(single, edge, equations.n, equations.links)


def _link_power(node: Node, edge: Edge) -> sp.Expr:
    """What stick adds to the work on an oscillator: friction holds it against its links, which the
    node does not know.
    """
    if not node.events:
        return sp.S.Zero
    velocity, mode = edge.here[1:3]
    return -velocity * (edge.rhs[1].xreplace({mode: sp.S.One}) - edge.rhs[1])

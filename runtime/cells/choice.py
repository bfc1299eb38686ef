"""Which integrator "auto" stands for, by what was measured (docs/performance.md)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import islice

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Count, Sum
from synchain.codegen.integrators import Integrator, integrator
from synchain.codegen.kernels.sweep import AUTO, KernelSource
from synchain.codegen.steps.mass import turned_masses
from synchain.codegen.taylor import is_linear, kink, order_for
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.scene import Scene

from .buffers import Buffers
from .plan import Plan, Planner
from .reduce import Reduction

__all__ = ["STIFF", "chosen_integrator", "stiffness", "warn_of_stiffness"]

STIFF = 30.0
"""Stiffness from which Rosenbrock steps are faster than Taylor steps at equal error."""

NODES, LINKS = 50, 5000
"""Nodes of a large network that are looked at, and links."""


def chosen_integrator(reduction: Reduction) -> Integrator:
    """Return the integrator of a scene, the fastest at equal error where the scene says "auto".

    Power series where all functions are analytic and the start is not stiff, in the extreme cells of
    the sweep; between the events of set-valued friction too.  Nodes with a mass matrix take explicit
    steps in their place: the recurrences of a dense matrix take longer to compile than most runs.
    Otherwise Rosenbrock steps, or a switching pair of methods for two oscillators at a tight
    tolerance.

    Parameters
    ----------
    reduction : Reduction
        What is left of the scene to integrate.
    """
    scene, equations = reduction.scene, reduction.equations
    if scene.integrator == "taylor":
        return _taylor(scene, equations)
    if scene.integrator != "auto":
        return integrator(scene.integrator)
    if not equations.inertial_links and kink(equations) is None and (equations.sticks or stiffness(scene) < STIFF):
        return integrator("dop853") if equations.inertial else _taylor(scene, equations)
    if equations.sticks:
        return integrator("dop853")
    pair = equations.n == 2 and not (equations.mixed or equations.inertial) and scene.rtol <= 1e-9
    return integrator("switching" if pair else AUTO)


def _taylor(scene: Scene, equations: Equations) -> Integrator:
    return integrator("taylor", order_for(scene.rtol, scene.atol, is_linear(equations)))


def stiffness(scene: Scene) -> float:
    """Return how much faster motions decay or grow at the start than they turn, the largest of the extreme cells.

    The rate is the real part of an eigenvalue of a node's own block of the Jacobian, with twice what
    its links add, which bounds that of a network of springs; it is compared with the imaginary
    parts and one.
    """
    rows = Planner(scene).extremes()
    found = (_rates(scene.equations, *row) for row in zip(rows.start, rows.numbers, strict=True))
    return max((fastest / max(1.0, turning) for fastest, turning in found), default=0.0)


def warn_of_stiffness(source: KernelSource, buffers: Buffers, rows_of: Callable[[np.ndarray], Plan]) -> None:
    """Warn if Taylor steps of some cells were short because the equations are stiff, not because the motion is fast.

    The three cells with the shortest steps are looked at, where they ended.

    Parameters
    ----------
    source : KernelSource
    buffers : Buffers
        What the kernel filled.
    rows_of : callable
        Gives the rows of some cells, as the kernel took them.
    """
    steps = buffers.counts[:, Count.ACCEPTED] + buffers.counts[:, Count.REJECTED]
    times = buffers.sums[:, Sum.STOPPED_AT]
    lengths = np.where((steps > 0) & (times > 0.0), times / np.maximum(steps, 1), math.inf)
    cells = np.argsort(lengths)[:3]
    for cell, numbers in zip(cells, rows_of(cells).numbers, strict=True):
        if not math.isfinite(lengths[cell]) or not np.isfinite(buffers.end[cell]).all():
            continue
        fastest, turning = _rates(source.equations, buffers.end[cell], numbers)
        if fastest * lengths[cell] > 1.0 and fastest > STIFF * max(1.0, turning):
            warnings.warn(
                f"stiff equations: found a rate of {fastest:.3g} beside slow motion, and {steps[cell]} Taylor steps in a cell; "
                "expected few; integrator = 'rodas5p' takes longer steps",
                RuntimeWarning,
                stacklevel=4,
            )
            return


def _rates(equations: Equations, state: np.ndarray, numbers: np.ndarray) -> tuple[float, float]:
    """The fastest decay or growth at a state, and the fastest turning; 0 where there are no numbers."""
    values = dict(zip(equations.state, state, strict=True)) | dict(zip(equations.parameters, numbers, strict=True))
    blocks = [block for block in _blocks(equations, values) if np.all(np.isfinite(block))]
    rates = np.concatenate([np.linalg.eigvals(block) for block in blocks]) if blocks else np.zeros(0)
    return float(np.abs(rates.real).max(initial=0.0)), float(np.abs(rates.imag).max(initial=0.0))


def _blocks(equations: Equations, values: Mapping[str, float]) -> list[np.ndarray]:
    """The blocks of the Jacobian of the first nodes, with twice what their links add."""
    nodes = range(min(equations.n, NODES))
    masses = {
        i: _value(node.inertia, equations.at_node(i), values) for i in nodes if (node := equations.node_at(i)).inertia
    }
    blocks = [_block(equations, i, values, masses.get(i)) for i in nodes]
    for link in islice(equations.links, LINKS):
        if link[0] < len(blocks):
            found = _value(equations.edge_at(link).jacobian_here(), equations.at_link(link), values)
            blocks[link[0]] = blocks[link[0]] + 2.0 * found
    return [np.linalg.solve(masses[i], block) if i in masses else block for i, block in enumerate(blocks)]


def _block(equations: Equations, i: int, values: Mapping[str, float], mass: np.ndarray | None) -> np.ndarray:
    """The Jacobian of a node's right-hand side less that of M F at fixed rates F."""
    node, at = equations.node_at(i), equations.at_node(i)
    found = _value(node.jacobian(), at, values)
    if mass is None or node.constant_inertia:
        return found
    size = len(node.state)
    forces = _value(tuple((e,) * size for e in node.rhs), at, values)[:, 0]
    rates = [sp.Dummy(s.name, real=True) for s in node.state]
    known = dict(zip(rates, map(sp.Float, np.linalg.solve(mass, forces)), strict=True))
    return found - _value(turned_masses(node, rates), {**at, **known}, values)


def _value(
    entries: tuple[tuple[sp.Expr, ...], ...], at: Mapping[sp.Symbol, sp.Expr], values: Mapping[str, float]
) -> np.ndarray:
    """The numbers of a block; NaN where it has none."""
    symbols, function = _compiled(entries)
    known: dict[sp.Symbol, float] = {TIME: 0.0}
    for s in symbols:
        e = at.get(s, s)
        known[s] = 0.0 if s == TIME else float(e) if e.is_number else values[e.name]
    size = len(entries)
    try:
        with np.errstate(all="ignore"):
            return np.array(function(*(known[s] for s in symbols)), dtype=float).reshape(size, size)
    except (ArithmeticError, TypeError, ValueError):
        return np.full((size, size), math.nan)


@lru_cache(maxsize=64)
def _compiled(entries: tuple[tuple[sp.Expr, ...], ...]) -> tuple[tuple[sp.Symbol, ...], Callable[..., object]]:
    flat = [e for row in entries for e in row]
    symbols = tuple(sorted(set().union(*(e.free_symbols for e in flat)), key=lambda s: s.name))
    return symbols, sp.lambdify(symbols, flat, "math")

"""Which integrator "auto" stands for, by what was measured (docs/performance.md)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import islice

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Count, Sum
from synchain.codegen.integrators import Integrator, integrator
from synchain.codegen.kernels.sweep import AUTO, KernelSource
from synchain.codegen.steps.mass import turned_masses
from synchain.codegen.taylor import is_analytic, is_linear, jump, order_for
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.graphs.links import LINK_LIMIT, Link
from synchain.models.mechanics.components import TIME, Edge
from synchain.models.scenes.scene import Scene

from ..support.status import Status
from .buffers import Buffers
from .plan import Plan, Planner
from .reduce import Reduction

__all__ = [
    "STIFF",
    "chosen_for_modes",
    "chosen_for_rows",
    "chosen_integrator",
    "mode_stiffness",
    "stiffness",
    "warn_of_stiff_modes",
    "warn_of_stiffness",
]

STIFF = 30.0
"""Stiffness from which Rosenbrock steps are faster than Taylor steps at equal error."""

NODES, LINKS = 50, 5000
"""Nodes of a large network that are looked at, and links."""

LAYER = 0.1
"""Part of its stiffness with which the layer of a smoothed jump counts: motion is not always inside."""

TURNING = (sp.atan, sp.tanh, sp.erf, sp.Abs)
"""Functions that are steep, or turn sharply, where their argument is zero: the layer of a smoothed jump."""


def chosen_integrator(reduction: Reduction) -> Integrator:
    """Return the integrator of a scene, the fastest at equal error where the scene says "auto".

    Where the equations are not stiff in the extreme cells of the sweep, and between the events of set-valued friction:
    power series if all functions are analytic between kinks, and between jumps along which no motion slides, explicit steps
    otherwise. Nodes or links with a mass matrix take explicit steps too: the recurrences of a dense matrix take longer to
    compile than most runs. Elsewhere Rosenbrock steps, or a switching pair of methods for two oscillators at a tight
    tolerance. A mean field of more nodes than Rosenbrock steps can take, whose Jacobian has an entry for each pair, takes
    explicit steps however stiff it is.

    Parameters
    ----------
    reduction : Reduction
        What is left of the scene to integrate.
    """
    return _chosen(reduction.scene, reduction.equations, lambda: stiffness(reduction.scene))


def chosen_for_rows(scene: Scene, equations: Equations, rows: Plan) -> Integrator:
    """Return the integrator of equations whose cells come as rows; otherwise as `chosen_integrator`.

    Parameters
    ----------
    scene : Scene
        Its integrator and its tolerances.
    equations : Equations
        What is integrated.
    rows : Plan
        The extreme cells.
    """
    return _chosen(scene, equations, lambda: _stiffness(equations, rows))


def _chosen(scene: Scene, equations: Equations, stiffness_of: Callable[[], float]) -> Integrator:
    if scene.integrator == "taylor":
        return _taylor(scene, equations)
    if scene.integrator != "auto":
        return integrator(scene.integrator)
    calm = equations.sticks or stiffness_of() < STIFF
    if calm and not equations.inertial and jump(equations) is None:
        return _taylor(scene, equations)
    if calm or any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        return integrator("dop853")
    pair = equations.n == 2 and not (equations.mixed or equations.inertial) and scene.rtol <= 1e-9
    return integrator("switching" if pair else AUTO)


def chosen_for_modes(
    scene: Scene, variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray
) -> Integrator:
    """Return the integrator of orbits with deviations along them, Taylor or Rosenbrock steps: modes have no others.

    Power series where all functions are analytic, and neither the orbit nor the strongest mode is stiff at the start.

    Parameters
    ----------
    scene : Scene
        Its integrator, and the tolerances that the order follows.
    variation : Variation
        Orbit with its variational equation.
    state : ndarray, shape (cells, dimension)
        Initial states.
    numbers : ndarray, shape (cells, parameters)
        Values of the parameters of the orbit.
    strengths : ndarray, shape (number of strengths, modes)
        Strengths of the modes.
    """
    if scene.integrator == "taylor":
        return _taylor(scene, variation.orbit)
    smooth = scene.integrator == "auto" and is_analytic(variation.orbit)
    if smooth and mode_stiffness(variation, state, numbers, strengths) < STIFF:
        return _taylor(scene, variation.orbit)
    return integrator(AUTO)


def _taylor(scene: Scene, equations: Equations) -> Integrator:
    return integrator("taylor", order_for(scene.rtol, scene.atol, is_linear(equations)))


def stiffness(scene: Scene) -> float:
    """Return how much faster motions decay or grow at the start than they turn, the largest of the extreme cells.

    The rate is the real part of an eigenvalue of a node's own block of the Jacobian, with twice what
    its links add, which bounds that of a network of springs; it is compared with the imaginary
    parts and one.  The layers of smoothed jumps are looked at too, although the start lies outside.
    """
    return _stiffness(scene.equations, Planner(scene).extremes())


def _stiffness(equations: Equations, rows: Plan) -> float:
    cells = list(zip(rows.start, rows.numbers, strict=True))
    found = [_rates(equations, *cell) for cell in cells]
    bends = [_eigenvalue_parts(_bends(equations, _named(equations, *cell))) for cell in cells]
    return _stiffest(found + [(LAYER * fastest, LAYER * turning) for fastest, turning in bends])


def mode_stiffness(variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray) -> float:
    """Return how much faster deviations decay or grow at some states than they turn: the largest of the first orbits.

    Of the strengths none and the largest are looked at; parameters as for `chosen_for_modes`.
    """
    return _stiffest(_mode_rates(variation, state, numbers, strengths))


def warn_of_stiff_modes(
    variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray, step: float
) -> bool:
    """Warn if Taylor steps with deviations were short, `step` in the mean, because they are stiff where they ended.

    The other parameters are those of `chosen_for_modes`.  Return whether they were.
    """
    if step * STIFF >= 1.0:
        return False
    for fastest, turning in _mode_rates(variation, state, numbers, strengths):
        if fastest * step > 1.0 and fastest > STIFF * max(1.0, turning):
            warnings.warn(
                f"stiff modes: found a rate of {fastest:.3g} beside slow motion, and Taylor steps of {step:.2g}; "
                "expected longer ones; integrator = 'rodas5p' takes them",
                RuntimeWarning,
                stacklevel=4,
            )
            return True
    return False


def _mode_rates(
    variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray
) -> Iterator[tuple[float, float]]:
    """The fastest growth and turning of deviations without a strength and with the largest, of the first orbits."""
    strengths = strengths[: len(variation.parameters)]
    largest = (
        strengths[:, np.argmax(np.hypot.reduce(strengths, axis=0))] if strengths.size else np.zeros(len(strengths))
    )
    table = [[sp.S.Zero] * variation.size for _ in range(variation.size)]
    for (row, column), e in variation.matrix:
        table[row][column] = e
    entries, orbit = tuple(map(tuple, table)), variation.orbit
    names = (*orbit.state, *orbit.parameters, *(s.name for s in variation.parameters), TIME.name)
    for cell in zip(state[:NODES], numbers[:NODES], strict=True):
        for strong in (0.0 * largest, largest):
            values = dict(zip(names, np.concatenate([*cell, strong, [0.0]]), strict=True))
            yield _eigenvalue_parts([_value(entries, {}, values)])


def _stiffest(rates: Iterable[tuple[float, float]]) -> float:
    return max((fastest / max(1.0, turning) for fastest, turning in rates), default=0.0)


FEW = 100
"""Steps of a cell that are no crawling, however short."""

BLOWN = 1e6
"""Growth of a state from which on its fast rates are those of a solution without bound."""


def warn_of_stiffness(source: KernelSource, buffers: Buffers, rows_of: Callable[[np.ndarray], Plan]) -> None:
    """Warn if explicit steps of some cells were short because the equations are stiff or the motion has no bound.

    The three cells with the shortest steps are looked at, where they ended, unless they ended at a singularity.

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
    broken = np.isin(buffers.counts[:, Count.STATUS], (Status.STEP_UNDERFLOW, Status.DIVERGED))
    lengths = np.where((steps > 0) & (times > 0.0) & ~broken, times / np.maximum(steps, 1), math.inf)
    cells = np.argsort(lengths)[:3]
    rows, kind = rows_of(cells), "Taylor" if source.method.series else source.method.name
    for cell, start, numbers in zip(cells, rows.start, rows.numbers, strict=True):
        if not math.isfinite(lengths[cell]) or not np.isfinite(buffers.end[cell]).all():
            continue
        size = np.abs(buffers.end[cell]).max()
        blown = size > BLOWN * max(1.0, np.abs(start).max())
        if steps[cell] < FEW and not blown:
            continue
        fastest, turning = _rates(source.equations, buffers.end[cell], numbers, times[cell])
        if fastest * lengths[cell] > 1.0 and fastest > STIFF * max(1.0, turning):
            if blown:
                warnings.warn(
                    f"a state grew to {size:.3g} in {steps[cell]} {kind} steps of a cell; expected a bounded motion; "
                    "check the signs and the size of the parameters",
                    RuntimeWarning,
                    stacklevel=4,
                )
                return
            warnings.warn(
                f"stiff equations: found a rate of {fastest:.3g} beside slow motion, and {steps[cell]} {kind} steps in a cell; "
                "expected few; the result may be worse than rtol says; integrator = 'rodas5p' takes longer steps",
                RuntimeWarning,
                stacklevel=4,
            )
            return


def _rates(equations: Equations, state: np.ndarray, numbers: np.ndarray, time: float = 0.0) -> tuple[float, float]:
    """The fastest decay or growth at a state, and the fastest turning; 0 where there are no numbers."""
    return _eigenvalue_parts(_blocks(equations, _named(equations, state, numbers, time)))


def _named(equations: Equations, state: np.ndarray, numbers: np.ndarray, time: float = 0.0) -> dict[str, float]:
    """States, parameters and the time by name."""
    found = dict(zip(equations.state, state, strict=True)) | dict(zip(equations.parameters, numbers, strict=True))
    return {**found, TIME.name: time}


def _eigenvalue_parts(blocks: Iterable[np.ndarray]) -> tuple[float, float]:
    """The largest real and the largest imaginary part of the eigenvalues of some blocks; 0 where there are no numbers.

    A block with entries beyond the largest float is infinitely fast.
    """
    blocks = [block for block in blocks if not np.isnan(block).any()]
    if any(np.isinf(block).any() for block in blocks):
        return math.inf, 0.0
    rates = np.concatenate([np.linalg.eigvals(block) for block in blocks]) if blocks else np.zeros(0)
    return float(np.abs(rates.real).max(initial=0.0)), float(np.abs(rates.imag).max(initial=0.0))


def _blocks(equations: Equations, values: Mapping[str, float]) -> list[np.ndarray]:
    """The blocks of the Jacobian of the first nodes, with twice what their links add."""
    blocks = [_block(equations, i, values) for i in range(min(equations.n, NODES))]
    for link, edge, share in _links(equations):
        if link[0] < len(blocks):
            found = _value(edge.jacobian_here(), equations.at_link(link, edge), values)
            with np.errstate(over="ignore", invalid="ignore"):
                blocks[link[0]] = blocks[link[0]] + 2.0 * share * found
    return [_by_masses(equations, i, values, block) for i, block in enumerate(blocks)]


def _block(equations: Equations, i: int, values: Mapping[str, float]) -> np.ndarray:
    """The Jacobian of a node's right-hand side less that of M F at fixed rates F."""
    node, at = equations.node_at(i), equations.at_node(i)
    found = _value(node.jacobian(), at, values)
    if node.constant_inertia:
        return found
    size = len(node.state)
    forces = _value(tuple((e,) * size for e in node.rhs), at, values)[:, :1]
    rates = [sp.Dummy(s.name, real=True) for s in node.state]
    known = dict(zip(rates, map(sp.Float, _by_masses(equations, i, values, forces)[:, 0]), strict=True))
    return found - _value(turned_masses(node, rates), {**at, **known}, values)


def _by_masses(equations: Equations, i: int, values: Mapping[str, float], right: np.ndarray) -> np.ndarray:
    """M^-1 right, M the mass matrix of a node; NaN where it is singular."""
    inertia = equations.node_at(i).inertia
    if not inertia:
        return right
    try:
        return np.linalg.solve(_value(inertia, equations.at_node(i), values), right)
    except np.linalg.LinAlgError:
        return np.full(right.shape, math.nan)


def _links(equations: Equations) -> Iterator[tuple[Link, Edge, float]]:
    """The links that are looked at with their templates, and how many links each stands for."""
    large = [(edge, pairs) for edge, pairs in equations.fields if len(pairs) > LINKS]
    if not large:
        yield from ((link, edge, 1.0) for link, edge in islice(equations.linked(), LINKS))
        return
    yield from ((link, edge, 1.0) for link, edge in islice(replace(equations, layers=equations.listed).linked(), LINKS))
    each = LINKS // NODES
    for edge, pairs in large:
        gaps = [1 + k * (pairs.n - 1) // each for k in range(each)]
        links = ((i, (i + gap) % pairs.n, pairs.weight) for i in range(min(pairs.n, NODES)) for gap in gaps)
        yield from ((link, edge, (pairs.n - 1) / each) for link in links)


def _bends(equations: Equations, values: Mapping[str, float]) -> Iterator[np.ndarray]:
    """The blocks of the nodes and of the links in the layers of their turning functions, one state moved there."""
    for i in range(min(equations.n, NODES)):
        node = equations.node_at(i)
        for moved in _turned(node.rhs, node.state, equations.at_node(i), values):
            yield _by_masses(equations, i, moved, _block(equations, i, moved))
    for link, edge, share in _links(equations):
        at = equations.at_link(link, edge)
        for moved in _turned(edge.rhs, edge.here, at, values):
            with np.errstate(over="ignore"):
                added = 2.0 * share * _by_masses(equations, link[0], moved, _value(edge.jacobian_here(), at, moved))
            yield added


def _turned(
    rates: tuple[sp.Expr, ...],
    states: tuple[sp.Symbol, ...],
    at: Mapping[sp.Symbol, sp.Expr],
    values: Mapping[str, float],
) -> Iterator[dict[str, float]]:
    """Values at which the argument of a turning function is zero, and close by on either side."""
    for state, place in _turns(rates, states):
        ((there,),) = _value(((place,),), at, values)
        for shift in (-1e-9, 0.0, 1e-9):
            yield {**values, at[state].name: there + shift * (1.0 + abs(there))}


@lru_cache(maxsize=64)
def _turns(rates: tuple[sp.Expr, ...], states: tuple[sp.Symbol, ...]) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """For each turning function a state, and the value of it at which the argument is zero.

    A root of a size is steep at a point, and has no layer.
    """
    roots = {
        p: sp.S.Zero for e in rates for p in e.atoms(sp.Pow) if isinstance(p.base, sp.Abs) and (1 - p.exp).is_positive
    }
    gaps = {part.args[0] for e in rates for part in e.xreplace(roots).atoms(*TURNING)}
    found = []
    for gap in sorted(gaps, key=sp.default_sort_key):
        slopes = ((s, gap.diff(s)) for s in states)
        found += [(s, s - gap / slope) for s, slope in slopes if slope != 0 and not slope.has(s)][:1]
    return tuple(found)


def _value(
    entries: tuple[tuple[sp.Expr, ...], ...], at: Mapping[sp.Symbol, sp.Expr], values: Mapping[str, float]
) -> np.ndarray:
    """The numbers of a block; NaN where it has none."""
    symbols, function = _compiled(entries)
    known: dict[sp.Symbol, float] = {}
    for s in symbols:
        e = at.get(s, s)
        known[s] = float(e) if e.is_number else values[e.name]
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

"""Warnings about scenes: choices that are allowed but probably not intended."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import product
from typing import Any

import sympy as sp

from ..dynamics.synchrony import NoSynchrony, synchronous_node
from ..graphs.topology import Topology
from ..inputs.names import LinkName, NodeName
from ..interactions.coupling import Coupling, MatrixCoupling, Rates
from ..interactions.ends import WEIGHT
from ..mechanics.components import TIME, Node
from ..mechanics.contact import ContactModel
from ..networks.model import Model
from ..sweeps.axis import Axis
from ..sweeps.parameters import at_nodes

STIFF = 100.0
"""Frequency of a mode, and number of its oscillations, above which springs count as stiff (a choice)."""

STEEP = 100.0
"""Least kappa times belt speed at which a smoothed law is close to the law: 1 - (2/pi) atan(100) is 0.6 %."""

COUNTED = 200
"""Most nodes of a graph with negative weights whose characteristic polynomial is computed (a choice of time)."""


def zero_multiplicity(graph: Topology) -> int:
    """Return the multiplicity of the eigenvalue 0 of the connectivity matrix; 1 means a connected graph.

    With positive weights the multiplicity is the number of groups on which no other node acts (J. S. Caughman,
    J. J. P. Veerman, Electron. J. Combin. 13, R39, 2006).  With negative weights this number is a lower bound; up to
    COUNTED nodes the exact multiplicity is returned.
    """
    leading = graph.leading_groups
    if graph.n > COUNTED or not _has_negative(graph):
        return leading
    from ..spectra.characteristic import characteristic  # most scenes need no FLINT

    return next(k for k, c in enumerate(characteristic(graph).coeffs()) if c != 0)


def warnings(model: Model, varied: tuple[str, ...], values: Mapping[str, Any], duration: float) -> tuple[str, ...]:
    """Return the sentences about one scene."""
    in_parts, asynchronous = asynchrony(model, varied)
    sentences = [in_parts]
    for _, graph in model.linked:
        if _has_negative(graph):
            sentences.append(
                f"topology {graph.name}({graph.n}) has negative weights, which drive oscillators apart; if its matrix is a "
                "Laplacian D - A, negate it: the connectivity matrix is A - D"
            )
    of_nodes = tuple(name for name in varied if model.holders(name))
    if of_nodes and model.topology.link_count:
        sentences.append(
            f"the nodes differ in {', '.join(of_nodes)}: equal states are no solution of this network, so there is no "
            "complete synchronisation; the synchronisation error stays above 0"
        )
    sentences += (
        asynchronous,
        unresolved_smoothing(model, values["parameters"], values["axes"]),
        *(function_of_inputs(coupling, graph) for coupling, graph in model.linked),
        _stiff_springs(model, values, duration),
    )
    # The synchronisation error of equal oscillators that start from one state is zero.
    initial = values["initial"]
    moved = {name.base for axis in values["axes"] if (name := NodeName.parse(axis.name))} & set(initial)
    together = not moved and all(len(set(states)) <= 1 for states in initial.values())
    alike = not varied and len(model.kinds) == 1 and not asynchronous
    if alike and together and "sync_error" in values["record"]:
        sentences.append(
            "all oscillators start from the same state, so the synchronisation error stays 0 whatever the "
            "coupling; give them different initial states"
        )
    return tuple(filter(None, sentences))


def asynchrony(model: Model, varied: tuple[str, ...]) -> tuple[str, str]:
    """Return the reasons, of the graph and of the links, against complete synchronisation; "" without a reason."""
    return _in_parts(model.topology), _without_synchrony(model, varied) if len(model.kinds) == 1 else ""


def unresolved_smoothing(model: Model, parameters: Mapping[str, float], axes: tuple[Axis, ...]) -> str:
    """Return a warning if a smoothed friction law has not reached its plateau at the speed of a belt; else "".

    Belts at rest, and belts with a speed that depends on states or time, are skipped.  Of an axis only the ends are
    tested.
    """
    if model.contact != ContactModel.ATAN:
        return ""
    ends: dict[str, tuple[float, ...]] = {name: (value,) for name, value in parameters.items()}
    ends |= {axis.name: (min(axis.values), max(axis.values)) for axis in axes if axis.name in ends}
    nodes = dict(zip(model.kinds, model.unlinked.nodes, strict=True))
    least = math.inf
    for kind, values in at_nodes(model, ends):
        for names, product_at in _belts(nodes[kind]) if kind.friction else ():
            sizes = [abs(product_at(*corner)) for corner in product(*(values[name] for name in names))]
            least = min([least, *(size for size in sizes if size > 0.0)])
    if least >= STEEP:
        return ""
    return (
        f"smoothed friction: found kappa * speed of the belt = {least:.3g}; expected at least about {STEEP:.0f}, "
        f"for (2/pi) atan(kappa w) is {2.0 / math.pi * math.atan(least):.2g} there and not 1; raise kappa, or use "
        "contact = 'set-valued'"
    )


@lru_cache(maxsize=64)
def _belts(node: Node) -> tuple[tuple[tuple[str, ...], Callable[..., float]], ...]:
    """Return kappa times the sliding velocity of a node at rest, for each smoothed law: parameter names, function."""
    kappa, belts = sp.Symbol("kappa", real=True), []
    smoothed = {a.args[0] for e in node.rhs for a in e.atoms(sp.atan) if a.has(kappa)}
    for argument in sorted(smoothed, key=str):
        at_rest = argument.xreplace(dict.fromkeys(node.state[len(node.state) // 2 :], sp.S.Zero))
        if not at_rest.free_symbols & {TIME, *node.state}:
            names = tuple(sorted(s.name for s in at_rest.free_symbols))
            belts.append((names, sp.lambdify([sp.Symbol(name, real=True) for name in names], at_rest, "math")))
    return tuple(belts)


@lru_cache(maxsize=16)
def _in_parts(graph: Topology) -> str:
    """Return a warning if the graph is not connected."""
    multiplicity = zero_multiplicity(graph)
    if multiplicity <= 1:
        return ""
    parts = graph.components
    reason = f"is not connected ({parts} parts)" if parts > 1 else "has nodes that cannot reach one another"
    return (
        f"topology {graph.name}({graph.n}) {reason}: zero is an eigenvalue of multiplicity "
        f"{multiplicity}, so there is no complete synchronisation by coupling (a common drive may still lock the "
        "parts); join them by links"
    )


def _has_negative(graph: Topology) -> bool:
    """Return True if a weight is negative."""
    weight = graph.all_to_all
    return any(w < 0 for _, _, w in graph.links) if weight is None else bool(graph.link_count and weight < 0)


def _without_synchrony(model: Model, varied: tuple[str, ...]) -> str:
    """Return a warning if equal motion of all nodes is no solution, because couplings act between equal states."""
    if all(isinstance(coupling, MatrixCoupling) for coupling, _ in model.linked):
        return ""
    equations = model.equations(tuple(name for name in varied if not model.holders(name)))
    try:
        synchronous_node(equations)
    except NoSynchrony as problem:
        pairs = zip(model.linked, equations.edges, strict=True)
        names = dict.fromkeys(f"'{coupling}'" for (coupling, _), edge in pairs if not edge.diffusive)
        return (
            f"coupling {' and '.join(names)} does not vanish between oscillators in equal states: {problem}; expected a "
            "function of differences, or one sum of weights at all nodes"
        )
    except ValueError:  # there is no test for nodes with a mass matrix
        pass
    return ""


def function_of_inputs(coupling: Coupling, graph: Topology) -> str:
    """Return a warning if a link is S(W x_j) and a node has several links: a firing rate is S of the sum instead."""
    if not isinstance(coupling, Rates) or graph.link_count <= graph.n:
        return ""
    for rate in coupling.rates.values():
        for call in sorted(rate.atoms(sp.Function) - rate.atoms(sp.Piecewise), key=sp.default_sort_key):
            slope = call.args[0].diff(WEIGHT)
            ends = {s.name[-2:] for s in call.free_symbols}
            if "_i" not in ends and not slope.has(WEIGHT) and any(s.name.endswith("_j") for s in slope.free_symbols):
                text = str(call).replace(WEIGHT.name, "W")
                return (
                    f"coupling '{coupling}': {text} is a function of each link's input, and the links are added; a function of "
                    "the sum of inputs is another model, which docs/links.md writes by other links"
                )
    return ""


def _stiff_springs(model: Model, values: Mapping[str, Any], duration: float) -> str:
    """Return a warning if a mode of the springs oscillates so often that its phase error exceeds rtol."""
    if [str(coupling) for coupling, _ in model.linked] != ["spring"]:
        return ""
    # Collect the strengths of all links, and of single links, in all cells.
    strengths = [value for axis in values["axes"] if axis.name == "sigma" for value in axis.values]
    for name, value in values["parameters"].items():
        link = LinkName.parse(name)
        if name == "sigma" or (link and link.base == "sigma"):
            strengths.append(value)
    # d: the largest sum of |weight| over the links to a node.
    graph = model.topology
    if graph.all_to_all is not None:
        degree = abs(float(graph.all_to_all)) * (graph.n - 1)
    else:
        weights = [0.0] * graph.n
        for target, _, weight in graph.links:
            weights[target] += abs(float(weight))
        degree = max(weights)
    # By Gershgorin's theorem the frequency of the fastest mode is at most sqrt(1 + 2 sigma d).
    fastest = math.sqrt(1.0 + 2.0 * max(strengths) * degree)
    swings = fastest * duration / (2.0 * math.pi)
    if fastest < STIFF or swings < STIFF:
        return ""
    return (
        f"stiff springs: a mode of frequency {fastest:.3g} swings {swings:.3g} times, and the errors of its phase add up "
        "to more than rtol; tighten rtol until the result no longer changes"
    )

"""Networks from one node and one edge: the template derivation that holds for any number of oscillators.

The Lagrangian of a network is a sum over nodes and edges, T = sum T_i and V = sum V_i + sum V_edge, so the Euler-Lagrange
equations of a node are those of the single oscillator plus one force for each edge that meets it.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache

import sympy as sp

from .equations import Edge, Equations, Node
from .frictions import CONTACTS, KAPPA
from .lagrangian import mass_matrix
from .nondimensional import Scales, describe, model_energies, scaled_accelerations
from .parameter import Parameter
from .plugins import call, load
from .topology import Topology

__all__ = ["connectivity", "edge", "network", "node", "parameters"]


def parameters(oscillator: str, friction: str | None, contact: str, coupling: str | None) -> dict[str, Parameter]:
    """Return every parameter with default, unit, meaning and range, in the order of Equations.parameters.

    Raises ValueError for an unknown oscillator, law, contact or coupling, and for a law that the oscillator does not take.
    """
    model = load("oscillator", oscillator)
    scales = Scales(model)
    table = dict(describe(model.PARAMETERS, scales)) if hasattr(model, "scales") else dict(model.PARAMETERS)
    law = _law(oscillator, friction, contact)
    if law is not None:
        table |= describe(law.PARAMETERS, scales)
        if contact == "atan" and _jumps(law):
            table["kappa"] = describe({"kappa": KAPPA}, scales)["kappa"]
    if coupling is not None:
        table |= describe(load("coupling", coupling).PARAMETERS, scales)
    return table


def _law(oscillator: str, friction: str | None, contact: str):  # type: ignore[no-untyped-def]
    """The friction law's module, None where the oscillator takes none."""
    if contact not in CONTACTS:
        raise ValueError(f"unknown contact {contact!r}; known: {', '.join(CONTACTS)}")
    takes = load("oscillator", oscillator).FRICTION
    if friction is None:
        if takes:
            raise ValueError(f"oscillator {oscillator!r} needs a friction law, found none; give friction = 'exponential'")
        return None
    law = load("friction", friction)
    if not takes:
        raise ValueError(f"oscillator {oscillator!r} takes no friction law, found {friction!r}; leave friction out")
    return law


def _jumps(law) -> bool:  # type: ignore[no-untyped-def]
    symbols = {name: sp.Symbol(name, real=True) for name in law.PARAMETERS}
    return bool(call(law.force, {**symbols, "w": sp.Symbol("w", real=True)}).has(sp.sign))


@lru_cache(maxsize=64)
def node(oscillator: str, friction: str | None, contact: str) -> Node:
    """Derive the equations of one oscillator: state x, v, with x' = v and v' from the scaled Lagrangian.

    Raises ValueError as `parameters` does.
    """
    names = parameters(oscillator, friction, contact, None)
    symbols = {name: sp.Symbol(name, real=True) for name in names}
    model = load("oscillator", oscillator)
    if hasattr(model, "field"):
        state = tuple(sp.Symbol(name, real=True) for name in model.STATE)
        rates = call(model.field, {**symbols, **{s.name: s for s in state}})
        return Node(state, tuple(rates), tuple(symbols.values()))
    state, found = scaled_accelerations(model, _law(oscillator, friction, contact), contact, symbols)
    half = len(state) // 2
    return Node(state, (*state[half:], *found), tuple(symbols.values()))


@lru_cache(maxsize=64)
def edge(coupling: str, single: Node, oscillator: str = "friction") -> Edge:
    """Derive what one link adds to the rate of its target, from the coupling's potential or Rayleigh function.

    The force on coordinate q_i is -dV/dq_i - dR/dv_i, over the mass of the oscillator in its own units (`oscillator` names
    the model whose mass that is).  Raises ValueError for an unknown coupling.
    """
    model = load("coupling", coupling)
    half = len(single.state) // 2
    here = tuple(sp.Symbol(f"{s.name}_i", real=True) for s in single.state)
    there = tuple(sp.Symbol(f"{s.name}_j", real=True) for s in single.state)
    weight = sp.Symbol("weight", real=True)
    strengths = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    rates = []
    for k in range(half):
        force = sp.S.Zero
        if hasattr(model, "potential"):
            given = {"q_i": here[k], "q_j": there[k], "weight": weight, **strengths}
            force -= call(model.potential, given).diff(here[k])
        if hasattr(model, "dissipation"):
            given = {"v_i": here[half + k], "v_j": there[half + k], "weight": weight, **strengths}
            force -= call(model.dissipation, given).diff(here[half + k])
        rates.append(_difference(sp.factor(force / _mass(oscillator, k))))
    return Edge(here, there, weight, (*[sp.S.Zero] * half, *rates), tuple(strengths.values()))


def _difference(e: sp.Expr) -> sp.Expr:
    """sigma w (x_j - x_i) rather than -sigma w (x_i - x_j)."""
    sums = [f for f in sp.Mul.make_args(e) if f.is_Add]
    if sums and e.could_extract_minus_sign():
        return sp.Mul(-e / sums[0], -sums[0])
    return e


@lru_cache(maxsize=64)
def _mass(oscillator: str, k: int) -> sp.Expr:
    """Non-dimensional mass of coordinate k: the second derivative of T over the unit of mass."""
    model = load("oscillator", oscillator)
    if hasattr(model, "field"):
        return sp.S.One
    scales = Scales(model)
    symbols = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    kinetic, _, _, pairs = model_energies(model, lambda w: sp.S.Zero, scales, symbols)
    masses = mass_matrix(kinetic, [v for _, v in pairs])
    if not masses.is_diagonal() or masses.free_symbols & {s for pair in pairs for s in pair}:
        raise ValueError(f"oscillator {oscillator!r}: couplings need a constant diagonal mass matrix, found {masses}")
    return sp.simplify(masses[k, k] / scales.of("kg"))


def network(single: Node, link: Edge | None, graph: Topology) -> Equations:
    """Join copies of a node by the links of a graph."""
    return Equations(single, link, graph.n, graph.links if link is not None else ())


def connectivity(coupling: str, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read the connectivity matrix off the coupling: minus the Hessian of its potential over sigma, edge by edge.

    For a damper the Rayleigh function takes the potential's place.  A one-way link has no potential of its own; it acts on
    its target with the force that the template potential gives there, so its row is read off in the same way.
    Raises ValueError for a coupling whose Hessian is not sigma times a constant.
    """
    model = load("coupling", coupling)
    q_i, q_j, weight, sigma = (sp.Symbol(name, real=True) for name in ("q_i", "q_j", "weight", "sigma"))
    strengths = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    if hasattr(model, "potential"):
        energy = call(model.potential, {"q_i": q_i, "q_j": q_j, "weight": weight, **strengths})
    else:
        energy = call(model.dissipation, {"v_i": q_i, "v_j": q_j, "weight": weight, **strengths})
    own, other = (sp.simplify(-energy.diff(q_i, q) / sigma / weight) for q in (q_i, q_j))
    if not (own.is_Rational and other.is_Rational):
        raise ValueError(f"coupling {coupling!r}: its Hessian over sigma is not constant ({own}, {other}); it has no matrix G")
    rows = [[Fraction(0)] * graph.n for _ in range(graph.n)]
    for target, source, factor in graph.links:
        rows[target][target] += factor * Fraction(int(own.p), int(own.q))
        rows[target][source] += factor * Fraction(int(other.p), int(other.q))
    return tuple(map(tuple, rows))

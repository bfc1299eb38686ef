"""The equations of one link between nodes of one kind or of two: the terms in the rates of the target.

The energy of some couplings changes if the two ends are exchanged: V(q_i, q_j) is not V(q_j, q_i).  Links of such a
coupling are oriented, and the weight W is the direction: W = 1 if the link runs from the target to the source, W = -1
if the link runs from the source to the target.  The energy of the link is W^2 V_even + W V_odd.  An exchange of the
ends keeps V_even and changes the sign of V_odd.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache, partial

import sympy as sp

from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Block, Edge, Node
from ..mechanics.contact import ContactModel, FrictionLaw
from ..mechanics.impacts import Stop
from ..mechanics.lagrangian import Mechanics, mass_matrix, solve_masses
from ..mechanics.nondimensional import friction_coefficient, nondimensional, static_coefficient
from ..mechanics.oscillator import FieldModel, Oscillator
from ..mechanics.rows import Law, Surface, check_surfaces, friction_surface, projection
from .coupling import WEIGHT, Coupling
from .ends import Pair, Terms

Symbols = tuple[sp.Symbol, ...]


@lru_cache(maxsize=64)
def edge(
    coupling: Coupling,
    single: Node,
    oscillator: Oscillator | None = None,
    other: Node | None = None,
    partner: Oscillator | None = None,
) -> Edge:
    """Derive the terms of one link in the rates of its target.

    Rates of a coupling are added unchanged.  Energies give forces by the Euler-Lagrange equations of a pair of nodes
    with only this link; a kinetic energy adds inertia.  Forces are written in differences, such as sigma w (x_j - x_i),
    so that they vanish exactly between equal states.

    An undirected edge is two links of one symmetric template, so both ends feel the force of the potential.  A one-way
    link acts only on its target.  Set-valued friction balances the force of a link while the target sticks.
    """
    if single.events:
        plain = Node(single.state[:2], (single.state[1], sp.S.Zero), single.parameters)
        (event,) = single.events
        return _on_sliding(edge(coupling, plain, oscillator), event.mode)
    if single.sticks or (other is not None and other.sticks):
        return _on_rows(coupling, single, oscillator, other, partner)
    coupling.check_ends(single, other)
    pair = Pair((single, other or single), (oscillator, partner or oscillator))
    terms = coupling.terms(pair)
    if not terms.rates:
        rates, inertia = _by_lagrange(pair, terms)
    elif single.inertia:  # right-hand sides of such nodes are M times the rates
        masses = sp.Matrix(single.inertia).xreplace(dict(zip(single.state, pair.here, strict=True)))
        rates, inertia = tuple(masses * sp.Matrix(terms.rates)), ()
    else:
        rates, inertia = terms.rates, ()

    surfaces = _surfaces(coupling, pair, terms)
    # Parameters of the edge: all parameters of the coupling, and parameters of the nodes that occur in the terms.
    entries = (
        *rates,
        *(e for block in inertia for row in block for e in row),
        *(e for s in surfaces for e in s.expressions),
    )
    used = {s for e in entries for s in e.free_symbols}
    strengths = tuple(sp.Symbol(name, real=True) for name in coupling.parameters)
    symbols = tuple(s for s in single.parameters if s not in strengths and s in used)
    theirs = tuple((s, parameter) for s, parameter in pair.theirs.items() if s in used)
    beyond = pair.beyond if used & set(pair.beyond) else ()
    parameters = (*strengths, *symbols)
    return Edge(pair.here, pair.there, WEIGHT, rates, parameters, inertia, theirs, terms.oriented, beyond, surfaces)


def _surfaces(coupling: Coupling, pair: Pair, terms: Terms) -> tuple[Surface, ...]:
    """Return the rows of a link; its forces and impulses act on both ends along the gradient of the level."""
    if not terms.events:
        return ()
    # the inverse masses of each end, in the symbols of that end
    of_source = {parameter: s for s, parameter in pair.theirs.items()}
    ends: list[tuple[Oscillator | None, Node, Symbols, dict[sp.Symbol, sp.Symbol]]] = [
        (pair.oscillators[0], pair.nodes[0], pair.here, {}),
        (pair.oscillators[1], pair.nodes[1], pair.there, of_source),
    ]
    if any(node.inertia for _, node, *_ in ends):
        raise ValueError(
            f"coupling '{coupling}': found events between nodes with a mass matrix; expected at most three coupled coordinates"
        )
    masses = [_masses(oscillator, node, states).xreplace(named) for oscillator, node, states, named in ends]

    def push(slopes: Callable[[sp.Symbol], sp.Expr], moved: int) -> tuple[sp.Expr, ...]:
        """Return M^-1 times the slopes by the coordinates (moved = 0) or the velocities (1) of both ends."""
        column: list[sp.Expr] = []
        for matrix, (_, _, states, _) in zip(masses, ends, strict=True):
            half = len(states) // 2
            by = states[half:] if moved else states[:half]
            column += [*[sp.S.Zero] * half, *solve_masses(matrix, [slopes(s) for s in by], states[half:])]
        return tuple(column)

    surfaces = []
    for event in terms.events:
        speeds = {*pair.velocities}
        if isinstance(event, Stop):
            if event.gap.free_symbols & speeds:
                raise ValueError(
                    f"coupling '{coupling}': found the gap {event.gap}; expected a function of coordinates and time"
                )
            column = push(partial(derivative, event.gap), 0)
            surfaces.append(Surface(Law.STOP, event.gap, column, event.restitution, in_order=event.in_order))
            continue
        sliding = sp.expand(event.sliding)
        slopes = [derivative(sliding, v) for v in pair.velocities]
        if all(e == 0 for e in slopes) or any(e.free_symbols & speeds for e in slopes):
            raise ValueError(
                f"coupling '{coupling}': found the sliding velocity {sliding}; expected a linear function of velocities"
            )
        # virtual work: the force on a coordinate is -load f(w) dw/dv
        pull = tuple(-event.load * e for e in push(partial(derivative, sliding), 1))
        w, law = sp.Dummy("w", real=True), event.law
        assert isinstance(law, FrictionLaw)
        coefficient = friction_coefficient(law, ContactModel.SET_VALUED)
        surfaces.append(friction_surface(sliding, pull, coefficient(w), w, static_coefficient(law)))
    check_surfaces(surfaces)
    return tuple(surfaces)


def strength(edge: Edge, parameters: Iterable[sp.Symbol] = ()) -> sp.Symbol:
    """Return the strength of a link: the parameter sigma, or the only parameter that is a factor of the whole link."""

    def is_factor(s: sp.Symbol, e: sp.Expr) -> bool:
        slope = e.diff(s)
        return bool(slope != 0 and not sp.expand(slope).has(s) and sp.expand(e - s * slope) == 0)

    # Search the parameters of the link: sigma by its name, else the only common factor.
    of_nodes = set(parameters)
    of_link = [s for s in edge.parameters if s not in of_nodes]
    sigma = [s for s in of_link if s.name == "sigma"]
    factors = sigma or [s for s in of_link if all(is_factor(s, e) for e in edge.expressions if e != 0)]
    if len(factors) == 1:
        return factors[0]
    names = ", ".join(s.name for s in of_link) or "no parameter"
    found = f"found the factors {', '.join(s.name for s in factors)}" if factors else f"found {names}"
    raise ValueError(
        f"strength of the links: {found}; expected sigma, or exactly one parameter that is a factor of the whole link"
    )


def _by_lagrange(pair: Pair, terms: Terms) -> tuple[tuple[sp.Expr, ...], tuple[Block, ...]]:
    """Return the rates of the target from the energies of one link, and the blocks of its inertia, empty without."""
    half = pair.halves[0]
    speeds = pair.here[half:]

    # The pair with the energies of the link only: M_link a = r, with the coordinates of both ends.
    forces = tuple(-terms.dissipation.diff(v) for v in pair.velocities)
    mechanics = Mechanics(pair.coordinates, pair.velocities, terms.kinetic, terms.potential, forces)
    r, link_masses = mechanics.balance()

    # The equations of the node are divided by its masses m: multiply the rows of the target by m^-1 as well.
    masses = sp.eye(half) if pair.nodes[0].inertia else _masses(pair.oscillators[0], pair.nodes[0], pair.here)
    accelerations = solve_masses(masses, [_in_differences(e, pair.alike, pair.here) for e in r[:half]], speeds)
    rates = (*[sp.S.Zero] * half, *accelerations)
    if all(e == 0 for e in link_masses):
        return rates, ()
    columns = [solve_masses(masses, list(link_masses[:half, c]), speeds) for c in range(link_masses.cols)]

    # The block of each end; rows and columns of coordinates are zero, since x' = v feels no inertia.
    blocks = []
    for end in (columns[:half], columns[half:]):
        zeros = [sp.S.Zero] * len(end)
        rows = [[*zeros, *zeros] for _ in range(half)]
        rows += [[*zeros, *(column[row] for column in end)] for row in range(half)]
        blocks.append(tuple(map(tuple, rows)))
    return rates, tuple(blocks)


def _on_sliding(plain: Edge, mode: sp.Symbol) -> Edge:
    """Return a link between nodes with set-valued friction, which acts on the velocity only while the target slips."""
    if plain.rhs[0] != 0:
        raise ValueError("set-valued contact: a link acts on the rate of the position; expected forces alone")
    if plain.inertia:
        raise ValueError("set-valued contact: a link has inertia; expected forces alone; use contact 'atan'")
    here, there = (sp.Symbol(f"{mode.name}_{end}", real=True) for end in "ij")
    rates = (sp.S.Zero, here**2 * plain.rhs[1], sp.S.Zero)
    return replace(plain, here=(*plain.here, here), there=(*plain.there, there), rhs=rates)


def _on_rows(
    coupling: Coupling, single: Node, oscillator: Oscillator | None, other: Node | None, partner: Oscillator | None
) -> Edge:
    """Return a link to a node with rows, whose held rows balance the link; see `rows.projection`."""
    plain = edge(coupling, _without_rows(single), oscillator, None if other is None else _without_rows(other), partner)
    if plain.inertia:
        raise ValueError(
            "links with inertia: found events of a node; expected links without inertia; use contact 'atan'"
        )
    target, source = single, other or single
    here, there = (
        tuple(sp.Symbol(f"{mode.name}_{end}", real=True) for mode in node.modes)
        for node, end in ((target, "i"), (source, "j"))
    )
    swap = dict(zip(target.state, (*plain.here, *here), strict=True))
    rates = tuple(
        e.xreplace(swap) for e in projection([row.map(lambda e: e.xreplace(swap)) for row in target.rows], plain.rhs)
    )
    known = {*plain.parameters, *(s for s, _ in plain.theirs)}
    used = {s for e in rates for s in e.free_symbols}
    parameters = (*plain.parameters, *(p for p in target.parameters if p in used and p not in known))
    return replace(
        plain,
        here=(*plain.here, *here),
        there=(*plain.there, *there),
        rhs=(*rates, *[sp.S.Zero] * len(here)),
        parameters=parameters,
    )


def _without_rows(node: Node) -> Node:
    """Return a node of the continuous states alone; links need only those of its rates that no row changes."""
    modes = set(node.modes)
    rates = (sp.S.Zero if e.free_symbols & modes else e for e in node.rhs[: len(node.continuous)])
    return Node(node.continuous, tuple(rates), node.parameters, inertia=node.inertia)


def _in_differences(e: sp.Expr, pairs: list[tuple[sp.Symbol, sp.Symbol]], here: Symbols) -> sp.Expr:
    """Write an expression in the differences `there` - `here`; return it unchanged if it is no function of these."""
    gaps = [sp.Dummy(f"d{k}", real=True) for k in range(len(pairs))]
    shifted = sp.expand(e.xreplace({q: p + d for (p, q), d in zip(pairs, gaps, strict=True)}))
    if shifted.free_symbols & set(here):
        return e
    return sp.factor_terms(shifted).xreplace({d: q - p for (p, q), d in zip(pairs, gaps, strict=True)})


def _masses(oscillator: Oscillator | None, single: Node, here: Symbols) -> sp.Matrix:
    """Return the mass matrix of the target without links, in the symbols of the target in a link."""
    if oscillator is None or isinstance(oscillator.model, FieldModel):
        return sp.eye(len(here) // 2)
    system = nondimensional(oscillator)
    masses = mass_matrix(system.kinetic, system.velocities)
    if masses.has(TIME):
        raise ValueError(
            f"oscillator {oscillator.name!r}: a coupling needs masses that do not depend on time, found {masses}"
        )
    return masses.xreplace(dict(zip(single.state, here, strict=True)))

"""The equations of one link: what a coupling adds to the rates of its target, between nodes of one kind or of two.

Some couplings have an energy that changes if their two ends are exchanged: V(q_i, q_j) is not
V(q_j, q_i).  Their links say at which end node i is, by the sign of their weight W as seen from the
target: W = 1 if the link runs from the target to the source, W = -1 if it runs from the source to
the target.  The energy of the link is W^2 V_even + W V_odd, the parts of V that keep and that change
their sign in the exchange.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import sympy as sp

from ..mechanics.components import TIME, Block, Edge, Node
from ..mechanics.lagrangian import balance, mass_matrix, solve_masses
from ..mechanics.nondimensional import nondimensional
from ..mechanics.oscillator import FieldModel, Oscillator
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
    """Derive what one link adds to the rates of its target.

    Rates are what a link adds, whatever the node is.  Energies act on coordinates followed by their velocities, by the
    Euler-Lagrange equations of a pair with that link alone.  A coupling with kinetic energy adds inertia.  A force is
    kept as a function of differences, sigma w (x_j - x_i), so that equal states feel exactly nothing.

    An undirected edge is two links, and the template is symmetric, so the two forces are those of the potential.  A
    one-way link has no potential: the force that the template gives its target acts there, and nothing acts back on
    the source.  Set-valued friction takes up the force of a link while its target sticks.
    """
    if single.events:
        plain = Node(single.state[:2], (single.state[1], sp.S.Zero), single.parameters)
        (event,) = single.events
        return _on_sliding(edge(coupling, plain, oscillator), event.mode)
    coupling.check_ends(single, other)
    pair = Pair((single, other or single), (oscillator, partner or oscillator))
    terms = coupling.terms(pair)
    rates, inertia = (_carried(pair, terms.rates), ()) if terms.rates else _by_lagrange(pair, terms)
    used = {s for e in (*rates, *(e for block in inertia for row in block for e in row)) for s in e.free_symbols}
    strengths = tuple(sp.Symbol(name, real=True) for name in coupling.parameters)
    symbols = tuple(s for s in single.parameters if s not in strengths and s in used)
    theirs = tuple((s, own) for s, own in pair.theirs.items() if s in used)
    return Edge(pair.here, pair.there, WEIGHT, rates, (*strengths, *symbols), inertia, theirs, terms.oriented)


def strength(edge: Edge, parameters: Iterable[sp.Symbol] = ()) -> sp.Symbol:
    """Return the parameter that is the strength of a link: sigma, or the only one that is a factor of the whole link."""
    of_nodes = set(parameters)
    own = [s for s in edge.parameters if s not in of_nodes]
    named = [s for s in own if s.name == "sigma"]
    factors = named or [s for s in own if all(_is_factor(s, e) for e in edge.expressions if e != 0)]
    if len(factors) == 1:
        return factors[0]
    names = ", ".join(s.name for s in own) or "no parameter"
    found = f"found the factors {', '.join(s.name for s in factors)}" if factors else f"found {names}"
    raise ValueError(
        f"strength of the links: {found}; expected sigma, or exactly one parameter that is a factor of the whole link"
    )


def _is_factor(s: sp.Symbol, e: sp.Expr) -> bool:
    slope = e.diff(s)
    return slope != 0 and not sp.expand(slope).has(s) and sp.expand(e - s * slope) == 0


def _carried(pair: Pair, rates: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    """M rates of the target: what is added to its right-hand sides."""
    node = pair.nodes[0]
    if not node.inertia:
        return rates
    return tuple(sp.Matrix(node.inertia).xreplace(dict(zip(node.state, pair.here, strict=True))) * sp.Matrix(rates))


def _by_lagrange(pair: Pair, terms: Terms) -> tuple[tuple[sp.Expr, ...], tuple[Block, ...]]:
    """Rates of the target by the energies of a link alone, and the blocks of its inertia, empty without one."""
    coordinates, moving, half = pair.coordinates, pair.velocities, pair.halves[0]
    speeds = pair.here[half:]
    forces = tuple(-terms.dissipation.diff(v) for v in moving)
    rest, masses = balance(terms.kinetic, terms.potential, forces, coordinates, moving)
    own = sp.eye(half) if pair.nodes[0].inertia else _masses(pair.oscillators[0], pair.nodes[0], pair.here)
    rates = solve_masses(own, [_in_differences(e, pair.alike, pair.here) for e in rest[:half]], speeds)
    rates = (*[sp.S.Zero] * half, *rates)
    if all(e == 0 for e in masses):
        return rates, ()
    columns = [solve_masses(own, list(masses[:half, c]), speeds) for c in range(masses.cols)]
    return rates, _inertia(pair, sp.Matrix(columns).T)


def _inertia(pair: Pair, masses: sp.Matrix) -> tuple[Block, ...]:
    """The blocks of a link's mass matrix, with rows and columns for coordinates too."""
    a, b = pair.halves
    blocks = []
    for first, half in ((0, a), (a, b)):
        rows = [[sp.S.Zero] * (2 * half) for _ in range(a)]
        rows += [[*[sp.S.Zero] * half, *(masses[r, first + c] for c in range(half))] for r in range(a)]
        blocks.append(tuple(map(tuple, rows)))
    return tuple(blocks)


def _on_sliding(plain: Edge, mode: sp.Symbol) -> Edge:
    """A link between nodes with a mode: it acts on the velocity of a target that slips."""
    if plain.rhs[0] != 0:
        raise ValueError("set-valued contact: a link acts on the rate of the position; expected forces alone")
    if plain.inertia:
        raise ValueError("set-valued contact: a link has inertia; expected forces alone; use contact 'atan'")
    modes = (sp.Symbol(f"{mode.name}_i", real=True), sp.Symbol(f"{mode.name}_j", real=True))
    here, there = (*plain.here, modes[0]), (*plain.there, modes[1])
    rates = (sp.S.Zero, modes[0] ** 2 * plain.rhs[1], sp.S.Zero)
    return replace(plain, here=here, there=there, rhs=rates)


def _in_differences(e: sp.Expr, pairs: list[tuple[sp.Symbol, sp.Symbol]], here: Symbols) -> sp.Expr:
    """The expression in terms of `there` - `here` if it depends on nothing else of both, unchanged otherwise."""
    gaps = [sp.Dummy(f"d{k}", real=True) for k in range(len(pairs))]
    shifted = sp.expand(e.xreplace({q: p + d for (p, q), d in zip(pairs, gaps, strict=True)}))
    if shifted.free_symbols & set(here):
        return e
    return sp.factor_terms(shifted).xreplace({d: q - p for (p, q), d in zip(pairs, gaps, strict=True)})


def _masses(oscillator: Oscillator | None, single: Node, here: Symbols) -> sp.Matrix:
    """The mass matrix of the target by itself, in the symbols of a link's target."""
    if oscillator is None or isinstance(oscillator.model, FieldModel):
        return sp.eye(len(here) // 2)
    system = nondimensional(oscillator)
    masses = mass_matrix(system.kinetic, system.velocities)
    if masses.has(TIME):
        raise ValueError(
            f"oscillator {oscillator.name!r}: a coupling needs masses that do not depend on time, found {masses}"
        )
    return masses.xreplace(dict(zip(single.state, here, strict=True)))

"""The equations of one link: what a coupling adds to the rates of its target, between nodes of one kind or of two.

Some couplings have an energy that changes if their two ends are exchanged: V(q_i, q_j) is not
V(q_j, q_i).  Their links say at which end node i is, by the sign of their weight W as seen from the
target: W = 1 if the link runs from the target to the source, W = -1 if it runs from the source to
the target.  The energy of the link is W^2 V_even + W V_odd, the parts of V that keep and that change
their sign in the exchange.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import sympy as sp

from .components import TIME, Edge, Node
from .coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling
from .friction import SLIP
from .lagrangian import balance, mass_matrix, solve_masses
from .nondimensional import nondimensional
from .oscillator import FieldModel, Oscillator

__all__ = ["check_coupling", "edge", "is_oriented", "link_energies", "link_energy"]

Symbols = tuple[sp.Symbol, ...]

_POSITIONS = sp.symbols("q_i q_j", real=True)
"""The coordinates of the two ends in the energies of a coupling."""

_SPEEDS = sp.symbols("v_i v_j", real=True)
"""Their velocities."""


def check_coupling(coupling: Coupling, single: Node, other: Node | None = None) -> None:
    """Raise ValueError if a coupling cannot join nodes: an unknown component, or a spring without velocities.

    Parameters
    ----------
    coupling : Coupling
        What is to join the nodes.
    single : Node
        The target of a link, and its source if there is no `other`.
    other : Node, optional
        The source of a link between nodes of two kinds.
    """
    if isinstance(coupling, MatrixCoupling):
        if other is None:
            coupling.check(_names(single))
        return
    for node in (single,) if other is None else (single, other):
        half = len(node.state) // 2
        if coupling.between is not None and other is None:
            raise ValueError(
                f"coupling {str(coupling)!r} joins {' and '.join(coupling.between)}; found nodes of one kind"
            )
        if node.contact is None and node.rhs[:half] != node.state[half:]:
            name = node.state[0].name
            raise ValueError(
                f"coupling {str(coupling)!r} joins coordinates with velocities; found a node of {node.state} without "
                f"them; name the components that a link joins, e.g. coupling = '{name}->{name}'"
            )
        if other is None:
            coupling.places(_names(node)[: max(half, 1)])


@lru_cache(maxsize=64)
def edge(
    coupling: Coupling,
    single: Node,
    oscillator: Oscillator | None = None,
    other: Node | None = None,
    partner: Oscillator | None = None,
) -> Edge:
    """Derive what one link adds to the rates of its target.

    Entries such as "x->x, 1/2 y->z" add sigma w factor (a_j - a_i) to the rate of their second component, whatever the
    node is.  Other couplings act on coordinates followed by their velocities, by the Euler-Lagrange equations of a
    pair with that link alone, on all coordinates or, as in "spring on x", on those it names.  A coupling with kinetic
    energy adds inertia.  The force is kept as a function of differences, sigma w (x_j - x_i), so that equal states feel
    exactly nothing.

    An undirected edge is two links, and the template is symmetric, so the two forces are those of the potential.  A
    one-way link has no potential: the force that the template gives its target acts there, and nothing acts back on
    the source.  Set-valued friction takes up the force of a link while its target sticks.

    Parameters
    ----------
    coupling : Coupling
        What joins the nodes.
    single : Node
        The target, and the source if there is no `other`.
    oscillator : Oscillator, optional
        The model of the target, whose mass matrix turns forces into accelerations; without it the masses are 1, as
        they are in the units of every oscillator with one mass.
    other : Node, optional
        A source of another kind: components of equal names are joined.
    partner : Oscillator, optional
        The model of that source.

    Raises
    ------
    ValueError
        As `check_coupling` does, and if nothing is joined.
    """
    if single.contact is not None:
        plain = Node(single.state[:2], (single.state[1], sp.S.Zero), single.parameters)
        return _on_sliding(edge(coupling, plain, oscillator))
    check_coupling(coupling, single, other)
    here = tuple(sp.Symbol(f"{s.name}_i", real=True) for s in single.state)
    there = tuple(sp.Symbol(f"{s.name}_j", real=True) for s in (other or single).state)
    if isinstance(coupling, MatrixCoupling):
        sigma = sp.Symbol("sigma", real=True)
        rates = _entry_rates(coupling, (single, other or single), sigma * WEIGHT, here, there)
        return Edge(here, there, WEIGHT, rates, (sigma,))
    half = len(single.state) // 2
    strengths = tuple(sp.Symbol(name, real=True) for name in coupling.parameters)
    ends = _Ends(single, other or single, oscillator, partner or oscillator, here, there)
    rates, inertia = _by_lagrange(ends, ends.energies(coupling, WEIGHT), oscillator)
    used = (*rates, *(e for block in inertia for row in block for e in row))
    symbols = tuple(s for s in single.parameters if s not in strengths and any(e.has(s) for e in used))
    return Edge(here, there, WEIGHT, (*[sp.S.Zero] * half, *rates), (*strengths, *symbols), inertia)


def _by_lagrange(
    ends: _Ends, energies: tuple[sp.Expr, sp.Expr, sp.Expr], oscillator: Oscillator | None
) -> tuple[tuple[sp.Expr, ...], tuple[tuple[tuple[sp.Expr, ...], ...], ...]]:
    """Accelerations of the target by the energies of a link alone, and the blocks of its inertia, empty without one."""
    kinetic, potential, dissipation = energies
    coordinates, moving, half, speeds = ends.coordinates, ends.velocities, ends.halves[0], ends.here[ends.halves[0] :]
    forces = tuple(-dissipation.diff(v) for v in moving)
    rest, masses = balance(kinetic, potential, forces, coordinates, moving)
    own = _masses(oscillator, ends.nodes[0], ends.here)
    rates = solve_masses(own, [_in_differences(e, ends.pairs, ends.here) for e in rest[:half]], speeds)
    if all(e == 0 for e in masses):
        return rates, ()
    columns = [solve_masses(own, list(masses[:half, c]), speeds) for c in range(masses.cols)]
    return rates, ends.inertia(sp.Matrix(columns).T)


class _Ends:
    """The two ends of a link between Lagrangian nodes."""

    def __init__(
        self,
        single: Node,
        other: Node,
        oscillator: Oscillator | None,
        partner: Oscillator | None,
        here: Symbols,
        there: Symbols,
    ) -> None:
        self.nodes, self.oscillators, self.here, self.there = (single, other), (oscillator, partner), here, there
        self.halves = (len(here) // 2, len(there) // 2)
        a, b = self.halves
        self.coordinates, self.velocities = (*here[:a], *there[:b]), (*here[a:], *there[b:])
        names = dict(zip(_names(other), there, strict=True))
        self.pairs = [(p, names[name]) for name, p in zip(_names(single), here, strict=True) if name in names]

    def energies(self, coupling: LagrangianCoupling, weight: sp.Symbol) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """The kinetic energy, the potential and the Rayleigh function of a link."""
        if coupling.between is not None:
            return self._between(coupling, coupling.between, weight)
        half = self.halves[0]
        known = [str(p)[:-2] for p, _ in self.pairs if p in self.here[:half]]
        if not known:
            raise ValueError(
                f"coupling {str(coupling)!r}: {self._described()} have no coordinate of one name; nothing is joined"
            )
        joined = [known[k] for k in coupling.places(tuple(known))]
        places = [(_names(self.nodes[0]).index(name), _names(self.nodes[1]).index(name)) for name in joined]
        return _energies(coupling, self.here, self.there, weight, places)

    def _between(
        self, coupling: LagrangianCoupling, kinds: tuple[str, str], weight: sp.Symbol
    ) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
        """The energies of a coupling that joins two named kinds of oscillator, in the names of their states."""
        if set(map(str, self.oscillators)) != set(kinds):
            wanted = " and ".join(kinds)
            raise ValueError(f"coupling {str(coupling)!r} joins {wanted}; found a link between {self._described()}")
        symbols = dict(zip(self.nodes[0].state, self.here, strict=True))
        symbols |= dict(zip(self.nodes[1].state, self.there, strict=True))
        symbols[WEIGHT] = weight
        kinetic, potential, dissipation = (
            energy.xreplace(symbols) for energy in (coupling.kinetic, coupling.potential, coupling.dissipation)
        )
        return kinetic, potential, dissipation

    def _described(self) -> str:
        return " and ".join(str(name or node.state) for name, node in zip(self.oscillators, self.nodes, strict=True))

    def inertia(self, masses: sp.Matrix) -> tuple[tuple[tuple[sp.Expr, ...], ...], ...]:
        """The blocks of a link's mass matrix, with rows and columns for coordinates too."""
        a, b = self.halves
        blocks = []
        for first, half in ((0, a), (a, b)):
            rows = [[sp.S.Zero] * (2 * half) for _ in range(a)]
            rows += [[*[sp.S.Zero] * half, *(masses[r, first + c] for c in range(half))] for r in range(a)]
            blocks.append(tuple(map(tuple, rows)))
        return tuple(blocks)


def _energies(
    coupling: LagrangianCoupling,
    here: Symbols,
    there: Symbols,
    weight: sp.Symbol,
    places: Sequence[tuple[int, int]],
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """The kinetic energy, the potential and the Rayleigh function, summed over pairs of coordinates by number."""
    kinetic = potential = dissipation = sp.S.Zero
    for a, b in places:
        coordinates = dict(zip(_POSITIONS, (here[a], there[b]), strict=True))
        speeds = dict(zip(_SPEEDS, (here[len(here) // 2 + a], there[len(there) // 2 + b]), strict=True))
        kinetic += link_energy(coupling.kinetic, speeds, weight)
        potential += link_energy(coupling.potential, coordinates, weight)
        dissipation += link_energy(coupling.dissipation, speeds, weight)
    return kinetic, potential, dissipation


def link_energies(
    coupling: LagrangianCoupling, joint: Edge, nodes: tuple[Node, Node], oscillators: tuple[Oscillator, Oscillator]
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return the kinetic energy, the potential and the Rayleigh function of a link, in the symbols of its edge.

    Parameters
    ----------
    coupling : LagrangianCoupling
        What joins the nodes.
    joint : Edge
        What the link adds to the rates of its target.
    nodes, oscillators : pair of Node, pair of Oscillator
        Those of its target and its source.
    """
    return _Ends(*nodes, *oscillators, joint.here, joint.there).energies(coupling, joint.weight)


def _names(node: Node) -> tuple[str, ...]:
    return tuple(s.name for s in node.state)


def _on_sliding(plain: Edge) -> Edge:
    """A link between nodes with a mode: it acts on the velocity of a target that slips."""
    if plain.rhs[0] != 0:
        raise ValueError("set-valued contact: a link acts on the rate of the position; expected forces alone")
    if plain.inertia:
        raise ValueError("set-valued contact: a link has inertia; expected forces alone; use contact 'atan'")
    modes = (sp.Symbol(f"{SLIP.name}_i", real=True), sp.Symbol(f"{SLIP.name}_j", real=True))
    here, there = (*plain.here, modes[0]), (*plain.there, modes[1])
    return Edge(here, there, plain.weight, (sp.S.Zero, modes[0] ** 2 * plain.rhs[1], sp.S.Zero), plain.parameters)


def _entry_rates(
    coupling: MatrixCoupling, nodes: tuple[Node, Node], strength: sp.Expr, here: Symbols, there: Symbols
) -> tuple[sp.Expr, ...]:
    """strength H (there - here), each difference a factor of its own: a sum over all of them would feel round-off.

    Between nodes of two kinds the entries apply whose components there are.
    """
    own, others = (_names(node) for node in nodes)
    rates = [sp.S.Zero] * len(own)
    fitting = [(a, b, factor) for a, b, factor in coupling.entries if {a, b} <= set(own) and a in others]
    if not fitting:
        raise ValueError(
            f"coupling {str(coupling)!r} joins nothing between nodes of {', '.join(own)} and {', '.join(others)}"
        )
    for source, target, factor in fitting:
        share = sp.Rational(factor.numerator, factor.denominator)
        gap = there[others.index(source)] - here[own.index(source)]
        rates[own.index(target)] += sp.Mul(share, *strength.args, gap)
    return tuple(rates)


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


def link_energy(energy: sp.Expr, ends: Mapping[sp.Symbol, sp.Symbol], weight: sp.Symbol) -> sp.Expr:
    """Return the energy (or Rayleigh function) of one link.

    Parameters
    ----------
    energy : Expr
        The function as a coupling has it, in the symbols of its two ends and `WEIGHT`.
    ends : mapping of Symbol to Symbol
        The symbols that take the place of those two, target first.
    weight : Symbol
        The symbol that takes the place of `WEIGHT`.
    """
    first, second = ends
    back = {first: ends[second], second: ends[first]}
    here, there = (energy.xreplace({**pair, WEIGHT: weight}) for pair in (ends, back))
    if sp.expand(here - there) == 0:
        return here
    here, there = (e.xreplace({weight: sp.S.One}) for e in (here, there))
    return sp.expand(weight**2 * (here + there) / 2 + weight * (here - there) / 2)


@lru_cache(maxsize=64)
def is_oriented(edge: Edge) -> bool:
    """Return True if the rates of a link do not just change their sign with its weight."""
    turned = {edge.weight: -edge.weight}
    return any(sp.expand(e + e.xreplace(turned)) != 0 for e in edge.rhs)

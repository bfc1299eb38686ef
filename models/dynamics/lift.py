"""Networks that carry deviations or parameter derivatives: templates are differentiated, not the whole network.

The derivative of a template by a parameter is a template again, and so is the pair (state, deviation).  Both functions
of this module therefore return networks of any size at the cost of one node and one link, and every kernel runs them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, count

import sympy as sp

from ..inputs.names import LinkName, NodeName
from ..mechanics import calculus
from ..mechanics.components import Block, Edge, Node
from ..mechanics.rows import Law
from .equations import Equations, Layer
from .variational import expect_continuous

Along = tuple[tuple[sp.Symbol, sp.Symbol], ...]
"""Pairs of a state or parameter and its deviation."""


@dataclass(frozen=True, slots=True)
class Lift:
    """A network of nodes (x, d), where d is a small deviation from the motion x."""

    equations: Equations
    states: tuple[int, ...]  # index in the state of `equations` of each state of the original network
    deviations: tuple[int, ...]  # index of the deviation of each state of the original network
    seeds: Mapping[str, str]  # parameter of the original network: its deviation, a parameter of `equations`


def lifted(equations: Equations, names: Iterable[str] = ()) -> Lift:
    """Return the network of nodes (x, d) with d' = r_x d + sum_p seed_p r_p over some parameters p.

    `seed_p` = 1 makes d the derivative of x by p. With a mass matrix, M x' = r, the second equation is
    M d' + (M_x d + sum_p seed_p M_p) x' = r_x d + sum_p seed_p r_p. `names` may hold parameters of one node or one
    link: P_2, k_1_2.
    """
    _check(equations)
    bases = {name: _base(equations, name) for name in names}
    # The deviation of x is d_x, that of p seed_p. A network that is lifted twice has these names: take d2_x, seed2_p.
    taken = {s.name for node in equations.nodes for s in (*node.state, *node.parameters)}
    taken |= {s.name for edge in equations.edges for s in edge.parameters}
    rank = next(
        k for k in chain([""], map(str, count(2))) if not any(n.startswith((f"d{k}_", f"seed{k}_")) for n in taken)
    )

    def deviations(symbols: Iterable[sp.Symbol], kind: str = "d") -> tuple[sp.Symbol, ...]:
        return tuple(sp.Symbol(f"{kind}{rank}_{s.name}", real=True) for s in symbols)

    def seeded(parameters: Iterable[sp.Symbol]) -> tuple[sp.Symbol, ...]:
        return tuple(s for s in parameters if s.name in bases.values())

    def node(each: Node) -> Node:
        states, parameters = deviations(each.state), seeded(each.parameters)
        seeds = deviations(parameters, "seed")
        along = (*zip(each.state, states, strict=True), *zip(parameters, seeds, strict=True))
        rates = (*each.rhs, *_changes(each.rhs, along))
        inertia = _lower_triangular(each.inertia, along) if each.inertia else ()
        return Node((*each.state, *states), rates, (*each.parameters, *seeds), inertia=inertia)

    def edge(each: Edge) -> Edge:
        here, there, beyond = (deviations(states) for states in (each.here, each.there, each.beyond))
        parameters = seeded(each.parameters)
        seeds = deviations(parameters, "seed")
        # A parameter of the source has a symbol of the link's; its seed as well.
        theirs = tuple((s, of) for s, of in each.theirs if of.name in bases.values())
        source_seeds = deviations((s for s, _ in theirs), "seed")
        along = (
            *zip((*each.here, *each.there, *each.beyond), (*here, *there, *beyond), strict=True),
            *zip(parameters, seeds, strict=True),
            *zip((s for s, _ in theirs), source_seeds, strict=True),
        )
        return replace(
            each,
            here=(*each.here, *here),
            there=(*each.there, *there),
            beyond=(*each.beyond, *beyond),
            rhs=(*each.rhs, *_changes(each.rhs, along)),
            parameters=(*each.parameters, *seeds),
            inertia=tuple(_lower_triangular(block, along) for block in each.inertia),
            theirs=(*each.theirs, *zip(source_seeds, deviations((of for _, of in theirs), "seed"), strict=True)),
        )

    # Seeds of parameters with a value for each node or link have one as well. `Equations.map_templates` would check the
    # templates before that is known.
    seeds = {base: f"seed{rank}_{base}" for base in bases.values()}

    def with_seeds(varied: tuple[str, ...]) -> tuple[str, ...]:
        return (*varied, *(seeds[name] for name in varied if name in seeds))

    def layer(each: Layer) -> Layer:
        edge_of = tuple((ends, edge(template)) for ends, template in each.edge_of)
        return replace(each, edge_of=edge_of, varied=with_seeds(each.varied))

    both = replace(
        equations,
        nodes=tuple(map(node, equations.nodes)),
        layers=tuple(map(layer, equations.layers)),
        varied=with_seeds(equations.varied),
    )
    index = {name: k for k, name in enumerate(both.state)}
    return Lift(
        both,
        tuple(index[name] for name in equations.state),
        tuple(index[f"d{rank}_{name}"] for name in equations.state),
        {name: f"seed{rank}_{name}" for name in bases},
    )


def derivative(equations: Equations, name: str) -> tuple[Equations, dict[str, float]]:
    """Return the network whose rates, and whose masses if it has any, are the derivatives by a parameter; and its seeds.

    The state stays the same. The seeds are further parameters: 1 for the parameter, 0 for the same parameter of other nodes
    and links. `name` may be a parameter of one node or one link: P_2, k_1_2.
    """
    lift = lifted(equations, [name])

    # The rates of deviations that are zero are seed r_p, and the lower left block of their masses is seed M_p.
    def at_zero(ends: Iterable[tuple[sp.Symbol, ...]]) -> dict[sp.Symbol, sp.Expr]:
        return {d: sp.S.Zero for end in ends for d in end[len(end) // 2 :]}

    def lower(rates: tuple[sp.Expr, ...], zeros: dict[sp.Symbol, sp.Expr]) -> tuple[sp.Expr, ...]:
        return tuple(e.xreplace(zeros) for e in rates[len(rates) // 2 :])

    def lower_left(block: Block, zeros: dict[sp.Symbol, sp.Expr]) -> Block:
        return tuple(tuple(e.xreplace(zeros) for e in row[: len(row) // 2]) for row in block[len(block) // 2 :])

    def node(each: Node, both: Node) -> Node:
        zeros, size = at_zero([both.state]), len(each.state)
        massless = ((sp.S.Zero,) * size,) * size if equations.inertial else ()
        inertia = lower_left(both.inertia, zeros) or massless
        return Node(each.state, lower(both.rhs, zeros), both.parameters, inertia=inertia)

    def edge(each: Edge, both: Edge) -> Edge:
        zeros = at_zero(both.end_states)
        inertia = tuple(lower_left(block, zeros) for block in both.inertia)
        rates = lower(both.rhs, zeros)
        return replace(both, here=each.here, there=each.there, beyond=each.beyond, rhs=rates, inertia=inertia)

    layers = []
    for layer, both in zip(equations.layers, lift.equations.layers, strict=True):
        pairs = zip(layer.edge_of, both.edge_of, strict=True)
        layers.append(replace(both, edge_of=tuple((ends, edge(each, twin)) for (ends, each), (_, twin) in pairs)))
    nodes = tuple(map(node, equations.nodes, lift.equations.nodes))
    seeds = dict.fromkeys((p for p in lift.equations.parameters if p not in equations.parameters), 0.0)
    return replace(lift.equations, nodes=nodes, layers=tuple(layers)), {**seeds, lift.seeds[name]: 1.0}


def _check(equations: Equations) -> None:
    """Raise ValueError for rates that jump, whose derivatives do not describe small deviations."""
    surfaces = (s for template in equations.templates for s in template.surfaces)
    if laws := {row.law for node in equations.nodes for row in node.rows} | {s.law for s in surfaces}:
        events = " and ".join({Law.SIGN: "set-valued signs"}.get(law, f"{law}s") for law in Law if law in laws)
        raise ValueError(
            f"derivative of a network: found {events}; expected smooth rates; use steep rates in their place"
        )
    if equations.sticks:
        raise ValueError(
            "derivative of a network: found set-valued friction; expected smooth rates; use contact 'atan'"
        )
    expect_continuous(equations)


def _base(equations: Equations, name: str) -> str:
    """Return the symbol's name of a parameter, P of P_2 and k of k_1_2."""
    if name not in equations.parameters:
        raise ValueError(f"derivative of a network: found {name!r}; expected one of {', '.join(equations.parameters)}")
    if name not in equations.single:
        return name
    link = LinkName.parse(name)
    holder = link if link is not None and link.base in equations.numbered else NodeName.parse(name)
    return name if holder is None else holder.base


def _changes(expressions: Sequence[sp.Expr], along: Along) -> tuple[sp.Expr, ...]:
    """Return the derivative of expressions along deviations of states and parameters."""
    return tuple(sp.Add(*(calculus.derivative(e, s) * change for s, change in along)) for e in expressions)


def _lower_triangular(block: Block, along: Along) -> Block:
    """Return the block [[M, 0], [dM, M]] of a mass matrix, where dM is the derivative of M along deviations."""
    zero = (sp.S.Zero,) * len(block[0])
    return (*((*row, *zero) for row in block), *((*_changes(row, along), *row) for row in block))

"""Equations of networks from oscillators, friction laws and couplings.

The Lagrangian of a network is a sum over nodes and edges: T = sum T_i and V = sum V_i + sum V_edge.  The Euler-Lagrange
equations of a node are therefore those of the single oscillator plus one force for each edge at the node.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import sympy as sp

from ..definitions.definition import FRICTION_LAW
from ..graphs.hypergraph import Hypergraph
from ..graphs.links import LINK_LIMIT, AllPairs, Link
from ..graphs.topology import Topology
from ..inputs.plugin_files import names
from ..interactions.coupling import Coupling, LagrangianCoupling, MatrixCoupling, Potential
from ..interactions.link import edge
from ..interactions.separation import separated
from ..mechanics.calculus import cancelled, derivative, expanded
from ..mechanics.components import WEIGHT_NUMBER, Block, Edge, Node
from ..mechanics.contact import KAPPA, SLIDING, ContactModel, FrictionLaw, regularise
from ..mechanics.events import on_steady_ground, set_valued
from ..mechanics.impacts import EventDefinition, Reset, Stop
from ..mechanics.lagrangian import LARGEST_BY_MINORS, check_masses_exist, coupled, solve_masses
from ..mechanics.nondimensional import friction_coefficient, nondimensional, scale, static_coefficient
from ..mechanics.oscillator import FRICTION, FieldModel, LagrangianModel, Oscillator
from ..mechanics.parameter import Parameter
from ..mechanics.rows import Law, Surface, check_surfaces, friction_surface, modes_of, with_rows
from ..mechanics.sliding import sliding_surfaces
from .equations import Equations, Layer

FEW = 8
"""Most nodes of a complete graph whose links are always listed (a choice)."""


def parameters(
    oscillator: Oscillator,
    friction: FrictionLaw | None = None,
    contact: str = ContactModel.ATAN,
    couplings: Sequence[Coupling] = (),
) -> dict[str, Parameter]:
    """Return every parameter with default, unit, meaning and range, in the order of Equations.parameters."""
    ContactModel.parse("contact", contact)
    if friction is None and oscillator.takes_friction:
        raise ValueError(
            f"oscillator {oscillator.name!r} has no friction law; known: {', '.join(names(FRICTION_LAW))}; name one"
        )
    if friction is not None and not oscillator.takes_friction:
        raise ValueError(f"oscillator {oscillator.name!r} takes no friction law, found {friction.name!r}; leave it out")
    # In this order: parameters of the oscillator, its friction law, the smoothing of contacts, the couplings.
    table: dict[str, Parameter] = dict(oscillator.parameters)
    laws = [*([] if friction is None else [friction]), *oscillator.laws.values()]
    for law in dict.fromkeys(laws):
        _join(table, law.parameters, f"friction law {law.name!r}")
    if contact == ContactModel.ATAN and any(
        regularise(law.force, SLIDING, sp.Symbol("kappa")) != law.force for law in laws
    ):
        _join(table, {"kappa": KAPPA}, f"contact {str(contact)!r}")
    for coupling in couplings:
        # contacts of nodes and links with one law share its parameters
        shared = {name for law in _laws_of(coupling) if law in laws for name in law.parameters}
        more = {name: p for name, p in coupling.parameters.items() if name not in shared}
        _join(table, more, f"coupling {str(coupling)!r}", _free_spelling(coupling, oscillator))
        laws += _laws_of(coupling)
    return {name: replace(p, scale=str(scale(oscillator, p.unit))) for name, p in table.items()}


def _laws_of(coupling: Coupling) -> tuple[FrictionLaw, ...]:
    return coupling.laws if isinstance(coupling, Potential) else ()


@lru_cache(maxsize=64)
def node(
    oscillator: Oscillator,
    friction: FrictionLaw | None = None,
    contact: str = ContactModel.ATAN,
    rows: bool = False,
    of_links: tuple[str, ...] | None = None,
) -> Node:
    """Derive the equations of one oscillator; for a Lagrangian, x' = v and the Euler-Lagrange equations for v'.

    rows: write friction of one coordinate on a steady ground as a row too, as networks of several kinds need it.
    of_links: names of the modes of rows of links, in a network that has any; rows are then solved by `Equations.parts`.

    Raises ValueError as `parameters` does.
    """
    symbols = tuple(sp.Symbol(name, real=True) for name in parameters(oscillator, friction, contact))
    events = oscillator.model.events
    if isinstance(oscillator.model, FieldModel):
        state = tuple(sp.Symbol(name, real=True) for name in oscillator.model.state)
        rates, surfaces = oscillator.model.rates, _resets(events)
        if contact == ContactModel.SET_VALUED and oscillator.has_contact:
            rates, signs = sliding_surfaces(state, rates)
            surfaces = [*signs, *surfaces]
        return _with_surfaces(state, rates, surfaces, {}, symbols, of_links)

    # Solve M dv/dt = r in symbols. With too many coupled coordinates keep M, with identity rows for the coordinates.
    system = nondimensional(oscillator)
    positions, velocities = system.coordinates, system.velocities
    r, masses = system.balance()
    inertia: Block = ()
    if len(coupled(masses)) <= LARGEST_BY_MINORS:
        accelerations = cancelled(solve_masses(masses, r, velocities))
    else:
        check_masses_exist(masses, velocities)
        accelerations = expanded(r)
        inertia = tuple(map(expanded, sp.diag(sp.eye(masses.rows), masses).tolist()))

    # Friction laws take the place of the unknown function f(w), or f(w, k) for the law of event k.
    laws: dict[object, FrictionLaw] = {**oscillator.laws} | ({} if friction is None else {None: friction})
    coefficients = {k: friction_coefficient(law, contact) for k, law in laws.items()}
    law = None if friction is None else coefficients[None](SLIDING)
    sticking = {k for k, each in laws.items() if contact == ContactModel.SET_VALUED and each.jumps}
    smooth = [
        e.replace(FRICTION, lambda w, k=None: FRICTION(*_numbered(w, k)) if k in sticking else coefficients[k](w))
        for e in accelerations
    ]
    stops = [event for event in events if isinstance(event, Stop)]
    plain = not rows and of_links is None and not events and on_steady_ground(smooth, FRICTION, positions, velocities)
    if sticking and friction is not None and plain:
        (x,), (v,) = positions, velocities
        w = sp.Dummy("w", real=True)
        rate, event = set_valued(smooth[0], FRICTION, coefficients[None](w), w, static_coefficient(friction), v)
        return Node((x, v, event.mode), (v, event.mode**2 * rate, sp.S.Zero), symbols, (event,), law=law)
    if inertia and (sticking or events):
        raise ValueError(
            f"events: found {len(coupled(masses))} coordinates that the masses couple; expected at most {LARGEST_BY_MINORS}; "
            "use contact 'atan', and no stops or resets"
        )
    speeds = dict(zip(velocities, positions, strict=True))
    smooth, surfaces = _contacts(smooth, speeds, coefficients, laws)
    zeros = [sp.S.Zero] * len(positions)
    for stop in stops:
        push = solve_masses(masses, [derivative(stop.gap, x) for x in positions], velocities)
        surfaces.append(Surface(Law.STOP, stop.gap, (*zeros, *push), stop.restitution, in_order=stop.in_order))
    surfaces += _resets(events)
    node = _with_surfaces((*positions, *velocities), (*velocities, *smooth), surfaces, speeds, symbols, of_links)
    return replace(node, law=law, inertia=inertia)


def _numbered(w: sp.Expr, k: sp.Expr | None) -> tuple[sp.Expr, ...]:
    return (w,) if k is None else (w, k)


def _resets(events: Sequence[EventDefinition]) -> list[Surface]:
    resets = (event for event in events if isinstance(event, Reset))
    return [
        Surface(Law.RESET, event.guard, sets=tuple((sp.Symbol(s, real=True), e) for s, e in event.sets.items()))
        for event in resets
    ]


def _with_surfaces(
    state: tuple[sp.Symbol, ...],
    rates: tuple[sp.Expr, ...],
    surfaces: Sequence[Surface],
    speeds: Mapping[sp.Symbol, sp.Symbol],
    parameters: tuple[sp.Symbol, ...],
    of_links: tuple[str, ...] | None,
) -> Node:
    """Return a node of these states and rates, with rows if there are surfaces."""
    if of_links is not None:
        check_surfaces(surfaces)
        modes = modes_of(surfaces)
        held = iter(modes)
        placed = [surface if surface.law is Law.RESET else surface.in_mode(next(held)) for surface in surfaces]
        joined = (*modes, *(sp.Symbol(name, real=True) for name in of_links))
        return Node(
            (*state, *joined), (*rates, *[sp.S.Zero] * len(joined)), parameters, surfaces=tuple(placed), joined=joined
        )
    if not surfaces:
        return Node(state, rates, parameters)
    states, rhs, rows = with_rows(state, rates, surfaces, speeds)
    return Node(states, rhs, parameters, rows=rows)


def _contacts(
    accelerations: Sequence[sp.Expr],
    speeds: Mapping[sp.Symbol, sp.Symbol],
    coefficients: Mapping[object, Callable[[sp.Expr], sp.Expr]],
    laws: Mapping[object, FrictionLaw],
) -> tuple[list[sp.Expr], list[Surface]]:
    """Return the accelerations without friction, and the row of each contact f(w)."""
    velocities = list(speeds)
    applied = sorted(
        {f for e in accelerations for f in e.atoms(FRICTION)},
        key=lambda f: ([not f.has(v) for v in velocities], sp.default_sort_key(f)),
    )
    swap = {f: sp.Dummy(f"f{k}", real=True) for k, f in enumerate(applied)}
    plain = [e.xreplace(swap) for e in accelerations]
    smooth, surfaces = [e.xreplace(dict.fromkeys(swap.values(), sp.S.Zero)) for e in plain], []
    for f, coefficient in swap.items():
        pull = [e.diff(coefficient) for e in plain]
        if any(e.has(*swap.values()) for e in pull):
            raise ValueError(f"set-valued contact: {f} acts nonlinearly; expected a multiple of it in the forces")
        sliding = sp.expand(f.args[0])
        slopes = [sliding.diff(v) for v in velocities]
        if all(e == 0 for e in slopes) or any(e.has(*velocities) for e in slopes):
            raise ValueError(
                f"set-valued contact: found the sliding velocity {sliding}; expected a linear function of velocities"
            )
        if sp.simplify(sp.Add(*(a * b for a, b in zip(slopes, pull, strict=True)))) == 0:
            raise ValueError(
                f"set-valued contact: found the sliding velocity {sliding}, which does not feel its own friction; expected one "
                "that it changes"
            )
        felt = [v for v, e in zip(velocities, slopes, strict=True) if e != 0]
        k, w = f.args[1] if len(f.args) > 1 else None, sp.Dummy("w", real=True)
        static = static_coefficient(laws[k])
        surface = friction_surface(sliding, (*[sp.S.Zero] * len(pull), *pull), coefficients[k](w), w, static)
        surfaces.append(replace(surface, name=speeds[felt[0]].name if len(felt) == 1 else ""))
    return smooth, surfaces


def _join(table: dict[str, Parameter], more: Mapping[str, Parameter], what: str, remedy: str = "rename it") -> None:
    """Add the parameters of another part of the model; raise ValueError for a name that the table already has."""
    for name, parameter in more.items():
        if name in table:
            raise ValueError(f"{what}: its parameter {name!r} has the name of one of another part; {remedy}")
        table[name] = parameter


def _free_spelling(coupling: Coupling, oscillator: Oscillator) -> str:
    """Return the remedy if a parameter of a coupling has the name of another parameter."""
    if isinstance(coupling, MatrixCoupling):
        rates: dict[str, str] = {}
        for source, target, factor in coupling.entries:
            front = "" if factor == 1 else f"{factor}*"
            rates[target] = f"{rates[target]} + " if target in rates else ""
            rates[target] += f"k*{front}W*({source}_j - {source}_i)"
        return f"write Rates({rates}, {{'k': 1}}), whose parameter may have any name"
    if not isinstance(coupling, LagrangianCoupling) or not isinstance(oscillator.model, LagrangianModel):
        return "rename it"
    # Write the energies of the link once for each coordinate that it joins, with names of parameters that are free.
    joined = [c for c in oscillator.model.coordinates if coupling.coordinates is None or c.name in coupling.coordinates]
    if coupling.name == "spring":
        energy = " + ".join(f"k*W*({c.name}_j - {c.name}_i)**2/2" for c in joined)
        return f"write Potential({energy!r}, {{'k': 1}}), whose parameter may have any name"
    if coupling.name == "damper" and len(oscillator.model.coordinates) == 1:
        speed = joined[0].velocity
        rate = f"k*W*({speed}_j - {speed}_i)"
        return f"write Rates({{{speed!r}: {rate!r}}}, {{'k': 1}}), a force per mass, whose parameter may have any name"
    return "write it in a file with another name of the parameter (docs/plugins.md)"


Layers = Sequence[tuple[Coupling, Topology]]
"""Couplings with their graphs."""


def network(single: Node, link: Edge | None, graph: Topology, varied: tuple[str, ...] = ()) -> Equations:
    """Return the equations of equal nodes that the links of a graph join.

    Notes
    -----
    The weight of an oriented link, whose energy changes if its ends are exchanged, is the sign of its direction
    (`synchain.models.interactions.link`).
    """
    apart = Equations.of_equal_nodes(single, None, graph.n, (), varied)
    return apart if link is None else replace(apart, layers=(_layer(apart, link, graph),))


def _layer(
    apart: Equations, link: Edge, graph: Topology, numbered: tuple[str, ...] = (), mutual: bool = False
) -> Layer:
    """Return the links of a graph between equal nodes: `AllPairs` if they act by a mean field, else a list.

    Each link has a value of the parameters in `numbered`.  `mutual`: both directions of a link share these values.
    """
    shared = link.with_shared(apart.varied)
    if link.beyond or isinstance(graph, Hypergraph):
        return _triadic_layer(shared, graph, numbered)
    if numbered:
        return _listed_layer((((0, 0), shared),), graph, numbered, mutual)
    # A complete graph of one weight becomes a mean field if the link separates, else a list, if not too long.
    weight = None if graph.n <= FEW or apart.sticks or link.surfaces else graph.all_to_all
    if weight is not None and separated(shared, apart.varied) is not None:
        return Layer((((0, 0), shared),), AllPairs(graph.n, weight))
    if weight is not None and graph.link_count > LINK_LIMIT:
        raise ValueError(
            f"mean field of {graph}: found the rates {', '.join(map(str, link.rhs))}; expected a finite sum of products, "
            f"functions of the target times functions of the source, or at most {LINK_LIMIT} links, which can be listed"
        )
    return Layer((((0, 0), shared),), oriented_links(graph) if graph.link_count and link.oriented else graph.links)


def _triadic_layer(link: Edge, graph: Topology, numbered: tuple[str, ...]) -> Layer:
    """Return the links of three ends of a hypergraph between equal nodes."""
    if not link.beyond or not isinstance(graph, Hypergraph):
        found, expected = ("a graph of pairs", "triangles") if link.beyond else ("a hypergraph", "a graph of pairs")
        ends = "three" if link.beyond else "two"
        raise ValueError(
            f"links of {ends} ends: found {found}, {graph.name}({graph.n}); expected {expected}; give each coupling its own "
            "graph, links=[(coupling, graph), …]"
        )
    if numbered:
        raise ValueError(f"links of three ends: found numbers of links, {', '.join(numbered)}; expected weights alone")
    triads = graph.triads
    links = tuple((target, source, weight) for target, source, weight, _ in triads)
    return Layer((((0, 0), link),), links, beyond=tuple(k for *_, k in triads))


def _listed_layer(
    edges: tuple[tuple[tuple[int, int], Edge], ...], graph: Topology, numbered: tuple[str, ...], mutual: bool
) -> Layer:
    """Return the links of a graph, each with values of the parameters in `numbered`."""
    oriented = any(link.oriented for _, link in edges)
    if WEIGHT_NUMBER.name in numbered:
        if oriented:
            raise ValueError(
                "W: found weights as numbers of a coupling that tells the two ends of a link apart; strength and direction "
                "share one number there; expected a parameter of the link"
            )
        edges = tuple((ends, link.with_weight_number()) for ends, link in edges)
    return Layer(edges, oriented_links(graph) if oriented else graph.links, numbered, mutual and graph.symmetric)


def layered_network(
    oscillators: Sequence[Oscillator],
    singles: Sequence[Node],
    kinds: Sequence[int],
    layers: Layers,
    varied: tuple[str, ...] = (),
) -> Equations:
    """Return the equations of nodes of one or several kinds, joined by one or several layers of links."""
    # Split the varied parameters into parameters of nodes and parameters of links.
    names = {s.name for single in singles for s in single.parameters}
    apart = Equations(tuple(singles), tuple(kinds), (), tuple(name for name in varied if name in names))
    of_links = [name for name in varied if name not in names]
    linked = []
    for coupling, graph in layers:
        numbered = tuple(name for name in of_links if name in coupling.parameters or name == WEIGHT_NUMBER.name)
        mutual = isinstance(coupling, LagrangianCoupling | Potential)
        if apart.mixed and isinstance(graph, Hypergraph):
            raise ValueError("links of three ends: found nodes of several kinds; expected equal nodes")
        if apart.mixed:
            linked.append(_mixed_layer(apart, oscillators, coupling, graph, numbered, mutual))
        else:
            linked.append(_layer(apart, edge(coupling, singles[0], oscillators[0]), graph, numbered, mutual))
    if any(_has_rows(coupling) for coupling, _ in layers):
        linked = _with_held(apart, layers, linked)
    return replace(apart, layers=tuple(linked)) if linked else apart


def _has_rows(coupling: Coupling) -> bool:
    return isinstance(coupling, Potential) and bool(coupling.events)


def modes_of_links(layers: Layers, kinds: Sequence[int]) -> tuple[tuple[str, ...], ...] | None:
    """Return the names of the modes of links at each kind of node; None if no link has rows.

    The source of a link has the modes of its rows.  All nodes of a kind have as many modes as the node with most; a mode
    without a link stays 1.
    """
    if not any(_has_rows(coupling) for coupling, _ in layers):
        return None
    most = _most_of_links(layers, kinds)
    names: list[list[str]] = [[] for _ in range(max(kinds) + 1)]
    for (_, stem, _), counts in most.items():
        for kind, count in enumerate(counts):
            names[kind] += [stem] * count
    return tuple(
        tuple(s if of_kind.count(s) == 1 else f"{s}{of_kind[: k + 1].count(s)}" for k, s in enumerate(of_kind))
        for of_kind in names
    )


def _most_of_links(layers: Layers, kinds: Sequence[int]) -> dict[tuple[int, str, int], list[int]]:
    """Return, for each event of each layer, the largest number of its rows at a node of each kind."""
    most = {}
    for number, (coupling, graph) in enumerate(layers):
        if not (isinstance(coupling, Potential) and coupling.events):
            continue
        sources = Counter(source for _, source, _ in _links_with_rows(coupling, graph, len(set(kinds)) > 1))
        counts = [max(sources[i] for i, k in enumerate(kinds) if k == kind) for kind in range(max(kinds) + 1)]
        for a, event in enumerate(coupling.events):
            most[number, "open_link" if isinstance(event, Stop) else "slip_link", a] = counts
    return most


def _links_with_rows(coupling: Potential, graph: Topology, mixed: bool) -> list[Link]:
    """Return one direction of each link of a graph; W = 1, from the target to the source, if the coupling has a direction."""
    if isinstance(graph, Hypergraph) or graph.asymmetry:
        found = "a hypergraph" if isinstance(graph, Hypergraph) else graph.asymmetry
        raise ValueError(
            f"coupling '{coupling}': found {found} in {graph.name}({graph.n}); contacts and stops act on both ends of a link; "
            "expected links of equal weights both ways"
        )
    if coupling.oriented and not mixed:
        return [link for link in oriented_links(graph) if link[2] == 1]
    return [link for link in graph.links if link[0] < link[1]]


def _with_held(apart: Equations, layers: Layers, linked: Sequence[Layer]) -> list[Layer]:
    """Return the layers with the links whose rows can be held, and the places of their modes."""
    most = _most_of_links(layers, apart.kind_of)
    # the modes of links follow those of the rows of the node, event after event
    firsts: dict[tuple[int, int, int], int] = {}
    for kind, node in enumerate(apart.nodes):
        place = len(node.joined) - sum(counts[kind] for counts in most.values())
        for (number, _, a), counts in most.items():
            firsts[number, a, kind] = place
            place += counts[kind]
    held_layers = []
    for number, ((coupling, graph), layer) in enumerate(zip(layers, linked, strict=True)):
        held, used = [], Counter[int]()
        if isinstance(coupling, Potential) and coupling.events:
            differing = sorted({name for law in coupling.laws for name in law.parameters} & set(apart.varied))
            if differing:
                raise ValueError(
                    f"coupling '{coupling}': found {differing[0]!r} of its contact, which differs from node to node; expected one "
                    "value; give the contact a law with another parameter"
                )
            for link in _links_with_rows(coupling, graph, apart.mixed):
                source = link[1]
                kind = apart.kind_of[source]
                held.append((link, tuple(firsts[number, a, kind] + used[source] for a in range(len(coupling.events)))))
                used[source] += 1
        held_layers.append(replace(layer, held=tuple(held)))
    return held_layers


def _mixed_layer(
    apart: Equations,
    oscillators: Sequence[Oscillator],
    coupling: Coupling,
    graph: Topology,
    numbered: tuple[str, ...],
    mutual: bool,
) -> Layer:
    """Return the links of a graph between nodes of several kinds."""
    singles, pairs = apart.nodes, sorted({apart.ends(link) for link in graph.links})
    edges = tuple(((a, b), edge(coupling, singles[a], oscillators[a], singles[b], oscillators[b])) for a, b in pairs)
    if any(a == b and link.oriented for (a, b), link in edges):
        raise ValueError(
            f"coupling {str(coupling)!r} tells the ends of a link apart; expected nodes of one kind, which "
            "may differ in parameters (a stop that a node cannot reach has no effect)"
        )
    shared = tuple((ends, link.with_shared(apart.varied)) for ends, link in edges)
    return _listed_layer(shared, graph, numbered, mutual) if numbered else Layer(shared, graph.links)


def oriented_links(graph: Topology) -> tuple[Link, ...]:
    """Return the links of a graph with the sign of their direction as weight.

    A link runs from the smaller to the larger number of a node.  On a circulant graph, such as a ring, a link runs the
    shorter way round, so the last link runs from the last node to the first.
    """
    if not graph.symmetric or any(weight != 1 for _, _, weight in graph.links):
        raise ValueError(
            f"topology {graph.name}({graph.n}): found one-way links or weights other than 1; expected neither, since this "
            "coupling tells the two ends of a link apart: choose another graph or coupling"
        )
    n = graph.n
    pairs = {(i, j) for i, j, _ in graph.links}
    # A graph is circulant if shifting all nodes by one maps links onto links.
    circulant = all(((i + 1) % n, (j + 1) % n) in pairs for i, j in pairs)
    links = []
    for i, j, _ in graph.links:
        way, back = (j - i) % n, (i - j) % n
        forward = way < back if circulant and way != back else i < j
        links.append((i, j, Fraction(1 if forward else -1)))
    return tuple(links)

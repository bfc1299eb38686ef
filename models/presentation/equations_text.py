"""Equations as LaTeX, as plain text, and as a dictionary fit for JSON.

Where an equation contains one of the friction laws, the law is written as f and defined once below,
in the letters of Marszal et al., Eur. Phys. J. Special Topics (2016), eqs. 3-6: chi for the
displacement and tau for the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from ..dynamics.equations import Equations
from ..inputs.checks import check_instance
from ..mechanics.components import TIME, WEIGHT_NUMBER, Edge, Node
from ..mechanics.contact import SLIDING
from ..mechanics.oscillator import FRICTION
from .writer import ExpressionWriter, Latex, Style, Text

LARGEST = 6
"""Networks of more nodes are written once, for node i, instead of node by node."""


def _weights(equations: Equations) -> list[tuple[Edge, str]]:
    """The templates of links between equal nodes, and what their weights are called: G, of several layers G_1, G_2, …"""
    edges = equations.edges
    return [(edge, "G" if len(edges) == 1 else f"G_{k}") for k, edge in enumerate(edges, start=1)]


def latex(equations: Equations) -> str:
    """Return the equations as LaTeX.

    Parameters
    ----------
    equations : Equations
        The equations of a network.

    Returns
    -------
    str
        An align* environment; more than LARGEST nodes give one equation for node i.
    """
    body = " \\\\\n".join(f"  & {line}" for line in lines(_those("latex", equations), Latex()))
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}"


def text(equations: Equations) -> str:
    """Return the equations as plain text with Greek letters.

    Parameters
    ----------
    equations : Equations
        The equations of a network.

    Returns
    -------
    str
        One equation a line; more than LARGEST nodes give one for node i.
    """
    return "\n".join(lines(_those("text", equations), Text()))


def _those(what: str, equations: object) -> Equations:
    """The equations; TypeError for anything else."""
    return check_instance(what, equations, Equations, "equations, such as scene.equations")


def as_dict(equations: Equations) -> dict[str, object]:
    """Return names, right-hand sides and derivatives as text that SymPy reads, and the digest.

    `jacobian` has the non-zero entries only, under keys such as "v_1,x_1" (row, column); time is
    called t.  Where links have inertia `mass` has the entries of M in M d(state)/dt = rhs in the
    same way.
    """
    state = equations.state
    entries, mass = equations.jacobian().items(), equations.mass()
    return {
        "state": list(state),
        "parameters": list(equations.parameters),
        "rhs": [str(e) for e in equations.rhs()],
        "jacobian": {f"{state[row]},{state[column]}": str(e) for (row, column), e in entries},
        "time_derivative": [str(e) for e in equations.time_derivative()],
        **({"mass": {f"{state[r]},{state[c]}": str(e) for (r, c), e in mass.items()}} if mass else {}),
        "digest": equations.digest,
    }


@dataclass(frozen=True, slots=True)
class _Named:
    """A node's right-hand side with its friction law as f(w), and the law, None if it has none."""

    rhs: tuple[sp.Expr, ...]
    law: sp.Expr | None


def _name_law(node: Node) -> _Named:
    taken = {s.name for s in (*node.state, *node.parameters)}
    if node.law is not None and not taken & {SLIDING.name, "f"}:
        rhs = tuple(_with_law(e, node.law, node.state) for e in node.rhs)
        if any(e.has(FRICTION) for e in rhs):
            return _Named(rhs, node.law)
    return _Named(node.rhs, None)


def _with_law(e: sp.Expr, law: sp.Expr, state: tuple[sp.Symbol, ...]) -> sp.Expr:
    """The expression with (factor) law(w) written as (factor) f(w).

    w is the first sum with a state for which that works.
    """
    sums = sorted((s for s in e.atoms(sp.Add) if s != e and s.has(*state)), key=sp.default_sort_key)
    for w in sums:
        terms = sp.Add.make_args(e.xreplace({w: SLIDING}))
        inside = sp.Add(*(term for term in terms if term.has(SLIDING)))
        factor = inside / law
        if inside != 0 and not factor.has(SLIDING, *state):
            return sp.Add(*(term for term in terms if not term.has(SLIDING)), factor * FRICTION(w))
    return e


def lines(equations: Equations, style: Style) -> Iterator[str]:
    """Yield equation by equation, then the laws, then what the indices of a large network mean."""
    sticks, equations = equations.sticks, _in_slip(equations)
    named = tuple(_name_law(node) for node in equations.nodes)
    generic = equations.n > LARGEST and not equations.mixed
    if generic:
        yield from _generic(equations, named[0], style)
    else:
        for i in range(equations.n):
            yield from _at_node(equations, named, style, i)
    for kind, one in enumerate(named):
        if one.law is not None:
            yield _law(equations, one.law, style, kind)
    if sticks:
        yield style.words("at zero sliding velocity f is what holds the body, up to the static coefficient")
    if generic:
        count, meaning = equations.link_count, ""
        layers = (layer for layer in equations.layers if layer.links)
        for layer, (_, name) in zip(layers, _weights(equations), strict=True):
            shown = WEIGHT_NUMBER.name if WEIGHT_NUMBER.name in layer.varied else name
            meaning += f", {style.letter(shown, 'ij')}" + style.words(f" the weights of the {len(layer.links)} links")
        if any(edge.oriented for edge in equations.edges):
            meaning += style.words(", -1 where a link runs from j to i")
        yield ("i, j" if count else "i") + f" = 1, {style.dots}, {equations.n}{meaning}"


def _law(equations: Equations, law: sp.Expr, style: Style, kind: int) -> str:
    """The friction law of nodes of some kind; i is the node whose parameters they are."""
    own = {s: style.letter(s.name, "i") for s in _varied(equations) if law.has(s)}
    writer = ExpressionWriter(style, own, frozenset((SLIDING,)))
    text = f"{writer.write(FRICTION(SLIDING))} = {writer.write(law)}"
    nodes = [str(i + 1) for i, k in enumerate(equations.kind_of) if k == kind]
    about = [f"of node{'s' * (len(nodes) > 1)} {', '.join(nodes)}"] if equations.mixed else []
    about += ["of node i"] if own and not equations.mixed else []
    return text + "".join(style.words(f", {words}") for words in about)


def _varied(equations: Equations) -> list[sp.Symbol]:
    """The parameters of the templates that have a value for each node."""
    return [sp.Symbol(name, real=True) for name in equations.varied]


def _in_slip(equations: Equations) -> Equations:
    """Equations with set-valued friction as they are in slip, without the modes."""
    if not equations.sticks:
        return equations
    return equations.map_templates(_node_in_slip, _edge_in_slip)


def _node_in_slip(node: Node) -> Node:
    rate = node.events[0].shown if node.events else node.rhs[1]
    return Node(node.state[:2], (node.rhs[0], rate), node.parameters, law=node.law)


def _edge_in_slip(edge: Edge) -> Edge:
    rates = tuple(e.xreplace({edge.here[2]: sp.S.One}) for e in edge.rhs[:2])
    return Edge(edge.here[:2], edge.there[:2], edge.weight, rates, edge.parameters)


def _at_node(equations: Equations, named: tuple[_Named, ...], style: Style, i: int) -> Iterator[str]:
    """The equations of node i with all its links."""
    here, node, own = equations.at_node(i), equations.node_at(i), named[equations.kind_of[i]]
    letters: dict[sp.Symbol, str] = {}
    for j in range(equations.n):
        index = str(j + 1) if equations.n > 1 else ""
        letters |= _letters(equations, named[equations.kind_of[j]], style, equations.symbols(j), index, j)
    writer = ExpressionWriter(style, letters, frozenset((*letters, TIME)))
    links = [(link, edge) for link, edge in equations.linked() if link[0] == i]
    for c in _shown(equations, i):
        terms = [term.xreplace(here) for term in _ordered(own.rhs[c], node)]
        parts = (edge.rhs[c].xreplace(equations.at_link(link, edge)) for link, edge in links)
        felt = sp.factor_terms(sp.Add(*parts))
        terms += [term for term in sp.Add.make_args(felt) if term != 0]
        yield f"{_left(equations, writer, c, i)} = {writer.total(terms)}"


def _left(equations: Equations, writer: ExpressionWriter, c: int, i: int) -> str:
    """The left side: the rate of component c of node i, and the rates that links add.

    The rate is written chi'' if the component is the velocity of chi.
    """
    own = writer.write(equations.symbols(i)[c]) + "'"
    row = [e.xreplace(equations.at_node(i)) for e in _masses(equations.node_at(i), c)]
    if row:
        own = _massive(row, equations.symbols(i), writer)
    rates: dict[sp.Symbol, str] = {}
    terms: list[sp.Expr] = []
    for link, edge in equations.linked() if equations.inertial else ():
        if link[0] == i:
            for block, end in zip(edge.inertia, link[:2], strict=False):
                values = equations.at_link(link, edge)
                for symbol, e in zip(equations.symbols(end), block[c], strict=True):
                    rate = sp.Symbol(f"{symbol.name}'", real=True)
                    rates[rate] = writer.write(symbol) + "'"
                    terms.append(e.xreplace(values) * rate)
    added = sp.collect(sp.expand(sp.Add(*terms)), list(rates))
    if added == 0:
        return own
    full = ExpressionWriter(writer.style, {**writer.letters, **rates}, frozenset((*writer.letters, *rates, TIME)))
    more = full.total([sp.factor_terms(term) for term in sp.Add.make_args(added)])
    return f"{own} {'- ' + more[1:] if more.startswith('-') else '+ ' + more}"


def _masses(node: Node, c: int) -> tuple[sp.Expr, ...]:
    """Row c of the mass matrix of a node, empty if it is a row of the identity."""
    row = node.inertia[c] if node.inertia else ()
    return () if all(e == sp.Integer(k == c) for k, e in enumerate(row)) else row


def _massive(row: Sequence[sp.Expr], states: Sequence[sp.Symbol], writer: ExpressionWriter) -> str:
    """A row of masses times rates."""
    rates = {sp.Symbol(f"{s.name}'", real=True): writer.write(s) + "'" for s in states}
    full = ExpressionWriter(writer.style, {**writer.letters, **rates}, frozenset((*writer.letters, *rates, TIME)))
    return full.total([e * rate for e, rate in zip(row, rates, strict=True) if e != 0])


def _generic(equations: Equations, named: _Named, style: Style) -> Iterator[str]:
    """The equations of node i, its links as a sum over j."""
    node, joints = equations.node, _weights(equations)
    own = tuple(sp.Symbol(f"{s.name}_i", real=True) for s in node.state)
    here = dict(zip(node.state, own, strict=True))
    letters = _letters(equations, named, style, own, "i")
    letters |= {s: style.letter(s.name, "i") for s in _varied(equations)}
    numbered = tuple(sp.Symbol(name, real=True) for name in equations.numbered)
    letters |= {s: style.letter(s.name, "ij") for s in numbered}
    for edge, name in joints:
        letters |= _letters(equations, named, style, edge.here, "i")
        letters |= _letters(equations, named, style, edge.there, "j")
        letters |= {s: style.letter(of.name, "j") for s, of in edge.theirs}
        letters[_weight(name)] = style.letter(name, "ij")
    writer = ExpressionWriter(style, letters, frozenset({TIME, *letters} - {_weight(name) for _, name in joints}))
    for c in _shown(equations):
        line = writer.total([term.xreplace(here) for term in _ordered(named.rhs[c], node)])
        for edge, name in joints:
            if edge.rhs[c] != 0:
                summed = _sum_over_links(edge, _weight(name), c, writer, numbered)
                line = line + summed if line != "0" else summed.removeprefix(" + ").lstrip()
        row = [e.xreplace(here) for e in _masses(node, c)]
        left = _massive(row, own, writer) if row else writer.write(here[node.state[c]]) + "'"
        for edge, name in joints:
            if edge.inertia:
                left += _summed_inertia(edge, _weight(name), c, writer)
        yield f"{left} = {line}"


def _weight(name: str) -> sp.Symbol:
    """The symbol of the weights of a layer."""
    return sp.Symbol(f"{name}_ij", real=True)


def _summed_inertia(edge: Edge, weight: sp.Symbol, c: int, writer: ExpressionWriter) -> str:
    """What the links of node i add to the left side of component c: masses times rates."""
    ends = (*edge.here, *edge.there)
    rates = {sp.Symbol(f"{s.name}'", real=True): writer.write(s) + "'" for s in ends}
    masses = (e for block in edge.inertia for e in block[c])
    term = sp.factor(sp.Add(*(e * rate for e, rate in zip(masses, rates, strict=True))))
    if term == 0:
        return ""
    full = ExpressionWriter(
        writer.style, {**writer.letters, **rates}, frozenset((*writer.letters, *rates, TIME)) - {weight}
    )
    return _summed(term.xreplace({edge.weight: weight}), (weight, *ends, *rates), full)


def _sum_over_links(
    edge: Edge, weight: sp.Symbol, c: int, writer: ExpressionWriter, numbered: tuple[sp.Symbol, ...]
) -> str:
    """The links of node i: what all of them share, not what is `numbered` by link, stands before the sum sign."""
    inside = (weight, *edge.here, *edge.there, *(s for s, _ in edge.theirs), *numbered)
    return _summed(edge.rhs[c].xreplace({edge.weight: weight}), inside, writer)


def _summed(term: sp.Expr, inside: tuple[sp.Symbol, ...], writer: ExpressionWriter) -> str:
    """A sum over j with its sign in front.

    Factors that do not depend on symbols `inside` stand before the sum sign.
    """
    term = sp.factor_terms(term) if term.is_Add else term
    negative = term.as_coeff_Mul()[0].is_negative
    outer, inner = (-term if negative else term).as_independent(*inside, as_Add=False)
    front = [writer.write(outer)] if outer.is_Mul else writer.factors(outer) if outer != 1 else []
    summed = writer.style.product([*front, writer.style.sum_over_j, *writer.factors(inner)])
    return (" - " if negative else " + ") + summed


def _pairs(equations: Equations, i: int = 0) -> dict[int, int]:
    """Component -> component that is its velocity, of node i.

    The rate of such a component is that state alone: links add nothing.
    """
    node, kind = equations.node_at(i), equations.kind_of[i]
    edges = [edge for (target, _), edge in equations.edge_of if target == kind]
    found: dict[int, int] = {}
    for c, rate in enumerate(node.rhs):
        free = all(edge.rhs[c] == 0 for edge in edges)
        if free and rate in node.state and rate != node.state[c] and node.state.index(rate) not in found.values():
            found[c] = node.state.index(rate)
    return found if not set(found) & set(found.values()) else {}


def _shown(equations: Equations, i: int = 0) -> list[int]:
    """The components whose rate gets an equation: all but coordinates."""
    pairs = _pairs(equations, i)
    return [c for c in range(len(equations.node_at(i).state)) if c not in pairs]


def _letters(
    equations: Equations, named: _Named, style: Style, symbols: tuple[sp.Symbol, ...], index: str, i: int = 0
) -> dict[sp.Symbol, str]:
    """How the states of a node and the time are written.

    They are chi and tau beside a friction law; velocities have a prime.
    """
    node = equations.node_at(i)
    plain = named.law is None or {"chi", "tau"} & {s.name for s in (*node.state, *node.parameters)}
    speeds = {velocity: c for c, velocity in _pairs(equations, i).items()}
    letters = {} if plain else {TIME: style.letter("tau")}
    for c, symbol in enumerate(symbols):
        name = node.state[speeds.get(c, c)].name
        letters[symbol] = style.letter("chi" if name == "x" and not plain else name, index, int(c in speeds))
    return letters


def _ordered(e: sp.Expr, node: Node) -> list[sp.Expr]:
    """The terms of an equation: springs, damping, constants, functions of time, friction last."""

    def place(term: sp.Expr) -> tuple[bool, bool, int, int, tuple[object, ...]]:
        last = max((c for c, s in enumerate(node.state) if term.has(s)), default=len(node.state))
        return term.has(FRICTION), term.has(TIME), last, sp.count_ops(term), sp.default_sort_key(term)

    return sorted((term for term in sp.Add.make_args(e) if term != 0), key=place)

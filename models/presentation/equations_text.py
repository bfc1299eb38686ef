"""Write equations as LaTeX, as plain text, and as a dictionary for JSON.

A friction law in an equation is written as f(w), and f is defined once below the equations.  Equations
with a friction law use the letters of Marszal et al., Eur. Phys. J. Special Topics (2016), eqs. 3-6: chi
for the displacement and tau for the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import sympy as sp

from ..dynamics.equations import Equations
from ..inputs.checks import check_instance
from ..mechanics.components import TIME, WEIGHT_NUMBER, Edge, Node
from ..mechanics.contact import SLIDING, SLIP
from ..mechanics.oscillator import FRICTION
from ..mechanics.rows import Law, Row, Surface, in_signs, off_surfaces
from .writer import ExpressionWriter, Latex, Style, Text

LARGEST = 6  # most nodes of a network written node by node, a choice; larger networks are written once, for node i

EXPECTED = "equations, such as scene.equations"


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

    See Also
    --------
    synchain.export.text

    Examples
    --------
    >>> import synchain as sc
    >>> print(sc.export.latex(sc.Scene("harmonic").equations))
    \\begin{align*}
      & x'' = -x
    \\end{align*}
    """
    checked = check_instance("latex", equations, Equations, EXPECTED)
    body = " \\\\\n".join(f"  & {line}" for line in lines(checked, Latex()))
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

    See Also
    --------
    synchain.export.latex

    Examples
    --------
    >>> import synchain as sc
    >>> print(sc.export.text(sc.Scene("harmonic").equations))
    x'' = -x
    """
    return "\n".join(lines(check_instance("text", equations, Equations, EXPECTED), Text()))


def as_dict(equations: Equations) -> dict[str, object]:
    """Return names, right-hand sides, derivatives and digest; expressions are text that SymPy reads."""
    # `jacobian` holds the non-zero entries, with keys such as "v_1,x_1" (row, column). Time is called t. If links have
    # inertia, `mass` holds the non-zero entries of M in M d(state)/dt = rhs, with the same keys.
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


def lines(equations: Equations, style: Style) -> Iterator[str]:
    """Yield the equations, then the friction laws, then for a large network the meaning of the indices."""
    network = _NetworkText(_in_slip(equations), style)
    rows: list[Row | Surface] = [row for node in equations.nodes for row in node.rows]
    rows += [surface for template in equations.templates for surface in template.surfaces]
    generic = network.equations.n > LARGEST and not network.equations.mixed
    if generic:
        yield from network.generic()
    else:
        for i in range(network.equations.n):
            yield from network.at_node(i)
    yield from network.laws()
    yield from dict.fromkeys(_events(rows, style))  # both directions of a link have the same stop
    if any(node.events for node in equations.nodes) or any(row.law is Law.SIGN for row in rows):
        yield style.words("at zero sliding velocity f is what holds the body, up to the static coefficient")
    if generic:
        yield network.legend()


def _events(rows: Sequence[Row | Surface], style: Style) -> Iterator[str]:
    """Yield what happens at stops and guards."""
    writer = ExpressionWriter(style, {}, frozenset())
    for row in rows:
        if row.law is Law.STOP:
            gap, times = style.words("stop at the gap "), style.words(": its rate is reversed times ")
            turn = style.words(", in order with others hit at once") if row.in_order else ""
            yield f"{gap}{writer.write(row.level)}{times}{writer.write(row.ratio)}{turn}"
        elif row.law is Law.RESET:
            jumps = ", ".join(f"{writer.write(s)} := {writer.write(e)}" for s, e in row.sets)
            yield f"{jumps}{style.words(' where this passes 0 upwards: ')}{writer.write(row.level)}"


def _in_slip(equations: Equations) -> Equations:
    """Return the equations of slip for set-valued friction; stick modes are left out."""
    if not equations.sticks:
        return equations
    modes = equations.modes

    def node(node: Node) -> Node:
        if node.rows:
            return Node(node.continuous, off_surfaces(node.rhs, node.rows), node.parameters, law=node.law)
        if node.joined or node.surfaces:
            rates = list(node.rhs[: len(node.continuous)])
            held = (surface for surface in node.surfaces if surface.law is not Law.RESET)
            for surface, mode in zip(held, node.joined, strict=False):
                if surface.law is Law.SIGN:
                    signs = [in_signs(e, surface.level, mode) for e in surface.push]
                    rates = [sp.expand(rate) + e for rate, e in zip(rates, signs, strict=True)]
            return Node(node.continuous, tuple(rates), node.parameters, law=node.law)
        if not node.events:
            return node
        return Node(node.state[:2], (node.rhs[0], node.events[0].shown), node.parameters, law=node.law)

    def edge(edge: Edge) -> Edge:
        here, there = ([s for s in end if s.name.rpartition("_")[0] not in modes] for end in (edge.here, edge.there))
        free = {s: sp.S.One for s in edge.here if s not in here}
        rates = [e.xreplace(free) for e in edge.rhs[: len(here)]]
        for surface in edge.surfaces:
            if surface.law is Law.SIGN:
                rates = [a + b for a, b in zip(rates, _signs_of_link(edge, surface, here, there), strict=True)]
        plain = replace(edge, here=tuple(here), there=tuple(there), rhs=tuple(rates), surfaces=())
        return plain.without_unused_parameters()

    apart = equations.layers if not equations.joined else tuple(replace(layer, held=()) for layer in equations.layers)
    return replace(equations, layers=apart).map_templates(node, edge)


def _signs_of_link(
    edge: Edge, surface: Surface, here: Sequence[sp.Symbol], there: Sequence[sp.Symbol]
) -> list[sp.Expr]:
    """Return what a contact of a link adds to the rates of its target off the surface."""
    signs = [in_signs(e, surface.level, SLIP) for e in surface.push]
    if not edge.oriented:
        return signs[: len(here)]
    # W = 1 at the end i of the link, W = -1 at the end j, which feels what the source does with exchanged ends
    swap = {**dict(zip(here, there, strict=True)), **dict(zip(there, here, strict=True))}
    ahead, back = signs[: len(here)], [e.xreplace(swap) for e in signs[len(here) :]]
    return [(1 + edge.weight) / 2 * a + (1 - edge.weight) / 2 * b for a, b in zip(ahead, back, strict=True)]


@dataclass(frozen=True, slots=True)
class _NamedNode:
    """The right-hand side of a node with its friction law as f(w), and the law; None if the law is written out."""

    rhs: tuple[sp.Expr, ...]
    law: sp.Expr | None

    @classmethod
    def of(cls, node: Node) -> _NamedNode:
        """Replace the law of a node by f(w), unless a state or parameter has the name f or w."""
        taken = {s.name for s in (*node.state, *node.parameters)}
        if node.law is not None and not taken & {SLIDING.name, "f"}:
            rhs = tuple(_with_law(e, node.law, node.state) for e in node.rhs)
            if any(e.has(FRICTION) for e in rhs):
                return cls(rhs, node.law)
        return cls(node.rhs, None)


def _with_law(e: sp.Expr, law: sp.Expr, state: tuple[sp.Symbol, ...]) -> sp.Expr:
    """Replace (factor) law(w) in an expression by (factor) f(w)."""
    # Try each sum with a state as w; take the first for which the replacement succeeds.
    sums = sorted((s for s in e.atoms(sp.Add) if s != e and s.has(*state)), key=sp.default_sort_key)
    for w in sums:
        terms = sp.Add.make_args(e.xreplace({w: SLIDING}))
        inside = sp.Add(*(term for term in terms if term.has(SLIDING)))
        factor = inside / law
        if inside != 0 and not factor.has(SLIDING, *state):
            return sp.Add(*(term for term in terms if not term.has(SLIDING)), factor * FRICTION(w))
    return e


class _NetworkText:
    def __init__(self, equations: Equations, style: Style) -> None:
        self.equations, self.style = equations, style
        self.named = tuple(_NamedNode.of(node) for node in equations.nodes)
        # Parameters with a value for each node.
        self.varied = [sp.Symbol(name, real=True) for name in equations.varied]
        # Layers of links with the letters of their weights: G for one layer, G_1, G_2, … for several.
        edges = equations.edges
        self.layers = [(edge, "G" if len(edges) == 1 else f"G_{k}") for k, edge in enumerate(edges, start=1)]

    def at_node(self, i: int) -> Iterator[str]:
        """Yield the equations of node i with all its links."""
        equations = self.equations
        here, node, named = equations.at_node(i), equations.node_at(i), self.named[equations.kind_of[i]]
        letters: dict[sp.Symbol, str] = {}
        for j in range(equations.n):
            index = str(j + 1) if equations.n > 1 else ""
            letters |= self._letters(self.named[equations.kind_of[j]], equations.symbols(j), index, j)
        writer = ExpressionWriter(self.style, letters, frozenset((*letters, TIME)))
        links = [(link, edge) for link, edge in equations.linked() if link[0] == i]
        for c in _shown(equations, i):
            terms = [term.xreplace(here) for term in _ordered(named.rhs[c], node)]
            parts = (edge.rhs[c].xreplace(equations.at_link(link, edge)) for link, edge in links)
            felt = sp.factor_terms(sp.Add(*parts))
            terms += [term for term in sp.Add.make_args(felt) if term != 0]
            yield f"{self._left(writer, c, i)} = {writer.total(terms)}"

    def _left(self, writer: ExpressionWriter, c: int, i: int) -> str:
        """Write the left side: the rate of component c of node i, plus masses of links times rates."""
        # The rate of a velocity is written as a second derivative, chi''.
        equations, states = self.equations, self.equations.symbols(i)
        row = [e.xreplace(equations.at_node(i)) for e in _masses(equations.node_at(i), c)]
        left = _massive(row, states, writer) if row else writer.write(states[c]) + "'"
        # Collect the inertia of all links that node i feels: masses times rates of both ends.
        ends: dict[sp.Symbol, None] = {}
        terms: list[sp.Expr] = []
        for link, edge in equations.linked() if equations.inertial else ():
            if link[0] == i:
                for block, end in zip(edge.inertia, link[:2], strict=False):
                    values = equations.at_link(link, edge)
                    for symbol, e in zip(equations.symbols(end), block[c], strict=True):
                        ends[symbol] = None
                        terms.append(e.xreplace(values) * _rate(symbol))
        added = sp.collect(sp.expand(sp.Add(*terms)), list(map(_rate, ends)))
        if added == 0:
            return left
        full = _with_rates(writer, tuple(ends))
        more = full.total([sp.factor_terms(term) for term in sp.Add.make_args(added)])
        return f"{left} {'- ' + more[1:] if more.startswith('-') else '+ ' + more}"

    def generic(self) -> Iterator[str]:
        """Yield the equations of node i for any i; the links are a sum over j."""
        equations, style, (named, *_) = self.equations, self.style, self.named
        node = equations.node
        states = tuple(sp.Symbol(f"{s.name}_i", real=True) for s in node.state)
        here = dict(zip(node.state, states, strict=True))
        indices = {name: "ijk"[: len(edge.end_states)] for edge, name in self.layers}
        weights = {name: sp.Symbol(f"{name}_{indices[name]}", real=True) for _, name in self.layers}

        # Choose letters for states and parameters of node i, values of the link ij, states and parameters of node j.
        letters = self._letters(named, states, "i") | {s: style.letter(s.name, "i") for s in self.varied}
        numbered = tuple(sp.Symbol(name, real=True) for name in equations.numbered)
        letters |= {s: style.letter(s.name, "ij") for s in numbered}
        for edge, name in self.layers:
            for states, index in zip(edge.end_states, "ijk", strict=False):
                letters |= self._letters(named, states, index)
            letters |= {s: style.letter(of.name, "j") for s, of in edge.theirs}
            letters[weights[name]] = style.letter(name, indices[name])
        writer = ExpressionWriter(style, letters, frozenset({TIME, *letters} - set(weights.values())))

        for c in _shown(equations):
            line = writer.total([term.xreplace(here) for term in _ordered(named.rhs[c], node)])
            row = [e.xreplace(here) for e in _masses(node, c)]
            left = _massive(row, states, writer) if row else writer.write(here[node.state[c]]) + "'"
            for edge, name in self.layers:
                weight, ends = weights[name], tuple(s for states in edge.end_states for s in states)
                if edge.rhs[c] != 0:
                    inside = (weight, *ends, *(s for s, _ in edge.theirs), *numbered)
                    summed = _summed(edge.rhs[c].xreplace({edge.weight: weight}), inside, writer, len(indices[name]))
                    line = line + summed if line != "0" else summed.removeprefix(" + ").lstrip()
                if edge.inertia:  # links with inertia add masses times rates to the left side
                    masses = (e for block in edge.inertia for e in block[c])
                    term = sp.factor(sp.Add(*(e * _rate(s) for e, s in zip(masses, ends, strict=True))))
                    if term != 0:
                        inside = (weight, *ends, *map(_rate, ends))
                        full = _with_rates(writer, ends)
                        left += _summed(term.xreplace({edge.weight: weight}), inside, full)
            yield f"{left} = {line}"

    def laws(self) -> Iterator[str]:
        """Yield the definition of f for each kind of node; in it, i is the node with the law's parameters."""
        for kind, named in enumerate(self.named):
            if (law := named.law) is None:
                continue
            letters = {s: self.style.letter(s.name, "i") for s in self.varied if law.has(s)}
            writer = ExpressionWriter(self.style, letters, frozenset((SLIDING,)))
            nodes = [str(i + 1) for i, k in enumerate(self.equations.kind_of) if k == kind]
            about = ""
            if self.equations.mixed:
                about = self.style.words(f", of node{'s' * (len(nodes) > 1)} {', '.join(nodes)}")
            elif letters:
                about = self.style.words(", of node i")
            yield f"{writer.write(FRICTION(SLIDING))} = {writer.write(law)}{about}"

    def legend(self) -> str:
        """Explain the range of the indices and the meaning of the weights."""
        equations, style, meaning = self.equations, self.style, ""
        linked = (layer for layer in equations.layers if layer.links)
        for layer, (edge, name) in zip(linked, self.layers, strict=True):
            shown = WEIGHT_NUMBER.name if WEIGHT_NUMBER.name in layer.varied else name
            index = "ijk"[: len(edge.end_states)]
            meaning += f", {style.letter(shown, index)}" + style.words(f" the weights of the {len(layer.links)} links")
        if any(edge.oriented for edge in equations.edges):
            meaning += style.words(", -1 where a link runs from j to i")
        return (
            ", ".join("ijk"[: max((len(edge.end_states) for edge in equations.edges), default=1)])
            + f" = 1, {style.dots}, {equations.n}{meaning}"
        )

    def _letters(
        self, named: _NamedNode, symbols: tuple[sp.Symbol, ...], index: str, i: int = 0
    ) -> dict[sp.Symbol, str]:
        """Map the states of node i and the time to letters."""
        # With a friction law these are chi and tau. A velocity is its coordinate with a prime.
        node, style = self.equations.node_at(i), self.style
        plain = named.law is None or {"chi", "tau"} & {s.name for s in (*node.state, *node.parameters)}
        speeds = {velocity: c for c, velocity in _pairs(self.equations, i).items()}
        letters = {} if plain else {TIME: style.letter("tau")}
        for c, symbol in enumerate(symbols):
            name = node.state[speeds.get(c, c)].name
            letters[symbol] = style.letter("chi" if name == "x" and not plain else name, index, int(c in speeds))
        return letters


def _masses(node: Node, c: int) -> tuple[sp.Expr, ...]:
    """Return row c of the mass matrix of a node; empty for a row of the identity."""
    row = node.inertia[c] if node.inertia else ()
    return () if all(e == sp.Integer(k == c) for k, e in enumerate(row)) else row


def _rate(state: sp.Symbol) -> sp.Symbol:
    return sp.Symbol(f"{state.name}'", real=True)


def _with_rates(writer: ExpressionWriter, states: Sequence[sp.Symbol]) -> ExpressionWriter:
    """Add the rates of states, written with a prime, to the letters of a writer."""
    rates = {_rate(s): writer.write(s) + "'" for s in states}
    return replace(writer, letters={**writer.letters, **rates}, variables=writer.variables | set(rates))


def _massive(row: Sequence[sp.Expr], states: Sequence[sp.Symbol], writer: ExpressionWriter) -> str:
    """Write a row of the mass matrix times the rates."""
    terms = [e * _rate(s) for e, s in zip(row, states, strict=True) if e != 0]
    return _with_rates(writer, states).total(terms)


def _summed(term: sp.Expr, inside: tuple[sp.Symbol, ...], writer: ExpressionWriter, ends: int = 2) -> str:
    """Write a sum over the sources of links with its sign; factors without the symbols `inside` precede the sum sign."""
    term = sp.factor_terms(term) if term.is_Add else term
    negative = term.as_coeff_Mul()[0].is_negative
    outer, inner = (-term if negative else term).as_independent(*inside, as_Add=False)
    front = [writer.write(outer)] if outer.is_Mul else writer.factors(outer) if outer != 1 else []
    summed = writer.style.product([*front, writer.style.sums[ends - 2], *writer.factors(inner)])
    return (" - " if negative else " + ") + summed


def _pairs(equations: Equations, i: int = 0) -> dict[int, int]:
    """Map each coordinate of node i to its velocity, by component numbers."""
    # A state is a coordinate if its rate is exactly another state, and links add nothing to the rate.
    node, kind = equations.node_at(i), equations.kind_of[i]
    edges = [edge for (target, _), edge in equations.edge_of if target == kind]
    velocity_of: dict[int, int] = {}
    for c, rate in enumerate(node.rhs):
        if rate in node.state and rate != node.state[c] and all(edge.rhs[c] == 0 for edge in edges):
            velocity = node.state.index(rate)
            if velocity not in velocity_of.values():
                velocity_of[c] = velocity
    # Write chains of more than two, x' = v, v' = a, as first-order equations.
    return {} if set(velocity_of) & set(velocity_of.values()) else velocity_of


def _shown(equations: Equations, i: int = 0) -> list[int]:
    """Return the components that need an equation: all except coordinates."""
    pairs = _pairs(equations, i)
    return [c for c in range(len(equations.node_at(i).state)) if c not in pairs]


def _ordered(e: sp.Expr, node: Node) -> list[sp.Expr]:
    """Sort the terms of an equation: springs, damping, constants, functions of time, friction."""

    def order(term: sp.Expr) -> tuple[bool, bool, int, int, tuple[object, ...]]:
        last = max((c for c, s in enumerate(node.state) if term.has(s)), default=len(node.state))
        return term.has(FRICTION), term.has(TIME), last, sp.count_ops(term), sp.default_sort_key(term)

    return sorted((term for term in sp.Add.make_args(e) if term != 0), key=order)

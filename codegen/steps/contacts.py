"""The text that decides between stick and slip: what a kernel must know of each contact at a state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.saltation import Entry, Events
from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.components import TIME, Edge
from synchain.models.mechanics.stick_slip import Contact

from ..program.passes import Hoist, Names
from ..program.printers import show
from .names import NAMES

__all__ = ["event_constants", "write_events", "write_pushes"]

HEAD = '''
@njit(error_model='numpy', forceinline=True)
def pushes(t, y, p, out, network):
    """For each contact: sliding velocity, ground's velocity, accelerations under static friction both ways, in slip."""
'''.strip()

RELEASE = '''
@njit(error_model='numpy')
def release(i, after, t, y, strengths, modes, which):
    """Where a contact begins to slip and friction drops at once, deviations that let go early have gained a velocity."""
'''.strip()

FORCES = (2, 3, 4, 5)
"""The groups of `pushes` that the force of a link adds to."""


def write_pushes(equations: Equations, names: Names, looped: bool = False) -> str:
    """The function `pushes`: writes six groups of NODES numbers, in the order of its docstring.

    Written out, its text grows with the network; `looped` it runs over nodes and links, which it takes from `network`.
    """
    if not equations.sticks:
        return ""
    lines = (_looped if looped else _written_out)(equations, names)
    return "\n".join([HEAD, *(f"    {line}" for line in lines)])


def _columns(contact: Contact) -> tuple[sp.Expr, ...]:
    return contact.sliding, contact.speed, contact.up, contact.down, contact.pushed, contact.pulled


def _written_out(equations: Equations, names: Names) -> list[str]:
    contacts = [found for i in range(equations.n) if (found := equations.contact_at(i)) is not None]
    results = [e for column in zip(*map(_columns, contacts), strict=True) for e in column]
    statements, reduced = sp.cse(results, symbols=names.fresh("z"), order="canonical")
    used = _symbols((*reduced, *(e for _, e in statements)))
    lines = [f"{name} = load(y, {k}, WIDTH)" for k, name in enumerate(equations.state) if _in(name, used)]
    lines += _parameters(equations, used)
    lines += [f"{s} = {show(e)}" for s, e in statements]
    return lines + [f"store(out, {k}, {_lane(e)})" for k, e in enumerate(reduced)]


def _looped(equations: Equations, names: Names) -> list[str]:
    """One loop over the nodes with what is fixed for all of them before it, and one over the links."""
    node = equations.node
    if node.contact is None:
        return []
    fixed = Hoist(frozenset(node.state), names.fresh("fixed"))
    moving = [fixed.apply(e) for e in _columns(node.contact)]
    statements, reduced = sp.cse(moving, symbols=names.fresh("z"), order="canonical")
    force, link = _force(equations.edges, node.contact)
    used = _symbols((*moving, *fixed.table, *link))
    lines = _parameters(equations, used)
    lines += [f"{s} = {_lane(e)}" for e, s in fixed.table.items()]
    own = [f"{s} = load(y, {k}*NODES + i, WIDTH)" for k, s in enumerate(node.state) if s in used]
    own += [f"{s} = {show(e)}" for s, e in statements]
    own += [f"store(out, {k}*NODES + i, {_lane(e)})" for k, e in enumerate(reduced)]
    lines += ["for i in range(NODES):", *(f"    {line}" for line in own)]
    if force:
        lines += [f"({', '.join(NAMES)}), weights = network"]
        lines += ["for e in range(target.size):", *(f"    {line}" for line in force)]
    return lines


def _force(edges: tuple[Edge, ...], contact: Contact) -> tuple[list[str], tuple[sp.Expr, ...]]:
    """Statements that add the force of one link on a body that sticks, and the expressions they hold."""
    if not edges:
        return [], ()
    (edge,) = edges
    velocity, mode = edge.here[1], edge.here[2]
    force = edge.rhs[1].xreplace({mode: sp.S.One, velocity: contact.speed})
    swap = {s: sp.Symbol(f"{s.name}_here", real=True) for s in edge.here}
    swap |= {s: sp.Symbol(f"{s.name}_there", real=True) for s in edge.there}
    lines = ["i, j = target[e], source[e]", f"{edge.weight.name} = weights[e]"]
    for place, ends in (("i", edge.here), ("j", edge.there)):
        lines += [f"{swap[s]} = load(y, {k}*NODES + {place}, WIDTH)" for k, s in enumerate(ends) if force.has(s)]
    lines += [f"f_link = {show(force.xreplace(swap))}"]
    lines += [f"store(out, {k}*NODES + i, load(out, {k}*NODES + i, WIDTH) + f_link)" for k in FORCES]
    return lines, (force,)


def write_events(variation: Variation, names: Names) -> list[str]:
    """The functions that the events of set-valued friction need in a kernel that carries deviations."""
    if variation.events is None:
        return []
    made = _release(variation.events, variation, names)
    return [write_pushes(variation.orbit, names), *([made] if made else [])]


def event_constants(variation: Variation) -> list[str]:
    """What the skeletons must know of the events: whether slip begins with a jump, and whose velocities the rows are."""
    events = variation.events
    if events is None:
        return []
    return [f"JUMPS = {bool(events.exits)}", f"OWNERS = np.array({list(events.owners)!r})"]


def _release(events: Events, variation: Variation, names: Names) -> str:
    """The function `release`, which sets the velocities of the deviations in one register; '' where they stay."""
    equations, size, strengths = variation.orbit, variation.size, [s.name for s in variation.parameters]
    if not events.exits:
        return ""
    used = _symbols(events.expressions)
    known = enumerate((*equations.state, *equations.parameters))  # the orbit is one, its numbers fill a register
    lines = [f"{name} = broadcast(y[{k}], LANES)" for k, name in known if _in(name, used)]
    loaded = enumerate(strengths)
    lines += [f"{s} = load(strengths, {len(strengths)}*which + {k}, LANES)" for k, s in loaded if _in(s, used)]
    for i, (up, down) in enumerate(events.exits):
        for words, entries in (("> 0.0", up), ("< 0.0", down)):
            lines.append(f"if i == {i} and after {words}:")
            lines += [f"    {line}" for line in _gained(entries, size, names)]
    return "\n".join([RELEASE, *(f"    {line}" for line in lines)])


def _gained(entries: Sequence[Entry], size: int, names: Names) -> list[str]:
    """Statements that put rows of a deviation together from others."""
    statements, reduced = sp.cse([e for _, e in entries], symbols=names.fresh("z"), order="canonical")
    lines = [f"{s} = {_text(e)}" for s, e in statements]
    rows: dict[int, list[str]] = {}
    for ((row, column), _), e in zip(entries, reduced, strict=True):
        rows.setdefault(row, []).append(f"({_text(e)})*load(modes, {size}*which + {column}, LANES)")
    return lines + [f"store(modes, {size}*which + {row}, {' + '.join(terms)})" for row, terms in rows.items()]


def _parameters(equations: Equations, used: set[sp.Symbol]) -> list[str]:
    first = equations.dimension
    return [f"{p} = load(p, {first + k}, WIDTH)" for k, p in enumerate(equations.parameters) if _in(p, used)]


def _lane(e: sp.Expr) -> str:
    return f"broadcast({_text(e)}, WIDTH)" if e.is_number else _text(e)


def _text(e: sp.Expr) -> str:
    return show(e.xreplace({TIME: sp.Symbol("t")}))


def _symbols(expressions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    return set().union(*(e.free_symbols for e in expressions))


def _in(name: str, used: set[sp.Symbol]) -> bool:
    return sp.Symbol(name, real=True) in used

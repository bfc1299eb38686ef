"""What the equations of a network must satisfy, whoever made them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .equations import Equations

__all__ = ["check"]


def check(eq: Equations) -> None:
    """Raise ValueError where nodes, links and names do not fit together (see `Equations`)."""
    if eq.n < 1:
        raise ValueError(f"a network needs at least one node, found n = {eq.n}")
    _check_kinds(eq)
    _check_links(eq)
    _check_names(eq)


def _check_kinds(eq: Equations) -> None:
    if bool(eq.others or eq.joints) != eq.mixed or (eq.mixed and set(eq.kinds) != set(range(len(eq.nodes)))):
        raise ValueError(f"kinds of nodes: found {len(eq.nodes)} templates and the kinds {sorted(set(eq.kinds))}")
    if eq.mixed and len(eq.kinds) != eq.n:
        raise ValueError(f"kinds of nodes: found {len(eq.kinds)} for {eq.n} nodes; expected one for each")
    if eq.mixed and any(node.contact is not None for node in eq.nodes):
        raise ValueError(
            "nodes of several kinds: found set-valued friction; expected smooth contacts; use contact 'atan'"
        )
    if eq.inertial and eq.node.contact is not None:
        raise ValueError("links with inertia: found set-valued friction; expected a smooth contact; use contact 'atan'")
    sizes = eq.joints or (() if eq.edge is None else (((0, 0), eq.edge),))
    for (target, source), edge in sizes:
        for end, symbols in ((target, edge.here), (source, edge.there)):
            if len(symbols) != len(eq.nodes[end].state):
                states = len(eq.nodes[end].state)
                raise ValueError(f"the edge joins nodes of {len(symbols)} states, the node has {states}")


def _check_links(eq: Equations) -> None:
    seen = set()
    for link in eq.links:
        target, source, _ = link
        if not (0 <= target < eq.n and 0 <= source < eq.n) or target == source:
            raise ValueError(f"link {target} <- {source}: expected two different nodes of 0 … {eq.n - 1}")
        if (target, source) in seen:
            raise ValueError(f"link {target} <- {source} occurs twice; add the weights up")
        seen.add((target, source))
    pairs = {(eq.kind(target), eq.kind(source)) for target, source, _ in eq.links}
    lacking = sorted(pairs - {pair for pair, _ in eq.joints}) if eq.mixed else [(0, 0)] if pairs and not eq.edge else []
    if lacking:
        raise ValueError(f"{len(eq.links)} links but no edge equations; give a coupling")


def _check_names(eq: Equations) -> None:
    own = {s.name for node in eq.nodes for s in node.parameters}
    for name in eq.varied:
        if name not in own:
            raise ValueError(f"{name!r} has a value for each node, but no node has it as a parameter")
    twice = _repeated(eq.parameters)
    if twice is not None:
        raise ValueError(f"the name {twice!r} stands for two parameters; rename one")
    states = {*eq.state, *(s.name for node in eq.nodes for s in node.state)}
    taken = sorted(states.intersection(eq.parameters))
    if taken:
        raise ValueError(f"the parameter {taken[0]!r} has the name of a state variable; rename it")


def _repeated(names: Iterable[str]) -> str | None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None

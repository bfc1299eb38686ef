"""The two ends of a link, target i and source j: symbols of their states and parameters, and the terms of a link."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, overload

import sympy as sp

from ..inputs.checks import check_instance, suggestion
from ..mechanics.components import TIME, Node
from ..mechanics.impacts import Friction, Stop
from ..mechanics.oscillator import Oscillator

WEIGHT = sp.Symbol("weight", real=True)
"""The weight of a link in the expressions of a coupling."""

Symbols = tuple[sp.Symbol, ...]


@dataclass(frozen=True, slots=True)
class End:
    """One end of a link; the attributes are the symbols of the states and parameters of the node at this end."""

    _letter: str
    _states: tuple[str, ...]
    _parameters: tuple[str, ...]

    def __getattr__(self, name: str) -> sp.Symbol:
        if name.startswith("_"):  # pickle and copy look for these
            raise AttributeError(name)
        names = (*self._states, *self._parameters)
        if name not in names:
            raise AttributeError(
                f"end {self._letter} of a link: unknown {name!r}; known: {', '.join(names)}{suggestion(name, names)}"
            )
        return sp.Symbol(f"{name}_{self._letter}", real=True)

    def __dir__(self) -> list[str]:
        return [*self._states, *self._parameters]


@overload
def ends(node: Oscillator, source: Oscillator | Literal[2] | None = None) -> tuple[End, End, sp.Symbol]: ...
@overload
def ends(node: Oscillator, source: Literal[3]) -> tuple[End, End, End, sp.Symbol]: ...
def ends(node: Oscillator, source: Oscillator | Literal[2, 3] | None = None) -> tuple[End | sp.Symbol, ...]:
    """Return the ends of a link and its weight, for the expressions of a coupling.

    Parameters
    ----------
    node : Oscillator
        The oscillator at the target; also at the source if `source` is left out.
    source : Oscillator or 3, optional
        The oscillator at the source of a link between two kinds.  3 stands for a link of three ends, in which the
        target feels two sources together.

    Returns
    -------
    i, j : End
        Target and source: `i.x` is the state x of the target, `j.m` the parameter m of the source.
    k : End
        The second source of a link of three ends; it has states only.
    W : Symbol
        The weight of the link.

    Raises
    ------
    TypeError
        If a node is no Oscillator.

    See Also
    --------
    synchain.Rates
    synchain.Potential

    Examples
    --------
    >>> from synchain import ends
    >>> from synchain.models.definitions.loader import load_oscillator
    >>> i, j, W = ends(load_oscillator("harmonic"))
    >>> W * (j.x - i.x)
    weight*(-x_i + x_j)
    >>> i, j, k, W = ends(load_oscillator("harmonic"), 3)
    >>> W * (j.x * k.x - i.x**2)
    weight*(-x_i**2 + x_j*x_k)
    """
    if isinstance(source, int):
        check_instance("ends", node, Oscillator, "an Oscillator")
        if source not in (2, 3):
            raise ValueError(f"ends: found {source}; expected 2 or 3 ends of a link")
        first, second = (End(letter, node.states, tuple(node.parameters)) for letter in "ij")
        return (first, second, *([End("k", node.states, ())] if source == 3 else []), WEIGHT)
    oscillators = (
        check_instance("ends", each, Oscillator, "an Oscillator") for each in (node, node if source is None else source)
    )
    i, j = (End(letter, each.states, tuple(each.parameters)) for letter, each in zip("ij", oscillators, strict=True))
    return i, j, WEIGHT


@dataclass(frozen=True, slots=True)
class Terms:
    """The terms of one link: energies and events in the symbols of both ends, or rates of the states of the target.

    `oriented` is True if the energy changes when the ends are exchanged (`synchain.models.interactions.link`).
    """

    kinetic: sp.Expr = sp.S.Zero
    potential: sp.Expr = sp.S.Zero
    dissipation: sp.Expr = sp.S.Zero
    rates: tuple[sp.Expr, ...] = ()
    oriented: bool = False
    events: tuple[Friction | Stop, ...] = ()


@dataclass(frozen=True, slots=True)
class Pair:
    """The nodes at both ends of a link, target first, and the symbols of their states."""

    nodes: tuple[Node, Node]  # the templates of target and source
    oscillators: tuple[Oscillator | None, Oscillator | None]  # their models; None for nodes whose masses are 1
    here: Symbols = field(init=False)
    there: Symbols = field(init=False)
    beyond: Symbols = field(init=False)  # of the second source of a link of three ends, a node like the source

    def __post_init__(self) -> None:
        for name, letter, node in zip(("here", "there", "beyond"), "ijk", (*self.nodes, self.nodes[1]), strict=True):
            object.__setattr__(self, name, tuple(sp.Symbol(f"{s.name}_{letter}", real=True) for s in node.state))

    @property
    def halves(self) -> tuple[int, int]:
        """The numbers of coordinates of the two nodes, whose states are coordinates followed by velocities."""
        return len(self.here) // 2, len(self.there) // 2

    @property
    def coordinates(self) -> Symbols:
        """The coordinates of both ends."""
        a, b = self.halves
        return (*self.here[:a], *self.there[:b])

    @property
    def velocities(self) -> Symbols:
        """The velocities of both ends."""
        a, b = self.halves
        return (*self.here[a:], *self.there[b:])

    @property
    def names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of the states of either node."""
        first, second = (tuple(s.name for s in node.state) for node in self.nodes)
        return first, second

    @property
    def alike(self) -> list[tuple[sp.Symbol, sp.Symbol]]:
        """The pairs of states that have the same name at both ends."""
        there = dict(zip(self.names[1], self.there, strict=True))
        return [(s, there[name]) for name, s in zip(self.names[0], self.here, strict=True) if name in there]

    @property
    def described(self) -> str:
        """The two nodes, for messages."""
        return " and ".join(str(each or node.state) for each, node in zip(self.oscillators, self.nodes, strict=True))

    @property
    def theirs(self) -> dict[sp.Symbol, sp.Symbol]:
        """For each symbol of a parameter of the source (m_j) the symbol in the template of the source (m)."""
        return {sp.Symbol(f"{s.name}_j", real=True): s for s in self.nodes[1].parameters}

    def symbols(self) -> dict[sp.Symbol, sp.Symbol]:
        """Return for each symbol of `ends` the symbol in an `Edge`: m in place of the parameter m_i of the target."""
        of_target = {sp.Symbol(f"{s.name}_i", real=True): s for s in self.nodes[0].parameters}
        return {**{s: s for s in (*self.here, *self.there, *self.beyond, *self.theirs, WEIGHT, TIME)}, **of_target}


def directed(energy: sp.Expr, exchanged: sp.Expr) -> tuple[sp.Expr, bool]:
    """Return the energy of a link, and True if the energy changes when the ends are exchanged (`exchanged`).

    If it changes, the energy of the link is W^2 V_even + W V_odd (`synchain.models.interactions.link`).
    """
    if sp.expand(energy - exchanged) == 0:
        return energy, False
    here, there = (e.xreplace({WEIGHT: sp.S.One}) for e in (energy, exchanged))
    return sp.expand(WEIGHT**2 * (here + there) / 2 + WEIGHT * (here - there) / 2), True


def has_velocities(node: Node) -> bool:
    """Return True if the states of a node are coordinates followed by their velocities."""
    states = node.continuous
    half = len(states) // 2
    return node.rhs[:half] == states[half:]

"""What a link between two nodes adds, as a value: entries of a matrix, energies of two ends, or any rates or potential.

Every coupling has parameters, checks the nodes that it joins (`check_ends`), and turns the two ends of a link into what
the link adds there (`terms`); `synchain.models.interactions.link` derives the equations from that.

The text "y->x" lets the difference of y between two nodes enter the rate of x.  A link of weight w from node j to
node i adds sigma w H (s_j - s_i) to the rates of the states s_i, so the entry "1/2 y->x" is 1/2 in the row of x and
the column of y.  H is the matrix of the master stability function (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998)).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy as sp

from ..inputs.checks import check_text, short_repr, suggestion
from ..inputs.expression_text import MAGNITUDE
from ..inputs.frozen import FrozenDict
from ..mechanics.components import Node
from ..mechanics.parameter import Parameter
from .ends import WEIGHT, Pair, Terms
from .interaction import Potential, Rates, from_table

__all__ = [
    "COUPLINGS",
    "STRENGTH",
    "WEIGHT",
    "Coupling",
    "LagrangianCoupling",
    "MatrixCoupling",
    "Potential",
    "Rates",
    "from_table",
    "split",
]

STRENGTH = FrozenDict({"sigma": Parameter(0.0, "1", "strength of the coupling")})
"""The parameters of every coupling by components; sigma may be negative."""

_POSITIONS = sp.symbols("q_i q_j", real=True)
"""The coordinates of the two ends in the energies of a coupling."""

_SPEEDS = sp.symbols("v_i v_j", real=True)
"""Their velocities."""

_NUMBER = r"[0-9]{1,120}(?:/[0-9]{1,120}|(?:\.[0-9]{1,120})?(?:[eE][+-]?[0-9]{1,3}(?=[\s*]))?)"

_NAME = r"[^\W\d]\w*"

_ENTRY = re.compile(rf"\s*([+-]?)\s*(?:({_NUMBER})\s*\*?\s*)?({_NAME})\s*->\s*({_NAME})\s*")

_EXPECTED = (
    "expected 'a->b', the difference of a into the rate of b, with a rational factor or none: '1/2 x->y', '1e-3 x->y'"
)

_CHOSEN = re.compile(r"(?P<name>\S.*?)\s+on\s+(?P<coordinates>[^\W\d]\w*(?:\s*,\s*[^\W\d]\w*)*)\s*")


@dataclass(frozen=True, slots=True)
class MatrixCoupling:
    """A coupling that is linear in the states: the entries of its matrix H."""

    # source component, target component, and the factor with which the difference enters the target's rate
    entries: tuple[tuple[str, str, Fraction], ...]

    def __post_init__(self) -> None:
        pairs = [(source, target) for source, target, _ in self.entries]
        twice = next((pair for i, pair in enumerate(pairs) if pair in pairs[:i]), None)
        if twice is not None:
            raise ValueError(
                f"coupling {short_repr(str(self))}: '{twice[0]}->{twice[1]}' occurs twice; "
                "expected each entry once; add the factors"
            )

    @classmethod
    def parse(cls, words: str) -> MatrixCoupling | None:
        """Return the coupling of a text such as "x->x, 1/2 y->z"; None if the text names a coupling instead."""
        return cls(tuple(_read(words))) if "->" in words else None

    @property
    def parameters(self) -> FrozenDict[Parameter]:
        """The strength alone."""
        return STRENGTH

    @property
    def forced(self) -> bool:
        """False: time does not occur."""
        return False

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for components that nodes of one kind do not have."""
        if other is None:
            self.check(tuple(s.name for s in single.state))

    def terms(self, pair: Pair) -> Terms:
        """Return sigma weight H (there - here), each difference a factor of its own: a sum over all would feel round-off.

        Between nodes of two kinds the entries apply whose components there are.
        """
        own, others = pair.names
        rates = [sp.S.Zero] * len(own)
        fitting = [(a, b, factor) for a, b, factor in self.entries if {a, b} <= set(own) and a in others]
        if not fitting:
            raise ValueError(
                f"coupling {str(self)!r} joins nothing between nodes of {', '.join(own)} and {', '.join(others)}"
            )
        strength = sp.Symbol("sigma", real=True) * WEIGHT
        for source, target, factor in fitting:
            share = sp.Rational(factor.numerator, factor.denominator)
            gap = pair.there[others.index(source)] - pair.here[own.index(source)]
            rates[own.index(target)] += sp.Mul(share, *strength.args, gap)
        return Terms(rates=tuple(rates))

    def check(self, state: tuple[str, ...]) -> None:
        """Raise ValueError for components outside `state`, the names of a node's states."""
        names = (name for source, target, _ in self.entries for name in (source, target))
        _expect_known(self, "component", "states", names, state)

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...] = ()) -> MatrixCoupling:
        """Return the same coupling with its entries ordered by target and source as in `state`."""
        self.check(state)
        ordered = MatrixCoupling(tuple(sorted(self.entries, key=lambda e: (state.index(e[1]), state.index(e[0])))))
        check_text("coupling", str(ordered))
        return ordered

    def __str__(self) -> str:
        return ", ".join(f"{_front(factor)}{source}->{target}" for source, target, factor in self.entries)


@dataclass(frozen=True, slots=True)
class LagrangianCoupling:
    """A coupling by the energies of a link, as expressions of the coordinates and velocities of its two ends.

    The ends are the real symbols q_i, q_j of `potential` and v_i, v_j of `kinetic` and `dissipation`, target first;
    of a coupling `between` two named oscillators they are the states of these.  `WEIGHT` is the weight of the link.
    """

    name: str  # what messages and scene files call it
    parameters: FrozenDict[Parameter]
    potential: sp.Expr = sp.S.Zero  # the energy stored, Rayleigh's function and the kinetic energy of a link
    dissipation: sp.Expr = sp.S.Zero
    kinetic: sp.Expr = sp.S.Zero
    between: tuple[str, str] | None = None  # the names of the two oscillators that it joins, if it joins no others
    coordinates: tuple[str, ...] | None = None  # the coordinates that it joins, all of them if left out
    summary: str = field(default="", compare=False)  # what it is, and where it was published
    source: str = field(default="", compare=False)

    def places(self, known: tuple[str, ...]) -> tuple[int, ...]:
        """Return the numbers of the joined coordinates among those of a node, in ascending order."""
        if self.coordinates is None:
            return tuple(range(len(known)))
        if not known:
            raise ValueError(
                f"coupling {short_repr(str(self))}: found oscillators without coordinates, which are vector fields; expected "
                "a coupling by components, e.g. 'x->x'"
            )
        _expect_known(self, "coordinate", "coordinates", self.coordinates, known)
        if len(set(self.coordinates)) < len(self.coordinates):
            raise ValueError(
                f"coupling {short_repr(str(self))}: found a coordinate twice; expected each once; leave one out"
            )
        return tuple(k for k, name in enumerate(known) if name in self.coordinates)

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> LagrangianCoupling:
        """Return the same coupling with its coordinates in the order of the nodes', none if it joins them all."""
        if self.coordinates is None:
            return self
        places = self.places(coordinates)
        joined = None if len(places) == len(coordinates) else tuple(coordinates[k] for k in places)
        return replace(self, coordinates=joined)

    @property
    def forced(self) -> bool:
        """False: time does not occur."""
        return False

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for nodes without velocities, and for nodes of one kind if it joins two."""
        for node in (single,) if other is None else (single, other):
            half = len(node.state) // 2
            if self.between is not None and other is None:
                raise ValueError(f"coupling {str(self)!r} joins {' and '.join(self.between)}; found nodes of one kind")
            if not node.events and node.rhs[:half] != node.state[half:]:
                name = node.state[0].name
                raise ValueError(
                    f"coupling {str(self)!r} joins coordinates with velocities; found a node of {node.state} without "
                    f"them; name the components that a link joins, e.g. coupling = '{name}->{name}'"
                )
            if other is None:
                self.places(tuple(s.name for s in node.state)[: max(half, 1)])

    def terms(self, pair: Pair) -> Terms:
        """Return the energies of a link, summed over the coordinates that it joins."""
        if self.between is not None:
            return self._between(self.between, pair)
        known = [str(p)[:-2] for p, _ in pair.alike if p in pair.here[: pair.halves[0]]]
        if not known:
            raise ValueError(
                f"coupling {str(self)!r}: {pair.described} have no coordinate of one name; nothing is joined"
            )
        kinetic = potential = dissipation = sp.S.Zero
        oriented = False
        for name in (known[k] for k in self.places(tuple(known))):
            a, b = (names.index(name) for names in pair.names)
            half, other = pair.halves
            coordinates = dict(zip(_POSITIONS, (pair.here[a], pair.there[b]), strict=True))
            speeds = dict(zip(_SPEEDS, (pair.here[half + a], pair.there[other + b]), strict=True))
            kinetic += _link_energy(self.kinetic, speeds)
            potential += _link_energy(self.potential, coordinates)
            dissipation += _link_energy(self.dissipation, speeds)
            for energy, at in ((self.kinetic, speeds), (self.potential, coordinates), (self.dissipation, speeds)):
                oriented |= not _symmetric(energy, at)
        return Terms(kinetic, potential, dissipation, oriented=oriented)

    def _between(self, kinds: tuple[str, str], pair: Pair) -> Terms:
        """The energies of a coupling that joins two named kinds of oscillator, in the names of their states."""
        if set(map(str, pair.oscillators)) != set(kinds):
            wanted = " and ".join(kinds)
            raise ValueError(f"coupling {str(self)!r} joins {wanted}; found a link between {pair.described}")
        symbols = dict(zip(pair.nodes[0].state, pair.here, strict=True))
        symbols |= dict(zip(pair.nodes[1].state, pair.there, strict=True))
        kinetic, potential, dissipation = (
            e.xreplace(symbols) for e in (self.kinetic, self.potential, self.dissipation)
        )
        return Terms(kinetic, potential, dissipation)

    def __str__(self) -> str:
        return self.name if self.coordinates is None else f"{self.name} on {', '.join(self.coordinates)}"


Coupling = MatrixCoupling | LagrangianCoupling | Rates | Potential
"""What joins the nodes of a network."""

COUPLINGS = (MatrixCoupling, LagrangianCoupling, Rates, Potential)
"""The types of couplings."""


def _expect_known(coupling: Coupling, kind: str, all_of: str, names: Iterable[str], known: tuple[str, ...]) -> None:
    """Raise ValueError for a component or coordinate that a coupling names and a node does not have."""
    for name in names:
        if name not in known:
            raise ValueError(
                f"coupling {short_repr(str(coupling))}: unknown {kind} {short_repr(name)}; known: {', '.join(known)}"
                f"{suggestion(name, known) or f'; name {all_of} of the oscillator'}"
            )


def _turned(energy: sp.Expr, at: Mapping[sp.Symbol, sp.Symbol]) -> tuple[sp.Expr, sp.Expr]:
    """The energy in the symbols of a link, and with its ends exchanged."""
    first, second = at
    return energy.xreplace(dict(at)), energy.xreplace({first: at[second], second: at[first]})


def _symmetric(energy: sp.Expr, at: Mapping[sp.Symbol, sp.Symbol]) -> bool:
    """True if an energy does not change in the exchange of the ends."""
    here, there = _turned(energy, at)
    return bool(sp.expand(here - there) == 0)


def _link_energy(energy: sp.Expr, at: Mapping[sp.Symbol, sp.Symbol]) -> sp.Expr:
    """The energy (or Rayleigh function) of one link, in the symbols `at` its two ends, target first.

    One that changes in the exchange of the ends is W^2 V_even + W V_odd (`synchain.models.interactions.link`).
    """
    if _symmetric(energy, at):
        return energy.xreplace(dict(at))
    here, there = (e.xreplace({WEIGHT: sp.S.One}) for e in _turned(energy, at))
    return sp.expand(WEIGHT**2 * (here + there) / 2 + WEIGHT * (here - there) / 2)


def split(words: str) -> tuple[str, tuple[str, ...] | None]:
    """Return the name of a coupling and the coordinates that its text gives, as in "spring on x"; None for all."""
    match = _CHOSEN.fullmatch(words)
    if match is None:
        return words, None
    return match["name"], tuple(part.strip() for part in match["coordinates"].split(","))


def _read(coupling: str) -> Iterator[tuple[str, str, Fraction]]:
    """The entries of a text."""
    for part in coupling.split(","):
        match = _ENTRY.fullmatch(part)
        if match is None:
            raise ValueError(
                f"coupling {short_repr(coupling)}: cannot read {short_repr(part.strip())}; {_EXPECTED}; correct it"
            )
        sign, number, source, target = match.groups()
        try:
            factor = Fraction(number or 1) * (-1 if sign == "-" else 1)
        except ZeroDivisionError:
            raise ValueError(
                f"coupling {short_repr(coupling)}: {number} divides by zero; {_EXPECTED}; correct it"
            ) from None
        if max(abs(factor.numerator), factor.denominator) > MAGNITUDE:
            raise ValueError(
                f"coupling {short_repr(coupling)}: the factor {short_repr(number)} is too large, or has too many digits; expected "
                f"whole numbers up to {MAGNITUDE:g} above and below the line; write it shorter"
            )
        if factor == 0:
            raise ValueError(
                f"coupling {short_repr(coupling)}: the factor of '{source}->{target}' is 0; expected another; leave it out"
            )
        yield source, target, factor


def _front(factor: Fraction) -> str:
    """A factor as it stands before its entry: nothing for 1, a sign alone for -1."""
    if abs(factor) == 1:
        return "" if factor > 0 else "-"
    return f"{factor} "

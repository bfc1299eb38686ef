"""Couplings as values: entries of a matrix, energies of two ends, or arbitrary rates or potentials.

Every coupling has parameters, checks the nodes that it joins (`check_ends`), and returns the terms of a link between
two ends (`terms`).  `synchain.models.interactions.link` derives the equations from these terms.

A coupling by components is linear.  With the text "y->x" the difference of y between two nodes is added to the rate of
x.  A link of weight w from node j to node i adds sigma w H (s_j - s_i) to the rates of the states s_i, so the entry
"1/2 y->x" is 1/2 in the row of x and the column of y.  H is the matrix of the master stability function (Pecora &
Carroll, Phys. Rev. Lett. 80, 2109 (1998)).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction

import sympy as sp

from ..inputs.checks import check_text, short_repr, suggestion
from ..inputs.expression_text import MAGNITUDE
from ..inputs.frozen import FrozenDict
from ..mechanics.components import Node
from ..mechanics.parameter import Parameter, defaults_text
from .ends import WEIGHT, Pair, Terms, directed, has_velocities
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
"""The parameters of a coupling by components; sigma may be negative."""

_POSITIONS = sp.symbols("q_i q_j", real=True)
"""The coordinates of the two ends in the energies of a coupling."""

_SPEEDS = sp.symbols("v_i v_j", real=True)
"""The velocities of the two ends in the energies of a coupling."""

_NUMBER = r"[0-9]{1,120}(?:/[0-9]{1,120}|(?:\.[0-9]{1,120})?(?:[eE][+-]?[0-9]{1,3}(?=[\s*]))?)"

_NAME = r"[^\W\d]\w*"

_ENTRY = re.compile(rf"\s*([+-]?)\s*(?:({_NUMBER})\s*\*?\s*)?({_NAME})\s*->\s*({_NAME})\s*")

_EXPECTED = (
    "expected 'a->b', the difference of a into the rate of b, with a rational factor or none: '1/2 x->y', '1e-3 x->y'"
)

_CHOSEN = re.compile(r"(?P<name>\S.*?)\s+on\s+(?P<coordinates>[^\W\d]\w*(?:\s*,\s*[^\W\d]\w*)*)\s*")


@dataclass(frozen=True, slots=True)
class MatrixCoupling:
    """A coupling that is linear in the states, given by the non-zero entries of its matrix H."""

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
    def parse(cls, text: str) -> MatrixCoupling | None:
        """Return the coupling of a text such as "x->x, 1/2 y->z"; None if the text is the name of a coupling."""
        return cls(tuple(_read(text))) if "->" in text else None

    @property
    def parameters(self) -> FrozenDict[Parameter]:
        """The strength alone."""
        return STRENGTH

    @property
    def forced(self) -> bool:
        """False: time does not occur."""
        return False

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for components that nodes of one kind lack; for two kinds do nothing."""
        if other is None:
            self.check(tuple(s.name for s in single.state))

    def terms(self, pair: Pair) -> Terms:
        """Return sigma weight H (there - here); between nodes of two kinds only entries whose components exist."""
        here, there = pair.names
        rates = [sp.S.Zero] * len(here)
        # Entries for which the target has both components and the source has the first one.
        fitting = [(a, b, factor) for a, b, factor in self.entries if {a, b} <= set(here) and a in there]
        if not fitting:
            raise ValueError(
                f"coupling {str(self)!r} joins nothing between nodes of {', '.join(here)} and {', '.join(there)}"
            )
        strength = sp.Symbol("sigma", real=True) * WEIGHT
        for source, target, factor in fitting:
            share = sp.Rational(factor.numerator, factor.denominator)
            # Keep each difference as one factor: exactly zero between equal states. An expanded sum would round.
            gap = pair.there[there.index(source)] - pair.here[here.index(source)]
            rates[here.index(target)] += sp.Mul(share, *strength.args, gap)
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

    The symbols are q_i, q_j in `potential` and v_i, v_j in `kinetic` and `dissipation`, where i is the target and j the
    source.  For a coupling `between` two named oscillators the symbols are the states of these oscillators.  `WEIGHT`
    is the weight of the link.
    """

    name: str  # in messages and scene files
    parameters: FrozenDict[Parameter]
    potential: sp.Expr = sp.S.Zero  # the energy stored, Rayleigh's function and the kinetic energy of a link
    dissipation: sp.Expr = sp.S.Zero
    kinetic: sp.Expr = sp.S.Zero
    between: tuple[str, str] | None = None  # names of two oscillators, if the coupling joins only these
    coordinates: tuple[str, ...] | None = None  # the joined coordinates; None for all
    summary: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def joined(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return the joined coordinates among those of a node, in the order of the node."""
        if self.coordinates is None:
            return names
        if not names:
            raise ValueError(
                f"coupling {short_repr(str(self))}: found oscillators without coordinates, which are vector fields; expected "
                "a coupling by components, e.g. 'x->x'"
            )
        _expect_known(self, "coordinate", "coordinates", self.coordinates, names)
        if len(set(self.coordinates)) < len(self.coordinates):
            raise ValueError(
                f"coupling {short_repr(str(self))}: found a coordinate twice; expected each once; leave one out"
            )
        return tuple(name for name in names if name in self.coordinates)

    def canonical(self, state: tuple[str, ...], coordinates: tuple[str, ...]) -> LagrangianCoupling:
        """Return the same coupling with coordinates in the order of the nodes; None in place of all coordinates."""
        if self.coordinates is None:
            return self
        joined = self.joined(coordinates)
        return replace(self, coordinates=None if joined == coordinates else joined)

    @property
    def forced(self) -> bool:
        """False: time does not occur."""
        return False

    def check_ends(self, single: Node, other: Node | None = None) -> None:
        """Raise ValueError for nodes without velocities, and for nodes of one kind if `between` names two kinds."""
        for node in (single,) if other is None else (single, other):
            if self.between is not None and other is None:
                raise ValueError(f"coupling {str(self)!r} joins {' and '.join(self.between)}; found nodes of one kind")
            if not has_velocities(node):
                name = node.state[0].name
                raise ValueError(
                    f"coupling {str(self)!r} joins coordinates with velocities; found a node of {node.state} without "
                    f"them; name the components that a link joins, e.g. coupling = '{name}->{name}'"
                )
            if other is None:
                self.joined(tuple(s.name for s in node.state)[: max(len(node.state) // 2, 1)])

    def terms(self, pair: Pair) -> Terms:
        """Return the energies of a link, summed over the joined coordinates."""
        if self.between is not None:
            return self._between(self.between, pair)
        # Coordinates that both nodes have, by name.
        half, other_half = pair.halves
        names = tuple(str(p)[:-2] for p, _ in pair.alike if p in pair.here[:half])
        if not names:
            raise ValueError(
                f"coupling {str(self)!r}: {pair.described} have no coordinate of one name; nothing is joined"
            )
        kinetic, potential, dissipation = list[sp.Expr](), list[sp.Expr](), list[sp.Expr]()
        oriented = False
        for name in self.joined(names):
            a, b = (states.index(name) for states in pair.names)
            positions = pair.here[a], pair.there[b]
            speeds = pair.here[half + a], pair.there[other_half + b]
            # Add the energies of this coordinate, in the symbols of the link.
            for terms, energy, symbols, (p, q) in (
                (kinetic, self.kinetic, _SPEEDS, speeds),
                (potential, self.potential, _POSITIONS, positions),
                (dissipation, self.dissipation, _SPEEDS, speeds),
            ):
                i, j = symbols
                term, differs = directed(energy.xreplace({i: p, j: q}), energy.xreplace({i: q, j: p}))
                terms.append(term)
                oriented |= differs
        return Terms(sp.Add(*kinetic), sp.Add(*potential), sp.Add(*dissipation), oriented=oriented)

    def _between(self, kinds: tuple[str, str], pair: Pair) -> Terms:
        """Return the energies of a coupling between two named oscillators, in the symbols of the link."""
        if set(map(str, pair.oscillators)) != set(kinds):
            raise ValueError(
                f"coupling {str(self)!r} joins {' and '.join(kinds)}; found a link between {pair.described}"
            )
        here, there = (node.state for node in pair.nodes)
        used = {s.name for e in (self.kinetic, self.potential, self.dissipation) for s in e.free_symbols}
        if both := sorted({s.name for s in here} & {s.name for s in there} & used):
            raise ValueError(
                f"coupling {str(self)!r}: {pair.described} both have a state {both[0]!r}; expected a name that only one of "
                "them has; rename it in one oscillator"
            )
        symbols = dict(zip(here, pair.here, strict=True))
        symbols |= dict(zip(there, pair.there, strict=True))
        kinetic, potential, dissipation = (
            e.xreplace(symbols) for e in (self.kinetic, self.potential, self.dissipation)
        )
        return Terms(kinetic, potential, dissipation)

    def __str__(self) -> str:
        return self.name if self.coordinates is None else f"{self.name} on {', '.join(self.coordinates)}"

    def __repr__(self) -> str:
        return f"LagrangianCoupling({str(self)!r}{defaults_text(self.parameters)})"


Coupling = MatrixCoupling | LagrangianCoupling | Rates | Potential
"""Any coupling between the nodes of a network."""

COUPLINGS = (MatrixCoupling, LagrangianCoupling, Rates, Potential)
"""The types of couplings."""


def _expect_known(
    coupling: Coupling, kind: str, all_of: str, names: Iterable[str], valid_names: tuple[str, ...]
) -> None:
    """Raise ValueError if a coupling names a component or coordinate that a node does not have."""
    for name in names:
        if name not in valid_names:
            raise ValueError(
                f"coupling {short_repr(str(coupling))}: unknown {kind} {short_repr(name)}; known: {', '.join(valid_names)}"
                f"{suggestion(name, valid_names) or f'; name {all_of} of the oscillator'}"
            )


def split(text: str) -> tuple[str, tuple[str, ...] | None]:
    """Split a text such as "spring on x" into the name of a coupling and its coordinates; None for all coordinates."""
    match = _CHOSEN.fullmatch(text)
    if match is None:
        return text, None
    return match["name"], tuple(part.strip() for part in match["coordinates"].split(","))


def _read(coupling: str) -> Iterator[tuple[str, str, Fraction]]:
    """Yield the entries (source, target, factor) of a text."""
    for part in coupling.split(","):
        match = _ENTRY.fullmatch(part)
        if match is None:
            raise ValueError(
                f"coupling {short_repr(coupling)}: cannot read {short_repr(part.strip())}; {_EXPECTED}; correct it"
            )
        # Factors are exact: 1/2, 0.5 and 5e-1 are one number.
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
    """Return the text of a factor in front of its entry: empty for 1, "-" for -1."""
    if abs(factor) == 1:
        return "" if factor > 0 else "-"
    return f"{factor} "

"""Rows: several surfaces of one node at which its rates jump, and on which its motion can be held.

A row has a speed h(state, t) that is held at zero: the sliding velocity of a contact, a level whose sign stands in the
rates, or the speed with which a stop is approached.  The rates of a node with rows are linear in one number x of each
row, dz/dt = f(z, t) + sum G x, and dh/dt = b - K x with b = grad h f + dh/dt and K = -grad h G.  Off the surface x is
the sign of h, and 0 at an open stop.  On the surface x is the number that makes dh/dt = 0, as long as |x| <= r, where r
is static over kinetic friction; a closed stop presses, x >= 0.  With D = 1 in held rows and D = 0 in the others, all x
of all modes solve one linear system D (K x - b) + (1 - D) (x - s) = 0, which is solved in symbols by Cramer's rule.

Sources: Filippov, Differential Equations with Discontinuous Righthand Sides (Kluwer, 1988), chapter 2; Leine &
Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapter 5; Acary & Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems (Springer, 2008).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import sympy as sp

from ..inputs.words import Word
from .calculus import derivative
from .contact import SLIDING, SLIP, beyond_rest, coefficient_at_rest, in_slip

MOST_ROWS = 3
"""Most rows of a node that can be held (a choice): x is solved in symbols by minors, which are short for three rows."""

MOST_JOINED = 8
"""Most rows that can be held in a part, the nodes that rows of links join (a choice): an event tries up to 3**8 sets."""

TIME = sp.Symbol("t", real=True)

NO_MODE = sp.Symbol("no mode", real=True)
"""In place of the mode of a row that is never held."""

Column = tuple[sp.Expr, ...]


class Law(Word):
    """What happens where the level of a row is zero."""

    SIGN = "sign"
    """The sign of the level stands in the rates; motion crosses, or is held."""
    STOP = "stop"
    """A gap closes: motion rebounds, or is held."""
    RESET = "reset"
    """A guard passes zero upwards and states jump."""


@dataclass(frozen=True, slots=True)
class Surface:
    """A row as a model defines it, in the symbols of the node."""

    law: Law
    level: sp.Expr  # SIGN: h; STOP: the gap, positive while open; RESET: the guard
    push: Column = ()  # what one unit of x adds to the rate of each continuous state, in terms of the mode `SLIP`
    ratio: sp.Expr = sp.S.One  # SIGN: static over kinetic friction; STOP: restitution
    sets: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()  # RESET: the values just after
    name: str = ""  # ending of the name of the mode if a node has several
    in_order: bool = False  # STOP: hit together with others that it influences, they rebound one after another

    @property
    def expressions(self) -> Column:
        """All expressions; a push contains `SLIP` in place of the mode."""
        return self.level, *self.push, self.ratio, *(e for _, e in self.sets)

    def in_mode(self, mode: sp.Symbol) -> Surface:
        """Return the surface with its mode in place of `SLIP`."""
        return self.map(lambda e: e.xreplace({SLIP: mode}))

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Surface:
        """Return the surface with every symbol and expression changed."""
        sets = tuple((change(s), change(e)) for s, e in self.sets)
        return replace(
            self, level=change(self.level), push=tuple(map(change, self.push)), ratio=change(self.ratio), sets=sets
        )


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a node, or of a network under the forces of its links.  Columns have an entry for each continuous state."""

    law: Law
    mode: sp.Symbol  # SIGN: the sign of the level, 0 while held; STOP: 1 open, 0 closed; RESET: `NO_MODE`
    level: sp.Expr
    speed: sp.Expr  # held at zero: the level, or of a stop the rate at which the gap closes
    rate: sp.Expr  # b, the rate of the speed if all x were 0
    gradient: Column  # of the speed
    push: Column  # what one unit of x adds to the rates
    stiffness: Column  # K, an entry for each row of the node
    ratio: sp.Expr
    x: sp.Expr  # the solution of the masked system
    lift: Column  # what one unit of a stop's correction adds to the states, to close the gap again; zeros elsewhere
    answer: Column  # derivative of x by the rates without rows, for the forces of links
    sets: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    in_order: bool = False
    redundant: bool = False  # SIGN: a level that vanishes where those of other contacts do (two bodies on the ground)

    @property
    def gap(self) -> sp.Expr:
        """An expression that is positive while the mode lasts: the smallest of `gaps`."""
        return sp.Min(*self.gaps)

    @property
    def gaps(self) -> Column:
        """Expressions that are positive while the mode lasts; the second of two can pass zero only in held rows."""
        if self.law is Law.RESET:
            return (-self.level,)
        off, held = self.mode * self.level, 1 - self.mode**2
        if self.law is Law.STOP:
            return (off + held * self.x,)
        return off + held * (self.ratio - self.x), off + held * (self.ratio + self.x)

    def side(self, mode: sp.Expr) -> sp.Expr:
        """Return the last term of the masked system in a mode, (1 - D) s."""
        return _side(self.law, mode, self.redundant)

    @property
    def size(self) -> sp.Expr:
        """An expression as large as the terms of the gap, of which the rounding error of the gap is a small part."""
        off, held, level = abs(self.mode), 1 - self.mode**2, term_size(self.level)
        if self.law is Law.RESET:
            return level
        return off * level + held * (term_size(self.x) + (self.ratio if self.law is Law.SIGN else 0))

    def gained(self, force: Sequence[sp.Expr]) -> Column:
        """Return what further rates of the continuous states add to the gaps."""
        x = (1 - self.mode**2) * sp.Add(*(a * b for a, b in zip(self.answer, force, strict=True)))
        return {Law.RESET: (sp.S.Zero,), Law.STOP: (x,), Law.SIGN: (-x, x)}[self.law]

    @property
    def expressions(self) -> Column:
        """All expressions."""
        columns = (*self.gradient, *self.push, *self.stiffness, *self.lift, *self.answer, *(e for _, e in self.sets))
        return self.level, self.speed, self.rate, self.ratio, self.x, *columns

    def map(self, change: Callable[[sp.Expr], sp.Expr]) -> Row:
        """Return the row with every symbol and expression changed."""
        changed = {}
        for field in fields(Row):
            value = getattr(self, field.name)
            if isinstance(value, sp.Expr):
                changed[field.name] = change(value)
            elif field.name == "sets":
                changed[field.name] = tuple((change(s), change(e)) for s, e in value)
            elif isinstance(value, tuple):
                changed[field.name] = tuple(map(change, value))
        return replace(self, **changed)

    def under(self, force: Sequence[sp.Expr]) -> Row:
        """Return the row with further rates of the continuous states."""
        rate = self.rate + sp.Add(*(a * b for a, b in zip(self.gradient, force, strict=True)))
        return replace(self, rate=rate, x=self.x + sp.Add(*(a * b for a, b in zip(self.answer, force, strict=True))))


@lru_cache(maxsize=4096)
def term_size(e: sp.Expr) -> sp.Expr:
    """Return an expression with the modulus of each term in place of the term."""
    if isinstance(e, sp.Add | sp.Mul):
        return e.func(*map(term_size, e.args))
    # SymPy takes minutes over moduli of long quotients.
    return abs(e) if e.is_Atom or e.is_number else sp.Abs(e, evaluate=False)


def with_rows(
    state: Sequence[sp.Symbol],
    rates: Sequence[sp.Expr],
    surfaces: Sequence[Surface],
    speeds: Mapping[sp.Symbol, sp.Symbol],
) -> tuple[tuple[sp.Symbol, ...], tuple[sp.Expr, ...], tuple[Row, ...]]:
    """Return the states, rates and rows of a node from its continuous states, and their rates with all x = 0.

    speeds: maps each velocity to its coordinate.
    """
    check_surfaces(surfaces)
    modes = modes_of(surfaces)
    rows = rows_of(state, rates, surfaces, modes, speeds)
    total = [sp.sympify(f) + added for f, added in zip(rates, added_rates(rows, len(state)), strict=True)]
    return (*state, *modes), (*total, *[sp.S.Zero] * len(modes)), rows


def rows_of(
    state: Sequence[sp.Symbol],
    rates: Sequence[sp.Expr],
    surfaces: Sequence[Surface],
    modes: Sequence[sp.Symbol],
    speeds: Mapping[sp.Symbol, sp.Symbol],
) -> tuple[Row, ...]:
    """Return the row of each surface, with one of `modes` for each that can be held; see `with_rows`."""
    held = [surface for surface in surfaces if surface.law is not Law.RESET]
    inside = [[e.xreplace({SLIP: mode}) for e in surface.push] for surface, mode in zip(held, modes, strict=True)]
    along = list(map(sp.sympify, rates))

    def slope(e: sp.Expr) -> Column:
        return tuple(derivative(e, s) for s in state)

    def total(e: sp.Expr) -> sp.Expr:
        return derivative(e, TIME) + sp.Add(*(a * f for a, f in zip(slope(e), along, strict=True)))

    levels = [surface.level if surface.law is Law.SIGN else -total(surface.level) for surface in held]
    gradients = list(map(slope, levels))
    biases = list(map(total, levels))
    stiffness = [
        tuple(sp.factor_terms(-sp.Add(*(a * g for a, g in zip(gradient, push, strict=True)))) for push in inside)
        for gradient in gradients
    ]
    redundant = _redundant([surface.level for surface in held if surface.law is Law.SIGN], state)
    sides = [_side(surface.law, mode, surface.level in redundant) for surface, mode in zip(held, modes, strict=True)]
    x = forces(sides, modes, stiffness, biases)
    # in larger parts the forces of links are among the rates, so that none is added later
    inverse = _inverse(modes, stiffness) if len(held) <= MOST_ROWS else [()] * len(held)
    answers = [
        tuple(
            sp.Add(*(e * (1 - modes[b] ** 2) * gradients[b][c] for b, e in enumerate(row))) for c in range(len(state))
        )
        for row in inverse
    ]
    rows, places = [], dict(zip(state, range(len(state)), strict=True))
    for surface in surfaces:
        zeros = (sp.S.Zero,) * len(state)
        if surface.law is Law.RESET:
            none = (sp.S.Zero,) * len(held)
            rows.append(
                Row(surface.law, NO_MODE, surface.level, surface.level, sp.S.Zero, zeros, zeros, none, sp.S.One, sp.S.Zero,
                    zeros, zeros, surface.sets)
            )  # fmt: skip
            continue
        a, lift = held.index(surface), list(zeros)
        for speed, coordinate in speeds.items() if surface.law is Law.STOP else ():
            lift[places[coordinate]] = inside[a][places[speed]]
        rows.append(
            Row(surface.law, modes[a], surface.level, levels[a], biases[a], gradients[a], tuple(inside[a]), stiffness[a],
                surface.ratio, x[a], tuple(lift), answers[a], in_order=surface.in_order,
                redundant=surface.law is Law.SIGN and surface.level in redundant)
        )  # fmt: skip
    return tuple(rows)


def _redundant(levels: Sequence[sp.Expr], state: Sequence[sp.Symbol]) -> set[sp.Expr]:
    """Return the levels of which a sum with constant factors vanishes at all states and times."""
    # each level as a row of its factors of functions of states and time
    moving = {*state, TIME}
    terms = [[e.as_independent(*moving, as_Add=False) for e in sp.Add.make_args(sp.expand(level))] for level in levels]
    functions = list(dict.fromkeys(function for row in terms for _, function in row))
    table = sp.Matrix(
        len(levels), len(functions), lambda k, j: sp.Add(*(factor for factor, f in terms[k] if f == functions[j]))
    )
    sums = table.T.nullspace() if len(levels) > 1 else []
    return {level for k, level in enumerate(levels) if any(factors[k] != 0 for factors in sums)}


def added_rates(rows: Sequence[Row], size: int) -> list[sp.Expr]:
    """Return what the x of all rows add to the rates of `size` continuous states."""
    return [sp.Add(*(row.push[c] * row.x for row in rows if row.law is not Law.RESET)) for c in range(size)]


def _side(law: Law, mode: sp.Expr, redundant: bool) -> sp.Expr:
    """Return (1 - D) s with D = 1 - s**2 of a contact, which is s if it slides; of a stop 0."""
    if law is not Law.SIGN:
        return sp.S.Zero
    return mode**3 if redundant else mode


def forces(
    sides: Sequence[sp.Expr], modes: Sequence[sp.Symbol], stiffness: Sequence[Column], rates: Sequence[sp.Expr]
) -> list[sp.Expr]:
    """Return x of each row that can be held: A x = D b + (1 - D) s with A = D K + (1 - D); sides: the last terms.

    In rows that are not held A is the identity, so that x = s there to the last bit.
    """
    right = [(1 - mode**2) * rate + side for mode, rate, side in zip(modes, rates, sides, strict=True)]
    if len(modes) > MOST_ROWS:
        return _eliminated(_masked(modes, stiffness), right)
    return [sp.Add(*(e * c for e, c in zip(row, right, strict=True))) for row in _inverse(modes, stiffness)]


def _masked(modes: Sequence[sp.Symbol], stiffness: Sequence[Column]) -> list[list[sp.Expr]]:
    """Return A = D K + (1 - D)."""
    size = len(modes)
    return [
        [(1 - modes[a] ** 2) * stiffness[a][b] + (modes[a] ** 2 if a == b else 0) for b in range(size)]
        for a in range(size)
    ]


def _eliminated(matrix: list[list[sp.Expr]], right: list[sp.Expr]) -> list[sp.Expr]:
    """Solve A x = right without a search for pivots: leading minors are positive if K is a P-matrix."""
    size = len(right)
    for k in range(size):
        for r in range(k + 1, size):
            if matrix[r][k] != 0:
                factor = matrix[r][k] / matrix[k][k]
                for c in range(k + 1, size):
                    matrix[r][c] -= factor * matrix[k][c]
                right[r] -= factor * right[k]
    for k in reversed(range(size)):
        known = sp.Add(*(matrix[k][c] * right[c] for c in range(k + 1, size)))
        right[k] = (right[k] - known) / matrix[k][k]
    return right


def projection(rows: Sequence[Row], plain: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return what rates that a link adds to a node become while rows are held: f + sum G dx(f)."""
    held = [row for row in rows if row.law is not Law.RESET]
    gained = [sp.Add(*(a * f for a, f in zip(row.answer, plain, strict=True))) for row in held]
    return tuple(
        f + sp.Add(*(row.push[c] * x for row, x in zip(held, gained, strict=True))) for c, f in enumerate(plain)
    )


def struck(rows: Sequence[Row], state: Sequence[sp.Symbol], numbers: Sequence[Sequence[sp.Symbol]]) -> list[sp.Expr]:
    """Return the continuous states after an event, from the impulse, correction and firing of each row."""
    after = []
    for c, s in enumerate(state):
        moves = (row.push[c] * z + row.lift[c] * g for row, (z, g, _) in zip(rows, numbers, strict=True))
        e = s + sp.Add(*moves)
        for row, (_, _, fires) in zip(rows, numbers, strict=True):
            value = dict(row.sets).get(s)
            e = e if value is None else sp.Piecewise((value, fires > sp.Rational(1, 2)), (e, True))
        after.append(e)
    return after


def off_surfaces(rates: Sequence[sp.Expr], rows: Sequence[Row]) -> tuple[sp.Expr, ...]:
    """Return the rates of a node off all surfaces, with the sign of each level, for printing."""
    free = {row.mode: sp.S.One for row in rows}
    signs = [row for row in rows if row.law is Law.SIGN]
    smooth = (
        e.xreplace(free) - sp.Add(*(row.push[c].xreplace(free) for row in signs))
        for c, e in enumerate(rates[: len(rates) - len(free) + (NO_MODE in free)])
    )
    return tuple(sp.expand(e) + sp.Add(*(_by_sign(row.push[c], row) for row in signs)) for c, e in enumerate(smooth))


def _by_sign(e: sp.Expr, row: Row) -> sp.Expr:
    return in_signs(e, row.level, row.mode)


def in_signs(e: sp.Expr, level: sp.Expr, mode: sp.Symbol) -> sp.Expr:
    """Return s e of a push e with the sign s of the level in place of the mode, for printing."""
    sign = sp.sign(level)
    return sign * e.xreplace({mode: sign}).xreplace({sign**2: sp.S.One})


def friction_surface(
    sliding: sp.Expr, pull: Column, law: sp.Expr, argument: sp.Symbol, static: sp.Expr | None
) -> Surface:
    """Return the row of a contact: `pull` is what one unit of the friction coefficient adds to the rates."""
    moving = in_slip(law, argument)
    slow = coefficient_at_rest(moving, argument)
    if slow == 0:
        raise ValueError(
            f"set-valued contact: the law {law.xreplace({argument: SLIDING})} has no jump at w = 0, so nothing sticks; use contact 'atan'"
        )
    # the law in slip over its sign, as a function of |w| = mode w
    size = beyond_rest(moving, argument).xreplace({SLIP: sp.S.One}).xreplace({argument: SLIP * sliding})
    ratio = sp.S.One if static is None else sp.cancel(static / slow)
    return Surface(Law.SIGN, sliding, tuple(e * size for e in pull), ratio)


def modes_of(surfaces: Sequence[Surface]) -> list[sp.Symbol]:
    """Return the symbols of the modes: slip or open, with an ending where there are several."""
    held = [surface for surface in surfaces if surface.law is not Law.RESET]
    stems = ["open" if surface.law is Law.STOP else "slip" for surface in held]
    endings = [surface.name and f"_{surface.name}" for surface in held]
    names = [stem if stems.count(stem) == 1 else f"{stem}{ending}" for stem, ending in zip(stems, endings, strict=True)]
    unique = [
        name if names.count(name) == 1 else f"{stem}{names[: k + 1].count(name)}"
        for k, (name, stem) in enumerate(zip(names, stems, strict=True))
    ]
    return [sp.Symbol(name, real=True) for name in unique]


def check_surfaces(surfaces: Sequence[Surface]) -> None:
    """Raise ValueError for rows that no motion determines."""
    held = [surface for surface in surfaces if surface.law is not Law.RESET]
    if len(held) > MOST_ROWS:
        raise ValueError(
            f"events: found {len(held)} contacts, stops and surfaces of a node; expected at most {MOST_ROWS}"
        )
    for k, one in enumerate(held):
        for j, other in enumerate(held[:k]):
            same = one.law is other.law and sp.simplify(one.level / other.level) if other.level != 0 else sp.S.Zero
            if same is not False and getattr(same, "is_number", False) and same != 0:
                raise ValueError(f"contacts {j + 1} and {k + 1} slide together; add their loads")


def _inverse(modes: Sequence[sp.Symbol], stiffness: Sequence[Column]) -> list[list[sp.Expr]]:
    """Return the inverse of A = D K + (1 - D) by minors, group by group of rows that feel each other."""
    size, matrix = len(modes), _masked(modes, stiffness)
    inverse: list[list[sp.Expr]] = [[sp.S.Zero] * size for _ in range(size)]
    left = set(range(size))
    while left:
        group, more = set[int](), {min(left)}
        while more:
            group |= more
            more = {b for a in group for b in left if stiffness[a][b] != 0 or stiffness[b][a] != 0} - group
        rows = sorted(group)
        # minors of placeholders: the entries stay as they are, so that code computes each of them once
        block = sp.Matrix(len(rows), len(rows), lambda k, j: sp.Dummy(f"a{k}{j}"))
        values = {block[k, j]: matrix[a][b] for k, a in enumerate(rows) for j, b in enumerate(rows)}
        minors, determinant = block.adjugate(), block.det(method="berkowitz").xreplace(values)
        for k, a in enumerate(rows):
            for j, b in enumerate(rows):
                inverse[a][b] = minors[k, j].xreplace(values) / determinant
        left -= group
    return inverse

"""A Taylor step of an orbit and of the deviations along it.

The tangent of a Taylor step is the Taylor step of orbit and deviation together. Of d' = A d the coefficients are
d_(k+1) = scale/(k+1) sum_j A_j d_(k-j), and the series of A belongs to the orbit: a step of the orbit leaves it in a short
shared array, from which every mode takes its own step. The orbit is scalar; a register holds one deviation for each of
LANES modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation

from ..program.expressions import ZERO, Compare, Expression, Junction, Load, Name, Not, Number, Power, call, plus
from ..program.lowering import lower
from ..program.passes import Names
from ..program.printers import LANES
from ..program.statements import Comment, Function, If, Return, Role, let, store
from .series import Series, State
from .series_graph import SeriesGraph, Template, is_analytic
from .simplify import absolute, add, largest, times
from .step_length import last_orders, reach
from .taylor_step import TaylorStep, check_order
from .unrolled_series import SQUARE, Lines, UnrolledSeries, polynomial

HEAD = 2
"""First entries of the shared array: `scale` of the orbit's step, and its length, which the driver writes."""

COMMON = '''
@njit(error_model="numpy")
def common_length(lengths, longest, new, place):
    """The shortest of the lengths that the lanes can go, `longest` if none is much shorter; `new` has room at `place`."""
    if any_lane(lengths < 0.96875*longest):
        store(new, place, lengths)
        for lane in range(LANES):
            longest = min(longest, new[place*LANES + lane])
    return longest
'''.strip()

CARRY = '''
@njit(error_model="numpy", cache=True)
def carry(shared, strengths, old, new, registers, tolerance):
    """Step all modes, the last register first; returns the length of the step, with which all of them agree."""
    done, longest = 0, shared[1]
    while done < registers and longest > 0.0:
        length = mode_step(shared, strengths, old, new, registers - 1 - done, longest, tolerance)
        done = done + 1 if length == longest or done == 0 else 0  # a shorter step begins anew with all that are done
        longest = length
    return longest
'''.strip()


LEAST = 2.2250738585072014e-308
"""The smallest number of full precision."""


@dataclass(frozen=True, slots=True)
class TangentStep:
    """The text of `step` for the orbit and those of the functions that step its modes.

    shared: the length of the array in which the orbit leaves the series of A.
    """

    orbit: TaylorStep
    modes: tuple[str, ...]
    shared: int


class OrbitWriter(UnrolledSeries):
    """Writes the step of an orbit, which leaves the series of some coefficients.

    Attributes
    ----------
    wanted : list of Expression
        The coefficients, in the symbols of the network.
    called_so : dict
        What each of them is called in the step of a mode; those that are one series have one name.
    left : dict
        Their coefficients by name and order: a number, or the name of what is left.
    places : dict
        Where in the shared array a name is found.
    """

    def __init__(self, equations: Equations, order: int, wanted: Sequence[sp.Expr]) -> None:
        self.wanted = list(wanted)
        self.called_so: dict[sp.Expr, str] = {}
        self.left: dict[tuple[str, int], Expression] = {}
        self.places: dict[str, int] = {}
        super().__init__(equations, order)
        self.exact = True  # deviations feel the time of an event to first order

    def read(self) -> dict[State, Series]:
        """The rates of the states; what is wanted beside them is noted."""
        rates = super().read()
        moving, swap = self.of_network()
        found = self.graph.read(Template.of(self.wanted, moving, self.supply.fresh("shared_")), moving, swap)
        self.noted = list(dict.fromkeys(found))
        self.called_so = {e: f"a{self.noted.index(series)}" for e, series in zip(self.wanted, found, strict=True)}
        return rates

    def make(self, k: int) -> None:
        """Write coefficients k of all series, and leave those of what is wanted, but in the last order."""
        super().make(k)
        if k == 0:
            self.lines.put(store("shared", 0, "scale"))
        for which, series in enumerate(self.noted if k < self.order else ()):
            name, value = f"a{which}_{k}", self.lines.of(series)
            if not isinstance(value, Number):
                self.places[name] = HEAD + len(self.places)
                self.lines.put(store("shared", self.places[name], value))
                value = Name(name)
            self.left[f"a{which}", k] = value


class ModeWriter(Lines):
    """Writes the step of the modes in one register, from what an orbit leaves."""

    def __init__(self, variation: Variation, orbit: OrbitWriter) -> None:
        super().__init__(SeriesGraph(Names([s.name for s in variation.parameters])), orbit.order)
        self.size, self.called_so, strengths = variation.size, orbit.called_so, variation.parameters
        self.outer = {name: State(name=name) for name in orbit.called_so.values()}
        self.values |= {(self.outer[name], k): value for (name, k), value in orbit.left.items()}
        self.put(let("scale", _shared(0)))
        self.put(*(let(s.name, _of_modes("strengths", len(strengths), k)) for k, s in enumerate(strengths)))
        self.put(*(let(f"d{c}_0", _of_modes("old", self.size, c)) for c in range(self.size)))
        self.put(*(let(name, _shared(place)) for name, place in orbit.places.items()))
        deviations = [State(name=f"d{c}") for c in range(self.size)]
        self.values |= {(d, 0): Name(f"{d.name}_0") for d in deviations}
        self.rates = {d: self.rate(variation, row, deviations) for row, d in enumerate(deviations)}
        self.graph.settle([*self.rates.values()])

    def rate(self, variation: Variation, row: int, deviations: Sequence[State]) -> Series:
        """The rate of a deviation: each entry is what does not move times it, and convolutions for what does."""
        terms: list[tuple[Expression, Series]] = []
        for (r, c), e in variation.matrix:
            if r != row:
                continue
            fixed: Expression = ZERO
            for coefficient, strength in variation.parts(e):
                series, factor = self.outer[self.called_so[coefficient]], lower(strength)
                if self.moves(series):
                    terms.append((factor, self.graph.product(series, deviations[c])))
                else:
                    fixed = add(fixed, times(factor, self.of(series)))
            if not isinstance(fixed, Number | Name):  # what each order multiplies by is made once
                self.put(let(f"g{r}_{c}", fixed))
                fixed = Name(f"g{r}_{c}")
            if fixed != ZERO:
                terms.append((fixed, deviations[c]))
        return self.graph.sum(terms)

    def moves(self, series: Series) -> bool:
        """True if any later coefficient of a series is not zero."""
        return any(self.at(series, k) != ZERO for k in range(1, self.order))

    def write(self) -> Function:
        """The function `mode_step`."""
        for k in range(self.order + 1):
            self.coefficients(k)
        self.length()
        self.put(Comment("new deviation"), SQUARE)
        for c, d in enumerate(self.rates):
            self.put(*polynomial(d.name, [self.at(d, k) for k in range(self.order + 1)]))
            self.put(store("new", _place(self.size, c), f"n_{d.name}"))
        self.put(let("total", plus(*(absolute(Name(f"n_{d.name}")) for d in self.rates))))
        broken = Not(Compare("<", Name("total"), Name("math.inf")))
        self.put(If(call("any_lane", broken), (Return((Name("math.nan"),)),)), Return((Name("length"),)))
        return Function(
            "mode_step",
            ("shared", "strengths", "old", "new", "which", "longest", "tolerance"),
            "Step the modes in one register by at most `longest`; returns the length, which may be shorter.",
            tuple(self.statements),
            Role.CALLED,
        )

    def length(self) -> None:
        """The length of the step: the last three coefficients are small beside the deviation at its beginning."""
        self.put(Comment("step length"), let("size", largest(absolute(self.at(d, 0)) for d in self.rates)))
        self.put(let("weight", 1.0 / (Name("tolerance") * "size" + LEAST)))
        found = {k: [absolute(e) for d in self.rates if (e := self.at(d, k)) != ZERO] for k in last_orders(self.order)}
        known = [k for k, last in found.items() if last]
        self.put(*(let(f"size_{k}", times(largest(found[k]), Name("weight"))) for k in known))
        self.put(let("ratio", Name("longest") / "scale"), let("length", "longest"))
        if known:
            sizes = (Name(f"size_{k}") * Power(Name("ratio"), Number(k)) for k in known)
            far = Not(Junction("and", tuple(Compare("<=", size, Number(1.0)) for size in sizes)))
            shorter = (
                Comment("not all of them go so far"),
                let("lengths", call("truncated", Name("scale") * call("exp", reach(known)))),
                let("length", call("common_length", "lengths", "longest", "new", _place(self.size, 0))),
                let("ratio", Name("length") / "scale"),
            )
            self.put(If(call("any_lane", far), shorter))


def write_tangent(variation: Variation, order: int) -> TangentStep:
    """Return the Taylor step of some order of an orbit and of deviations along it."""
    if variation.orbit.inertial:
        raise ValueError("taylor: found a mass matrix beside deviations along an orbit; expected the identity")
    if not is_analytic(variation.orbit):
        raise ValueError(
            "taylor: found a kink beside deviations along an orbit; expected analytic functions; use rodas5p"
        )
    wanted = dict.fromkeys(c for _, e in variation.matrix for c, _ in variation.parts(e))
    check_order(order)
    orbit = OrbitWriter(variation.orbit, order, list(wanted))
    step = orbit.step("shared")
    modes = LANES.function(ModeWriter(variation, orbit).write())
    return TangentStep(step, (COMMON, modes, CARRY), HEAD + len(orbit.places))


def _place(size: int, k: int) -> Expression:
    """Number k of the registers of one group of modes, which fill `size` registers of an array."""
    group = Name("which") if size == 1 else size * Name("which")
    return group + k if k else group


def _of_modes(array: str, size: int, k: int) -> Expression:
    return Load(array, _place(size, k), "LANES")


def _shared(place: int) -> Expression:
    return Load("shared", Number(place), None)

"""Write a Taylor step of an orbit and of the deviations along the orbit.

The derivative of a Taylor step with respect to the initial state is the Taylor step of orbit and deviations together,
because differentiated recurrences have the same form (R. Barrio, SIAM Journal on Scientific Computing 27, 1929 (2006)).
The coefficients of d' = A d are

    d_(k+1) = scale/(k+1) sum_j A_j d_(k-j)

where the series of A depends on the orbit only.  The orbit's step stores the series of A in a short shared array; the
step of each mode reads this array.  The orbit is scalar; a register holds one deviation for each of LANES modes.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation

from ..program.expressions import ZERO, Compare, Expression, Junction, Load, Name, Not, Number, PowerExpr, call, plus
from ..program.lowering import lower
from ..program.passes import Names
from ..program.printers import LANES
from ..program.statements import Comment, Function, If, Return, Role, let, store
from .passable import is_analytic
from .series import Series, State
from .series_graph import SeriesGraph, Template
from .simplify import absolute, add, largest, times
from .step_length import last_orders, reach
from .taylor_step import TaylorStep, check_order
from .unrolled_series import SQUARE, Lines, UnrolledSeries, polynomial

HEAD = 2
"""Number of entries at the beginning of the shared array: `scale` and length of the orbit's step."""

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
"""Text that lets a mode take the orbit's step if its own is at least 31/32 of it; the error grows by (32/31)**order."""

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

LEAST = sys.float_info.min
"""The smallest normal double, added to the allowed error so that a zero deviation does not divide by zero."""


@dataclass(frozen=True, slots=True)
class TangentStep:
    """The text of the orbit's function `step`, and of the functions that advance the modes.

    shared: the length of the array in which the orbit stores the series of A.
    """

    orbit: TaylorStep
    modes: tuple[str, ...]
    shared: int


class OrbitWriter(UnrolledSeries):
    """Write the step of an orbit; the step stores the series of the coefficients of A that move.

    Attributes
    ----------
    coefficients_of_a : list of Expression
        The coefficients of A in the symbols of the network.
    names_of_a : dict
        Name of each coefficient in the step of a mode; coefficients with the same series share a name.
    stored_values : dict
        Coefficient of each series by name and order: a number, or the name of an entry of the shared array.
    slots : dict
        Index of each entry of the shared array by name.
    """

    def __init__(self, equations: Equations, order: int, coefficients_of_a: Sequence[sp.Expr]) -> None:
        self.coefficients_of_a = list(coefficients_of_a)
        self.names_of_a: dict[sp.Expr, str] = {}
        self.stored_values: dict[tuple[str, int], Expression] = {}
        self.slots: dict[str, int] = {}
        super().__init__(equations, order)
        self.exact = True  # an error in the time of an event changes deviations to first order

    def read(self) -> dict[State, Series]:
        rates = super().read()
        moving, constant = self.of_network()
        template = Template.of(self.coefficients_of_a, moving, self.supply.fresh("shared_"))
        series = self.graph.read(template, moving, constant)
        self.noted = list(dict.fromkeys(series))
        self.names_of_a = {e: f"a{self.noted.index(s)}" for e, s in zip(self.coefficients_of_a, series, strict=True)}
        return rates

    def make(self, k: int) -> None:
        super().make(k)
        if k == 0:
            self.lines.put(store("shared", 0, "scale"))
        # store the coefficients of A, except the last order, behind the HEAD entries of the shared array
        for number, series in enumerate(self.noted if k < self.order else ()):
            name, value = f"a{number}_{k}", self.lines.of(series)
            if not isinstance(value, Number):
                self.slots[name] = HEAD + len(self.slots)
                self.lines.put(store("shared", self.slots[name], value))
                value = Name(name)
            self.stored_values[f"a{number}", k] = value


class ModeWriter(Lines):
    """Write the step of the modes in one register; the step reads the series that the orbit's step has stored."""

    def __init__(self, variation: Variation, orbit: OrbitWriter) -> None:
        super().__init__(SeriesGraph(Names([s.name for s in variation.parameters])), orbit.order)
        self.size, self.names_of_a, strengths = variation.size, orbit.names_of_a, variation.parameters
        self.series_of_a = {name: State(name=name) for name in orbit.names_of_a.values()}
        self.values |= {(self.series_of_a[name], k): value for (name, k), value in orbit.stored_values.items()}
        # load `scale`, then strengths and deviations of the modes in this register
        self.put(let("scale", Load("shared", Number(0), None)))
        for k, s in enumerate(strengths):
            self.put(let(s.name, Load("strengths", _register(len(strengths), k), "LANES")))
        for c in range(self.size):
            self.put(let(f"d{c}_0", Load("old", _register(self.size, c), "LANES")))
        self.put(*(let(name, Load("shared", Number(slot), None)) for name, slot in orbit.slots.items()))
        deviations = [State(name=f"d{c}") for c in range(self.size)]
        self.values |= {(d, 0): Name(f"{d.name}_0") for d in deviations}
        self.rates = {d: self.rate(variation, row, deviations) for row, d in enumerate(deviations)}
        self.graph.finish([*self.rates.values()])

    def rate(self, variation: Variation, row: int, deviations: Sequence[State]) -> Series:
        """Return a row of A d: products for constant entries of A, convolutions for entries that move."""
        terms: list[tuple[Expression, Series]] = []
        for (r, c), e in variation.matrix:
            if r != row:
                continue
            fixed: Expression = ZERO
            for coefficient, strength in variation.parts(e):
                series, factor = self.series_of_a[self.names_of_a[coefficient]], lower(strength)
                if any(self.at(series, k) != ZERO for k in range(1, self.order)):
                    terms.append((factor, self.graph.product(series, deviations[c])))
                else:
                    fixed = add(fixed, times(factor, self.of(series)))
            if not isinstance(fixed, Number | Name):  # compute a factor that all orders share once
                self.put(let(f"g{r}_{c}", fixed))
                fixed = Name(f"g{r}_{c}")
            if fixed != ZERO:
                terms.append((fixed, deviations[c]))
        return self.graph.sum(terms)

    def write(self) -> Function:
        """Return the generated function `mode_step`: one Taylor step of the deviations along the orbit."""
        for k in range(self.order + 1):
            self.coefficients(k)

        # step length: the last three terms must be small relative to the deviation at the start of the step
        self.put(Comment("step length"), let("size", largest(absolute(self.at(d, 0)) for d in self.rates)))
        self.put(let("weight", 1.0 / (Name("tolerance") * "size" + LEAST)))
        last = {k: [absolute(e) for d in self.rates if (e := self.at(d, k)) != ZERO] for k in last_orders(self.order)}
        orders = [k for k, sizes in last.items() if sizes]
        self.put(*(let(f"size_{k}", times(largest(last[k]), Name("weight"))) for k in orders))
        self.put(let("ratio", Name("longest") / "scale"), let("length", "longest"))
        if orders:
            terms = (Name(f"size_{k}") * PowerExpr(Name("ratio"), Number(k)) for k in orders)
            far = Not(Junction("and", tuple(Compare("<=", term, Number(1.0)) for term in terms)))
            shorter = (
                Comment("not all of them go so far"),
                let("lengths", call("truncated", Name("scale") * call("exp", reach(orders)))),
                let("length", call("common_length", "lengths", "longest", "new", _register(self.size, 0))),
                let("ratio", Name("length") / "scale"),
            )
            self.put(If(call("any_lane", far), shorter))

        # the deviations at the end of the step; NaN if any of them is infinite or NaN
        self.put(Comment("new deviation"), SQUARE)
        for c, d in enumerate(self.rates):
            self.put(*polynomial(d.name, self.all_of(d)))
            self.put(store("new", _register(self.size, c), f"n_{d.name}"))
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


def write_tangent(variation: Variation, order: int) -> TangentStep:
    """Return the Taylor step of this order for an orbit and the deviations along the orbit."""
    if variation.orbit.inertial:
        raise ValueError("taylor: found a mass matrix beside deviations along an orbit; expected the identity")
    if not is_analytic(variation.orbit):
        raise ValueError(
            "taylor: found a kink beside deviations along an orbit; expected analytic functions; use rodas5p"
        )
    check_order(order)
    coefficients = dict.fromkeys(c for _, e in variation.matrix for c, _ in variation.parts(e))
    orbit = OrbitWriter(variation.orbit, order, list(coefficients))
    step = orbit.step("shared")
    modes = LANES.function(ModeWriter(variation, orbit).write())
    return TangentStep(step, (COMMON, modes, CARRY), HEAD + len(orbit.slots))


def _register(size: int, k: int) -> Expression:
    """Return the index of register k of the current group of modes; each group has `size` registers."""
    group = Name("which") if size == 1 else size * Name("which")
    return group + k if k else group

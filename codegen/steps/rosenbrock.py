"""The statements of a Rosenbrock step: exact Jacobian, one elimination, and a solve for each stage."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import sympy as sp

from ..program.expressions import ZERO, Expression, Name, Negation, Number, Product, linear, plus
from ..program.lowering import lower
from ..program.statements import Statement, let
from .elimination import Factors, Plan, plan, write_factors, write_solve
from .linearise import entry, linearise, write_bound
from .step import StepWriter

__all__ = ["scales", "stage_state", "time_term", "write_rosenbrock"]

Entries = dict[tuple[int, int], sp.Expr]


def write_rosenbrock(w: StepWriter, note: Callable[[int], None] | None = None) -> None:
    """Write a Rosenbrock step; `note` may write more after each stage."""
    w.opening()
    # (shift - J) k = …; reach = 1/shift, rate = 1/h
    w.put(*scales(w.method.gamma))
    own = linearise(w)
    if w.bounded:
        write_bound(w, own)
    entries = gather(w, own)
    entries = w.mass.at_start(w, entries)
    steps = plan(len(w.state), set(entries) | w.mass.coupled)
    factors = write_factors(steps, entries, tuple(w.state), w.mass.entries)
    w.note(f"factors of {'shift*M - J' if w.mass.entries else 'shift - J'}")
    w.put(*factors.statements)
    places = [(k, i, s) for i, own_places in enumerate(w.equations.places)
              for k, s in zip(own_places, w.equations.node_at(i).state, strict=True)]  # fmt: skip
    slopes = [lower(own[i][f"ft_{s.name}"]) for _, i, s in sorted(places, key=lambda place: place[0])]
    for i in range(w.method.stages):
        stage(w, i, steps, factors, slopes)
        if note is not None:
            note(i)
    finish(w)


def scales(gamma: float) -> tuple[Statement, ...]:
    """The three scales of a step of length h."""
    return let("reach", Name("h") * gamma), let("shift", 1.0 / Name("reach")), let("rate", Name("shift") * gamma)


def gather(w: StepWriter, own: list[dict[str, sp.Expr]]) -> Entries:
    """Entries of the whole Jacobian: those of the nodes by name, plus what the links add."""
    eq = w.equations
    if w.method.inexact:
        w.mass.refuse(f"integrator {w.method.name}")
    entries: Entries = {}
    for i, places in enumerate(eq.places):
        state = eq.node_at(i).state
        for row, r in zip(places, state, strict=True):
            for column, c in zip(places, state, strict=True):
                entries[row, column] = own[i][entry(r, c)]
    node = {k: i for i, places in enumerate(eq.places) for k in places}
    for key, e in eq.link_jacobian():
        if w.method.inexact and node[key[0]] != node[key[1]]:
            continue
        entries[key] = entries.get(key, sp.S.Zero) + e
    return {key: e for key, e in entries.items() if e != 0}


def stage(w: StepWriter, i: int, steps: Plan, factors: Factors, time_slopes: Sequence[Expression]) -> None:
    """Write one stage: state, right-hand side, linear solve."""
    m = w.method
    w.note(f"stage {i + 1}")
    if i > 0:
        for name in w.state:
            w.let(f"u_{name}", stage_state(m.a[i], m.a[i - 1], name))
        w.stage_time(i, first=1)
        w.slopes("u_", "f_")
    rights, results = {}, {}
    sums = {name: linear(m.big_c[i], w.stages(name, i)) for name in w.state} if i > 0 else {}
    known = w.mass.known(w, sums, i)
    for slot, name in enumerate(w.state):
        terms = [known.get(name, Name(f"f_{name}"))]
        if i > 0 and name not in known:
            terms.append(Product((Name("rate"), sums[name])))
        if m.d[i] != 0.0 and time_slopes[slot] != ZERO:
            terms.append(time_term(m.d[i], time_slopes[slot]))
        w.let(f"r_{name}", plus(*terms))
        rights[slot], results[slot] = f"r_{name}", f"k{i + 1}_{name}"
    w.put(*write_solve(steps, factors, rights, results))


def time_term(weight: float, slope: Expression) -> Expression:
    """weight * h * slope with its sign in front."""
    if isinstance(slope, Negation):
        weight, slope = -weight, slope.value
    term = Product((Number(abs(weight)), Name("h"), slope))
    return Negation(term) if weight < 0 else term


def stage_state(row: Sequence[float], previous: Sequence[float], name: str) -> Expression:
    """y + sum a_j k_j, written as the previous stage's state plus its increment where the rows allow that."""
    names = [f"k{j + 1}_{name}" for j in range(len(row))]
    if len(previous) > 0 and tuple(row) == (*previous, 1.0):
        return Name(f"u_{name}") + names[-1]
    return linear(row, names, name)


def finish(w: StepWriter) -> None:
    """Write the new state, the error and the dense output."""
    m = w.method
    w.note("new state and error")
    for name in w.state:
        w.let(f"n_{name}", stage_state(m.b, m.a[-1], name))
    with w.only_if("DENSE"):
        w.dense()
    w.closing([linear(m.e[0], w.stages(name, m.stages)) for name in w.state])

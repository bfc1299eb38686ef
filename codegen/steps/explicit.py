"""The statements of an explicit Runge-Kutta step."""

from __future__ import annotations

from ..program.expressions import Expression, Name, Product, call, linear
from .linearise import linearise, write_bound
from .step import StepWriter

__all__ = ["write_explicit"]


def write_explicit(w: StepWriter) -> None:
    """Write an explicit step; stages that serve the dense output alone run if DENSE."""
    m = w.method
    w.opening()
    for i in range(m.stages):
        stage(w, i)
    w.note("new state and error")
    errors = []
    for name in w.state:
        column = w.stages(name, m.stages)
        w.let(f"n_{name}", Name(name) + scaled(linear(m.b, column)))
        errors.append(error(w, name, [linear(row, column) for row in m.e]))
    with w.only_if("DENSE"):
        for i in range(m.stages, len(m.c)):
            stage(w, i)
        w.dense(Name("h"))
    w.closing(errors)


def scaled(increment: Expression) -> Expression:
    """The step length times a sum of rates."""
    return Product((Name("h"), increment))


def error(w: StepWriter, name: str, parts: list[Expression]) -> Expression:
    """The error estimate of one state variable, from one or two embedded methods."""
    if len(parts) == 1:
        return scaled(parts[0])
    e5, e3, h = Name("e5"), Name("e3"), Name("h")
    w.let("e5", parts[0])
    w.let("e3", parts[1])
    # the smallest normal double keeps 0/0 away where both estimates vanish
    size = call("sqrt", e5 * e5 + 0.01 * (Product((e3, e3))) + 2.2250738585072014e-308)
    w.let(f"e_{name}", h * e5 * call("absolute", e5) / size)
    return Name(f"e_{name}")


def stage(w: StepWriter, i: int) -> None:
    """Write one explicit stage; a row of `a` equal to `b` is the new state itself."""
    m = w.method
    w.note(f"stage {i + 1}")
    if i == 0 and w.bounded:
        write_bound(w, linearise(w))
        for name in w.state:
            w.let(f"k1_{name}", f"f_{name}")
        return
    for name in w.state if i else ():
        known = i >= m.stages and m.a[i] == m.b
        w.let(f"u_{name}", f"n_{name}" if known else Name(name) + scaled(linear(m.a[i], w.stages(name, i))))
    w.stage_time(i, first=0)
    prefix = "u_" if i else ""
    w.slopes(prefix, f"k{i + 1}_")
    w.mass.explicit(w, prefix, f"k{i + 1}_", first=i == 0)

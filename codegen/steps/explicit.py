"""The statements of an explicit Runge-Kutta step."""

from __future__ import annotations

from .linearise import linearise, write_bound
from .step import StepWriter, combine, indent_from

__all__ = ["write_explicit"]


def write_explicit(w: StepWriter) -> list[str]:
    """Return all statements of an explicit step; stages that serve the dense output alone stand under ``if DENSE``."""
    m = w.method
    w.opening()
    for i in range(m.stages):
        stage(w, i)
    w.put("# new state and error")
    errors = []
    for name in w.state:
        column = w.stages(name, m.stages)
        w.put(f"n_{name} = {name} + h*({combine(m.b, column)})")
        errors.append(error(w, name, [combine(row, column) for row in m.e]))
    w.put("if DENSE:")
    with indent_from(w):
        for i in range(m.stages, len(m.c)):
            stage(w, i)
        w.dense("h*")
    w.closing(errors)
    return w.lines


def error(w: StepWriter, name: str, parts: list[str]) -> str:
    """The error estimate of one state variable, from one or two embedded methods."""
    if len(parts) == 1:
        return f"h*({parts[0]})"
    w.put(f"e5 = {parts[0]}", f"e3 = {parts[1]}")
    # the smallest normal double keeps 0/0 away where both estimates vanish
    w.put(f"e_{name} = h*e5*absolute(e5)/sqrt(e5*e5 + 0.01*(e3*e3) + 2.2250738585072014e-308)")
    return f"e_{name}"


def stage(w: StepWriter, i: int) -> None:
    """Write one explicit stage; a row of `a` equal to `b` is the new state itself."""
    m = w.method
    w.put(f"# stage {i + 1}")
    if i == 0 and w.bounded:
        write_bound(w, linearise(w))
        w.put(*(f"k1_{name} = f_{name}" for name in w.state))
        return
    for name in w.state if i else ():
        w.put(f"u_{name} = " + (f"n_{name}" if i >= m.stages and m.a[i] == m.b else
                                f"{name} + h*({combine(m.a[i], w.stages(name, i))})"))  # fmt: skip
    w.stage_time(i, first=0)
    prefix = "u_" if i else ""
    w.slopes(prefix, f"k{i + 1}_")
    w.mass.explicit(w, prefix, f"k{i + 1}_", first=i == 0)

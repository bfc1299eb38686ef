"""Hard cases of models said in place: series that hide, powers, kinks, drives, links, masses, units
and singularities, each with three methods.
"""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from synchain.models.definitions.inline import Field, Lagrangian
from synchain.models.graphs.families import topology
from synchain.models.interactions.ends import ends
from synchain.models.interactions.interaction import Potential, Rates
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.oscillator import Oscillator
from synchain.models.scenes.scene import Scene

X, V, A = sp.symbols("x v a", real=True)
SMOOTH = ("taylor", "dop853", "rodas5p")
DIGITS = (2, 4, 8, 12, 14)

FIELDS: dict[str, tuple[dict[sp.Symbol, sp.Expr], tuple[float, ...]]] = {
    "pulses of a phase": ({A: sp.S.One, X: sp.exp(200 * (sp.cos(A) - 1)) - X / 10}, (1.0, 0.0)),
    "soft wall": ({X: V, V: sp.exp(-50 * X)}, (3.0, -1.0)),
    "x'' = -x^5": ({X: V, V: -(X**5)}, (0.0, 1.0)),
    "x'' = -x^6 sign x": ({X: V, V: -(X**5) * sp.Abs(X)}, (0.0, 1.0)),
    "pulse of time": ({X: V, V: -X + sp.exp(-10 * (TIME - 4) ** 2)}, (0.0, 0.0)),
    "comb of time": ({X: (1 - sp.cos(TIME)) ** 10 / 100}, (0.0,)),
    "switched on": ({X: V, V: -X - V / 5 + (1 + sp.tanh(10 * (TIME - 3))) / 2}, (0.0, 0.0)),
    "spring of two slopes": ({X: V, V: -X - 9 * sp.Max(X, 0) + sp.cos(TIME) / 2}, (0.0, 1.0)),
    "backlash": ({X: V, V: -sp.Max(0, X - 1) - sp.Min(0, X + 1)}, (0.0, 1.0)),
    "gate of a phase": ({A: sp.S.One, X: sp.Max(0, sp.sin(A) - sp.Rational(9, 10))}, (0.0, 0.0)),
    "roots and powers": ({X: V, V: -X / (1 + X**2) ** sp.Rational(3, 2)}, (1.0, 0.0)),
    "at rest": ({X: V, V: -sp.sin(X)}, (0.0, 0.0)),
    "Lorenz": ({X: 10 * (V - X), V: X * (28 - A) - V, A: X * V - sp.Rational(8, 3) * A}, (1.0, 1.0, 1.0)),
}
"""Name -> rates and start of a single node."""

LENGTH = 6.0
"""Length of a run in non-dimensional time."""

SINGULAR: dict[str, tuple[dict[sp.Symbol, sp.Expr], tuple[float, ...]]] = {
    "x' = x^2": ({X: X**2}, (1.0,)),
    "x' = exp x": ({X: sp.exp(X)}, (0.0,)),
    "x' = -sqrt x": ({X: -sp.sqrt(X)}, (1.0,)),
    "x' = -1/x": ({X: -1 / X}, (1.0,)),
    "x'' = -1/x^2": ({X: V, V: -1 / X**2}, (1.0, 0.0)),
    "log x through 0": ({X: -sp.S.One, V: sp.log(X)}, (1.0, 0.0)),
    "log x below 0": ({X: sp.log(X)}, (-1.0,)),
}
"""The same without an end state: the motion ends in a singularity before the window does."""

STATES = (1e-150, 1e-30, 1e-6, 1e6, 1e12)
TIMES = (1e-12, 1e-6, 1e6)


def said(quick: bool) -> Iterator[tuple[str, str, Scene, str]]:
    """Yield group, name, scene and the name of the reference of each case."""
    for name, (rates, start) in FIELDS.items():
        node = Field(rates)
        length = 2.0 if name == "Lorenz" else LENGTH
        initial: dict[str, object] = {s.name: a for s, a in zip(rates, start, strict=True)}
        for method in SMOOTH[:1] if quick else SMOOTH:
            for digits in DIGITS if method == "taylor" and not quick else (8,):
                yield "said", f"{name}, {method}", _scene(node, method, length, initial, rtol=10.0**-digits), "explicit"
    for name, (rates, start) in {} if quick else SINGULAR.items():
        initial = {s.name: a for s, a in zip(rates, start, strict=True)}
        for method in SMOOTH:
            yield "singular", f"{name}, {method}", _scene(Field(rates), method, 3.0, initial), "none"
    yield from _linked(quick)
    yield from () if quick else _scaled()


def _scene(node: Oscillator, method: str, length: float, initial: dict[str, object], **more: object) -> Scene:
    given: dict[str, object] = {
        "coupling": None, "topology": topology("chain", 1), "record": (), "time_unit": "time", "transient": 0.0,
        "integrator": method, "window": length, "max_steps": 2_000_000, "initial": initial,
    }  # fmt: skip
    return Scene(node, **{**given, **more})  # type: ignore[arg-type]


def _linked(quick: bool) -> Iterator[tuple[str, str, Scene, str]]:
    """Links said as rates and as a potential, and a pendulum of four links with its mass matrix."""
    phase = Field({A: sp.S.One})
    i, j, weight = ends(phase)
    lagging = Rates({i.a: weight * sp.sin(j.a - i.a - sp.Rational(1, 2)) + sp.exp(20 * (sp.cos(j.a) - 1))})
    y, w = sp.symbols("y w", real=True)
    body = Lagrangian((V**2 + w**2) / 2, coordinates={X: V, y: w})
    here, there, share = ends(body)
    apart = sp.sqrt((here.x - there.x) ** 2 + (here.y - there.y) ** 2)
    morse = Potential(share * (1 - sp.exp(1 - apart)) ** 2)
    for method in SMOOTH[:1] if quick else SMOOTH:
        start: dict[str, object] = {"a": (0.0, 0.5, 1.5, 3.0)}
        ring = _scene(phase, method, LENGTH, start, coupling=lagging, topology=topology("ring", 4))
        yield "links", f"phases with pulses, {method}", ring, "explicit"
        start = {"x": (0.0, 1.5, 0.3), "y": (0.0, 0.2, 1.1), "v": (0.1, 0.0, 0.0), "w": 0.0}
        bodies = _scene(body, method, LENGTH, start, coupling=morse, topology=topology("complete", 3))
        yield "links", f"three bodies, {method}", bodies, "explicit"
        yield "masses", f"pendulum of four links, {method}", _pendulum(4, method), "explicit"


def _pendulum(links: int, method: str) -> Scene:
    """Links of length and mass one in a row, from unequal angles."""
    q, w = sp.symbols(f"q1:{links + 1}", real=True), sp.symbols(f"w1:{links + 1}", real=True)
    hanging = {(a, b): links - max(a, b) for a in range(links) for b in range(links)}
    kinetic = sum(m * w[a] * w[b] * sp.cos(q[a] - q[b]) for (a, b), m in hanging.items()) / 2
    potential = -sum((links - a) * sp.cos(q[a]) for a in range(links))
    node = Lagrangian(kinetic, potential, coordinates=dict(zip(q, w, strict=True)))
    start: dict[str, object] = {f"q{a + 1}": 0.5 + 0.1 * a for a in range(links)} | {s.name: 0.0 for s in w}
    return _scene(node, method, 2.0, start)


def _scaled() -> Iterator[tuple[str, str, Scene, str]]:
    """A Duffing oscillator in other units of its state and of time."""
    k, w = sp.symbols("k w", real=True)
    node = Field({X: w * V, V: -w * X - w * k * X**3}, parameters={"k": 1, "w": 1})
    for method in SMOOTH:
        for size in STATES:
            given = {"parameters": {"k": min(1.0 / size / size, 1e200)}, "atol": min(1e-9 * size, 0.1)}
            yield (
                "units",
                f"states of {size:g}, {method}",
                _scene(node, method, LENGTH, {"x": size, "v": 0.0}, **given),
                "explicit",
            )
        for pace in TIMES:
            given = {"parameters": {"w": 1.0 / pace}}
            yield (
                "units",
                f"times of {pace:g}, {method}",
                _scene(node, method, LENGTH * pace, {"x": 1.0, "v": 0.0}, **given),
                "explicit",
            )

"""Random scenes with events against an event code in NumPy and SciPy (hybrid_reference.py).

Nodes have contacts on coupled coordinates, stops, resets and sliding surfaces, alone and in chains and rings.  A structure is
the number that draws it, and each of its scenes has other parameters and another start: `check(12, 3)` repeats a finding.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hybrid_reference import TIME, Endless, Motion, Row, System, Undetermined

import synchain as sc
from synchain.results import Status

INTEGRATORS = ("taylor", "dop853", "rodas5p")
W = sp.Symbol("w", real=True)
P = sp.Symbol("p", real=True)
"""A parameter that differs from node to node, a constant force or input."""


class Pick:
    """Choices of a structure, and the parameters that they introduce, with functions that draw their values."""

    def __init__(self, seed: int):
        self.random = np.random.default_rng(seed)
        self.ranges: dict[sp.Symbol, Callable[[np.random.Generator], float]] = {}

    def parameter(self, draw: Callable[[np.random.Generator], float]) -> sp.Symbol:
        symbol = sp.Symbol(f"a{len(self.ranges)}", real=True)
        self.ranges[symbol] = draw
        return symbol

    def used(self, expressions: Sequence[Any]) -> dict[sp.Symbol, float]:
        """Return a default of each parameter in the expressions."""
        symbols = set().union(*(sp.sympify(e).free_symbols for e in expressions))
        random = np.random.default_rng(0)
        return {s: self.ranges[s](random) if s in self.ranges else 0.0 for s in (P, *self.ranges) if s in symbols}

    def choice(self, options: Sequence[Any]) -> Any:
        return options[int(self.random.integers(len(options)))]


@dataclass
class Drawn:
    """A node: the model, and its states, masses, forces and rows for the reference; `spreads`: of each state at the start."""

    model: Any
    state: list[sp.Symbol]
    mass: sp.Matrix
    force: list[sp.Expr]
    rows: list[Row]
    spreads: list[float]
    coordinates: int = 0  # 0 for a field


@dataclass
class Structure:
    """A scene, the system of the reference, and the functions that draw the values of its parameters."""

    scene: sc.Scene
    system: System
    ranges: dict[sp.Symbol, Callable[[np.random.Generator], float]]
    node: Drawn


def number(pick: Pick, low: float, high: float) -> sp.Symbol:
    """A parameter with two digits behind the point."""
    return pick.parameter(lambda random: round(float(random.uniform(low, high)), 2))


def sign(pick: Pick) -> int:
    return int(pick.choice([-1, 1]))


def maybe(pick: Pick, share: float) -> bool:
    return bool(pick.random.random() < share)


def wave(pick: Pick, low: float = 0.2, high: float = 1.2) -> sp.Expr:
    return sign(pick) * number(pick, low, high) * sp.cos(number(pick, 0.5, 2.0) * TIME + number(pick, 0.0, 3.0))


# -- nodes ---------------------------------------------------------------------------------------------------


def masses(pick: Pick, q: Sequence[sp.Symbol]) -> sp.Matrix:
    """A positive definite matrix, constant or dependent on places."""
    n = len(q)
    if n == 1:
        return sp.Matrix([[1 + (number(pick, 0.1, 0.6) * sp.cos(q[0]) if maybe(pick, 0.3) else 0)]])
    kind = int(pick.random.integers(3))
    if kind == 0:
        return sp.diag(*(number(pick, 0.3, 2.0) for _ in q))
    m = sp.diag(*(number(pick, 1.0, 2.0) for _ in q))
    b = number(pick, 0.1, 0.6)
    m[0, 1] = m[1, 0] = b * (sp.cos(q[1]) if kind == 1 else 1)
    if n == 3 and maybe(pick, 0.5):
        m[1, 2] = m[2, 1] = number(pick, 0.1, 0.3)
    return m


def friction_law(pick: Pick) -> tuple[sp.Expr, sp.Expr | None]:
    """Coefficient in slip of |w| = W, and the static one."""
    mu = number(pick, 0.2, 0.9)
    kind = int(pick.random.integers(5))
    if kind <= 1:
        return mu, None
    if kind == 2:
        return mu, mu * number(pick, 1.05, 1.6)
    if kind == 3:
        return mu * (1 + number(pick, 0.1, 0.8) * sp.exp(-number(pick, 0.5, 4.0) * W)), None
    return mu * (1 + number(pick, 0.1, 0.5) * W), None


def contact(pick: Pick, q: Sequence[sp.Symbol], v: Sequence[sp.Symbol]) -> tuple[sp.Expr, sp.Expr]:
    """Sliding velocity and load."""
    ground = [sp.S.Zero, sign(pick) * number(pick, 0.1, 0.5), wave(pick, 0.1, 0.6)][int(pick.random.integers(3))]
    k = int(pick.random.integers(len(q)))
    along = v[k]
    if len(q) > 1 and maybe(pick, 0.4):
        along += sign(pick) * number(pick, 0.2, 1.0) * v[(k + 1) % len(q)]
    elif maybe(pick, 0.15):
        along *= 1 + sp.cos(q[k]) / 2
    elif maybe(pick, 0.06):
        along *= sp.sin(q[k])
    x = q[int(pick.random.integers(len(q)))]
    load = [sp.S.One, 1 + sp.cos(number(pick, 0.5, 2.0) * TIME) / 2, 1 + x**2 / 3][int(pick.choice([0, 0, 1, 2]))]
    return ground - along, load


def stop(pick: Pick, q: Sequence[sp.Symbol]) -> sp.Expr:
    """A gap that is open at the start, where places are within 0.3."""
    k, c = int(pick.random.integers(len(q))), number(pick, 0.4, 0.9)
    kind = int(pick.random.integers(5))
    if kind == 0 and len(q) > 1:
        return c + sign(pick) * (q[k] - q[(k + 1) % len(q)]) / 2
    if kind == 1:
        return c + sign(pick) * q[k] - sp.sin(number(pick, 0.5, 3.0) * TIME) / 20
    if kind == 2 and maybe(pick, 0.5):
        return c**2 - q[k] ** 2
    return c + sign(pick) * q[k]


def mechanical(pick: Pick) -> Drawn:
    """One to three coordinates with one to three contacts and stops."""
    n = int(pick.choice([1, 1, 2, 2, 3]))
    q, v = list(sp.symbols("x y z", real=True))[:n], list(sp.symbols("v u r", real=True))[:n]
    m = masses(pick, q)
    T = sp.expand((sp.Matrix(v).T * m * sp.Matrix(v))[0] / 2)
    V = sp.Add(*(number(pick, 0.3, 1.5) * (s**2 / 2 if maybe(pick, 0.7) else 1 - sp.cos(s)) for s in q))
    if maybe(pick, 0.3):
        V += number(pick, 0.1, 0.5) * q[0] ** 4 / 4
    Q = {s: -number(pick, 0.0, 0.3) * w for s, w in zip(q, v, strict=True)}
    Q[q[0]] += P + wave(pick)
    if n > 1 and maybe(pick, 0.5):
        Q[q[1]] += wave(pick)
    # The equations of motion: M a = Q - grad V - dM/dt v + grad T.
    turning = sum((m.diff(s) * w for s, w in zip(q, v, strict=True)), sp.zeros(n)) * sp.Matrix(v)
    force = [Q[s] - V.diff(s) - turning[k] + T.diff(s) for k, s in enumerate(q)]
    events, rows, written = [], [], dict(Q)
    common, shared = friction_law(pick), None
    for _ in range(int(pick.choice([1, 1, 2, 2, 3]))):
        if maybe(pick, 0.6):
            sliding, load = contact(pick, q, v)
            as_force = maybe(pick, 0.5)
            moving, static = common if as_force else friction_law(pick)
            mode = sp.Dummy("s", real=True)
            at_rest = moving.xreplace({W: sp.S.Zero})
            text = str(sp.sign(W) * moving.xreplace({W: sp.Abs(W)})).replace("Abs", "abs")
            # values above 1: the default of static friction, a product, is then above that of slow slip
            used = {s: 1.5 for s in (moving.free_symbols | sp.sympify(static or 0).free_symbols) - {W}}
            law = sc.friction_law(text, used, static=None if static is None else str(static))
            pull = [-load * sliding.diff(w) for w in v]
            size = moving.xreplace({W: mode * sliding})
            ratio = sp.S.One if static is None else static / at_rest
            rows.append(Row("sign", sliding, (*[sp.S.Zero] * n, *(e * size for e in pull)), ratio, mode))
            if as_force:
                shared = law
                for s, e in zip(q, pull, strict=True):
                    written[s] += e * sc.friction(sliding)
                events.append(None)
            else:
                events.append(sc.Friction(sliding, load, law))
        else:
            gap, e = (
                stop(pick, q),
                pick.parameter(lambda random: float(random.choice([0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1]))),
            )
            rows.append(Row("stop", gap, ratio=e))
            events.append(sc.Stop(gap, e))
    # Contacts that are written as forces come first, in the order of the forces.
    order = [k for k, e in enumerate(events) if e is None] + [k for k, e in enumerate(events) if e is not None]
    more = {"friction": shared} if shared else {}
    if any(row.law == "sign" for row in rows):
        more["contact"] = "set-valued"
    acting = [e for event in events if event is not None for e in event.expressions]
    model = sc.Lagrangian(T, V, written, coordinates=dict(zip(q, v, strict=True)), parameters=pick.used([T, V, *written.values(), *acting]),
                          events=[e for e in events if e is not None], **more)  # fmt: skip
    return Drawn(model, q + v, sp.diag(sp.eye(n), m), [*v, *force], [rows[k] for k in order], [0.3] * n + [1.0] * n, n)


def sliding(pick: Pick) -> Drawn:
    """A field of two or three states with one to three surfaces."""
    n = int(pick.choice([2, 2, 3]))
    z = list(sp.symbols("x y z", real=True))[:n]
    rates = []
    for k, s in enumerate(z):
        other = z[(k + 1) % n]
        e = -number(pick, 0.1, 0.8) * s + sign(pick) * number(pick, 0.3, 1.5) * (
            other if maybe(pick, 0.6) else sp.sin(other)
        )
        rates.append(e + (wave(pick) if maybe(pick, 0.5) else 0))
    rates[0] += P
    rows, whole = [], list(rates)
    for _ in range(int(pick.choice([1, 1, 2, 3]))):
        a, b = pick.random.permutation(n)[:2]
        level = (
            z[a]
            + [
                0,
                0,
                sign(pick) * number(pick, 0.2, 1.0) * z[b],
                z[b] ** 2 / 4,
                -number(pick, 0.1, 0.5),
                -wave(pick, 0.1, 0.5),
            ][int(pick.random.integers(6))]
        )
        push = [sp.S.Zero] * n
        push[a] = -number(pick, 0.4, 1.5) * (1 + (z[b] ** 2 / 4 if maybe(pick, 0.3) else 0))
        if maybe(pick, 0.5):
            push[b] = sign(pick) * number(pick, 0.1, 0.8)
        if maybe(pick, 0.1):
            push[a] = -push[a]
        form = int(pick.random.integers(4))
        factor = {0: sp.sign(level), 1: sp.exp(sp.sign(level)), 2: sp.Piecewise((1, level > 0), (-1, True))}.get(
            form, sp.sign(level)
        )
        if form == 1:  # exp(s) = cosh(1) + s sinh(1)
            whole = [f + g * factor for f, g in zip(whole, push, strict=True)]
            rates = [f + g * sp.cosh(1) for f, g in zip(rates, push, strict=True)]
            push = [g * sp.sinh(1) for g in push]
        else:
            whole = [f + g * factor for f, g in zip(whole, push, strict=True)]
        rows.append(Row("sign", level, tuple(push)))
    model = sc.Field(dict(zip(z, whole, strict=True)), contact="set-valued", parameters=pick.used(whole))
    return Drawn(model, z, sp.eye(n), rates, rows, [1.0] * n)


def firing(pick: Pick) -> Drawn:
    """A neuron that is reset: linear or quadratic with adaptation."""
    V, U = sp.symbols("V U", real=True)
    drive = P + number(pick, 1.1, 2.0) + (wave(pick, 0.1, 0.6) if maybe(pick, 0.5) else 0)
    if maybe(pick, 0.5):
        rates, sets, guard, state = [drive - V], {V: -number(pick, 0.0, 0.5)}, V - 1, [V]
    else:
        rates = [drive + V**2 / 2 - U, number(pick, 0.1, 0.5) * (number(pick, 0.1, 0.8) * V - U)]
        sets, guard, state = (
            {V: -number(pick, 0.2, 1.0), U: U + number(pick, 0.1, 0.6)},
            V - number(pick, 2.0, 4.0),
            [V, U],
        )
    row = Row("reset", guard, sets=tuple((state.index(s), sp.sympify(e)) for s, e in sets.items()))
    model = sc.Field(
        dict(zip(state, rates, strict=True)),
        events=[sc.Reset(guard, sets)],
        parameters=pick.used([*rates, guard, *sets.values()]),
    )
    return Drawn(model, state, sp.eye(len(state)), rates, [row], [0.8] * len(state))


# -- networks ------------------------------------------------------------------------------------------------

JOINED = 20
"""Structures from this one on have contacts and stops in their links."""

LINK = 99
"""Owner of the rows of links."""


@functools.lru_cache(maxsize=4)
def structure(seed: int) -> Structure:
    """The model, links and graph that a number draws."""
    pick, joined = Pick(seed), seed >= JOINED
    node = (
        mechanical(pick)
        if joined
        else pick.choice([mechanical, mechanical, mechanical, sliding, sliding, firing])(pick)
    )
    heavy = len(node.rows) * len(node.state) > 6
    n = pick.choice([2, 2, 3] if joined else [1, 1, 1, 2, 3] if heavy else [1, 2, 3, 4, 9])
    closed = n > 2 and not joined and maybe(pick, 0.5)
    pairs = [(i, i + 1) for i in range(n - 1)] + ([(0, n - 1)] if closed else [])
    d, rate = len(node.state), sp.Symbol("k", real=True)
    linked = int(pick.random.integers(node.coordinates or d))
    name = node.state[linked].name
    load, bounce = (number(pick, *span) for span in ((0.05, 0.6), (0.2, 1.0)))
    rubs, stops = joined and maybe(pick, 0.7), joined and maybe(pick, 0.5)
    static = sp.Rational(6, 5) if seed % 2 else sp.S.One
    if node.coordinates:
        speed = node.state[target := linked + node.coordinates].name
        law = sc.friction_law("sign(w)", static=str(static)) if static > 1 else sc.friction_law("sign(w)")
        of_link: list[Any] = [sc.Friction(f"{speed}_j - {speed}_i", load, law)] if rubs else []
        of_link += [sc.Stop(f"{name}_j - {name}_i + 3/5", bounce)] if stops else []
        numbers = {"k": 0, **{s.name: 0.5 for s, used in ((load, rubs), (bounce, stops)) if used}}
        link: Any = sc.Potential(f"k*W*({name}_i - {name}_j)**2/2", numbers, events=of_link)
    else:
        link = sc.Rates({name: f"k*W*({name}_j - {name}_i)"}, {"k": 0})
    target = linked + node.coordinates  # the force of a spring acts on the velocity
    states = [[sp.Symbol(f"{s.name}_{i}", real=True) for s in node.state] for i in range(n)]
    inputs = [sp.Symbol(f"p_{i}", real=True) for i in range(n)]
    force, rows, blocks = list[sp.Expr](), list[Row](), []
    for i, own in enumerate(states):
        here = dict(zip(node.state, own, strict=True)) | {P: inputs[i]}
        local = [e.xreplace(here) for e in map(sp.sympify, node.force)]
        for a, b in pairs:
            if i in (a, b):
                local[target] += rate * (states[b][linked] - states[a][linked]) * (1 if i == a else -1)
        force += local
        blocks.append(node.mass.xreplace(here))
        for k, row in enumerate(node.rows):
            mode = sp.Dummy("s", real=True)
            push = [sp.S.Zero] * (n * d)
            for c, e in enumerate(row.push):
                push[i * d + c] = sp.sympify(e).xreplace(here | {row.mode: mode})
            sets = tuple((i * d + c, e.xreplace(here)) for c, e in row.sets)
            rows.append(Row(row.law, row.level.xreplace(here), tuple(push) if row.push else (), row.ratio, mode, sets, (i, k)))  # fmt: skip
    for i, j in pairs:
        ends = [(j, 1), (i, -1)]  # the speed and the gap of a link are those of its second end less those of its first
        if rubs:
            push = [sp.S.Zero] * (n * d)
            for m, side in ends:
                push[m * d + target] = -side * load
            rows.append(
                Row(
                    "sign",
                    sp.Add(*(side * states[m][target] for m, side in ends)),
                    tuple(push),
                    static,
                    owner=(LINK, 0),
                )
            )
        if stops:
            gap = sp.Add(sp.Rational(3, 5), *(side * states[m][linked] for m, side in ends))
            rows.append(Row("stop", gap, ratio=bounce, owner=(LINK, 1)))
    table = [
        *force,
        *(e for block in blocks for e in block),
        *(e for row in rows for e in (row.level, row.ratio, *row.push)),
    ]
    table += [e for row in rows for _, e in row.sets]
    symbols = set().union(*(sp.sympify(e).free_symbols for e in table))
    ranges = {s: draw for s, draw in pick.ranges.items() if s in symbols}
    system = System([s for own in states for s in own], sp.diag(*blocks), force, rows, [*ranges, rate, *inputs])
    scene = sc.Scene(
        node.model, link if n > 1 else None, (sc.graphs.ring if closed else sc.graphs.chain)(n), record=("events",),
        transient=0, time_unit="time", window=1, max_steps=400_000, integrator=INTEGRATORS[(0, 1, 0, 1, 2)[seed % 5]],
    )  # fmt: skip
    return Structure(scene, system, ranges, node)


def drawn(seed: int, number: int) -> tuple[sc.Scene, System, np.ndarray]:
    """A scene of a structure, and the system and start of the reference, node after node."""
    given, random = structure(seed), np.random.default_rng([seed, number])
    node, n = given.node, given.scene.n
    values = {s.name: draw(random) for s, draw in given.ranges.items()}
    values["k"] = round(float(random.uniform(0.1, 0.6)), 2)
    equal = random.random() < 0.25
    inputs = np.round(random.uniform(-0.2, 0.2, 1 if equal else n), 2)
    start = np.round(random.uniform(-1, 1, (1 if equal else n, len(node.state))) * node.spreads, 2)
    if node.coordinates and random.random() < 0.25:
        start[:, node.coordinates :] = 0.0
    inputs, start = np.broadcast_to(inputs, n), np.broadcast_to(start, (n, len(node.state)))
    given.system.values = [*values.values(), *inputs]
    rtol = float(random.choice([1e-6, 1e-9, 1e-12]))
    if n == 1:
        del values["k"]
    scene = given.scene.replace(
        parameters={**values, "p": inputs.tolist() if n > 1 else float(inputs[0])}, rtol=rtol, atol=rtol / 10,
        initial={s.name: start[:, c].tolist() for c, s in enumerate(node.state)}, window=float(random.choice([3.0, 6.0, 10.0])),
    )  # fmt: skip
    return scene, given.system, np.array(start).ravel()


# -- comparison ----------------------------------------------------------------------------------------------

STRUCTURES, DRAWS = 25, 12
"""Structures, and scenes of each: 300 scenes."""
QUICK = [(0, 1), (0, 5), (2, 2)]
"""Scenes of every run of the tests."""
REFERENCE = 1e-10
"""Error of the reference, times the growth of a small change."""


def motion(system: System, start: np.ndarray, window: float, rtol: float, longest: float) -> Motion | None:
    """The motion by the reference; None where it gives up."""
    try:
        return Motion(system, start, rtol, longest).run(window)
    except (Endless, Undetermined, ArithmeticError, ValueError):
        return None


def check(seed: int, number: int) -> tuple[str, str]:
    """What became of a scene, and in words: right, WRONG, refused, a status, or nothing to compare."""
    scene, system, start = drawn(seed, number)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = sc.run(scene, show_progress=False, workers=1)
    except (ValueError, TypeError) as refused:
        return ("refused" if "\n" not in str(refused) else "WRONG"), str(refused)
    status = Status(int(result.status))
    if status != Status.FINISHED:
        return "status", status.name
    right = motion(system, start, scene.window, 1e-12, 0.1)
    if right is None:
        return "no reference", "the reference gives up"
    moved = motion(system, start + 1e-7 * np.random.default_rng(seed).normal(size=len(start)), scene.window, 1e-12, 0.1)
    if moved is None:
        return "no reference", "the reference gives up near the start"
    size = max(1.0, float(np.abs(right.z).max()))
    growth = max(1.0, 1e7 * float(np.abs(moved.z - right.z).max()))
    allowed = (30 * scene.rtol + REFERENCE) * size * growth
    if not allowed < 1e-2 * size:
        return "sensitive", f"growth {growth:.3g}, allowed {allowed:.3g}"
    n, d = scene.n, len(start) // scene.n
    end = result.states("end")
    error = float(np.abs(end[[c * n + i for i in range(n) for c in range(d)]] - right.z).max())
    words = f"{scene.integrator}, rtol = {scene.rtol:g}, error {error:.3g} of {allowed:.3g}, {len(right.events)} events"
    if not error <= allowed:
        return "WRONG", words
    # Modes and the record of events, where no event is close to the end and stops close at times of their own.
    if any(row.law == "stop" for row in system.rows):
        return "right", words
    count, table = int(result.events.event_count), result.events
    columns = [table[f"event_{name}"].values.ravel()[:count] for name in ("time", "node", "row", "before", "after")]
    owners = [system.rows[k].owner for _, k, _, _ in right.events]
    if not structure(seed).node.coordinates:  # the package sorts the surfaces of a field
        owners, columns[2] = [(i, 0) for i, _ in owners], np.ones(count)
    times = [t for t, *_ in right.events]
    late = float(abs(np.sort(times) - np.sort(columns[0])).max(initial=0.0)) if len(times) == count else np.inf
    mine = [(i + 1, a + 1, abs(old), abs(new)) for (_, _, old, new), (i, a) in zip(right.events, owners, strict=True)]
    in_links = columns[2] > len(
        structure(seed).node.rows
    )  # after the rows of the link's source; stops are not compared
    columns[1], columns[2] = np.where(in_links, LINK + 1, columns[1]), np.where(in_links, 1, columns[2])
    theirs = [tuple(map(int, map(abs, each))) for each in zip(*columns[1:], strict=True)]
    same = sorted(mine) == sorted(theirs) and late < 1e3 * allowed + 1e-9
    return ("right" if same else "EVENTS"), f"{words}, {count} recorded, late by {late:.3g}"


def wrong(scenes: Iterable[tuple[int, int]]) -> list[str]:
    """Return a line for each scene that is silently wrong; fail if fewer than two thirds could be compared."""
    verdicts = {scene: check(*scene) for scene in scenes}
    right = sum(verdict == "right" for verdict, _ in verdicts.values())
    assert 3 * right >= 2 * len(verdicts)
    return [
        f"check{scene}: {verdict}: {words}"
        for scene, (verdict, words) in verdicts.items()
        if verdict in ("WRONG", "EVENTS")
    ]


def test_some_random_scenes_with_events() -> None:
    assert not wrong(QUICK)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(STRUCTURES))
def test_random_scenes_with_events(seed: int) -> None:
    assert not wrong((seed, number) for number in range(DRAWS))

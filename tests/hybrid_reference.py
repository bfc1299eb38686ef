"""Motions with contacts, stops, resets and sliding computed a second way: SciPy's DOP853, dense output, enumeration.

A system is M dz/dt = F + sum P_k x_k with rows k, and shares no text with the package.  The mass matrix is a number at
each evaluation, and all rows of a network stand in one linear system.  A row is

sign    x = sign(h) off the level h = 0; on it x makes dh/dt = 0, as long as |x| <= ratio
stop    x = 0 while the gap is open; a closed stop has the pressure x >= 0 that makes d2(gap)/dt2 = 0
reset   states are set where a guard passes zero upwards
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

TIME = sp.Symbol("t", real=True)
NEAR = 1e-10
"""Gaps of at most this size close together."""
LOOKS = np.concatenate([np.geomspace(1e-6, 0.03, 7), np.linspace(0.05, 1.0, 16)])
"""Fractions of a step at which gaps are computed; the first ones see short flights."""
ROUNDING = 3e-15
"""A gap of at most this size may have either sign."""
MOST = 3000
"""Most events of a motion."""


class Undetermined(Exception):
    """Several sets of held rows agree with the laws, or none does."""


class Endless(Exception):
    """More than `MOST` events."""


@dataclass(frozen=True)
class Row:
    """A row in the symbols of all states; `push` may depend on its sign `mode`, 0 at rest."""

    law: str
    level: sp.Expr
    push: tuple[sp.Expr, ...] = ()
    ratio: sp.Expr = sp.S.One  # sign: static over kinetic friction; stop: restitution
    mode: sp.Symbol = field(default_factory=lambda: sp.Dummy("s", real=True))
    sets: tuple[tuple[int, sp.Expr], ...] = ()
    owner: tuple[int, int] = (0, 0)  # node and number of the row, as the package counts them


class System:
    """The numbers of a system at a state."""

    def __init__(
        self,
        state: Sequence[sp.Symbol],
        mass: sp.Matrix,
        force: Sequence[sp.Expr],
        rows: Sequence[Row],
        parameters: Sequence[sp.Symbol] = (),
    ):
        self.values: list[float] = []
        self.size, self.rows = len(state), tuple(rows)
        parts = list[sp.Expr]()
        for row in self.rows:
            level, push = row.level, row.push or (sp.S.Zero,) * self.size
            if row.law == "stop":
                # a stop is held by the rate of its gap; force[q] is the velocity of a position q
                slopes = {f: level.diff(q) for q, f in zip(state, force, strict=True) if level.has(q)}
                level = level.diff(TIME) + sp.Add(*(f * slope for f, slope in slopes.items()))
                push = tuple(slopes.get(s, sp.S.Zero) for s in state)
            parts += [row.level, level, level.diff(TIME), row.ratio, *(level.diff(s) for s in state), *push]
        self.law = np.array([row.law for row in self.rows])
        self.sign, self.stop = self.law == "sign", self.law == "stop"
        modes = [row.mode for row in self.rows]
        known = [TIME, list(state), list(parameters)]
        self._numbers = sp.lambdify([*known, modes], [*mass, *force, *parts], "math", cse=True)
        self._sets = [sp.lambdify(known, [e for _, e in row.sets], "math") for row in self.rows]

    def resets(self, row: int, t: float, z: np.ndarray) -> dict[int, float]:
        """Return the states that a reset sets, with their values."""
        values = self._sets[row](t, z.tolist(), self.values)
        return {slot: value for (slot, _), value in zip(self.rows[row].sets, values, strict=True)}

    def numbers(self, t: float, z: np.ndarray, modes: np.ndarray) -> dict[str, np.ndarray]:
        """Return rates without rows, what a unit of each x adds, levels, and slopes of what is held."""
        d, m = self.size, len(self.rows)
        flat = np.array(self._numbers(t, z.tolist(), self.values, modes.tolist()), dtype=float)
        mass, force, table = flat[: d * d].reshape(d, d), flat[d * d : d * d + d], flat[d * d + d :].reshape(m, -1)
        both = np.linalg.solve(mass, np.column_stack([force, table[:, 4 + d :].T]))
        slope, free, add = table[:, 4 : 4 + d], both[:, 0], both[:, 1:]
        rate = slope @ free + table[:, 2]
        return {"free": free, "add": add, "level": table[:, 0], "held": table[:, 1], "ratio": table[:, 3],
                "rate": rate, "feel": slope @ add, "slope": slope}  # fmt: skip

    def multipliers(self, at: dict[str, np.ndarray], modes: np.ndarray) -> np.ndarray:
        """Return x of all rows."""
        held = (modes == 0) & (self.law != "reset")
        x = np.where(self.sign, modes, 0.0)
        if held.any():
            x[held] = np.linalg.solve(at["feel"][np.ix_(held, held)], -(at["rate"] + at["feel"] @ x)[held])
        return x

    def rates(self, t: float, z: np.ndarray, modes: np.ndarray) -> np.ndarray:
        at = self.numbers(t, z, modes)
        return at["free"] + at["add"] @ self.multipliers(at, modes)

    def gaps(self, t: float, z: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """Return a number of each row that is positive while its mode lasts."""
        at = self.numbers(t, z, modes)
        x = self.multipliers(at, modes)
        held = np.where(self.sign, at["ratio"] - abs(x), x)
        off = np.where(self.sign, modes * at["level"], np.where(self.stop, at["level"], -at["level"]))
        return np.where((modes == 0) & (self.law != "reset"), held, off)

    def parts(self, at: dict[str, np.ndarray]) -> list[list[int]]:
        """Return the groups of rows that feel each other, or belong to one node."""
        m = len(self.rows)
        joined = (abs(at["feel"]) > 1e-13) | (abs(at["feel"]).T > 1e-13)
        for a, b in itertools.product(range(m), repeat=2):
            joined[a, b] |= self.rows[a].owner[0] == self.rows[b].owner[0]
        reach = np.linalg.matrix_power(joined.astype(float) + np.eye(m), m) > 0
        return [sorted(group) for group in {tuple(np.flatnonzero(line)) for line in reach}]


@dataclass
class Motion:
    """A motion of a system; `events` lists (time, row, mode before, mode after)."""

    system: System
    z: np.ndarray
    rtol: float = 1e-12
    longest: float = 0.05
    t: float = 0.0
    modes: np.ndarray = field(init=False)
    events: list[tuple[float, int, int, int]] = field(default_factory=list)
    ready: float = np.inf  # the first step after an impact

    def __post_init__(self) -> None:
        self.z = np.array(self.z, dtype=float)
        system, m = self.system, len(self.system.rows)
        at = system.numbers(0.0, self.z, np.zeros(m))
        rest = np.where(system.sign, at["held"] == 0, system.stop & (at["level"] == 0) & (at["held"] == 0))
        self.modes = np.where(system.sign, np.sign(at["level"]), 1.0)
        self.decide(rest.astype(bool), np.full(m, np.nan))

    def decide(self, open_rows: np.ndarray, before: np.ndarray) -> None:
        """Choose the modes of rows on their levels: all sets that agree with the laws, most held rows first."""
        system = self.system
        at = system.numbers(self.t, self.z, np.where(open_rows, 0.0, self.modes))
        for part in system.parts(at) if open_rows.any() else ():
            chosen = [a for a in part if open_rows[a]]
            if not chosen:
                continue
            good = []
            for option in itertools.product(*((0.0, 1.0, -1.0) if system.sign[a] else (0.0, 1.0) for a in chosen)):
                tried = self.modes.copy()
                tried[chosen] = option
                # Slipping rows begin with the friction of rest, as open rows have the mode 0 in `at`.
                try:
                    x = system.multipliers(at, tried)
                except np.linalg.LinAlgError:
                    continue
                rate = at["rate"] + at["feel"] @ x
                scale = abs(at["rate"]) + abs(at["feel"]) @ abs(x) + 1e-300
                fits = True
                for a in chosen:
                    if tried[a] == 0:
                        low = -1.0 if system.sign[a] else 0.0
                        fits &= bool(low * at["ratio"][a] - 1e-9 <= x[a]) and bool(
                            not system.sign[a] or x[a] <= at["ratio"][a] + 1e-9
                        )
                    else:
                        fits &= bool(tried[a] * rate[a] >= -1e-9 * scale[a])
                if fits:
                    changes = sum(tried[a] != before[a] for a in chosen)
                    good.append(
                        (-sum(tried[a] == 0 for a in chosen), changes, max(abs(x[a]) for a in chosen), tried, x)
                    )
            drops = any(system.sign[a] and at["ratio"][a] > 1 + 1e-12 for a in chosen)
            good.sort(key=lambda each: each[:3])
            if not good:
                raise Undetermined("no set of held rows agrees")
            if not drops and any(self.differ(at, good[0], each) for each in good[1:]):
                raise Undetermined("several sets of held rows agree")
            self.modes = good[0][3]

    def differ(self, at: dict[str, np.ndarray], one: tuple, other: tuple) -> bool:
        """Return True if two sets of modes are different motions, not one motion at the border of both."""
        gap = abs(at["add"] @ (one[4] - other[4]))
        return bool((gap > 1e-7 * (1 + abs(at["add"]) @ abs(one[4]))).any())

    def strike(self, shut: np.ndarray) -> None:
        """Change the state and the modes at an event of the rows that have closed."""
        system, old = self.system, self.modes.copy()
        at = system.numbers(self.t, self.z, np.where(shut, 0.0, old))
        x = system.multipliers(system.numbers(self.t, self.z, old), old)
        parts = system.parts(at)
        touched = sorted(a for part in parts if shut[part].any() for a in part)
        open_rows, jumped = self.jump(shut, at, x, parts)
        before, after = at["held"], at["held"]
        if jumped:
            after = system.numbers(self.t, self.z, np.where(shut, 0.0, old))["held"]
        for a in touched:
            if system.law[a] == "reset":
                continue
            moved = abs(after[a] - before[a]) > 1e-11 * max(1.0, abs(after[a]), abs(before[a]))
            on_level = old[a] == 0 or (shut[a] and system.sign[a])
            if old[a] == 0 and shut[a]:
                self.modes[a] = np.sign(x[a]) if system.sign[a] else 1.0
            elif on_level and moved:
                self.modes[a] = np.sign(after[a]) if system.sign[a] else 1.0
            elif on_level:
                open_rows[a] = True
            elif system.sign[a] and old[a] * after[a] < 0:
                self.modes[a] = -old[a]
        self.decide(open_rows, old)
        changed = [a for a in touched if self.modes[a] != old[a] or (shut[a] and not system.sign[a])]
        self.events += [(self.t, a, int(old[a]), int(self.modes[a])) for a in changed]
        if len(self.events) > MOST:
            raise Endless

    def jump(
        self, shut: np.ndarray, at: dict[str, np.ndarray], x: np.ndarray, parts: list[list[int]]
    ) -> tuple[np.ndarray, bool]:
        """Reset states and let stops rebound; return the stops that close, and whether the state has changed."""
        system, z, closes, old = self.system, self.z.copy(), np.zeros(len(shut), bool), self.modes
        resets, hits = np.flatnonzero(shut & (system.law == "reset")), np.flatnonzero(shut & system.stop & (old != 0))
        for k in resets:
            for slot, value in system.resets(k, self.t, self.z).items():
                z[slot] = value
        for k in hits:
            near = [b for p in parts if k in p for b in p if b != k and system.stop[b] and (shut[b] or old[b] == 0)]
            if any(abs(at["feel"][k, b]) > 1e-12 for b in near):
                raise Undetermined("stops that feel each other")
            u, e, inward = -at["held"][k], at["ratio"][k], -(at["rate"] + at["feel"] @ x)[k]
            if e < 1 and inward > 0 and e * u < 1e-6 * max(1.0, inward):
                e = 0.0
            z += at["add"][:, k] * (1 + e) * u / at["feel"][k, k]
            closes[k] = e == 0
            if e > 0 and inward > 0:
                self.ready = min(self.ready, 0.3 * e * u / inward)
        self.z = z
        return closes, bool(len(resets) + len(hits))

    def project(self) -> None:
        """Put held rows back onto their levels: velocities, and the places of closed stops."""
        system, held = self.system, (self.modes == 0) & (self.system.law != "reset")
        if not held.any():
            return
        at = system.numbers(self.t, self.z, self.modes)
        feel = at["feel"][np.ix_(held, held)]
        self.z = self.z - at["add"][:, held] @ np.linalg.solve(feel, at["held"][held])

    def run(self, end: float) -> Motion:
        """Integrate up to a time."""
        rush, system = 0, self.system
        while self.t < end:
            modes = self.modes.copy()
            solver = DOP853(
                lambda t, z, modes=modes: system.rates(t, z, modes), self.t, self.z, end, max_step=self.longest,
                rtol=self.rtol, atol=self.rtol / 10, first_step=min(self.ready, self.longest, end - self.t) if self.ready < np.inf else None,
            )  # fmt: skip
            self.ready, begun = np.inf, self.t
            while solver.status == "running":
                message = solver.step()
                if message:
                    raise ArithmeticError(message)
                if abs(solver.y).max() > 1e6:
                    raise ArithmeticError("grows")
                inside = solver.dense_output()
                found = self.first_closed(inside, solver.t_old, solver.t, modes)
                if found is not None:
                    self.t, self.z = found, inside(found)
                    break
                self.t, self.z = solver.t, solver.y
            self.project()
            if found is None:
                continue
            gaps = system.gaps(self.t, self.z, modes)
            later = system.gaps(self.t + 1e-7, inside(self.t + 1e-7), modes)
            shut = (abs(gaps) <= NEAR) & (later < gaps)
            if not shut.any():
                shut = gaps == gaps.min()
            rush = rush + 1 if self.t - begun < 1e-12 else 0
            if rush > 50:
                raise Endless
            self.strike(shut)
            self.project()
        return self

    def first_closed(self, inside: Callable, begin: float, end: float, modes: np.ndarray) -> float | None:
        """Return the first time in a step at which a gap passes zero downwards."""
        times = begin + (end - begin) * np.concatenate([[0.0], LOOKS])
        table = np.array([self.system.gaps(t, inside(t), modes) for t in times])
        first = None
        for k in range(table.shape[1]):
            g = table[:, k]

            def gap(t: float, k: int = k) -> float:
                return float(self.system.gaps(t, inside(t), modes)[k])

            # a gap that begins at zero first shows its sign where it exceeds rounding
            seen = np.flatnonzero(abs(g) > ROUNDING)
            start = seen[0] if len(seen) else len(g)
            if start < len(g) and g[start] < 0:
                root = (
                    begin if g[0] <= ROUNDING else brentq(gap, times[start - 1], times[start], xtol=1e-15, rtol=1e-15)
                )
                first = root if first is None else min(first, root)
                continue
            for a in range(start, len(times) - 1):
                if g[a] > 0 >= g[a + 1]:
                    root = brentq(gap, times[a], times[a + 1], xtol=1e-15, rtol=1e-15)
                elif a > start and 0 < g[a] < min(g[a - 1], g[a + 1]):
                    around = (times[a - 1], times[a + 1])
                    least = minimize_scalar(gap, bounds=around, method="bounded", options={"xatol": 1e-12})
                    if least.fun >= 0:
                        continue
                    root = brentq(gap, times[a - 1], least.x, xtol=1e-15, rtol=1e-15)
                else:
                    continue
                first = root if first is None else min(first, root)
                break
        return first

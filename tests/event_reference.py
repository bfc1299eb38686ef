"""Stick and slip integrated a second way: Taylor series in many digits, events by bisection, plain Python throughout.

Oscillators x'' = -x + u cos(omega t) + sigma sum (x_j - x_i) + epsilon f(theta_b - x'), where f(w) = (mu_k + (mu_s - mu_k)
exp(-a w)) while w > 0, odd, and holds up to `hold` at w = 0.  It shares nothing with the package.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from mpmath import mp, mpf

ORDER, STEP, LOOKS = 20, "0.2", 6


def value(series: list[mpf], tau: mpf) -> mpf:
    total = mpf(0)
    for c in reversed(series):
        total = total * tau + c
    return total


@dataclass
class Reference:
    """The network at a time; slips are +1, 0, -1; `events` lists (time, oscillator, new mode)."""

    numbers: dict[str, float]
    pairs: list[tuple[int, int]]
    x: list[mpf]
    v: list[mpf]
    t: mpf = field(default_factory=lambda: mpf(0))
    slip: list[int] = field(default_factory=list)
    events: list[tuple[float, int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.p = {name: mpf(number) for name, number in self.numbers.items()}
        self.hold = self.p["epsilon"] * self.p.get("hold", self.p["mu_s"])
        self.x, self.v = [mpf(q) for q in self.x], [mpf(q) for q in self.v]
        self.slip = [self.start_mode(i) for i in range(len(self.x))]

    def load(self, i: int, x: list[mpf], t: mpf) -> mpf:
        """What friction must balance."""
        p = self.p
        links = sum((x[b] - x[a] if a == i else x[a] - x[b] for a, b in self.pairs if i in (a, b)), mpf(0))
        return -x[i] + p["u"] * mp.cos(p["omega"] * t) + p["sigma"] * links

    def start_mode(self, i: int) -> int:
        w = self.p["theta_b"] - self.v[i]
        return self.at_belt(i) if w == 0 else int(mp.sign(w))

    def at_belt(self, i: int) -> int:
        load = self.load(i, self.x, self.t)
        return 0 if abs(load) <= self.hold else -int(mp.sign(load))

    def series(self) -> tuple[list[list[mpf]], list[list[mpf]], list[mpf]]:
        """Taylor coefficients of positions, velocities and the drive."""
        p, n = self.p, len(self.x)
        drive, quadrature = [p["u"] * mp.cos(p["omega"] * self.t)], [p["u"] * mp.sin(p["omega"] * self.t)]
        xs, vs = [[q] for q in self.x], [[q] for q in self.v]
        decays = [[mp.exp(-p["a"] * abs(p["theta_b"] - self.v[i]))] for i in range(n)]
        for k in range(ORDER):
            drive.append(-p["omega"] * quadrature[k] / (k + 1))
            quadrature.append(p["omega"] * drive[k] / (k + 1))
            for i in range(n):
                xs[i].append(vs[i][k] / (k + 1))
                s = self.slip[i]
                rate = mpf(0)
                if s != 0:
                    links = sum(
                        (xs[b][k] - xs[a][k] if a == i else xs[a][k] - xs[b][k] for a, b in self.pairs if i in (a, b)),
                        mpf(0),
                    )
                    friction = (p["mu_s"] - p["mu_k"]) * decays[i][k] + (p["mu_k"] if k == 0 else 0)
                    rate = -xs[i][k] + drive[k] + p["sigma"] * links + p["epsilon"] * s * friction
                vs[i].append(rate / (k + 1))
            for i in range(n):  # (e^{-a s w})' = a s v' e^{-a s w}
                folded = sum(((j + 1) * vs[i][j + 1] * decays[i][k - j] for j in range(k + 1)), mpf(0))
                decays[i].append(p["a"] * self.slip[i] * folded / (k + 1))
        return xs, vs, drive

    def gap(self, i: int, series: tuple, tau: mpf) -> mpf:
        xs, vs, _ = series
        if self.slip[i] != 0:
            return self.slip[i] * (self.p["theta_b"] - value(vs[i], tau))
        return self.hold - abs(self.load(i, [value(s, tau) for s in xs], self.t + tau))

    def advance(self, end: mpf) -> None:
        end, step, tiny = mpf(end), mpf(STEP), mpf(10) ** (-mp.dps + 8)
        while self.t < end:
            series, h = self.series(), min(step, end - self.t)
            first, who = h, []
            for i in range(len(self.x)):
                low = mpf(0)
                for k in range(1, LOOKS + 1):
                    high = h * k / LOOKS
                    if self.gap(i, series, high) < -tiny:
                        while high - low > tiny:
                            half = (low + high) / 2
                            low, high = (low, half) if self.gap(i, series, half) < -tiny else (half, high)
                        if high < first - 2 * tiny:
                            first, who = high, []
                        if high <= first + 2 * tiny:
                            who.append(i)
                        break
                    low = high
            self.x = [value(s, first) for s in series[0]]
            self.v = [value(s, first) for s in series[1]]
            self.t += first
            for i in who:
                self.v[i] = self.p["theta_b"]
            for i in who:
                self.slip[i] = self.turn(i)
                self.events.append((float(self.t), i, self.slip[i]))

    def turn(self, i: int) -> int:
        """The new mode: one that stuck has reached the limit of its load, one that slipped sticks if that can hold it."""
        load = self.load(i, self.x, self.t)
        return -int(mp.sign(load)) if self.slip[i] == 0 else self.at_belt(i)

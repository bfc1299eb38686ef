"""Test problems of the literature: equations, starts, ends, and end values that are published or computed by SciPy.

DETEST: Hull, Enright, Fellen & Sedgwick, SIAM J. Numer. Anal. 9, 603 (1972), classes A to E, each over 0 to 20.
Stiff ones: Hairer & Wanner, Solving Ordinary Differential Equations II (1996), sections IV.1 and IV.10; Mazzia & Magherini,
Test Set for Initial Value Problem Solvers, release 2.4 (2008), whose end values have about 14 digits.
FitzHugh-Nagumo rings: Omelchenko, Omel'chenko, Hövel & Schöll, Phys. Rev. Lett. 110, 224101 (2013).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

import synchain as sc
from synchain import run
from synchain.results import Status


@dataclass(frozen=True)
class Problem:
    """Rates of one node of the states y1, y2, … as text, or a whole scene; `end` is published, or None."""

    name: str
    rates: tuple[str, ...]
    start: tuple[float, ...]
    span: float
    end: tuple[float, ...] | None = None
    network: Callable[[], sc.Scene] | None = None
    stiff: bool = False

    def scene(self, **settings: Any) -> sc.Scene:
        """The problem by default settings."""
        times = {"transient": 0.0, "window": self.span, "time_unit": "time"} | settings
        if self.network:
            return self.network().replace(**times)
        node = sc.Field({f"y{k + 1}": rate for k, rate in enumerate(self.rates)}, name=self.name)
        return sc.Scene(node, None, initial=dict(zip(node.states, self.start, strict=True)), **times)

    def reference(self) -> np.ndarray:
        """The end: published, or by SciPy: DOP853, or Radau if stiff, at a relative tolerance of 1e-13 (networks 1e-11)."""
        if self.end is not None:
            return np.array(self.end)
        if self.network:
            rates, start = rates_of(self.network())
            return _integrated(rates, start, self.span, "Radau", 1e-11)
        t, states = sp.Symbol("t"), sp.symbols(f"y1:{len(self.start) + 1}")
        texts = [sp.sympify(rate, locals={s.name: s for s in (t, *states)}) for rate in self.rates]
        function = sp.lambdify([t, states], texts, "math")
        slopes = sp.lambdify([t, states], sp.Matrix(texts).jacobian(states), "numpy")
        method = "Radau" if self.stiff else "DOP853"
        return _integrated(function, np.array(self.start), self.span, method, 1e-13, slopes if self.stiff else None)


def _integrated(
    rates: Callable[[float, np.ndarray], Any],
    start: np.ndarray,
    span: float,
    method: str,
    rtol: float,
    jacobian: Callable[..., Any] | None = None,
) -> np.ndarray:
    more = {} if jacobian is None else {"jac": jacobian}
    path = solve_ivp(rates, (0.0, span), start, method=method, rtol=rtol, atol=rtol * 1e-3, **more)
    assert path.success, path.message
    return path.y[:, -1]


def digits(problem: Problem, **settings: Any) -> float:
    """Correct digits at the end in the sense of the Test Set: of |error| / (floor + |value|), in the worst component.

    The floor is a tenth of the largest value at start or end.  -inf stands for a run that did not end.
    """
    expected = problem.reference()
    scene = problem.scene(**settings)
    result = run(scene, show_progress=False)
    if int(result.data["status"]) != Status.FINISHED:
        return -np.inf
    state = result.end.transpose("node", "component").values.ravel()
    start = np.array([scene.initial[name] for name in scene.components])
    floor = 0.1 * max(np.abs(expected).max(), np.abs(start).max())
    error = np.abs(state - expected) / (floor + np.abs(expected))
    return float(-np.log10(max(error.max(), 1e-16)))


def _matrix(rows: Sequence[Mapping[int, float]]) -> tuple[str, ...]:
    """Linear rates of the rows of a sparse matrix."""
    return tuple(" + ".join(f"({value})*y{k + 1}" for k, value in row.items()) or "0" for row in rows)


def _chain_of_decays(rates: Sequence[int]) -> tuple[str, ...]:
    """y1' = -r1 y1, yi' = r(i-1) y(i-1) - ri yi, and the last one gains only."""
    n = len(rates) + 1
    rows = [{k: -rates[k]} if k < n - 1 else {} for k in range(n)]
    return _matrix([row | ({k - 1: rates[k - 1]} if k else {}) for k, row in enumerate(rows)])


def _heat(n: int) -> tuple[str, ...]:
    return _matrix([{j: -2 if i == j else 1 for j in range(n) if abs(i - j) <= 1} for i in range(n)])


def _unit(n: int) -> tuple[float, ...]:
    return (1.0, *[0.0] * (n - 1))


def _two_bodies(e: float) -> Problem:
    cube = "(y1**2 + y2**2)**(3/2)"
    start = (1 - e, 0.0, 0.0, float(np.sqrt((1 + e) / (1 - e))))
    return Problem(f"D{round((e - 0.1) * 5) + 1}", ("y3", "y4", f"-y1/{cube}", f"-y2/{cube}"), start, 20.0)


def _five_bodies() -> Problem:
    """C5: the sun and the outer planets; positions, then velocities."""
    k2, sun = 2.95912208286, 1.00000597682
    masses = (0.000954786104043, 0.000285583733151, 0.0000437273164546, 0.0000517759138449, 0.00000277777777778)
    places = (3.42947415189, 3.35386959711, 1.35494901715, 6.64145542550, 5.97156957878, 2.18231499728, 11.2630437207,
              14.6952576794, 6.27960525067, -30.1552268759, 1.65699966404, 1.43785752721, -21.1238353380, 28.4465098142,
              15.3882659679)  # fmt: skip
    speeds = (-0.557160570446, 0.505696783289, 0.230578543901, -0.415570776342, 0.365682722812, 0.169143213293,
              -0.325325669158, 0.189706021964, 0.0877265322780, -0.0240476254170, -0.287659532608, -0.117219543175,
              -0.176860753121, -0.216393453025, -0.0148647893090)  # fmt: skip

    def y(i: int, k: int) -> str:
        return f"y{3 * i + k + 1}"

    def cube(i: int, j: int | None = None) -> str:
        apart = (y(i, k) if j is None else f"({y(i, k)} - {y(j, k)})" for k in range(3))
        return f"({' + '.join(f'{d}**2' for d in apart)})**(3/2)"

    def pull(i: int, k: int) -> str:
        pull_of_sun = f"-({sun} + {masses[i]})*{y(i, k)}/{cube(i)}"
        others = (
            f"{masses[j]}*(({y(j, k)} - {y(i, k)})/{cube(i, j)} - {y(j, k)}/{cube(j)})" for j in range(5) if j != i
        )
        return f"{k2}*({pull_of_sun} + {' + '.join(others)})"

    slopes = tuple(pull(i, k) for i in range(5) for k in range(3))
    return Problem("C5", (*(f"y{16 + k}" for k in range(15)), *slopes), (*places, *speeds), 20.0)


ROOT = "sqrt(y1**2 + y2**2)"
DETEST = (
    Problem("A1", ("-y1",), (1.0,), 20.0),
    Problem("A2", ("-y1**3/2",), (1.0,), 20.0),
    Problem("A3", ("y1*cos(t)",), (1.0,), 20.0),
    Problem("A4", ("y1/4*(1 - y1/20)",), (1.0,), 20.0),
    Problem("A5", ("(y1 - t)/(y1 + t)",), (4.0,), 20.0),
    Problem("B1", ("2*(y1 - y1*y2)", "-(y2 - y1*y2)"), (1.0, 3.0), 20.0),
    Problem("B2", ("-y1 + y2", "y1 - 2*y2 + y3", "y2 - y3"), (2.0, 0.0, 1.0), 20.0),
    Problem("B3", ("-y1", "y1 - y2**2", "y2**2"), (1.0, 0.0, 0.0), 20.0),
    Problem("B4", (f"-y2 - y1*y3/{ROOT}", f"y1 - y2*y3/{ROOT}", f"y1/{ROOT}"), (3.0, 0.0, 0.0), 20.0),
    Problem("B5", ("y2*y3", "-y1*y3", "-0.51*y1*y2"), (0.0, 1.0, 1.0), 20.0),
    Problem("C1", _chain_of_decays([1] * 9), _unit(10), 20.0),
    Problem("C2", _chain_of_decays(range(1, 10)), _unit(10), 20.0),
    Problem("C3", _heat(10), _unit(10), 20.0),
    Problem("C4", _heat(51), _unit(51), 20.0),
    _five_bodies(),
    *(_two_bodies(e) for e in (0.1, 0.3, 0.5, 0.7, 0.9)),
    Problem("E1", ("y2", "-(y2/(t + 1) + (1 - 0.25/(t + 1)**2)*y1)"), (0.6713967071418030, 0.09540051444747446), 20.0),
    Problem("E2", ("y2", "(1 - y1**2)*y2 - y1"), (2.0, 0.0), 20.0),
    Problem("E3", ("y2", "y1**3/6 - y1 + 2*sin(2.78535*t)"), (0.0, 0.0), 20.0),
    Problem("E4", ("y2", "0.032 - 0.4*y2**2"), (30.0, 0.0), 20.0),
    Problem("E5", ("y2", "sqrt(1 + y2**2)/(25 - t)"), (0.0, 0.0), 20.0),
)


def _pollution() -> tuple[str, ...]:
    constants = (0.35, 26.6, 1.23e4, 8.6e-4, 8.2e-4, 1.5e4, 1.3e-4, 2.4e4, 1.65e4, 9e3, 0.022, 1.2e4, 1.88, 1.63e4, 4.8e6,
                 3.5e-4, 0.0175, 1e8, 4.44e11, 1.24e3, 2.1, 5.78, 0.0474, 1.78e3, 3.12)  # fmt: skip
    partners = ((1,), (2, 4), (5, 2), (7,), (7,), (7, 6), (9,), (9, 6), (11, 2), (11, 1), (13,), (10, 2), (14,), (1, 6),
                (3,), (4,), (4,), (16,), (16,), (17, 6), (19,), (19,), (1, 4), (19, 1), (20,))  # fmt: skip
    r = [
        "*".join([f"{k:.12g}", *(f"y{j}" for j in pair)]).replace("e+", "e")
        for k, pair in zip(constants, partners, strict=True)
    ]
    gains = ("-1-10-14-23-24+2+3+9+11+12+22+25", "-2-3-9-12+1+21", "-15+1+17+19+22", "-2-16-17-23+15",
             "-3+4+4+6+7+13+20", "-6-8-14-20+3+18+18", "-4-5-6+13", "+4+5+6+7", "-7-8", "-12+7+9", "-9-10+8+11", "+9",
             "-11+10", "-13+12", "+14", "-18-19+16", "-20", "+20", "-21-22-24+23+25", "-25+24")  # fmt: skip
    import re

    return tuple(re.sub(r"([+-])(\d+)", lambda m: f" {m[1]} {r[int(m[2]) - 1]}", row) for row in gains)


def _pleiades() -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Seven stars of the masses 1 to 7: x, y, x', y'."""
    start = (3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4, 0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0)

    def pull(i: int, first: int) -> str:
        terms = (
            f"{j}*(y{first + j} - y{first + i})/((y{j} - y{i})**2 + (y{7 + j} - y{7 + i})**2)**(3/2)"
            for j in range(1, 8)
            if j != i
        )
        return " + ".join(terms)

    slopes = tuple(pull(i, first) for first in (0, 7) for i in range(1, 8))
    return (*(f"y{k}" for k in range(15, 29)), *slopes), tuple(map(float, start))


def _ring_modulator() -> tuple[str, ...]:
    """The 15 states with C_s = 2e-12."""
    first, second = "sin(2000*pi*t)/2", "2*sin(20000*pi*t)"
    across = (f"y3 - y5 - y7 - {second}", f"-y4 + y6 - y7 - {second}", f"y4 + y5 + y7 + {second}",
              f"-y3 - y6 + y7 + {second}")  # fmt: skip
    q1, q2, q3, q4 = (f"40.67286402e-9*(exp(17.7493332*({u})) - 1)" for u in across)
    return (
        "(y8 - y10/2 + y11/2 + y14 - y1/25000)/1.6e-8",
        "(y9 - y12/2 + y13/2 + y15 - y2/25000)/1.6e-8",
        f"(y10 - {q1} + {q4})/2e-12",
        f"(-y11 + {q2} - {q3})/2e-12",
        f"(y12 + {q1} - {q3})/2e-12",
        f"(-y13 - {q2} + {q4})/2e-12",
        f"(-y7/50 + {q1} + {q2} - {q3} - {q4})/1e-8",
        "-y1/4.45",
        "-y2/4.45",
        "(y1/2 - y3 - 17.3*y10)/5e-4",
        "(-y1/2 + y4 - 17.3*y11)/5e-4",
        "(y2/2 - y5 - 17.3*y12)/5e-4",
        "(-y2/2 + y6 - 17.3*y13)/5e-4",
        f"(-y1 + {first} - (50 + 36.3)*y14)/2e-3",
        "(-y2 - (600 + 36.3)*y15)/2e-3",
    )


def _brusselator() -> sc.Scene:
    """BRUSS on 32 points: u, v between fixed ends u = 1, v = 3, which pull at the first and last node."""
    n, strength = 32, 33.0**2 / 50
    u, v, e, g = sp.symbols("u v e g")
    rates = {u: 1 + u**2 * v - 4 * u + e * g * (1 - u), v: 3 * u - u**2 * v + e * g * (3 - v)}
    node = sc.Field(rates, parameters={e: 0, g: strength})
    links = sc.Rates({"u": "D*W*(u_j - u_i)", "v": "D*W*(v_j - v_i)"}, {"D": strength})
    x = np.arange(1, n + 1) / (n + 1)
    ends = [1.0, *[0.0] * (n - 2), 1.0]
    start = {"u": (1 + np.sin(2 * np.pi * x)).tolist(), "v": [3.0] * n}
    return sc.Scene(node, links, sc.graphs.chain(n), parameters={"e": ends}, initial=start)


def _cusp() -> sc.Scene:
    """CUSP: a nerve with a cusp catastrophe and van der Pol's oscillator on a ring of 32 nodes."""
    n = 32
    w = "((y - 0.7)*(y - 1.3)/((y - 0.7)*(y - 1.3) + 0.1))"
    rates = {
        "y": "-10000*(y**3 + a*y + b)",
        "a": f"b + 0.07*{w}",
        "b": f"(1 - a**2)*b - a - 0.4*y + 0.035*{w}",
    }
    links = sc.Rates({z: f"D*W*({z}_j - {z}_i)" for z in "yab"}, {"D": n**2 / 144})
    angle = 2 * np.pi * np.arange(1, n + 1) / n
    start = {"y": [0.0] * n, "a": (-2 * np.cos(angle)).tolist(), "b": (2 * np.sin(angle)).tolist()}
    return sc.Scene(sc.Field(rates), links, sc.graphs.ring(n), initial=start)


def _fitzhugh_nagumo() -> sc.Scene:
    """A ring of 20 nodes, each with its seven neighbours on both sides, eps = 0.05, a = 0.5, phi = pi/2 - 0.1."""
    n, reach, sigma, phi = 20, 7, 0.1, np.pi / 2 - 0.1
    node = sc.Field({"u": "(u - u**3/3 - v)/0.05", "v": "u + 0.5"})
    b = {name: float(value) for name, value in {"p": np.cos(phi), "q": np.sin(phi)}.items()}
    scaled = {"s": sigma / (2 * reach), **b}
    links = sc.Rates(
        {
            "u": "s*W*(p*(u_j - u_i) + q*(v_j - v_i))/0.05",
            "v": "s*W*(p*(v_j - v_i) - q*(u_j - u_i))",
        },
        scaled,
    )
    angle = 2 * np.pi * np.arange(n) / n
    start = {"u": (1.5 * np.cos(3 * angle)).tolist(), "v": (0.6 * np.sin(angle)).tolist()}
    return sc.Scene(node, links, sc.graphs.topology("circulant", n, offsets=tuple(range(1, reach + 1))), initial=start)


def rates_of(scene: sc.Scene) -> tuple[Callable[[float, np.ndarray], np.ndarray], np.ndarray]:
    """Rates of the three networks in NumPy, written by hand, of states node by node; and their start."""
    names, n = scene.components, scene.n
    start = np.array([scene.initial[name] for name in names]).T.ravel()
    p = scene.parameters

    def shifted(z: np.ndarray, reach: int) -> np.ndarray:
        return sum(np.roll(z, k) + np.roll(z, -k) - 2 * z for k in range(1, reach + 1))

    def brusselator(t: float, state: np.ndarray) -> np.ndarray:
        u, v = state.reshape(n, 2).T
        up, vp = np.r_[1.0, u, 1.0], np.r_[3.0, v, 3.0]
        du = 1 + u**2 * v - 4 * u + p["D"] * (up[2:] - 2 * u + up[:-2])
        dv = 3 * u - u**2 * v + p["D"] * (vp[2:] - 2 * v + vp[:-2])
        return np.c_[du, dv].ravel()

    def cusp(t: float, state: np.ndarray) -> np.ndarray:
        y, a, b = state.reshape(n, 3).T
        product = (y - 0.7) * (y - 1.3)
        w = product / (product + 0.1)
        dy = -1e4 * (y**3 + a * y + b) + p["D"] * shifted(y, 1)
        da = b + 0.07 * w + p["D"] * shifted(a, 1)
        db = (1 - a**2) * b - a - 0.4 * y + 0.035 * w + p["D"] * shifted(b, 1)
        return np.c_[dy, da, db].ravel()

    def fitzhugh_nagumo(t: float, state: np.ndarray) -> np.ndarray:
        u, v = state.reshape(n, 2).T
        du, dv = p["s"] * shifted(u, 7), p["s"] * shifted(v, 7)
        first = (u - u**3 / 3 - v + p["p"] * du + p["q"] * dv) / 0.05
        return np.c_[first, u + 0.5 + p["p"] * dv - p["q"] * du].ravel()

    return {("u", "v", "D"): brusselator, ("y", "a", "b", "D"): cusp}.get(
        (*names, *(["D"] if "D" in p else [])), fitzhugh_nagumo
    ), start


STIFF = (
    Problem(
        "VDPOL", ("y2", "((1 - y1**2)*y2 - y1)/1e-6"), (2.0, 0.0), 2.0, (1.706167732170483, -0.8928097010247975), stiff=True
    ),
    Problem(
        "ROBER",
        ("-0.04*y1 + 1e4*y2*y3", "0.04*y1 - 1e4*y2*y3 - 3e7*y2**2", "3e7*y2**2"),
        (1.0, 0.0, 0.0),
        1e11,
        (0.2083340149701255e-07, 0.8333360770334713e-13, 0.9999999791665050),
        stiff=True,
    ),
    Problem(
        "OREGO",
        ("77.27*(y2 + y1*(1 - 8.375e-6*y1 - y2))", "(y3 - (1 + y1)*y2)/77.27", "0.161*(y1 - y3)"),
        (1.0, 2.0, 3.0),
        360.0,
        (1.000814870318523, 1228.178521549917, 132.0554942846706),
        stiff=True,
    ),
    Problem(
        "HIRES",
        (
            "-1.71*y1 + 0.43*y2 + 8.32*y3 + 0.0007",
            "1.71*y1 - 8.75*y2",
            "-10.03*y3 + 0.43*y4 + 0.035*y5",
            "8.32*y2 + 1.71*y3 - 1.12*y4",
            "-1.745*y5 + 0.43*y6 + 0.43*y7",
            "-280*y6*y8 + 0.69*y4 + 1.71*y5 - 0.43*y6 + 0.69*y7",
            "280*y6*y8 - 1.81*y7",
            "-280*y6*y8 + 1.81*y7",
        ),
        (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057),
        321.8122,
        (0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4, 0.1175651343283149e-2,
         0.2386356198831331e-2, 0.6238968252742796e-2, 0.2849998395185769e-2, 0.2850001604814231e-2),
        stiff=True,
    ),
    Problem(
        "POLLU",
        _pollution(),
        (0, 0.2, 0, 0.04, 0, 0, 0.1, 0.3, 0.01, 0, 0, 0, 0, 0, 0, 0, 0.007, 0, 0, 0),
        60.0,
        (0.5646255480022769e-01, 0.1342484130422339, 0.4139734331099427e-08, 0.5523140207484359e-02,
         0.2018977262302196e-06, 0.1464541863493966e-06, 0.7784249118997964e-01, 0.3245075353396018,
         0.7494013383880406e-02, 0.1622293157301561e-07, 0.1135863833257075e-07, 0.2230505975721359e-02,
         0.2087162882798630e-03, 0.1396921016840158e-04, 0.8964884856898295e-02, 0.4352846369330103e-17,
         0.6899219696263405e-02, 0.1007803037365946e-03, 0.1772146513969984e-05, 0.5682943292316392e-04),
        stiff=True,
    ),
    Problem(
        "PLEI",
        *_pleiades(),
        3.0,
        (0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310, 0.3425581707156584,
         1.562172101400631, -0.7003092922212495, -3.943437585517392, -3.271380973972550, 5.225081843456543,
         -2.590612434977470, 1.198213693392275, -0.2429682344935824, 1.091449240428980, 3.417003806314313,
         1.354584501625501, -2.590065597810775, 2.025053734714242, -1.155815100160448, -0.8072988170223021,
         0.5952396354208710, -3.741244961234010, 0.3773459685750630, 0.9386858869551073, 0.3667922227200571,
         -0.3474046353808490, 2.344915448180937, -1.947020434263292),
    ),
    Problem(
        "RING",
        _ring_modulator(),
        (0.0,) * 15,
        1e-3,
        (-0.2339057358486745e-1, -0.7367485485540825e-2, 0.2582956709291169, -0.4064465721283450, -0.4039455665149794,
         0.2607966765422943, 0.1106761861269975, 0.2939904342435596e-6, -0.2840029933642329e-7, 0.7267198267264553e-3,
         0.7929487196960840e-3, -0.7255283495698965e-3, -0.7941401968526521e-3, 0.7088495416976114e-4,
         0.2390059075236570e-4),
        stiff=True,
    ),
    Problem(
        "E5 (stiff)",
        (
            "-7.89e-10*y1 - 1.1e7*y1*y3",
            "7.89e-10*y1 - 1.13e9*y2*y3",
            "7.89e-10*y1 - 1.1e7*y1*y3 + 1.13e3*y4 - 1.13e9*y2*y3",
            "1.1e7*y1*y3 - 1.13e3*y4",
        ),
        (1.76e-3, 0.0, 0.0, 0.0),
        1e13,
        (0.1152903278711829e-290, 0.8867655517642120e-22, 0.8854814626268838e-22, 0.0),
        stiff=True,
    ),
    Problem("Brusselator chain", (), (), 10.0, network=_brusselator, stiff=True),
    Problem("CUSP", (), (), 1.1, network=_cusp, stiff=True),
    Problem("FitzHugh-Nagumo ring", (), (), 20.0, network=_fitzhugh_nagumo, stiff=True),
)  # fmt: skip
PROBLEMS = {problem.name: problem for problem in (*DETEST, *STIFF)}

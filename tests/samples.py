"""Equations that the tests of the code generator share, a way to run kernels, and kernels as plain Python."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import sympy as sp
from pendula import pendulum, telescope

from synchain import Potential, Rates, Scene, ends
from synchain.codegen import driver
from synchain.codegen.driver.columns import COUNTS
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import SweepKernel, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.graphs import chain, from_matrix, one_way_ring, ring, star
from synchain.models.definitions.loader import load_oscillator
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.runtime.cells.plan import plan
from synchain.runtime.engines.step_control import control_array, tolerances

TABLE = {"theta_b": 0.1, "mu_s": 0.3, "mu_k": 0.15, "a": 2.5, "kappa": 1e5, "epsilon": 2.0, "u": 0.1, "omega": 1.15,
         "sigma": 0.1}  # fmt: skip
"""Table 1 of the paper, its first frequency, and a weak coupling."""


def real(*names: str) -> list[sp.Symbol]:
    return [sp.Symbol(name, real=True) for name in names]


def path(n: int) -> tuple[tuple[int, int, Fraction], ...]:
    """The links of a chain of n nodes."""
    pairs = [(i, i + 1) for i in range(n - 1)]
    return tuple(sorted((*p, Fraction(1)) for i, j in pairs for p in ((i, j), (j, i))))


def spring() -> Edge:
    x, v, x_there, v_there, weight, sigma = real("x", "v", "x_there", "v_there", "weight", "sigma")
    return Edge((x, v), (x_there, v_there), weight, (sp.S.Zero, sigma * weight * (x_there - x)), (sigma,))


def friction_chain(n: int) -> Equations:
    """Eq. 6 of the paper with the smoothed sign of eq. 5."""
    x, v = real("x", "v")
    theta_b, mu_s, mu_k, a, kappa, epsilon, u, omega = parameters = real(*list(TABLE)[:-1])
    w = theta_b - v
    law = (mu_k + (mu_s - mu_k) * sp.exp(-a * sp.Abs(w))) * 2 / sp.pi * sp.atan(kappa * w)
    node = Node((x, v), (v, -x + u * sp.cos(omega * TIME) + epsilon * law), tuple(parameters))
    return Equations.of_equal_nodes(node, spring() if n > 1 else None, n, path(n))


def friction_scene(n: int) -> Equations:
    """The same as scenes have it: with these equations, all records and the section v_1 a test shares the kernel of many."""
    return Scene(topology=chain(n)).equations if n > 1 else Scene().equations


def harmonic_chain(n: int) -> Equations:
    """Oscillators without friction or drive, joined by springs."""
    x, v = real("x", "v")
    return Equations.of_equal_nodes(Node((x, v), (v, -x), ()), spring(), n, path(n))


def waving() -> Equations:
    """A damped pendulum driven such that x = cos t, v = -sin t solves it."""
    x, v, damping = real("x", "v", "damping")
    drive = -sp.cos(TIME) + sp.sin(sp.cos(TIME)) - damping * sp.sin(TIME)
    return Equations.of_equal_nodes(Node((x, v), (v, drive - sp.sin(x) - damping * v), (damping,)), None, 1)


def looped() -> Equations:
    """Three nodes in a one-way ring with a chord, weights that are no units, a coupling through velocities too."""
    x, v, c, mu, omega = real("x", "v", "c", "mu", "omega")
    x_2, v_2, w, sigma, delta = real("x_there", "v_there", "weight", "sigma", "delta")
    node = Node((x, v), (v - x / 7, mu * (1 - x**2) * v - sp.exp(-c * x) + TIME * sp.sqrt(2) + sp.sin(omega * TIME) * x),
                (c, mu, omega))  # fmt: skip
    push = (delta * w * (v_2 - v), sigma * w * (x_2 - x) * sp.cos(x_2 - x) + mu * v_2)
    edge = Edge((x, v), (x_2, v_2), w, push, (sigma, delta, mu))
    links = ((0, 1, Fraction(2, 3)), (1, 2, Fraction(1)), (2, 0, Fraction(-3, 2)), (0, 2, Fraction(1)))
    return Equations.of_equal_nodes(node, edge, 3, links)


def parametric() -> Equations:
    """Two nodes whose equations hold the same terms of time as their Jacobian and their time derivative."""
    x, v, omega, u = real("x", "v", "omega", "u")
    wave = u * omega * sp.sin(omega * TIME)
    rhs = (v + u * sp.cos(omega * TIME), wave * x * v - x * sp.sin(omega * TIME))
    return Equations.of_equal_nodes(Node((x, v), rhs, (omega, u)), spring(), 2, path(2))


def third_order() -> Equations:
    """One node of three states: a chain of derivatives, with kinks and a power."""
    x, y, z, a, b = real("x", "y", "z", "a", "b")
    kinks = sp.Abs(y) * sp.sign(x - b)
    last = -a * z - kinks - x**3 + sp.cos(a * TIME) ** 2 - sp.log(b) / (1 + y**2)
    return Equations.of_equal_nodes(Node((x, y, z), (y, z + sp.Rational(1, 3), last), (a, b)), None, 1)


def tanh_pair() -> Equations:
    """Two nodes with the elementary functions that the others leave out, and a free-running phase."""
    x, phase, a = real("x", "phase", "a")
    rhs = (sp.tanh(a * x) * sp.sin(phase) - sp.sqrt(1 + x**2), sp.S.One)
    x_2, phase_2, w, sigma = real("x_2", "phase_2", "w", "sigma")
    edge = Edge((x, phase), (x_2, phase_2), w, (sp.S.Zero, sigma * w * sp.sin(phase_2 - phase)), (sigma,))
    return Equations.of_equal_nodes(Node((x, phase), rhs, (a,)), edge, 2, path(2))


def choices() -> Equations:
    """Two oscillators with stops: conditions on states, on parameters, on time and on several of them, and kinks."""
    x, v, a, b, omega = real("x", "v", "a", "b", "omega")
    stop = sp.Piecewise((-a * (x - b), x > b), (-sp.sin(a) * (x + b), x <= -b), (0, True))
    drag = sp.Piecewise((-a * v, a * b > 1), (-b * v**3, True)) - sp.Max(v, b / 3)
    drive = sp.Piecewise((a, sp.cos(omega * TIME) > b / 9), (b**2, True))
    mixed = sp.Piecewise((a**2, (v > 0) | (a < b)), (b, ~((x > 0) & (v > -b))), (x, True))
    x_2, v_2, w, sigma = real("x_there", "v_there", "weight", "sigma")
    rope = sp.Piecewise((sigma * w * (x_2 - x), (x_2 > x) & (sigma > b)), (0, True))
    node = Node((x, v), (v, stop - x + drag + drive + mixed), (a, b, omega))
    return Equations.of_equal_nodes(node, Edge((x, v), (x_2, v_2), w, (sp.S.Zero, rope), (sigma, b)), 2, path(2))


class Late(Mapping[str, Equations]):
    """Networks by name; each is derived when it is first asked for, not while tests are collected."""

    def __init__(self, makers: Mapping[str, Callable[[], Equations]]) -> None:
        self.makers = {name: functools.cache(make) for name, make in makers.items()}

    def __getitem__(self, name: str) -> Equations:
        return self.makers[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self.makers)

    def __len__(self) -> int:
        return len(self.makers)


CASES = Late({
    "choices": choices, "friction 1": lambda: friction_chain(1), "friction 3": lambda: friction_chain(3),
    "harmonic": lambda: harmonic_chain(2), "looped": looped, "parametric": parametric, "third order": third_order,
    "tanh pair": tanh_pair, "waving": waving,
})  # fmt: skip


def varied() -> Equations:
    """Driven Duffing oscillators on a one-way ring, with dampings and frequencies of their own."""
    graph = from_matrix([[-1, "2/3", "1/3"], [0, -1, 1], [2, 0, -2]])
    unequal = {"delta": [0.1, 0.2, 0.3], "omega": [1, 1.5, 2], "u": [0.1, 0.2, 0.4]}
    return Scene(oscillator="duffing", topology=graph, parameters=unequal).equations


def inertial() -> Equations:
    """Inerters on a one-way graph whose weights are no units, dampings of their own."""
    graph = from_matrix([[-1, "2/3", "1/3"], [0, -1, 1], ["1/2", 0, "-1/2"]])
    scene = Scene(
        oscillator="duffing", coupling="inerter", topology=graph, parameters={"delta": [0.1, 0.2, 0.3]}
    )  # fmt: skip
    return scene.equations


def clocks(n: int = 2) -> Equations:
    """Clocks on a beam: an arrow of a mass matrix that depends on the state, nodes of two kinds, masses of two kinds."""
    beam = [{"oscillator": "beam", "at": [1]}]
    return Scene(oscillator="clock", nodes=beam, coupling="hanging", topology=star(n + 1)).equations


def pendula() -> Equations:
    """Two nodes whose masses couple four coordinates and depend on them, one with more damping than the other."""
    unequal = {"delta": [0.1, 0.2]}
    return Scene(
        oscillator=pendulum(4), coupling="spring on q1", topology=chain(2), parameters=unequal, record=()
    ).equations


def telescopes() -> Equations:
    """Two nodes whose masses couple four coordinates by constants, and an inerter."""
    return Scene(oscillator=telescope(4), coupling="inerter on q2", topology=chain(2), record=()).equations


def two_kinds() -> Equations:
    """Nodes of two and of three states that share a name, some with parameters of their own."""
    kinds = [{"oscillator": "lorenz", "at": [2, 3]}]
    scene = Scene(oscillator="van_der_pol", nodes=kinds, topology=ring(4), coupling="x->x", parameters={"b": [1, 2]})
    return scene.equations


def numbered(n: int = 3, mutual: bool = True) -> Equations:
    """Springs with strengths and rest lengths of their own, or one-way links of squared strengths and own weights."""
    i, j, w = ends(load_oscillator("duffing"))
    k, length = sp.symbols("k rest")
    if mutual:
        coupling: Potential | Rates = Potential(
            k * w * ((i.x - j.x) ** 2 / 2 + sp.cos(i.x - j.x) / length), {k: 1, length: 1}
        )
    else:
        coupling = Rates({i.v: k**2 * w * sp.sin(j.x - i.x) / (2 + sp.cos(length * i.v))}, {k: 1, length: 1})
    graph = ring(n) if mutual else one_way_ring(n)
    numbers_of_links = {name: [0.3 + 0.1 * a * b for a in range(n)] for b, name in enumerate(("k", "rest"), start=1)}
    draws = {"draws": {"W": [[1.0] * n]}, "realisations": 1} if not mutual else {}
    return Scene("duffing", coupling, graph, parameters=numbers_of_links, **draws).equations


UNEQUAL = Late({
    "numbered": numbered, "numbered one way": lambda: numbered(mutual=False), "varied": varied, "inertial": inertial,
    "clocks": clocks, "two kinds": two_kinds, "pendula": pendula, "telescopes": telescopes,
})  # fmt: skip
"""Networks whose nodes differ or whose links have inertia."""


def numbers(equations: Equations, **changed: float) -> list[float]:
    """Parameter values in the kernel's order."""
    return [{**TABLE, **changed}[name] for name in equations.parameters]


def source_of(text: str, looped: bool = False) -> SweepKernel:
    """A kernel whose text is a test's own."""
    return replace(emit(harmonic_chain(2), "cash_karp", Recording(()), width=1, unroll=0 if looped else 8), code=text)


@functools.cache
def kernel(
    equations: Equations,
    method: str = "rodas5p",
    records: tuple[str, ...] = (),
    section: sp.Expr | None = None,
    width: int | None = None,
    **options: float,
) -> Kernel:
    """The compiled kernel; tests that ask for the same one share it.  `options` are `unroll` and `fill` of `emit`."""
    return load(emit(equations, method, Recording(records, section), width, **options))


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a kernel wrote; the columns are described in the docstring of `drive`."""

    end: np.ndarray
    sums: np.ndarray
    counts: np.ndarray
    points: np.ndarray
    samples: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        return self.end, self.sums, self.counts, self.points, self.samples, np.empty((0, 0))

    @property
    def steps(self) -> np.ndarray:
        """Accepted steps of each cell."""
        return self.counts[:, 1]

    def section(self, cell: int) -> np.ndarray:
        """The section points of a cell: rows of time and state."""
        return self.points[cell, : self.counts[cell, 3]]


def blank(cells: int, dimension: int, room: int = 0, samples: int = 0) -> Outcome:
    return Outcome(
        np.full((cells, dimension), np.nan), np.full((cells, 4), np.nan), np.zeros((cells, COUNTS), np.int64),
        np.full((cells, room, dimension + 1), np.nan), np.full((cells, samples, dimension), np.nan),
    )  # fmt: skip


def drive(
    compiled: Kernel, start: Any, values: Any, spans: Any, rtol: float, atol: float | None = None, *, room: int = 0,
    samples: int = 0, direction: float = -1.0, max_step: float = math.inf, max_steps: float = 1e9,
    into: Outcome | None = None, part: tuple[int, int] | None = None,
) -> Outcome:  # fmt: skip
    """Run cells: rows of start states, of parameters and of (begin, end) of the window."""
    start, spans = np.array(start, float), np.array(spans, float)
    cells = len(start)
    spans = np.pad(spans, ((0, 0), (0, 4 - spans.shape[1])))
    spans = np.hstack([spans, np.tile([1e-4, max_step, math.inf], (cells, 1))])
    values = np.array(values, float).reshape(cells, -1)
    control = np.array([rtol, rtol / 10 if atol is None else atol, 1e-4, max_step, max_steps, direction, 0.0, 0.0])
    outcome = blank(cells, start.shape[1], room, samples) if into is None else into
    compiled.drive(*(part or (0, cells)), start, values, spans, control, *outcome.arrays)
    return outcome


def run_cells(compiled: Kernel, scene: Scene) -> Outcome:
    """All cells of a scene by a kernel of its equations, as `run` has them but without reductions and early ends."""
    cells = plan(scene)
    rtol, atol = (tolerance.min() for tolerance in tolerances(scene, scene.equations, cells.numbers))
    control = control_array(rtol, atol, math.inf, scene.max_steps, jumps=False)
    outcome = blank(*cells.start.shape)
    compiled.drive(0, scene.cells, cells.start, cells.numbers, cells.spans, control, *outcome.arrays)
    return outcome


# -- kernels as plain Python ---------------------------------------------------------------------------------


class _From:
    """What stands in a list from some place on."""

    def __init__(self, array: list, first: int) -> None:
        self.array, self.first = array, first

    def __getitem__(self, k: int) -> Any:
        return self.array[self.first + k]

    def __setitem__(self, k: int, value: Any) -> None:
        self.array[self.first + k] = value


def _load(array: list, slot: int, width: int) -> Any:
    return array[slot]


def _store(array: list, slot: int, value: Any) -> None:
    array[slot] = value


def _maximum(a: Any, b: Any) -> Any:
    """Of a number and a NaN the number, as lanes have it."""
    return b if a != a else a if b != b else max(a, b)


def _minimum(a: Any, b: Any) -> Any:
    return b if a != a else a if b != b else min(a, b)


PYTHON: dict[str, Any] = {
    "njit": lambda **options: lambda function: function, "load": _load, "store": _store, "address": _From,
    "select": lambda mask, yes, no: yes if mask else no, "broadcast": lambda number, width: number,
    "any_lane": bool, "lane_bits": int, "absolute": abs, "maximum": _maximum, "minimum": _minimum, "np": np, "math": math,
    "sign": lambda x: (x > 0) - (x < 0),
}  # fmt: skip
SAME = ("exp", "log", "sin", "cos", "atan", "atan2", "tanh", "asinh", "erf", "sqrt", "floor")
FLOATS = {**PYTHON, **{n: getattr(math, n) for n in SAME}}
DIGITS = {**PYTHON, **{n: getattr(mpmath, n) for n in SAME}}
"""What generated text calls, on Python floats and on mpmath numbers."""


def plain(text: str, functions: dict[str, Any]) -> dict[str, Any]:
    """The names that a module of width 1 defines, run by Python itself on any kind of number."""
    body = re.sub(r"^(import|from) .*$", "", text, flags=re.MULTILINE)
    space = dict(functions)
    exec(compile(body, "<kernel>", "exec"), space)
    return space


@dataclass(frozen=True, slots=True)
class Step:
    """What one plain step wrote."""

    y: list
    y_new: list
    dense: list
    error: Any


@dataclass(frozen=True, slots=True)
class Interpreted:
    """The functions of a scene, and the dense output of its driver, as plain Python of width 1."""

    source: SweepKernel
    names: dict[str, Any]

    @classmethod
    def of(cls, source: SweepKernel, functions: dict[str, Any]) -> Interpreted:
        return cls(source, plain(f"{driver.text('driver.dense')}\n\n\n{source.text}", functions))

    def inside(self, theta: Any, c: int, step: Step) -> Any:
        """State variable c at the fraction theta of a step."""
        return self.names["inside"](theta, c, step.y, step.y_new, step.dense, self.source.dimensions)

    def section(self, theta: Any, t: Any, h: Any, p: list, step: Step) -> Any:
        """The section function at the fraction theta of a step."""
        y, outputs = [*step.y, *p], [None, None]  # its value, and the size of its terms
        self.names["section"](theta, t, h, y, step.y_new, step.dense, outputs, self.source.dimensions)
        return outputs[0]


def take_step(kernel: Interpreted, t: Any, h: Any, y: list, p: list, rtol: Any = 0, atol: Any = 1, *graph: Any) -> Step:
    """One step of a kernel that runs as plain Python; a looped one needs its graph and weights."""
    sizes = kernel.source.dimensions
    room = sizes.dense_rows * len(y)
    y_new, dense = [None] * len(y), [None] * (room + sizes.workspace)
    error = kernel.names["step"](t, h, y, [*y, *p], y_new, dense, rtol, atol, *graph)
    return Step(y, y_new, dense[:room], error)

"""Generated text, run by Python itself in 50 digits, against the equations it was made from."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import random
from collections.abc import Callable, Iterator
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from samples import (
    CASES,
    DIGITS,
    TABLE,
    UNEQUAL,
    Interpreted,
    Late,
    friction_chain,
    harmonic_chain,
    plain,
    real,
    take_step,
    third_order,
    waving,
)

from synchain.codegen import integrators
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.program import lowering
from synchain.codegen.program.expressions import Expression, call
from synchain.codegen.steps.elimination import plan
from synchain.codegen.steps.places import by_joint
from synchain.codegen.steps.safe_names import NAMES
from synchain.codegen.steps.sparse_plan import sparse_plan
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

SMALL = mpf(10) ** -38
NETWORKS = Late({**CASES.makers, **UNEQUAL.makers})


@pytest.fixture(autouse=True)
def _fifty_digits():
    with mp.workdps(50):
        yield


@pytest.fixture
def exact_numbers(monkeypatch):
    """Print every constant as a product that keeps all digits, so that only the structure of the text is tested."""
    rounded = lowering.number

    def exact(e: sp.Expr) -> Expression:
        if e.is_Integer or (e.is_Rational and float(e) == e):
            return rounded(e)
        return call("exact", repr(str(e)))

    monkeypatch.setattr(lowering, "number", exact)


@functools.cache
def _sixty_digits(text: str) -> mpf:
    with mp.workdps(60):
        return mpmath.mpmathify(sp.N(sp.sympify(text), 60))


EXACT = {**DIGITS, "exact": _sixty_digits}


# -- references that know nothing of the code generator -------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Right:
    """Right-hand side by mpmath; its derivatives by differences in 100 digits."""

    rhs: object
    p: list

    @classmethod
    def of(cls, eq: Equations, p: list) -> Right:
        return cls(cls.rates(eq), p)

    @staticmethod
    @functools.cache
    def rates(eq: Equations) -> Callable[..., list]:
        """The rates by the time, the states and the parameters."""
        symbols = [TIME, *(sp.Symbol(s, real=True) for s in (*eq.state, *eq.parameters))]
        forces = sp.lambdify(symbols, list(eq.rhs()), "mpmath")
        if not eq.inertial:
            return forces
        mass = sp.lambdify(symbols, sp.Matrix(sp.SparseMatrix(len(eq.state), len(eq.state), eq.mass())), "mpmath")
        return lambda *at: mpmath.lu_solve(mass(*at), mpmath.matrix(forces(*at)))

    def __call__(self, t, y) -> list:
        return [mpf(f) for f in self.rhs(t, *y, *self.p)]

    def jacobian(self, t, y) -> mpmath.matrix:
        size = len(y)
        table = mpmath.matrix(size, size)
        for c in range(size):
            for r, d in enumerate(self.slope(lambda e, c=c: self(t, [u + e * (k == c) for k, u in enumerate(y)]))):
                table[r, c] = d
        return table

    def time_derivative(self, t, y) -> list:
        return self.slope(lambda e: self(t + e, y))

    @staticmethod
    def slope(function) -> list:
        with mp.workdps(100):
            e = mpf(10) ** -25
            return [(8 * (a - b) - (c - d)) / (12 * e) for a, b, c, d in
                    zip(function(e), function(-e), function(2 * e), function(-2 * e), strict=True)]  # fmt: skip


def weighted(row, stages, size):
    return [mpmath.fsum(mpf(w) * k[i] for w, k in zip(row, stages, strict=False)) for i in range(size)]


def explicit_reference(m, f: Right, t, h, y) -> tuple[list, list, list]:
    """New state, error and dense coefficients from the definition in the docstring of Integrator."""
    size, k = len(y), []
    for a, c in zip(m.a, m.c, strict=True):
        k.append(f(t + mpf(c) * h, [u + h * d for u, d in zip(y, weighted(a, k, size), strict=True)]))
    new = [u + h * d for u, d in zip(y, weighted(m.b, k, size), strict=True)]
    rows = [weighted(e, k, size) for e in m.e]
    error = [abs(h * e) for e in rows[0]]
    if len(rows) == 2:
        pairs, tiny = zip(*rows, strict=True), mpf(2.2250738585072014e-308)
        error = [h * e**2 / mpmath.sqrt(e**2 + mpf(0.01) * g**2 + tiny) for e, g in pairs]
    return new, error, [h * d for row in m.dense for d in weighted(row, k, size)]


def rosenbrock_reference(m, f: Right, t, h, y, eq: Equations, jacobian, slope) -> tuple[list, list, list]:
    size, k, jacobian = len(y), [], jacobian.copy()
    shift = 1 / (h * mpf(m.gamma))
    node = [int(name.rpartition("_")[2]) for name in eq.state]
    for i, j in itertools.product(range(size), repeat=2):
        if m.inexact and node[i] != node[j]:
            jacobian[i, j] = 0
    matrix = shift * mpmath.eye(size) - jacobian
    for i, c in enumerate(m.c):
        at = [u + d for u, d in zip(y, weighted(m.a[i], k, size), strict=True)]
        right, old = f(t + mpf(c) * h, at), weighted(m.big_c[i], k, size)
        right = [r + o / h + h * mpf(m.d[i]) * s for r, o, s in zip(right, old, slope, strict=True)]
        k.append(list(mpmath.lu_solve(matrix, mpmath.matrix(right))))
    new = [u + d for u, d in zip(y, weighted(m.b, k, size), strict=True)]
    return new, [abs(e) for e in weighted(m.e[0], k, size)], [d for row in m.dense for d in weighted(row, k, size)]


def dense_errors(m, eq: Equations, h, y, p, jacobian, dense: list, looped: bool) -> list:
    """Errors of the dense output by the pivots of shift M - J, eliminated in the order of the kernel without exchanges."""
    size, shift, mass = len(y), 1 / (h * mpf(m.gamma)), mpmath.eye(len(y))
    names = [sp.Symbol(s, real=True) for s in (*eq.state, *eq.parameters)]
    for key, e in eq.mass().items() if eq.inertial else ():
        mass[key] = sp.lambdify(names, e, "mpmath")(*y, *p)
    slopes = mass * jacobian
    pairs = list(itertools.product(range(size), repeat=2))
    pattern = {(r, c) for r, c in pairs if slopes[r, c] != 0 or mass[r, c] != int(r == c)}
    order = sparse_plan(eq).arrays[NAMES.index("order")].tolist() if looped else plan(size, pattern).order
    matrix, share = shift * mass - slopes, [mpf(0)] * size
    for at, k in enumerate(order):
        share[k] = shift * mass[k, k] / matrix[k, k]
        for r, c in itertools.product(order[at + 1 :], repeat=2):
            matrix[r, c] -= matrix[r, k] * matrix[k, c] / matrix[k, k]
    return [mpf(m.dense_error) * (1 - 2 * f) * abs(d) for f, d in zip(share, dense[-size:], strict=True)]


def states(eq: Equations, seed: int) -> tuple[list, list]:
    """Random state and parameters; those of the friction oscillator have all sizes of |v_r|, some below 1/kappa."""
    dice = random.Random(seed)
    p = [mpf(dice.uniform(0.2, 1.5)) for _ in eq.parameters]
    y = [mpf(dice.uniform(-1.0, 1.0)) for _ in eq.state]
    if "kappa" in eq.parameters:
        p = [mpf(TABLE[name]) for name in eq.parameters]
        reach = [mpf("0.3"), mpf("3e-6"), mpf("-7e-6"), mpf("-2e-5"), mpf("1e-9"), mpf("-0.8")]
        for i in range(eq.n):
            y[eq.n + i] = p[0] - reach[(seed + i) % len(reach)]
    return y, p


def seeds(case: str) -> range:
    """One state of smooth equations, several of those with kinks, all sizes of |v_r| of the friction oscillator."""
    return range(6) if "friction" in case else range(3) if case in ("choices", "third order") else range(2, 3)


@functools.lru_cache(maxsize=64)
def placed(case: str, seed: int) -> tuple:
    """The time, the state and the parameters of a step, its rates, and their derivatives by the state and by the time."""
    eq, t = NETWORKS[case], mpf(seed) / 3
    y, p = states(eq, seed)
    f = Right.of(eq, p)
    return t, y, p, f, f.jacobian(t, y), f.time_derivative(t, y)


@functools.lru_cache(maxsize=64)
def expected(case: str, method: str, seed: int) -> tuple:
    """The length of a step and its results by definition."""
    m = integrators.integrator(method)
    t, y, _, f, jacobian, slope = placed(case, seed)
    h = mpf(1) / (20 + 30 * seed)
    if m.kind == "rosenbrock":
        return h, rosenbrock_reference(m, f, t, h, y, NETWORKS[case], jacobian, slope)
    return h, explicit_reference(m, f, t, h, y)


def close(values: list, expected: list, allowed=SMALL) -> bool:
    size = max(map(abs, expected), default=mpf(0)) + 1
    return len(values) == len(expected) and all(
        abs(a - b) <= allowed * size for a, b in zip(values, expected, strict=True)
    )


def refused(eq: Equations, m: integrators.Integrator, looped: bool) -> str:
    """What a kernel says that cannot step a network; empty where it can."""
    if not eq.inertial or looped:
        return ""
    what = "links with inertia" if eq.inertial_links else "nodes with a mass matrix"
    return f"found {what}" if m.inexact else ""


METHODS = [name for name in integrators.names() if name != "taylor"]
INERTIAL = ("inertial", "clocks", "pendula", "telescopes")
"""Networks with masses, which need not be derived to be known."""


def steps_of_cases() -> Iterator[Any]:
    """Every method on two networks; on the others those that differ in more than numbers."""
    for case, looped in itertools.product(NETWORKS, (False, True)):
        if case in ("looped", "inertial"):
            methods = METHODS
        elif looped:
            methods = ["dop853", "rodas5p"]
        elif case in INERTIAL:
            methods = ["dop853", "rodas5p", "ros34pw2"]
        else:
            methods = ["ros34pw2", "rodas5p", "dop853"]
        for method in methods:
            dear = not looped and (method, case) in (
                ("dop853", "pendula"), ("dop853", "telescopes"),  # its stages: the implicit ones
                ("rodas5p", "pendula"),  # clocks have masses of states, telescopes four coordinates
            )  # fmt: skip
            yield pytest.param(case, method, looped, marks=[pytest.mark.long] if dear else [])


@pytest.mark.parametrize(("case", "method", "looped"), list(steps_of_cases()))
def test_a_step_is_what_its_definition_says(case, method, looped, exact_numbers):
    eq, m = NETWORKS[case], integrators.integrator(method)
    assert eq.inertial == (case in INERTIAL)
    unroll = 0 if looped else 8
    refusal = refused(eq, m, looped)
    if refusal:
        with pytest.raises(ValueError, match=refusal):
            emit(eq, method, Recording(()), width=1, unroll=unroll)
        return
    if looped and m.inexact:
        with pytest.raises(ValueError, match="steps at most 0 nodes"):
            emit(eq, method, Recording(()), width=1, unroll=unroll)
        return
    kernel = Interpreted.of(emit(eq, method, Recording(("trajectory",)), width=1, unroll=unroll), EXACT)
    assert kernel.source.driver.looped is looped
    weights = [mpf(w.numerator) / w.denominator for (_, _, w), _ in by_joint(eq)]
    graph = (sparse_plan(eq).arrays, np.array(weights, object)) if looped else ()
    for seed in seeds(case):
        t, y, p, _, jacobian, _ = placed(case, seed)
        h, (new, error, dense) = expected(case, method, seed)
        rtol, atol = mpf(1) / 7, mpf(1) / 1000
        step = take_step(kernel, t, h, y, p, rtol, atol, *graph)
        assert close(step.y_new, new)
        assert close(step.dense[: len(dense)], dense)
        if m.dense_error:
            error = list(map(max, error, dense_errors(m, eq, h, y, p, jacobian, dense, looped)))
        scaled = [e / (atol + rtol * max(abs(a), abs(b))) for e, a, b in zip(error, y, new, strict=True)]
        assert abs(step.error - max(scaled)) <= SMALL * (1 + max(scaled))


@pytest.mark.parametrize("case", NETWORKS)
def test_equations_agree_with_differences(case):
    eq = NETWORKS[case]
    names = [TIME, *(sp.Symbol(s, real=True) for s in (*eq.state, *eq.parameters))]
    places, entries = zip(*eq.jacobian().items(), strict=True)
    functions = (list(eq.rhs()), list(entries), list(eq.time_derivative()))
    rates, slopes, drifts = (sp.lambdify(names, e, "mpmath") for e in functions)
    for seed in seeds(case):
        y, p = states(eq, seed)
        f, t = Right(rates, p), mpf(seed) / 3
        table = mpmath.matrix(len(y), len(y))
        for index, e in zip(places, slopes(t, *y, *p), strict=True):
            table[index] = e
        expected = f.jacobian(t, y)
        assert max(abs(d) for d in table - expected) <= SMALL * (1 + mpmath.norm(expected))
        slope = drifts(t, *y, *p)
        assert close([mpf(s) for s in slope], f.time_derivative(t, y))


def test_node_functions_of_the_friction_oscillator(exact_numbers):
    # `node` and `node_linear` by themselves; what they are given is computed at the beginning of the step
    eq = friction_chain(1)
    text = emit(eq, "rodas5p", Recording(()), width=1).text
    head, _ = text.split("    # factors of shift - J\n")  # the step is the last function
    space = plain(head + "    return locals()\n", EXACT)
    for seed in range(6):
        y, p = states(eq, seed)
        error, f = space["step"](mpf(2), mpf(1) / 9, y, [*y, *p], [0, 0], [], 0, 1), Right.of(eq, p)
        assert close([error["f_x_1"], error["f_v_1"]], f(mpf(2), y))
        expected = f.jacobian(mpf(2), y)
        assert abs(error["j_vv_1"] - expected[1, 1]) <= SMALL * abs(expected[1, 1])
        passed = {name: error[name] for name in space["node"].__code__.co_varnames if name in error and name[0] != "z"}
        passed.update(x=y[0], v=y[1])
        arguments = space["node"].__code__.co_varnames[: space["node"].__code__.co_argcount]
        assert abs(space["node"](*(passed[a] for a in arguments)) - error["f_v_1"]) <= SMALL


def test_a_section_function_is_evaluated_inside_the_step(exact_numbers):
    eq = third_order()
    x, z, a = real("x_1", "z_1", "a")
    section = x * z - a * TIME**2 + sp.Rational(1, 10)
    kernel = Interpreted.of(emit(eq, "rodas5p", Recording(("section",), section), width=1), EXACT)
    y, p = states(eq, 4)
    t, h, theta = mpf(1) / 3, mpf(1) / 8, mpf(3) / 7
    step = take_step(kernel, t, h, y, p)
    inside = [kernel.inside(theta, c, step) for c in range(3)]
    expected = inside[0] * inside[2] - p[0] * (t + theta * h) ** 2 + mpf(1) / 10
    assert abs(kernel.section(theta, t, h, p, step) - expected) < SMALL


def test_dense_output_meets_both_ends():
    kernel = Interpreted.of(emit(waving(), "dop853", Recording(("trajectory",)), width=1), DIGITS)
    y = [mpf(1), mpf(0)]
    step = take_step(kernel, mpf(0), mpf(1) / 4, y, [mpf(1) / 5])
    for c in range(2):
        assert kernel.inside(mpf(0), c, step) == y[c]
        assert kernel.inside(mpf(1), c, step) == step.y_new[c]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("broken", [mpf("nan"), mpf("inf")])
def test_an_undefined_estimate_is_never_accepted(broken, method):
    # two nodes without links: what is wrong with one leaves the estimates of the other small
    unlinked = Equations.of_equal_nodes(harmonic_chain(2).node, None, 2)
    kernel = Interpreted.of(emit(unlinked, method, Recording(()), width=1), DIGITS)
    tiny = mpf(10) ** -6
    assert take_step(kernel, mpf(0), tiny, [mpf(1)] * 4, [], mpf(1), mpf(1)).error < 1
    for slot in range(4):
        y = [mpf(1)] * 4
        y[slot] = broken
        assert not take_step(kernel, mpf(0), tiny, y, [], mpf(1), mpf(1)).error <= 1

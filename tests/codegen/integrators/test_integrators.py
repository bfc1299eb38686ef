"""Every file of codegen/integrators: what it declares against what its coefficients do."""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf
from samples import DIGITS, Interpreted, take_step, waving

from synchain.codegen import integrators
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.models.scenes import defaults

METHODS = {name: m for name in integrators.names() if not (m := integrators.integrator(name)).series}
ROUNDING = {"rosenbrock": 4e-14, "explicit": 2e-14}
"""What the rounding of coefficients to doubles may do to a sum; those of Rosenbrock methods go up to 165."""

every_method = pytest.mark.parametrize("m", METHODS.values(), ids=METHODS.keys())
rosenbrock = pytest.mark.parametrize("m", [m for m in METHODS.values() if m.kind == "rosenbrock"], ids=lambda m: m.name)

# -- rooted trees --------------------------------------------------------------------------------------------

Tree = tuple  # of its branches, sorted


@functools.cache
def trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees with that many vertices."""
    return tuple(forests(order - 1, order - 1))


@functools.cache
def forests(order: int, largest: int) -> tuple[tuple[Tree, ...], ...]:
    if order == 0:
        return ((),)
    collected = []
    for size in range(min(order, largest), 0, -1):
        for count in range(1, order // size + 1):
            for many in itertools.combinations_with_replacement(trees(size), count):
                collected += [tuple(sorted((*many, *smaller))) for smaller in forests(order - count * size, size - 1)]
    return tuple(collected)


@functools.cache
def vertices(tree: Tree) -> int:
    return 1 + sum(map(vertices, tree))


@functools.cache
def density(tree: Tree) -> int:
    """gamma(t): the number of vertices times the densities of the branches."""
    product = vertices(tree)
    for branch in tree:
        product *= density(branch)
    return product


def test_numbers_of_rooted_trees():
    assert [len(set(trees(k))) for k in range(1, 10)] == [1, 1, 2, 4, 9, 20, 48, 115, 286]  # OEIS A000081


# -- the coefficients as matrices ----------------------------------------------------------------------------


class Tableau:
    """alpha, and beta = alpha + Gamma (the same for explicit methods); rows of weights on the same stages."""

    def __init__(self, m: Integrator) -> None:
        self.m, size = m, len(m.c)
        self.alpha, self.gamma = self.square(m.a, size), np.zeros((size, size))
        self.change = np.eye(size)  # from weights on the stages as stored to weights on k_i
        if m.kind == "rosenbrock":
            self.gamma = np.linalg.inv(np.eye(size) / m.gamma - self.square(m.big_c, size))
            self.change = self.gamma
            self.alpha = self.alpha @ self.gamma
        self.beta = self.alpha + self.gamma

    @staticmethod
    def square(rows: tuple, size: int) -> np.ndarray:
        table = np.zeros((size, size))
        for i, row in enumerate(rows):
            table[i, : len(row)] = row
        return table

    def weights(self, row: tuple[float, ...]) -> np.ndarray:
        return np.array([*row, *[0.0] * (len(self.m.c) - len(row))]) @ self.change

    def dense(self, theta: float) -> np.ndarray:
        """Weights of y(theta) - y: the formula in the docstring of Integrator."""
        inner = sum(theta**j * self.weights(row) for j, row in enumerate(self.m.dense))
        return theta * self.weights(self.m.b) + theta * (1 - theta) * inner

    def elementary(self, tree: Tree) -> np.ndarray:
        """Elementary weight of each stage: beta behind a single branch, alpha behind several (H&W II, IV.7)."""
        product = np.ones(len(self.m.c))
        for branch in tree:
            product = product * ((self.beta if len(tree) == 1 else self.alpha) @ self.elementary(branch))
        return product

    def defects(self, weights: np.ndarray, order: int, theta: float = 1.0) -> list[float]:
        """How far the conditions of one order are from holding."""
        return [abs(float(weights @ self.elementary(t)) - theta**order / density(t)) for t in trees(order)]


@every_method
def test_row_sums_are_the_nodes(m):
    t = Tableau(m)
    np.testing.assert_allclose(t.alpha.sum(axis=1), m.c, rtol=0, atol=1e-13)
    if m.kind == "rosenbrock":
        np.testing.assert_allclose(t.gamma.sum(axis=1), m.d, rtol=0, atol=1e-13)
        np.testing.assert_allclose(np.diag(t.gamma), m.gamma, rtol=1e-14)


@every_method
def test_order_conditions_hold_up_to_the_order_and_fail_above(m):
    t = Tableau(m)
    for order in range(1, m.order + 1):
        assert max(t.defects(t.weights(m.b), order)) < ROUNDING[m.kind], order
    assert max(t.defects(t.weights(m.b), m.order + 1)) > 1e-6


@every_method
def test_order_of_the_error_estimate(m):
    t = Tableau(m)
    orders = []
    for row in m.e:
        e = t.weights(row)
        sizes = [max(abs(float(e @ t.elementary(tree))) for tree in trees(k)) for k in range(1, m.order + 1)]
        orders.append(next(k for k, size in enumerate(sizes) if size > 1e-6))
        assert max(sizes[: orders[-1]], default=0.0) < ROUNDING[m.kind]
    local = orders[0] + 1 if len(orders) == 1 else 2 * (orders[0] + 1) - (orders[1] + 1)
    assert local == m.error_order + 1
    assert m.error_order < m.order


@every_method
def test_dense_output_has_its_order_and_no_more(m):
    t = Tableau(m)
    for theta in (0.21, 0.5, 0.83):
        for order in range(1, m.dense_order + 1):
            assert max(t.defects(t.dense(theta), order, theta)) < ROUNDING[m.kind], order
        assert max(t.defects(t.dense(theta), m.dense_order + 1, theta)) > 1e-7


@rosenbrock
def test_the_error_of_the_dense_output_in_the_stiff_limit(m):
    """y' = z (y - t^q) + q t^(q-1), z to minus infinity, h = 1: what a step makes of the first power that it gets wrong."""
    if m.dense_order < 2:  # chords; runs warn of them
        assert m.dense_error == 0.0
        return
    size, theta = len(m.c), np.linspace(0.0, 1.0, 1001)
    limit = np.linalg.inv(np.eye(size) + Tableau.square(m.a, size))
    for power in range(1, m.dense_order + 1):
        k = limit @ (np.array(m.c) ** power + (np.array(m.d) if power == 1 else 0.0))
        rows = [np.dot(row, k[: len(row)]) for row in m.dense]
        value = theta * np.dot(m.b, k) + theta * (1 - theta) * sum(theta**j * d for j, d in enumerate(rows))
        error = np.abs(value - theta**power).max()
        assert (error < 1e-12) == (power < m.dense_order), power
    assert m.dense_error == pytest.approx(error / abs(rows[-1]), rel=1e-3)


@every_method
def test_stages_behind_the_step_serve_the_dense_output_alone(m):
    assert len(m.b) == m.stages <= len(m.c)
    assert all(len(row) <= m.stages or not any(row[m.stages :]) for row in m.e)
    used = {i for row in m.dense for i, weight in enumerate(row) if weight}
    used |= {i for row in m.a[m.stages :] for i, weight in enumerate(row) if weight}
    assert set(range(m.stages, len(m.c))) <= used


@every_method
def test_the_source_can_be_found(m):
    assert re.search(r"\b(19|20)\d\d\b", m.source)
    assert re.search(r"\d+, \d+|section|arXiv:\d+", m.source), "neither volume and page nor a section"


@rosenbrock
def test_stiff_accuracy(m):
    t = Tableau(m)
    b = t.weights(m.b)
    np.testing.assert_allclose(t.beta[-1], b, rtol=0, atol=1e-13)
    assert m.c[-1] == 1.0
    assert b.sum() == pytest.approx(1.0, abs=1e-13)


@rosenbrock
def test_l_stability(m):
    t = Tableau(m)
    b, one, unit = t.weights(m.b), np.ones(len(m.c)), np.eye(len(m.c))
    assert abs(1 - b @ np.linalg.solve(t.beta, one)) < 1e-11
    for z in [*(1j * 10**p for p in np.linspace(-3, 6, 400)), *(-(10.0**p) for p in range(-3, 7))]:
        assert abs(1 + z * (b @ np.linalg.solve(unit - z * t.beta, one))) <= 1 + 1e-11, z


def free_defects(t: Tableau) -> list[float]:
    """Conditions of order 3 with any matrix in the place of the Jacobian (Hairer & Wanner II, section IV.7, W-methods)."""
    b, alpha, gamma, one = t.weights(t.m.b), t.alpha, t.gamma, np.ones(len(t.m.c))
    pairs = [
        (alpha, 1 / 2),
        (gamma, 0),
        (alpha @ alpha, 1 / 6),
        (alpha @ gamma, 0),
        (gamma @ alpha, 0),
        (gamma @ gamma, 0),
    ]
    return [abs(b @ m @ one - value) for m, value in pairs] + [abs(b @ (alpha @ one) ** 2 - 1 / 3)]


@pytest.mark.parametrize("m", [m for m in METHODS.values() if m.inexact], ids=lambda m: m.name)
def test_a_w_method_needs_no_jacobian(m):
    assert m.order == 3
    assert max(free_defects(Tableau(m))) < 2e-14


@every_method
def test_a_wrong_digit_is_noticed(m):
    # the conditions are sharp: two entries of a row that are off by 1e-9 against each other show in one of them
    for i, row in enumerate(m.a[: m.stages]):
        filled = [j for j, a in enumerate(row) if a]
        for j, k in itertools.pairwise(filled):
            t, off = Tableau(m), np.zeros((len(m.c), len(m.c)))
            off[i, j], off[i, k] = 1e-9, -1e-9
            t.alpha, t.beta = t.alpha + off, t.beta + off
            worst = max(max(t.defects(t.weights(m.b), order)) for order in range(1, m.order + 1))
            if m.inexact:
                worst = max(worst, *free_defects(t))
            assert worst > 5e-14, (i, j, k)


# -- orders measured with the generated step -----------------------------------------------------------------


@functools.cache
def generated(name: str) -> Interpreted:
    return Interpreted.of(emit(waving(), name, Recording(("trajectory",)), width=1), DIGITS)


DAMPING = [mpf(1) / 5]


def exact(t: mpf) -> list:
    return [mpmath.cos(t), -mpmath.sin(t)]


def distance(a: list, b: list) -> mpf:
    return max(abs(p - q) for p, q in zip(a, b, strict=True))


def slope(error: Callable[[mpf], mpf], *counts: int) -> float:
    """Least-squares slope of log error against log step, for steps 1/count."""
    with mp.workdps(40):
        errors = [float(mpmath.log(error(mpf(1) / n))) for n in counts]
    return float(np.polyfit(-np.log(counts), errors, 1)[0])


STEPS = {"rodas5p": (16, 24, 32), "cash_karp": (16, 32, 64), "dop853": (3, 4, 6)}
"""Steps to a unit of time: short enough for the slope, long enough for coefficients of double precision."""
STARTS = [mpf(0), mpf(1) / 3, mpf(5) / 4, mpf(5) / 2]


def steps(m: Integrator) -> tuple[int, ...]:
    return STEPS.get(m.name, (16, 24, 32))


@every_method
def test_measured_order_of_the_step(m):
    def error(h: mpf) -> mpf:
        y, t, total = exact(mpf(0)), mpf(0), mpf(0)
        for _ in range(round(4 / h)):
            y = take_step(generated(m.name), t, h, y, DAMPING).y_new
            t += h
            total += h * distance(y, exact(t))
        return total

    assert slope(error, *steps(m)) == pytest.approx(m.order, abs=0.15)


@every_method
def test_measured_order_of_the_dense_output(m):
    def error(h: mpf) -> mpf:
        kernel, total = generated(m.name), mpf(0)
        for t, theta in itertools.product(STARTS, (mpf(1) / 5, mpf(1) / 2, mpf(5) / 6)):
            step = take_step(kernel, t, h, exact(t), DAMPING)
            states = [kernel.inside(theta, c, step) for c in range(2)]
            total += distance(states, exact(t + theta * h))
        return total

    assert slope(error, *steps(m)) == pytest.approx(m.dense_order + 1, abs=0.15)


@every_method
def test_measured_order_of_the_error_estimate(m):
    def error(h: mpf) -> mpf:
        return sum(take_step(generated(m.name), t, h, exact(t), DAMPING).error for t in STARTS)

    assert slope(error, *steps(m)) == pytest.approx(m.error_order + 1, abs=0.15)


# -- refusals ------------------------------------------------------------------------------------------------


def test_wrong_integrators_are_refused():
    good = METHODS["cash_karp"]
    fields = {name: getattr(good, name) for name in Integrator.__slots__}
    with pytest.raises(ValueError, match="kind 'implicit'; expected 'rosenbrock', 'explicit' or 'taylor'"):
        Integrator(**{**fields, "kind": "implicit"})
    with pytest.raises(ValueError, match="not strictly lower triangular"):
        Integrator(**{**fields, "a": ((1.0,), *good.a[1:])})
    with pytest.raises(ValueError, match="needs gamma > 0"):
        Integrator(**{**fields, "kind": "rosenbrock"})
    with pytest.raises(
        ValueError,
        match="unknown integrator 'euler'; known: cash_karp, dop853, rodas4, rodas5p, rodas6p, ros34pw2, taylor",
    ):
        integrators.integrator("euler")


def test_scenes_know_the_integrators_that_there_are():
    assert defaults.integrators() == integrators.names()

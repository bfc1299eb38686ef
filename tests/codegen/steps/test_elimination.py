"""Elimination of (shift - J): the emitted statements against NumPy, and what they cost on chains, trees, rings and stars."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import FLOATS, friction_chain, harmonic_chain, plain, spring

from synchain.codegen import driver
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.program.expressions import ONE, Name, Negation, negative
from synchain.codegen.program.printers import LANES
from synchain.codegen.steps.elimination import less, plan, times, write_factors, write_solve
from synchain.codegen.steps.sparse_plan import order, sparse_plan
from synchain.models.dynamics.equations import Equations

Links = list[tuple[int, int]]


def chain(n: int) -> Links:
    return [(i, i + 1) for i in range(n - 1)]


def ring(n: int) -> Links:
    return [*chain(n), (0, n - 1)]


def star(n: int) -> Links:
    return [(0, i) for i in range(1, n)]


def tree(n: int, seed: int) -> Links:
    dice = np.random.default_rng(seed)
    names = dice.permutation(n)
    return [(int(names[dice.integers(i)]), int(names[i])) for i in range(1, n)]


def mechanical(n: int, pairs: Links) -> set[tuple[int, int]]:
    """The pattern of n oscillators: dx/dt = v, and v feels its own x, v and the x of its neighbours."""
    pattern = {(i, n + i) for i in range(n)} | {(n + i, n + i) for i in range(n)} | {(n + i, i) for i in range(n)}
    return pattern | {(n + i, j) for i, j in pairs} | {(n + j, i) for i, j in pairs}


def fill(size: int, pattern: set[tuple[int, int]]) -> int:
    """Entries of the factors that the matrix does not have, apart from the diagonal."""
    steps = plan(size, pattern)
    entries = {(r, k) for k, rows in zip(steps.order, steps.below, strict=True) for r in rows}
    entries |= {(k, c) for k, columns in zip(steps.order, steps.after, strict=True) for c in columns}
    return len(entries - {(r, c) for r, c in pattern if r != c})


# -- the numbers -----------------------------------------------------------------------------------------------


@st.composite
def patterns(draw) -> tuple[int, set[tuple[int, int]]]:
    size = draw(st.integers(1, 7))
    return size, draw(st.sets(st.tuples(st.integers(0, size - 1), st.integers(0, size - 1)), max_size=18))


def entry(kind: int, r: int, c: int) -> sp.Expr:
    """Jacobian entries of all the sorts that a network has: names, signs of names, units, sums, numbers."""
    name = sp.Symbol(f"a{r}_{c}", real=True)
    return [name, -name, sp.S.One, -sp.S.One, 1 + 2 * name, name * sp.Rational(1, 3), sp.Rational(-5, 7)][kind % 7]


def solved(size: int, jacobian: dict, shift: float, values: dict[str, float], right: np.ndarray) -> np.ndarray:
    """Run the emitted statements with Python floats."""
    steps = plan(size, set(jacobian))
    factors = write_factors(steps, jacobian, tuple(f"s{k}_1" for k in range(size)))
    rights, results = {k: f"right{k}" for k in range(size)}, {k: f"result{k}" for k in range(size)}
    space = {**values, "shift": shift, "reach": 1.0 / shift, **{rights[k]: right[k] for k in range(size)}}
    exec("\n".join(LANES.lines([*factors.statements, *write_solve(steps, factors, rights, results)])), space)
    return np.array([space[results[k]] for k in range(size)])


@settings(max_examples=150, deadline=None)
@given(patterns(), st.integers(0, 6), st.integers(0, 1000))
def test_statements_solve_the_system(shape, kinds, seed):
    size, pattern = shape
    dice = np.random.default_rng(seed)
    jacobian = {(r, c): entry(kinds + 3 * r + 5 * c, r, c) for r, c in pattern}
    values = {f"a{r}_{c}": float(dice.uniform(-1, 1)) for r, c in pattern}
    dense = np.zeros((size, size))
    for (r, c), e in jacobian.items():
        dense[r, c] = float(e.xreplace({s: sp.Float(values[s.name]) for s in e.free_symbols}))
    shift, right = 30.0, dice.normal(size=size)
    expected = np.linalg.solve(shift * np.eye(size) - dense, right)
    np.testing.assert_allclose(solved(size, jacobian, shift, values, right), expected, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("endless", [np.inf, -np.inf])
def test_an_infinite_pivot_has_no_solution(endless):
    a = sp.Symbol("a", real=True)
    solution = solved(2, {(0, 0): a, (1, 1): -sp.S.One}, 30.0, {"a": endless}, np.ones(2))
    np.testing.assert_array_equal(np.isnan(solution), [True, False])


@settings(max_examples=100, deadline=None)
@given(patterns())
def test_every_pivot_is_used_once_and_all_updates_are_listed(shape):
    size, pattern = shape
    for steps in (plan(size, pattern), order(size, pattern)):
        assert sorted(steps.order) == list(range(size))
        rank = {k: i for i, k in enumerate(steps.order)}
        filled = {(r, c) for r, c in pattern if r != c}
        for k, below, after in zip(steps.order, steps.below, steps.after, strict=True):
            assert set(below) == {r for r, c in filled if c == k and rank[r] > rank[k]}
            assert set(after) == {c for r, c in filled if r == k and rank[c] > rank[k]}
            filled |= {(r, c) for r in below for c in after if r != c}


def test_signs_and_units_are_folded():
    a, b, c = map(Name, "abc")
    minus = negative(ONE)
    assert times(a, ONE) == times(ONE, a) == a
    assert times(a, minus) == times(minus, a) == Negation(a)
    assert times(minus, Negation(a)) == a
    assert times(Negation(a), b) == Negation(a * b)
    assert negative(Negation(a)) == a
    assert less(a, b, c) == a - b * c
    assert less(a, minus, c) == a + c
    assert less(None, b, c) == Negation(b * c)
    assert less(None, minus, c) == c


def test_plans_do_not_depend_on_the_order_of_the_pattern():
    pattern = sorted(mechanical(6, ring(6)))
    dice = np.random.default_rng(5)
    shuffled = [pattern[i] for i in dice.permutation(len(pattern))]
    assert plan(12, set(pattern)) == plan(12, set(shuffled))
    assert order(12, set(pattern)) == order(12, set(shuffled))


# -- the cost --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 20])
def test_chains_cause_one_entry_a_spring(n):
    # leaf by leaf: with x of the leaf gone, its v and the x of its neighbour meet, and nothing else
    assert fill(2 * n, mechanical(n, chain(n))) == len(chain(n))


@pytest.mark.parametrize("seed", range(6))
def test_trees_cause_one_entry_a_spring(seed):
    links = tree(12, seed)
    assert fill(24, mechanical(12, links)) == len(links)


def test_stars_are_trees_and_rings_pay_for_closing():
    assert fill(24, mechanical(12, star(12))) == 11
    for n in (4, 6, 12):
        # each spring joins velocities, and n - 3 pivots each join a pair that no spring does
        assert fill(2 * n, mechanical(n, ring(n))) == 2 * n + 2 * (n - 3)


@pytest.mark.parametrize(("links", "growth"), [(chain, 2.05), (star, 2.05), (ring, 2.2)])
def test_work_grows_with_the_number_of_nodes(links, growth):
    def work(n: int) -> int:
        steps = plan(2 * n, mechanical(n, links(n)))
        return sum(len(b) * (1 + len(a)) + len(b) + len(a) for b, a in zip(steps.below, steps.after, strict=True))

    assert work(32) / work(16) < growth


@pytest.mark.parametrize("links", [chain, ring, star])
def test_the_plan_of_loops_is_nearly_as_cheap(links):
    n = 16
    pattern = mechanical(n, links(n))
    costs = [sum(map(len, s.below)) + sum(map(len, s.after)) for s in (plan(2 * n, pattern), order(2 * n, pattern))]
    assert costs[1] <= 1.25 * costs[0]


def test_divisions_of_the_friction_chain():
    # one division for each oscillator, besides the one for shift: positions need none
    text = emit(friction_chain(4), "rodas5p", width=1).text
    step = text[text.index("def step") : text.index("# stage 1")]
    assert len(re.findall(r"1\.0/", step)) == 1 + 4


# -- the program of large networks -----------------------------------------------------------------------------


@pytest.mark.parametrize("links", [chain, ring, star, lambda n: tree(n, 3)])
@pytest.mark.parametrize("weighted", [False, True])
def test_the_program_solves_the_system(links, weighted):
    n = 9
    dice = np.random.default_rng(8)
    weight = {p: Fraction(int(dice.integers(1, 5)), 3) if weighted else Fraction(1) for p in links(n)}
    ends = sorted((*p, w) for (i, j), w in weight.items() for p in ((i, j), (j, i)))
    eq = Equations.of_equal_nodes(harmonic_chain(2).node, spring(), n, tuple(ends))
    plan = sparse_plan(eq)
    arrays = dict(zip(driver_names(), plan.arrays, strict=True))
    matrix = np.zeros((2 * n, 2 * n))
    for (r, c), e in eq.jacobian().items():
        matrix[r, c] = float(e.subs({"sigma": 0.0}).xreplace({sp.Symbol("sigma", real=True): sp.Rational(2, 5)}))
    shifted = 3.0 * np.eye(2 * n) - matrix
    space = plain(driver.text("driver.sparse"), {**FLOATS, "NODES": n, "DIMENSION": 2 * n, "WIDTH": 1})
    dense = [0.0] * (plan.entries + 3 * 2 * n)
    dense[: 2 * n] = np.diag(shifted).tolist()
    place(dense, shifted, arrays, n)
    right = dice.normal(size=2 * n)
    x, scratch, other = (plan.entries + k * 2 * n for k in range(3))
    dense[x:scratch] = right.tolist()
    names = ("order", "place", "row_start", "after_start", "column")
    space["factorise"](dense, 0, 0, scratch, *(arrays[name] for name in names))
    names = ("order", "row_start", "after_start", "column")
    space["solve"](dense, 0, 0, x, scratch, other, *(arrays[name] for name in names))
    np.testing.assert_allclose(dense[x:scratch], np.linalg.solve(shifted, right), rtol=1e-11, atol=1e-13)


def driver_names() -> tuple[str, ...]:
    from synchain.codegen.steps.safe_names import NAMES

    return NAMES


def place(dense: list[float], matrix: np.ndarray, arrays: dict[str, np.ndarray], n: int) -> None:
    """Put the entries of a matrix of n nodes with two states where the program has them."""
    ends = list(zip(arrays["target"], arrays["source"], strict=True))
    blocks = (("node_slot", [(i, i) for i in range(n)]), ("there_slot", ends))
    for name, pairs in blocks:
        slots = arrays[name].reshape(4, len(pairs))
        for block in range(4):
            a, b = divmod(block, 2)
            for slot, (i, j) in zip(slots[block], pairs, strict=True):
                if slot >= 0:
                    dense[slot] = matrix[a * n + i, b * n + j]

"""Taylor steps that end at kinks: exact switching times, starts on a kink, joint kinks, kinks that are touched, zero series."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from march import Lanes, alone, compiled, step_of
from plain import Text, march
from samples import path, spring

from synchain import Scene
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import taylor_obstacle, write_looped
from synchain.graphs import chain
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME as T
from synchain.models.mechanics.components import Edge, Node

X, V, A, B = sp.symbols("x v a b", real=True)
NONE: list[float] = []
BOTH = pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])


def bilinear(t: float, stiff: float, x: float = 0.0, v: float = 1.0) -> list[float]:
    """x'' = -x for x < 0 and -stiff**2 x for x > 0, from x = 0 with v > 0: half waves of two lengths, to 30 digits."""
    with mpmath.workdps(30):
        above, below = mpmath.pi / stiff, mpmath.pi
        t = mpmath.mpf(t) % (above + below)
        if t < above:
            return [float(v * mpmath.sin(stiff * t) / stiff), float(v * mpmath.cos(stiff * t))]
        return [float(-v * mpmath.sin(t - above)), float(-v * mpmath.cos(t - above))]


def bending(form: str = "max") -> Equations:
    """A spring that is A**2 times as stiff on one side."""
    more = {
        "max": (A**2 - 1) * sp.Max(X, 0),
        "min": (1 - A**2) * sp.Min(-X, 0),
        "abs": (A**2 - 1) * (X + sp.Abs(X)) / 2,
        "negative": (A**2 - 1) * (X + sp.Abs(-3 * X) / 3) / 2,
        "pieces": sp.Piecewise((0, X < 0), ((A**2 - 1) * X, True)),
        "turned": sp.Piecewise(((A**2 - 1) * X, X >= 0), (0, True)),
    }[form]
    return alone([X, V], [V, -X - more], [A])


def springs(form: str = "max", order: int = 20, looped: bool = False, width: int = 1) -> Lanes:
    return compiled(bending(form), order, width, looped=looped)


# -- accuracy ----------------------------------------------------------------------------------------------------


FORMS = ("max", "min", "abs", "negative", "pieces", "turned")


@pytest.mark.parametrize(
    ("form", "looped"),
    [("max", False), ("abs", True), ("pieces", True), *(pytest.param(form, looped, marks=pytest.mark.long)
     for form in FORMS for looped in (False, True) if (form, looped) not in (("max", False), ("abs", True), ("pieces", True)))],
)  # fmt: skip
def test_a_bilinear_spring_switches_where_it_should(form, looped):
    """Two hundred passages; every form of the same force."""
    end = 100.3 * (math.pi + math.pi / 3.0)
    state, steps = springs(form, looped=looped).run([0.0, 1.0], [3.0], end, 1e-14)
    assert np.abs(state[0] - bilinear(end, 3.0)).max() < 3e-12  # rounding: a smooth swing of this length comes to 1e-12
    assert steps < 1200


@BOTH
@pytest.mark.parametrize("form", FORMS)
def test_the_text_of_every_form_switches_where_it_should(form, looped):
    end = 10.3 * (math.pi + math.pi / 3.0)
    state, steps = march(bending(form), 20, [0.0, 1.0], end, 1e-14, numbers=[3.0], looped=looped)
    assert np.abs(state - bilinear(end, 3.0)).max() < 3e-13
    assert steps < 130


@pytest.mark.parametrize(("rtol", "order"), [(1e-5, 12), (1e-8, 16), (1e-12, 20)])
def test_the_error_is_what_the_tolerance_asks(rtol, order):
    state, _ = march(bending(), order, [0.0, 1.0], 40.0, rtol, numbers=[3.0])
    assert np.abs(state - bilinear(40.0, 3.0)).max() < 30 * rtol


def test_a_step_has_its_order_across_a_kink():
    """The error of a fixed time falls with the tolerance although each half wave holds a jump of the third derivative."""
    errors = [
        np.abs(march(bending(), 8, [0.0, 1.0], 20.0, r, numbers=[3.0])[0] - bilinear(20.0, 3.0)).max()
        for r in (1e-4, 1e-7, 1e-10)
    ]
    assert errors[0] > 20 * errors[1] > 400 * errors[2]
    assert errors[2] < 1e-9


def test_exact_times_of_a_piecewise_exponential():
    """x' = 1 - |x| from -1/2: x = -1 + exp(t)/2 up to t = ln 2, then 1 - exp(-(t - ln 2))."""
    equations = alone([X], [1 - sp.Abs(X)])
    with mpmath.workdps(30):
        for t in (0.5, 0.7, 3.0):
            low, switch = mpmath.exp(mpmath.mpf(t)) / 2 - 1, mpmath.log(2)
            exact = low if t < switch else 1 - mpmath.exp(-(mpmath.mpf(t) - switch))
            assert abs(march(equations, 20, [-0.5], t, 1e-15)[0][0] - exact) < 5e-16 * 4


@BOTH
def test_kinks_of_time_are_found(looped):
    """x' = |sin t|: 2 for each half turn."""
    equations = alone([X], [sp.Abs(sp.sin(T))])
    state, _ = march(equations, 20, [0.0], 100 * math.pi, 1e-14, looped=looped)
    assert state[0] == pytest.approx(200.0, rel=1e-14)


def test_a_kink_that_bends_itself():
    """x' = |x**2 - 1| from 0: tanh t up to nothing; from -3 it comes down to -1 and rests there; from 2 it blows up."""
    equations = alone([X], [sp.Abs(X**2 - 1)])
    assert march(equations, 20, [0.0], 3.0, 1e-14)[0][0] == pytest.approx(math.tanh(3.0), rel=1e-13)
    slow = march(equations, 20, [-3.0], 5.0, 1e-14)[0][0]
    assert slow == pytest.approx(float(-mpmath.coth(mpmath.atanh(mpmath.mpf(1) / 3) + 5)), rel=1e-13)
    crossing, _ = march(alone([X, V], [sp.S.One, sp.Abs(X**2 - 1)]), 16, [-2.0, 0.0], 4.0, 1e-12)
    assert crossing.tolist() == pytest.approx([2.0, 4.0 / 3.0 + 4.0 / 3.0 + 4.0 / 3.0], rel=1e-13)


# -- where a step begins and what it touches ------------------------------------------------------------------------


@pytest.mark.parametrize("start", [0.0, 1e-17, -1e-17, 1e-12, -1e-12, 1e-9])
@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_start_on_or_by_the_kink_costs_a_step_at_most(start, speed):
    state, steps = springs().run([start, speed], [3.0], 2.5, 1e-12)
    _, usual = springs().run([0.0, speed], [3.0], 2.5, 1e-12)
    reference = bilinear(2.5, 3.0) if speed > 0 else [-v for v in (math.sin(2.5), math.cos(2.5))]
    assert np.abs(state[0] - reference).max() < 1e-11 + 4 * abs(start)
    assert steps <= usual + 1


@pytest.mark.parametrize("power", [2, 3, 4])
def test_a_start_at_rest_on_the_kink_goes_where_the_series_goes(power):
    """x leaves zero like t**power: what is on its side is chosen by the first coefficient that is not zero."""
    for sign in (1.0, -1.0):
        equations = alone([X, V], [A * T ** (power - 1), sp.Abs(X)], [A])
        state, _ = march(equations, 16, [0.0, 0.0], 2.0, 1e-13, numbers=[sign])
        assert state.tolist() == pytest.approx([sign * 2.0**power / power, 2.0 ** (power + 1) / power / (power + 1)])


@pytest.mark.parametrize("depth", [-1e-3, -1e-7, -1e-9, -1e-13, 0.0, 1e-13, 1e-9, 1e-7, 1e-3])
def test_a_kink_that_is_touched(depth):
    """v' = |(t - 1)**2 + depth|: two passages so close to each other that looks between would miss them, or none."""
    equations = alone([X, V], [2 * (T - 1), sp.Abs(X + A)], [A])
    state, steps = march(equations, 16, [1.0, 0.0], 2.0, 1e-13, numbers=[depth])
    with mpmath.workdps(40):
        d, edge = mpmath.mpf(depth), mpmath.sqrt(max(0, -mpmath.mpf(depth)))
        exact = mpmath.mpf(2) / 3 + 2 * d + 2 * (-2 * (edge**3 / 3 + d * edge))
        assert abs(state[1] - exact) < 2e-14
    assert steps < 25


def test_joint_kinks_end_one_step():
    """Two kinks that are passed at the same instant by equal and by opposite series."""
    y, w = sp.symbols("y w", real=True)
    rates = [V, -X - 8 * sp.Max(X, 0), w, -y - 8 * sp.Max(y, 0)]
    _, steps = march(bending(), 20, [0.0, 1.0], 30.0, 1e-12, numbers=[3.0])
    both, count = march(alone([X, V, y, w], rates), 20, [0.0, 1.0, 0.0, 1.0], 30.0, 1e-12)
    assert count == steps
    assert both[:2].tolist() == both[2:].tolist()
    mirrored = alone([X, V, y, w], [V, -X - 8 * sp.Max(X, 0), w, -y - 8 * sp.Min(y, 0)])
    both, count = march(mirrored, 20, [0.0, 1.0, 0.0, -1.0], 30.0, 1e-12)
    assert count <= steps + 1
    assert both[:2].tolist() == (-both[2:]).tolist()


def test_a_series_that_is_zero_for_ever_costs_nothing():
    """|x - y| of two equal motions, with equal bits and with rounding between them."""
    y, w = sp.symbols("y w", real=True)
    force = sp.Abs(X - y)
    for second, start in ((-y + force, 1.0), (-y + force, 1.0 + 2.0**-52), (-(y * A) / A + force, 1.0)):
        pair = alone([X, V, y, w], [V, -X + force, w, second], [A])
        free = alone([X, V, y, w], [V, -X, w, -y], [A])
        state, steps = march(pair, 16, [1.0, 0.0, start, 0.0], 60.0, 1e-10, numbers=[0.3])
        usual = march(free, 16, [1.0, 0.0, start, 0.0], 60.0, 1e-10, numbers=[0.3])[1]
        assert steps <= usual + 2
        assert np.abs(state[[0, 2]] - math.cos(60.0)).max() < 1e-8


@pytest.mark.parametrize("size", [1e-200, 1e-8, 1e8, 1e200])
def test_the_size_of_states_does_not_matter(size):
    state, steps = springs().run([0.0, size], [3.0], 40.0, 1e-12, 1e-13 * size)
    assert np.abs(state[0] / size - bilinear(40.0, 3.0)).max() < 1e-10
    assert steps <= springs().run([0.0, 1.0], [3.0], 40.0, 1e-12, 1e-13)[1] + 2


@pytest.mark.parametrize("offset", [1.0, 1e4, 1e8])
def test_a_kink_far_from_zero_passes_on(offset):
    """Rounding of x - a is not that of x: no kink is passed to and fro."""
    equations = alone([X, V], [sp.S.One, sp.Abs(X - A)], [A])
    state, steps = march(equations, 16, [offset - 1.0, 0.0], 2.0, 1e-12, numbers=[offset])
    assert state[1] == pytest.approx(1.0, abs=1e-12 + 1e-15 * offset)
    assert steps < 20


# -- lanes, networks, dense output -----------------------------------------------------------------------------------


def test_lanes_pass_kinks_at_times_of_their_own():
    start = [[0.1 * lane, 1.0 - 0.2 * lane] for lane in range(8)]
    many, _ = springs(width=8).run(start, [3.0], 17.0, 1e-11)
    assert [springs().run(row, [3.0], 17.0, 1e-11)[0][0].tolist() for row in start] == many.tolist()


def test_coefficients_have_the_same_bits_at_every_width():
    """A smoothed friction pair, whose series of |w| are sums of two products in the order of four and more."""
    scene = Scene(topology=chain(2), parameters={"kappa": 10.0})
    values = [scene.parameters[name] for name in scene.equations.parameters]
    single, many = (compiled(scene.equations, 6, width, True) for width in (1, 8))
    starts = np.random.default_rng(1).normal(size=(8, 4)) * [0.3, 0.3, 0.05, 0.05]
    _, _, together = many.step(starts, values, 0.3, scale=0.25, rtol=1e-12)
    for lane, start in enumerate(starts):
        _, _, alone = single.step([start], values, 0.3, scale=0.25, rtol=1e-12)
        assert alone[..., 0].tolist() == together[..., lane].tolist()


@BOTH
def test_equal_oscillators_keep_equal_bits(looped):
    """A ring of four whose links are one-sided springs, in a start of two alternating states."""
    here, there, w = sp.symbols("xh vh", real=True), sp.symbols("xt vt", real=True), sp.Symbol("w", real=True)
    gap = there[0] - here[0]
    edge = Edge(here, there, w, (sp.S.Zero, w * (sp.Max(gap - B, 0) - sp.Max(-gap - B, 0))), (B,))
    node = Node((X, V), (V, -X - A * sp.Abs(V) * V - 5 * sp.Max(X - sp.Rational(1, 5), 0)), (A,))
    ring = Equations.of_equal_nodes(node, edge, 4, tuple((i, (i + k) % 4, 1) for i in range(4) for k in (1, 3)))
    step = compiled(ring, 6, looped=looped)
    state, _ = step.run([1.0, -0.5, 1.0, -0.5, 0.0, 0.2, 0.0, 0.2], [0.3, 0.1], 40.0, 1e-11)
    assert state[0, [0, 1, 4, 5]].tolist() == state[0, [2, 3, 6, 7]].tolist()
    other = compiled(ring, 6, looped=not looped).run(
        [1.0, -0.5, 1.0, -0.5, 0.0, 0.2, 0.0, 0.2], [0.3, 0.1], 40.0, 1e-11
    )
    assert np.abs(other[0] - state).max() < 1e-9


def test_dense_output_ends_at_the_kink():
    step = compiled(alone([X, V], [V, -X - 8 * sp.Max(X, 0)]), 20, dense=True)
    length, new, dense = step.step([-0.05, 1.0], NONE, rtol=1e-13, atol=1e-14)
    passage = math.atan(0.05)
    assert length[0] == pytest.approx(passage, abs=1e-9)
    assert 0.0 < new[0, 0] < 1e-9
    for theta in (0.5, 1.0):
        value = -0.05 + sum(theta ** (k + 1) * row[0, 0] for k, row in enumerate(dense))
        assert value == pytest.approx(math.sin(theta * length[0]) - 0.05 * math.cos(theta * length[0]), abs=1e-15)


def test_states_that_are_no_numbers_give_no_length():
    for start in ([math.nan, 0.0], [1.0, math.inf]):
        assert math.isnan(springs().step(start, [3.0])[0][0])


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "jumping",
    [sp.sign(V), sp.floor(V), sp.ceiling(V), sp.Heaviside(V), sp.Piecewise((V, V > 0), (X, True)),
     sp.Piecewise((X, V > 0), (V, True)), sp.Piecewise((0, sp.And(X > 0, V > 0)), (X, True)),
     sp.Piecewise((sp.sin(X), X > 0), (sp.Abs(sp.sign(V)), True)),
     sp.Max(X - A, 0) ** sp.Rational(3, 2), X * sp.sqrt(2 * sp.Abs(V))],
)  # fmt: skip
def test_functions_that_jump_or_are_roots_at_a_kink_are_refused(jumping):
    equations = alone([X, V], [V, -X - jumping], [A])
    assert taylor_obstacle(equations) is not None
    for write in (step_of, lambda e, order: write_looped(tidy(e), order)):
        with pytest.raises(
            ValueError,
            match=r"taylor: found .*, (along which motion may slide|which has no series).*; expected functions",
        ):
            write(equations, 8)


@pytest.mark.parametrize(
    "joined",
    [sp.Abs(V), sp.Max(X, V, 0), sp.Piecewise((V, V > 0), (2 * V, True)), sp.Piecewise((-1, X < -1), (1, X > 1), (X, True)),
     sp.Piecewise((X**2, X * A > 0), (sp.sin(X), True)), sp.Abs(sp.Abs(X) - 1)],
)  # fmt: skip
def test_continuous_functions_are_taken(joined):
    assert taylor_obstacle(alone([X, V], [V, -X - joined], [A])) is None


def test_nested_kinks_follow_the_solution():
    """x' = 1, v' = ||x| - 1| from -2 to 2: four triangles of area 1/2; a clipped ramp."""
    nested, _ = march(alone([X, V], [sp.S.One, sp.Abs(sp.Abs(X) - 1)]), 12, [-2.0, 0.0], 4.0, 1e-12)
    assert nested[1] == pytest.approx(2.0, rel=1e-14)
    clip = sp.Piecewise((-1, X < -1), (1, X > 1), (X, True))
    ramp, _ = march(alone([X, V], [sp.S.One, clip]), 12, [-2.0, 0.0], 4.5, 1e-12)
    assert ramp[1] == pytest.approx(0.5, rel=1e-13)


def test_the_pair_of_springs_is_that_of_runge_and_kutta():
    from scipy.integrate import solve_ivp

    node = Node((X, V), (V, -X - sp.Abs(V) * V / 5 - A * sp.Max(X - sp.Rational(1, 3), 0) + sp.cos(2 * T)), (A,))
    pair = Equations.of_equal_nodes(node, spring(), 2, path(2))
    values = [{"a": 5.0}.get(name, 0.4) for name in pair.parameters]
    state, _ = march(pair, 20, [0.5, -0.3, 0.0, 0.2], 6.0, 1e-13, numbers=values)
    links = [(i, j, float(w)) for i, j, w in pair.links]
    (link,) = pair.edges
    edge = sp.lambdify([*link.here, *link.there, link.weight, *link.parameters], link.rhs)

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:2], y[2:]
        a = -x - np.abs(v) * v / 5 - 5.0 * np.maximum(x - 1 / 3, 0) + np.cos(2 * t)
        rate = [v.copy(), a]
        for i, j, w in links:
            for c, value in enumerate(edge(x[i], v[i], x[j], v[j], w, *[0.4] * len(link.parameters))):
                rate[c][i] += value
        return np.concatenate(rate)

    solution = solve_ivp(rhs, (0.0, 6.0), [0.5, -0.3, 0.0, 0.2], "DOP853", rtol=1e-13, atol=1e-15, max_step=0.02)
    assert np.abs(state - solution.y[:, -1]).max() < 1e-11


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
def test_a_start_within_rounding_of_a_kink_is_on_it(looped):
    """0.1 + 0.2 - 0.3 is 5.6e-17: the side is that on which the series goes on, and no step is lost on the way there."""
    gap = X + sp.Symbol("c", real=True) + sp.Symbol("d", real=True)
    equations = alone([X], [sp.Abs(gap) - 1], [sp.Symbol("c", real=True), sp.Symbol("d", real=True)])
    text = Text(equations, 8, looped)
    length, _ = text.step(np.array([0.1, 0.2, -0.3]), 0.0, 1.0, 0.25, 1e-6, 1e-7)
    assert length > 0.1
    assert text.state[0] + 0.2 - 0.3 == pytest.approx(np.exp(-length) - 1.0, abs=1e-6)

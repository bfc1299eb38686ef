"""Taylor steps that pass jumps: exact times, starts on a jump, values at zero, and jumps along which motion may slide."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from march import alone
from plain import march
from samples import path
from scipy.integrate import solve_ivp

from synchain import Field, Rates, Scene, run
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import taylor_obstacle, write_looped, write_step
from synchain.graphs import chain, ring
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME as T
from synchain.models.mechanics.components import Edge, Node

X, V, A, B, W = sp.symbols("x v a b w", real=True)
BOTH = pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
TURN = 2.0 * math.pi


def preloaded(t: float, a: float) -> list[float]:
    """x'' = -x - a sign(x) from x = 0, v = 1: half waves about -a and a, to 30 digits."""
    with mpmath.workdps(30):
        half = 2 * mpmath.atan2(1, a)  # x = -a + a cos t + sin t is zero again
        turns = int(t / half)
        sign, within = (-1) ** turns, t - turns * half
        x, v = -a + a * mpmath.cos(within) + mpmath.sin(within), -a * mpmath.sin(within) + mpmath.cos(within)
        return [float(sign * x), float(sign * v)]


PRELOADED = {
    "sign": X + A * sp.sign(X),
    "turned": X - A * sp.sign(-2 * X),
    "heaviside": X + 2 * A * sp.Heaviside(X) - A,
    "pieces": sp.Piecewise((X + A, X > 0), (X - A, True)),
    "three pieces": sp.Piecewise((X + A, X > 0), (X - A, X < 0), (X, True)),
    "closed": sp.Piecewise((X - A, X <= 0), (X + A, True)),
    "square": X + A * X / sp.Abs(X),
    "nested": X + A * sp.sign(X * (2 + sp.sign(X - 1000))),
}


@BOTH
@pytest.mark.parametrize("form", [form for form in PRELOADED if form != "square"])
def test_a_preloaded_spring_turns_where_it_should(form, looped):
    equations = alone([X, V], [V, -PRELOADED[form]], [A])
    state, steps = march(equations, 20, [0.0, 1.0], 60.3, 1e-14, numbers=[0.5], looped=looped)
    assert np.abs(state - preloaded(60.3, 0.5)).max() < 2e-12  # 27 passages, each some roundings late
    assert steps < 150


@pytest.mark.parametrize("rtol", [1e-3, 1e-8])
def test_the_time_of_a_jump_does_not_depend_on_the_tolerance(rtol):
    """x' = sign(sin t) from a jump: triangles, whose series are exact."""
    state, steps = march(alone([X], [sp.sign(sp.sin(T))]), 16, [0.0], 100.5 * TURN, rtol)
    assert state[0] == pytest.approx(math.pi, abs=2e-12)  # 201 passages
    assert steps < 900


@BOTH
def test_falling_to_and_fro(looped):
    """x'' = -sign x: parabolas of period 4."""
    state, steps = march(alone([X, V], [V, -sp.sign(X)]), 12, [0.0, 1.0], 41.0, 1e-10, looped=looped)
    assert state == pytest.approx([0.5, 0.0], abs=2e-11)
    assert steps < 60


@BOTH
@pytest.mark.parametrize(
    "floor", [sp.floor(X), -sp.ceiling(-X), -sp.floor(1 - X) + (1 - sp.Abs(sp.sign(X - sp.floor(X))))]
)
def test_steps_of_whole_numbers(floor, looped):
    """v' = floor x with x = t - 7/2: the sum of -4/2, -3 … 2, 3/2."""
    state, _ = march(alone([X, V], [sp.S.One, floor]), 8, [-3.5, 0.0], 7.0, 1e-10, looped=looped)
    assert state.tolist() == pytest.approx([3.5, -2.0 - 3.0 - 2.0 - 1.0 + 0.0 + 1.0 + 2.0 + 1.5], abs=3e-13)


def test_whole_numbers_on_the_way_up_and_down():
    """v' = floor(3 sin t) over a turn, to 30 digits; from a whole number on."""
    equations = alone([X], [sp.floor(3 * sp.sin(T))])
    with mpmath.workdps(30):
        one, two = mpmath.asin(mpmath.mpf(1) / 3), mpmath.asin(mpmath.mpf(2) / 3)
        up, down = (two - one) * 2 + 2 * (mpmath.pi - 2 * two), -(2 * one + 4 * (two - one) + 3 * (mpmath.pi - 2 * two))
        exact = float(up + down)
    assert march(equations, 20, [0.0], TURN, 1e-13)[0][0] == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(
    ("rate", "value"),
    [(sp.sign(X), 0.0), (sp.Heaviside(X), 0.5), (sp.Heaviside(X, 1), 1.0), (sp.floor(X), 0.0), (sp.ceiling(X), 0.0),
     (sp.Piecewise((3, X > 0), (5, True)), 5.0), (sp.Piecewise((3, X >= 0), (5, True)), 3.0),
     (sp.Piecewise((3, X < 0), (5, True)), 5.0), (sp.Piecewise((3, X <= 0), (5, True)), 3.0)],
)  # fmt: skip
def test_what_stays_zero_has_the_value_at_zero(rate, value):
    """x stays at zero; v' is the value there, and the steps are as long as ever."""
    state, steps = march(alone([X, V], [-X, rate]), 12, [0.0, 0.0], 3.0, 1e-10)
    assert state[1] == pytest.approx(3.0 * value, rel=1e-14)
    assert steps < 12


@pytest.mark.parametrize("speed", [1.0, -1.0])
@pytest.mark.parametrize("start", [0.0, 1e-17, -1e-17, 1e-13, -1e-13])
def test_a_start_on_a_jump_goes_to_its_side(start, speed):
    state, _ = march(alone([X, V], [A, sp.sign(X)], [A]), 12, [start, 0.0], 2.0, 1e-12, numbers=[speed])
    assert state[1] == pytest.approx(2.0 * speed, abs=3e-13 + 2.0 * abs(start))


@pytest.mark.parametrize("speed", [1.0, -1e-5])
@pytest.mark.parametrize("offset", [1.0, 1e8])
def test_a_start_on_a_jump_far_from_zero_leaves_it(offset, speed):
    """The steps that leave it change x by more than rounding."""
    equations = alone([X, V], [A, sp.sign(X - B)], [A, B])
    state, steps = march(equations, 12, [offset, 0.0], 2.0, 1e-12, numbers=[speed, offset])
    assert state[1] == pytest.approx(math.copysign(2.0, speed), abs=1e-14 + 1e-14 * offset / abs(speed))
    assert steps < 30


@BOTH
@pytest.mark.parametrize("power", [1, 2, 5])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_start_at_rest_on_a_jump_goes_where_the_series_goes(way, power, looped):
    """x leaves 3 like t**power, after one coefficient or some: the values are those of its side from the start on."""
    rates = [A * power * T ** (power - 1), sp.sign(X - 3) + 10 * sp.floor(X) + 100 * sp.ceiling(X)]
    state, steps = march(alone([X, V], rates, [A]), 12, [3.0, 0.0], 0.9, 1e-10, numbers=[way], looped=looped)
    assert state.tolist() == pytest.approx([3.0 + way * 0.9**power, 0.9 * (431.0 if way > 0 else 319.0)], rel=1e-14)
    assert steps < 16


@BOTH
def test_a_start_at_rest_that_its_own_jump_drives(looped):
    """x'' = 1 + sign(x - 1)/2 from x = 1 at rest."""
    equations = alone([X, V], [V, 1 + sp.sign(X - 1) / 2])
    state, _ = march(equations, 12, [1.0, 0.0], 2.0, 1e-10, looped=looped)
    assert state.tolist() == pytest.approx([4.0, 3.0], rel=1e-14)


@BOTH
def test_a_jump_sets_off_what_leaves_the_next_one(looped):
    """x = 1 + t from a jump at 1, y'' = sign(x - 1) from a jump at 5, z' = sign(y - 5): all sides are those just after."""
    y, w, z = sp.symbols("y w z", real=True)
    equations = alone([X, y, w, z], [sp.S.One, w, sp.sign(X - 1), sp.sign(y - 5)])
    state, steps = march(equations, 12, [1.0, 5.0, 0.0, 0.0], 2.0, 1e-10, looped=looped)
    assert state.tolist() == pytest.approx([3.0, 7.0, 2.0, 2.0], rel=1e-14)
    assert steps < 12


def test_steps_of_whole_numbers_begin_on_one_on_the_way_down():
    """x = 3 - t with y' = floor x: 2, 1, 0 … from the first moment on."""
    state, steps = march(alone([X, V], [-sp.S.One, sp.floor(X)]), 12, [3.0, 0.0], 4.5, 1e-10)
    assert state.tolist() == pytest.approx([-1.5, 2.0 + 1.0 + 0.0 - 1.0 - 1.0], abs=1e-13)
    assert steps < 20


def test_two_jumps_at_once_end_one_step():
    rates = [V, -X - sp.sign(X), W, -B - sp.sign(B)]
    pair, count = march(alone([X, V, B, W], rates), 16, [0.0, 1.0, 0.0, 1.0], 20.0, 1e-12)
    _, steps = march(alone([X, V], rates[:2]), 16, [0.0, 1.0], 20.0, 1e-12)
    assert count == steps
    assert pair[:2].tolist() == pair[2:].tolist()


@pytest.mark.parametrize("jump", [X**2 * sp.sign(X), sp.sign(X) * sp.sin(X) ** 3])
def test_a_jump_of_size_zero_costs_no_digits(jump):
    smooth = {X**2 * sp.sign(X): X * sp.Abs(X)}.get(jump, sp.Abs(sp.sin(X)) * sp.sin(X) ** 2)
    end, expected = (march(alone([X, V], [V, -X - e]), 16, [0.0, 1.0], 20.0, 1e-12)[0] for e in (jump, smooth))
    assert end == pytest.approx(expected, abs=1e-11)


# -- networks ---------------------------------------------------------------------------------------------------------

LINE = Scene(
    Field({"x": "v", "v": "-x - 3/10*v + 2*sign(cos(t)) - 1/2*sign(x - 1/10)"}),
    Rates({"v": "W*(x_j - x_i + 1/5*floor(x_j - x_i))"}), chain(3),
    initial={"x": (0.0, 0.4, -0.3), "v": (0.5, 0.0, 0.2)}, transient=0, window=20, time_unit="time", rtol=1e-11, record=(),
)  # fmt: skip


def stages(scene: Scene) -> tuple[np.ndarray, int]:
    """The end by SciPy, whose error is that of stages over which rates jump, and the number of steps."""
    rates = sp.lambdify([T, [sp.Symbol(name, real=True) for name in scene.equations.state]], scene.equations.rhs())
    solution = solve_ivp(rates, (0.0, scene.window), scene.y0, "DOP853", rtol=1e-13, atol=1e-14)
    return solution.y[:, -1], solution.t.size - 1


def test_a_network_is_that_of_another_method():
    """Two nodes as machine code; three run as Python below."""
    scene = LINE.replace(topology=chain(2), initial={"x": (0.0, 0.4), "v": (0.5, 0.0)})
    assert taylor_obstacle(scene.equations) is None
    data, (end, steps) = run(scene, show_progress=False).data, stages(scene)
    assert int(data.steps) < 0.1 * steps
    assert np.abs(data.end.values.ravel() - end).max() < 1e-9


def test_lines_and_loops_agree_on_the_network():
    assert taylor_obstacle(LINE.equations) is None
    both = [march(LINE.equations, 18, LINE.y0, 20.0, 1e-12, looped=looped) for looped in (False, True)]
    (lines, count), (loops, _) = both
    end, steps = stages(LINE)
    assert lines == pytest.approx(loops, abs=1e-11)
    assert np.abs(lines - end).max() < 1e-9
    assert count < 0.1 * steps


# -- what is refused --------------------------------------------------------------------------------------------------


def link(rate: sp.Expr, to: int = 1) -> Equations:
    here, there, weight = sp.symbols("x_i v_i", real=True), sp.symbols("x_j v_j", real=True), sp.Symbol("g", real=True)
    rates = [sp.S.Zero, sp.S.Zero]
    rates[to] = weight * rate.xreplace({X: here[0] - there[0], V: here[1] - there[1]})
    edge = Edge(here, there, weight, tuple(rates), ())
    return Equations.of_equal_nodes(Node((X, V), (V, -X), ()), edge, 2, path(2))


@pytest.mark.parametrize(
    "equations",
    [
        alone([X, V], [V, -X - sp.sign(V)]),
        alone([X, V], [V, -X - sp.floor(X + V)]),
        alone([X, V], [V - sp.sign(V), -X - sp.sign(X)]),  # in turn: the rate of x jumps with v, that of v with x
        alone([X, V], [V, -X - sp.Piecewise((1, sp.And(X > 0, V > 0)), (0, True))]),
        link(sp.sign(V)),
        link(sp.sign(X), to=0),
    ],
    ids=["velocity", "both", "in turn", "and", "link", "link of phases"],
)
def test_a_jump_along_which_motion_may_slide_is_refused(equations):
    assert taylor_obstacle(equations) is not None
    for write in (write_step, write_looped):
        with pytest.raises(ValueError, match=r"taylor: found .*, along which motion may slide.*; use .* dop853"):
            write(tidy(equations), 8)


@pytest.mark.parametrize(
    "rate",
    [sp.Piecewise((1 / X, X > 1), (5, True)), sp.Piecewise((1 / X, X > 1), (X, True)),
     sp.Piecewise((sp.log(X), X > 1), (0, True)), sp.Piecewise((sp.sqrt(X - 1), X > 1), (5, True)), sp.sign(1 / X),
     sp.sign(sp.tan(T)), sp.floor(X / (1 + V)), sp.atan(sp.tan(T)), sp.Piecewise((1, 1 / X > 0), (0, True))],
)  # fmt: skip
def test_poles_of_pieces_gaps_and_arcs_are_refused(rate):
    """A step would end at the pole of a piece that is not chosen, and arcs go on smoothly over one."""
    equations = alone([X, V], [sp.S.One, rate])
    assert taylor_obstacle(equations) is not None
    with pytest.raises(
        ValueError, match=r"taylor: found .*, a part of which has a pole, or no value, somewhere; expected"
    ):
        write_step(tidy(equations), 8)


@pytest.mark.parametrize(
    "rate", [sp.Piecewise((1 / (1 + X**2), X > 1), (sp.sqrt(2 + X**2), True)), sp.sign(sp.exp(X) - 2), sp.atan(X * V)]
)
def test_pieces_gaps_and_arcs_with_values_everywhere_are_taken(rate):
    assert taylor_obstacle(alone([X, V], [sp.S.One, rate])) is None


def test_pieces_that_agree_on_one_side_of_a_product_alone_jump():
    """1 - 2 x for x v > 0 and 1 elsewhere agree where x = 0, not where v = 0, along which motion slides."""
    for one, other in ((X, V), (V, X)):
        rate = sp.Piecewise((1 - 2 * one, one * other > 0), (1, True))
        assert taylor_obstacle(alone([one, other], [sp.S.Zero, rate])) == rate


def test_links_that_pass_jumps_are_taken():
    assert taylor_obstacle(link(sp.sign(X))) is None


def test_loads_of_contacts_and_masses_may_not_jump():
    stuck = Scene(topology=ring(3), contact="set-valued", coupling=Rates({"v": "W*(x_j - x_i + sign(x_j - x_i))"}))
    assert str(taylor_obstacle(stuck.equations)).startswith("sign(")
    smooth = stuck.replace(coupling=Rates({"v": "W*(x_j - x_i)"}))
    assert taylor_obstacle(smooth.equations) is None

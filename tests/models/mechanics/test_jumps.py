"""Right-hand sides that jump have no variational equation here: a deviation jumps with them."""

from __future__ import annotations

import pytest
import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from synchain import Field, Rates, Scene, cluster_exponents, exponents, lyapunov_spectrum, msf, periodic_orbit, run
from synchain.graphs import chain
from synchain.models.dynamics.variational import Variation, mode, network_variation, with_volume
from synchain.models.mechanics.jumps import discontinuity, rough_at

x, y, v, t, a = sp.symbols("x y v t a", real=True)


@pytest.mark.parametrize(
    ("e", "part"),
    [
        (v - 2 * sp.sign(x), sp.sign(x)),
        (a * sp.Heaviside(x - y) + v, sp.Heaviside(x - y)),
        (sp.floor(3 * y) - x, sp.floor(3 * y)),
        (v * sp.sign(x) * x + sp.sign(v) * x, sp.sign(v)),
        (Piecewise((x, x > 1), (0, True)), Piecewise((x, x > 1), (0, True))),
        (sp.sign(x**2 - 1) * v, sp.sign(x**2 - 1)),
        (Piecewise((x - 1, sp.Abs(x) > 1), (0, True)), Piecewise((x - 1, sp.Abs(x) > 1), (0, True))),
    ],
)
def test_what_jumps(e: sp.Expr, part: sp.Expr) -> None:
    assert discontinuity([x + v, e], {x, y, v}) == part


@pytest.mark.parametrize(
    "e",
    [
        sp.sign(v) * v**2 - x,
        sp.Abs(x) * x + sp.Max(x, 0),
        x + sp.sign(sp.sin(t)) + sp.Heaviside(a),
        Piecewise((x - 1, x > 1), (0, True)) * v,
        Piecewise((x, x > 1), (0, True)) * (x - 1),
        (x - y) * sp.Heaviside(x - y),
        Piecewise((sp.Abs(x) - 1, sp.Abs(x) > 1), (0, True)) * sp.sign(x),
        Piecewise((x**2 - 1, sp.Max(x, -x) > 1), (0, True)),
        Piecewise((1, sp.Abs(x - y) > a), (0, True)) * sp.Max(0, sp.Abs(x - y) - a),
    ],
)
def test_what_is_continuous(e: sp.Expr) -> None:
    assert discontinuity([e], {x, y, v}) is None


def test_a_volume_may_jump_on_which_nothing_depends() -> None:
    """The divergence of Chua's rates jumps, these do not."""
    network = network_variation(Scene(Field({"x": "y - abs(x)", "y": "-x - y/10 + cos(t)"})).equations)
    extended = Variation(with_volume(network.orbit), network.size, network.matrix)
    assert discontinuity(extended.orbit.node.rhs, {x}) == sp.sign(x)


JUMPS = Field({"x": "v", "v": "-x + 2*sign(x) - d*v + A*cos(w*t)"}, parameters={"A": 0.8, "w": 0.85, "d": 0.1})
NETWORK = Scene(JUMPS, "v->v", chain(3), initial={"x": 0.5, "v": 0})


@pytest.mark.parametrize(
    "call",
    [
        lambda: exponents(NETWORK, [0.0, 0.1]),
        lambda: msf(NETWORK, [0.0, 0.1]),
        lambda: lyapunov_spectrum(NETWORK),
        lambda: periodic_orbit(NETWORK),
        lambda: cluster_exponents(NETWORK, [0, 1, 0]),
        lambda: run(NETWORK, sigma=[0.1], certified=True, show_progress=False),
        lambda: exponents(Scene(topology=chain(2), contact="sign"), [0.0, 0.1]),
    ],
)
def test_small_deviations_along_a_jump_are_refused(call: object) -> None:
    """Without the jump of a deviation the exponent of `JUMPS` is -0.05; with it, it is 0.08."""
    assert callable(call)
    with pytest.raises(
        ValueError, match=r"found sign\((x|x_1|theta_b - v)\), by which rates jump, and deviations too"
    ) as e:
        call()
    assert "\n" not in str(e.value)


def test_jumps_in_time_alone_and_of_size_zero_are_not() -> None:
    node = Field({"x": "v", "v": "-x - sign(v)*v**2 + sign(sin(t))"})
    assert len(mode(Scene(node, "v->v", chain(2)).equations).matrix) == 3
    link = Rates({"x": "K*W*sign(x_j - x_i)"}, {"K": 1.0})
    with pytest.raises(ValueError, match="by which rates jump"):
        network_variation(Scene(Field({"x": "-x"}), link, chain(2)).equations)


@pytest.mark.parametrize("link", ["sign(x_j - x_i)", "abs(x_j - x_i)", "max(0, x_j - x_i)", "min(x_j, x_i) - x_i"])
def test_links_without_a_derivative_between_equal_states_have_no_modes(link: str) -> None:
    scene = Scene(Field({"x": "-x"}), Rates({"x": f"K*W*({link})"}, {"K": 1.0}), chain(2))
    with pytest.raises(ValueError, match="a link jumps or has a kink between equal states"):
        mode(scene.equations)


@pytest.mark.parametrize(
    ("link", "slope"), [("abs(x_j - x_i)*(x_j - x_i)", 0), ("(x_j - x_i)*abs(1 + x_j**2)", 1 + x**2)]
)
def test_kinks_beside_equal_states_and_of_size_zero_do(link: str, slope: sp.Expr) -> None:
    scene = Scene(Field({"x": "-x"}), Rates({"x": f"K*W*({link})"}, {"K": 1.0}), chain(2))
    (entry,) = (e for _, e in mode(scene.equations).matrix)
    state, strength = sp.Symbol("x_1", real=True), sp.Symbol("mode_alpha", real=True)
    assert sp.simplify(entry + 1 + strength * slope.subs(x, state) if slope else entry + 1) == 0


def test_a_kink_is_rough_at_its_place_alone() -> None:
    e = sp.Abs(x - 1) * v
    assert rough_at(e, {x: sp.S.One}, [x]) == sp.Abs(x - 1)
    assert rough_at(e, {x: sp.S.One, v: sp.S.Zero}, [x]) is None
    assert rough_at(e, {x: sp.S.Zero}, [x]) is None

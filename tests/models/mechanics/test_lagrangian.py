"""The Euler-Lagrange operator against textbook results and sympy.physics.mechanics, and every model's energy balance."""

from __future__ import annotations

import pytest
import sympy as sp
from catalogue import LAGRANGIAN
from mechanics_proof import vanishes
from parts import oscillator_of
from sympy.physics import mechanics

from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.lagrangian import Mechanics, total_derivative
from synchain.models.mechanics.nondimensional import nondimensional, physical

x, y, v, w = sp.symbols("x y v w", real=True)
m, g, length, b = sp.symbols("m g l b", positive=True)


def equations_of_motion(
    kinetic: sp.Expr, potential: sp.Expr, forces: list[sp.Expr], q: list[sp.Symbol], v: list[sp.Symbol]
) -> tuple[sp.Expr, ...]:
    return Mechanics(tuple(q), tuple(v), kinetic, potential, tuple(forces)).accelerations()


def test_pendulum() -> None:
    accelerations = equations_of_motion(m * length**2 * v**2 / 2, -m * g * length * sp.cos(x), [-b * v], [x], [v])
    assert sp.simplify(accelerations[0] + g / length * sp.sin(x) + b * v / (m * length**2)) == 0


def test_soft_walls_push_without_steps() -> None:
    accelerations = equations_of_motion(
        v**2 / 2, sp.Max(0, sp.Abs(x) - b) ** 2 + sp.Min(0, x - 2 * b) ** 3, [0], [x], [v]
    )
    assert accelerations == (-2 * sp.sign(x) * sp.Max(0, sp.Abs(x) - b) - 3 * sp.Min(0, x - 2 * b) ** 2,)


def test_growing_mass_brakes() -> None:
    accelerations = equations_of_motion(sp.exp(TIME) * v**2 / 2, sp.S.Zero, [sp.S.Zero], [x], [v])
    assert sp.simplify(accelerations[0] + v) == 0


def test_gyroscopic_terms_turn_the_motion() -> None:
    accelerations = equations_of_motion((v**2 + w**2) / 2 + b * x * w, sp.S.Zero, [0, 0], [x, y], [v, w])
    assert accelerations == (b * w, -b * v)


def test_kink_in_the_potential_gives_a_sign_and_no_delta() -> None:
    assert equations_of_motion(v**2 / 2, g * sp.Abs(x), [sp.S.Zero], [x], [v]) == (-g * sp.sign(x),)


def test_full_mass_matrix_agrees_with_sympy_mechanics() -> None:
    """The double pendulum, whose mass matrix is full and depends on the angles."""
    kinetic = v**2 + w**2 / 2 + sp.cos(x - y) * v * w
    potential = -2 * g * sp.cos(x) - g * sp.cos(y)
    ours = equations_of_motion(kinetic, potential, [sp.S.Zero, sp.S.Zero], [x, y], [v, w])
    q = mechanics.dynamicsymbols("x y")
    rates = [mechanics.dynamicsymbols(name, 1) for name in ("x", "y")]
    moving = dict(zip([v, w, x, y], [*rates, *q], strict=True))
    method = mechanics.LagrangesMethod((kinetic - potential).subs(moving), q)
    method.form_lagranges_equations()
    theirs = method.mass_matrix.LUsolve(method.forcing)
    for a, e in zip(ours, theirs, strict=True):
        assert sp.simplify(a.subs(moving) - e) == 0


@pytest.mark.parametrize("name", LAGRANGIAN)
@pytest.mark.parametrize("form", [physical, nondimensional])
def test_energy_balance_of_every_oscillator(name: str, form: object) -> None:
    system = form(oscillator_of(name))  # type: ignore[operator]
    found, power = system.energy_rate()
    assert vanishes(found - power)
    lost = sp.Add(*(rate * force for rate, force in zip(system.velocities, system.forces, strict=True)))
    steady = not any(e.has(TIME) for e in (system.kinetic, system.potential))
    assert not steady or vanishes(found - lost)


def test_energy_balance_of_the_friction_oscillator_by_hand() -> None:
    """The belt does the work epsilon f(theta_b - v) v; the driven end -dL/dt = u omega sin(omega t) (x - u cos(omega t))."""
    rate, _ = nondimensional(oscillator_of("friction")).energy_rate()
    epsilon, belt, u, omega = sp.symbols("epsilon theta_b u omega", real=True)
    f = sp.Function("f", real=True)
    end = u * sp.cos(omega * TIME)
    assert sp.expand(rate - epsilon * f(belt - v) * v - u * omega * sp.sin(omega * TIME) * (x - end)) == 0


def test_energy_balance_notices_a_wrong_force() -> None:
    """What the balance rests on: with the acceleration of another model it does not close."""
    kinetic, potential = v**2 / 2, x**2 / 2
    _, power = Mechanics((x,), (v,), kinetic, potential, (-b * v,)).energy_rate()
    assert sp.expand(total_derivative(kinetic + potential, [x], [v], [-x + b * v]) - power) == 2 * b * v**2


@pytest.mark.parametrize(
    ("kinetic", "forces", "message"),
    [
        (sp.S.Zero, [0, 0], "no kinetic energy in the velocity v"),
        ((v + w) ** 2 / 2, [0, 0], "mass matrix of v, w is singular"),
        (v**2 + w**2, [0], "2 coordinates, 2 velocities and 1 forces"),
    ],
)
def test_refuses(kinetic: sp.Expr, forces: list[int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        equations_of_motion(kinetic, sp.S.Zero, forces, [x, y], [v, w])


def test_a_motion_has_one_rate_for_each_coordinate_and_velocity() -> None:
    for rates in ([], [x, y]):
        with pytest.raises(ValueError, match="zip"):
            total_derivative(x * v, [x], [v], rates)


def test_mechanics_wants_one_force_for_each_coordinate() -> None:
    with pytest.raises(ValueError, match="1 coordinates, 1 velocities and 0 forces; expected one each"):
        Mechanics((x,), (v,), v**2, x**2, ())

"""What belongs to a located bifurcation: the solution there, its critical vectors, coefficients and the tangent."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import newton

from .arclength import Point, at_value
from .cycles import Cycles
from .detection import TOGETHER, Located, critical_of
from .equilibria import Equilibria
from .equilibrium import equilibrium
from .kinds import BifurcationKind
from .normal_forms import first_lyapunov_coefficient
from .results import Bifurcation
from .switching import directions

# Second value of the secant method that locates where cycles are born, relative to the range of the parameter, and
# largest distance of the critical value there from that of the cycle, relative to its modulus (choices).
FIRST_SHIFT, SAME_VALUE = 1e-4, 0.1


def bifurcation_at(problem: Equilibria | Cycles, located: Located) -> Bifurcation:
    """Return the bifurcation of a branch that was located."""
    point, critical, count = located.point, critical_of(located.point), located.multiplicity
    crosses = located.kind is BifurcationKind.BRANCH_POINT
    kind = problem.birth(point.z) if crosses and isinstance(problem, Cycles) else None
    if kind and isinstance(problem, Cycles) and (origin := _birth(problem, point, kind)):
        return origin
    solution, block = problem.solution(point), int(critical.blocks[located.index])
    value = complex(located.critical.real, abs(located.critical.imag))
    basis = problem.vectors(point.z, value if value.imag else complex(round(value.real)), count, block)
    basis = basis if value.imag else basis.real
    if isinstance(problem, Cycles) and (value.imag or problem.kinked):
        vectors = basis.T
    else:
        vectors = directions(problem.scene, solution.state, basis)
    coefficient, tangent = math.nan, np.zeros(0)
    if isinstance(problem, Equilibria) and located.kind is BifurcationKind.HOPF:
        # Real and imaginary part of the eigenvector are orthogonal at this phase.
        vectors = vectors * np.exp(-0.5j * np.angle((vectors**2).sum(axis=1)))[:, None]
        if count == 1:
            coefficient = first_lyapunov_coefficient(problem, point.z, vectors[0], value.imag)
    if crosses:
        tangent = problem.network_tangent(point)
    residual = abs(critical.growth[located.index]) / located.scale
    return Bifurcation(
        point.value, located.kind, residual, solution, problem.names[-1], point.length, value, count,
        vectors.astype(complex), problem.mode(block), coefficient, tangent,
    )  # fmt: skip


def _birth(problem: Cycles, point: Point, kind: BifurcationKind) -> Bifurcation | None:
    """Return the bifurcation of the equilibrium, or of the cycle of half the period, at which cycles are born.

    Cycles vanish there with the root of the distance, the growth of their origin is linear in it.
    """
    orbit, name = problem.solution(point), problem.names[-1]
    parent: Equilibria | Cycles
    try:
        if kind is BifurcationKind.HOPF:
            rest = equilibrium(orbit.scene, problem.network_states(problem.orbit_states(point.z).mean(axis=0)))
            parent = Equilibria.of(rest, name)
            target = 2j * math.pi / orbit.period
        else:
            half = problem.states(point.z)[: (problem.segments + 1) // 2]
            period, periods = 0.5 * orbit.period, problem.periods // 2
            parent = Cycles.near(orbit.scene, problem.names, problem.classes, half, period, periods, problem.begin)
            target = -1.0 + 0.0j
        span = float(problem.spans[-1])
        parent.set_ranges(np.array([span]))

        def located(value: float) -> Located:
            """Return the parent's solution at a value of the parameter with the critical value nearest to the target."""
            solution = at_value(parent, np.append(parent.point[:-1], value))
            if solution is None:
                raise ArithmeticError(f"no solution at {name} = {value:g}")
            critical = parent.critical(solution.z)
            distances = abs(critical.values - target)
            together = int((distances < distances.min() + TOGETHER * critical.scale).sum())
            solution = replace(solution, critical=critical, length=point.length)
            return Located(kind, solution, int(distances.argmin()), critical.scale, together)

        def growth(value: float) -> float:
            each = located(value)
            return float(critical_of(each.point).growth[each.index])

        value = newton(growth, point.value, x1=point.value + FIRST_SHIFT * span, tol=1e-14 * span, rtol=1e-14)
        found = located(float(value))
    except (ArithmeticError, RuntimeError):  # the origin has no solution there
        return None
    return bifurcation_at(parent, found) if abs(found.critical - target) < SAME_VALUE * abs(target) else None

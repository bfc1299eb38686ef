"""Kernels against quadruple-precision trajectories, exact solutions and their own tight runs."""

from __future__ import annotations

import dataclasses
import functools
import json
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from samples import TABLE, Outcome, drive, friction_scene, harmonic_chain, kernel, numbers, path, real
from scipy.integrate import solve_ivp

from synchain.codegen import integrators
from synchain.codegen.export.python import to_python
from synchain.codegen.machine_code.compile import load
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Edge, Node

DATA = Path(__file__).parents[2] / "data"
ALL = ("sync_error", "section", "trajectory")
V_1 = sp.Symbol("v_1", real=True)
PERIOD = 2 * np.pi / TABLE["omega"]
TOLERANCES = [10.0**-k for k in range(5, 12)]


def friction_kernel(n: int):
    return kernel(friction_scene(n), "rodas5p", ALL, V_1, 8)


def friction_run(n: int, rtol: float, spans: list[tuple[float, float]], **options) -> Outcome:
    start = [[0.3, 0.28][:n] + [0.0] * n] * len(spans)
    return drive(friction_kernel(n), start, [numbers(friction_scene(n))] * len(spans), spans, rtol, **options)


# -- the paper's equations against trajectories in quadruple precision ---------------------------------------


@dataclasses.dataclass(frozen=True)
class Reference:
    times: np.ndarray
    states: np.ndarray

    @classmethod
    def read(cls, n: int) -> Reference:
        data = json.loads((DATA / f"trajectory_n{n}.json").read_text())
        assert numbers(friction_scene(n)) == [data["parameters"][p] for p in friction_scene(n).parameters]
        assert data["y0"] == [0.3, 0.28][:n] + [0.0] * n
        return cls(np.array([float.fromhex(t) for t in data["t"]]), np.array(data["state"], float))


@pytest.mark.parametrize("n", [pytest.param(1, marks=pytest.mark.long), 2])
def test_end_states_keep_to_the_tolerance_and_follow_it(n):
    reference = Reference.read(n)
    errors = []
    for rtol in TOLERANCES:
        outcome = friction_run(n, rtol, [(0.0, t) for t in reference.times])
        assert (outcome.counts[:, 0] == 1).all()
        errors.append(np.abs(outcome.end - reference.states).max())
    ratios = np.array(errors) / TOLERANCES
    assert ratios.max() <= 10.0, ratios
    assert (np.diff(np.log10(errors)) < -0.3).all(), errors
    slope = np.polyfit(np.log10(TOLERANCES), np.log10(errors), 1)[0]
    assert slope > 0.85, slope


def test_samples_of_the_trajectory_lie_on_the_reference():
    # one run up to each reference time whose samples are the start, the middle and the end
    reference = Reference.read(2)
    ends = reference.times[-10:]
    outcome = friction_run(2, 1e-10, [(0.0, t) for t in ends], samples=3)
    middles = friction_run(2, 1e-12, [(0.0, t / 2) for t in ends])
    np.testing.assert_array_equal(outcome.samples[:, 0], [[0.3, 0.28, 0.0, 0.0]] * 10)
    np.testing.assert_allclose(outcome.samples[:, 1], middles.end, rtol=0, atol=1e-9)
    np.testing.assert_allclose(outcome.samples[:, 2], reference.states[-10:], rtol=0, atol=1e-9)


# -- what is recorded in the middle of steps -----------------------------------------------------------------

WINDOW = (10 * PERIOD, 40 * PERIOD)


@pytest.fixture(scope="module")
def tight() -> Outcome:
    return friction_run(2, 3e-14, [WINDOW], atol=1e-15, room=100, samples=61)


@pytest.mark.parametrize(("rtol", "bound"), [(1e-6, 1e-5), (1e-7, 1e-6), (1e-9, 1e-8)])
def test_section_points_are_as_good_as_the_integrator(tight, rtol, bound):
    points = friction_run(2, rtol, [WINDOW], room=100).section(0)
    expected = tight.section(0)
    assert len(points) == len(expected) >= 10
    error = np.abs(points - expected).max()
    step = (WINDOW[1] - WINDOW[0]) / friction_run(2, rtol, [WINDOW]).counts[0, 1]
    assert error <= bound < step**2, (error, step)
    assert np.abs(points[:, 3]).max() < 1e-13, "the section function does not vanish at its points"


def test_section_points_follow_the_tolerance(tight):
    errors = [np.abs(friction_run(2, r, [WINDOW], room=100).section(0) - tight.section(0)).max() for r in (1e-6, 1e-9)]
    assert errors[1] < 1e-2 * errors[0], errors


def test_trajectory_samples_follow_the_tolerance(tight):
    for rtol in (1e-6, 1e-8, 1e-10):
        samples = friction_run(2, rtol, [WINDOW], samples=61).samples
        assert np.abs(samples - tight.samples).max() <= 10 * rtol


def test_the_wrong_direction_finds_other_points(tight):
    rising = friction_run(2, 1e-9, [WINDOW], room=100, direction=1.0).section(0)
    both = friction_run(2, 1e-9, [WINDOW], room=100, direction=0.0).section(0)
    falling = friction_run(2, 1e-9, [WINDOW], room=100).section(0)
    assert len(rising) > 10
    merged = np.concatenate([rising, falling])
    np.testing.assert_array_equal(merged[np.argsort(merged[:, 0])], both)
    assert not set(rising[:, 0]) & set(falling[:, 0])


# -- chains without friction: normal modes -------------------------------------------------------------------

X0, V0, SIGMA = np.array([0.7, -0.3, 0.1]), np.array([0.2, 0.4, -0.5]), 0.3


def normal_modes(times: np.ndarray) -> np.ndarray:
    """The exact motion, one row a time."""
    stiffness = np.eye(3) + SIGMA * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]])
    squares, modes = np.linalg.eigh(stiffness)
    w, a, b = np.sqrt(squares), modes.T @ X0, modes.T @ V0
    phase = np.outer(times, w)
    x = (a * np.cos(phase) + b / w * np.sin(phase)) @ modes.T
    v = (-a * w * np.sin(phase) + b * np.cos(phase)) @ modes.T
    return np.hstack([x, v])


def distances(states: np.ndarray) -> np.ndarray:
    """The synchronisation error of rows of states."""
    x, v = states[:, :3], states[:, 3:]
    return np.hypot(x - x[:, :1], v - v[:, :1]).sum(axis=1)


def harmonic_run(method: str, rtol: float, **options) -> Outcome:
    compiled = kernel(harmonic_chain(3), method, ALL, V_1, 8)  # the driver of the others
    return drive(compiled, [[*X0, *V0]], [[SIGMA]], [(5.0, 45.0)], rtol, direction=0.0, **options)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9, 1e-11])
def test_harmonic_chain_follows_its_normal_modes(method, rtol):
    outcome = harmonic_run(method, rtol, room=100, samples=81)
    times = np.linspace(5.0, 45.0, 81)
    assert np.abs(outcome.end[0] - normal_modes(np.array([45.0]))[0]).max() <= rtol
    assert np.abs(outcome.samples[0] - normal_modes(times)).max() <= rtol
    points = outcome.section(0)
    exact = normal_modes(points[:, 0])
    assert len(points) == 15
    assert np.abs(exact[:, 3]).max() <= rtol
    assert np.abs(exact - points[:, 1:]).max() <= rtol


@pytest.mark.parametrize(("method", "bounds"), [("dop853", (1e-4, 3e-7)), ("rodas5p", (3e-6, 1e-9))])
def test_synchronisation_error_is_integrated(method, bounds):
    # Simpson's rule on whole steps: 4th order in a step that dop853 makes long
    times = np.linspace(5.0, 45.0, 800_001)
    values = distances(normal_modes(times))
    mean = np.average((values[1:] + values[:-1]) / 2)
    for rtol, bound in zip((1e-5, 1e-10), bounds, strict=True):
        sums = harmonic_run(method, rtol).sums[0]
        assert abs(sums[0] - mean) <= bound * mean
        assert abs(sums[1] - values.max()) <= 5e-3 * values.max()
        assert sums[1] <= values.max() * (1 + 10 * rtol)
        assert abs(sums[2] - values[-1]) <= 10 * rtol
        assert sums[3] == 45.0


def test_synchronisation_error_of_the_friction_scene(tight):
    # one coupled pair with friction that does not synchronise within the window
    eq = friction_scene(2)
    values = numbers(eq, sigma=0.4)
    run = drive(friction_kernel(2), [[0.3, 0.2, 0, 0]], [values], [(3.0, 25.0)], 1e-7)
    fine = drive(friction_kernel(2), [[0.3, 0.2, 0, 0]], [values], [(3.0, 25.0)], 1e-12, samples=200_001)
    states = fine.samples[0]
    gaps = np.hypot(states[:, 0] - states[:, 1], states[:, 2] - states[:, 3])
    assert gaps.max() > 0.05
    assert run.sums[0, 0] == pytest.approx(np.trapezoid(gaps, dx=22 / 200_000) / 22, rel=1e-5)
    assert run.sums[0, 1] == pytest.approx(gaps.max(), rel=1e-2)
    assert run.sums[0, 2] == pytest.approx(gaps[-1], abs=1e-5)


# -- the Jacobian ------------------------------------------------------------------------------------------


def steps_of(compiled) -> int:
    values = numbers(friction_scene(1))
    return int(
        drive(compiled, [[0.3, 0.0]], [values], [(0.0, 5 * PERIOD)], 1e-6, max_steps=50_000).counts[0, 1:3].sum()
    )


def test_exact_jacobian_keeps_the_number_of_steps_low():
    assert steps_of(friction_kernel(1)) / 5 < 100


def test_a_wrong_jacobian_shows_in_the_number_of_steps():
    right = friction_kernel(1)
    constant = next(line for line in right.source.splitlines() if line.endswith("*epsilon*kappa"))
    wrong = dataclasses.replace(right.origin, code=right.origin.code.replace(constant, constant + "*kappa"))
    assert wrong.text != right.source
    assert steps_of(load(wrong)) > 20 * steps_of(right)


# -- choices -------------------------------------------------------------------------------------------------


def stopped(n: int) -> Equations:
    """Driven oscillators with a stop at x = gap, a drag chosen by a parameter, and ropes that only pull."""
    x, v, gap, stiff, drag, sigma, x_2, v_2, w = real("x", "v", "gap", "stiff", "drag", "sigma", "x_2", "v_2", "w")
    stop = sp.Piecewise((-stiff * (x - gap), x > gap), (0, True))
    braked = sp.Piecewise((-drag * v, drag > sp.Rational(1, 2)), (-drag * v * sp.Abs(v), True))
    node = Node((x, v), (v, -x + stop + braked + sp.cos(sp.S(6) / 5 * TIME)), (gap, stiff, drag))
    rope = sp.Piecewise((sigma * w * (x_2 - x), x_2 > x), (0, True))
    edge = Edge((x, v), (x_2, v_2), w, (sp.S.Zero, rope), (sigma,))
    return Equations.of_equal_nodes(node, edge, n, path(n))


CELLS = [[0.2, 5.0, drag, 0.3] for drag in (0.1, 0.4, 0.6, 0.9, 1.2)]


def started(n: int) -> list[float]:
    return [*np.linspace(-0.4, 0.5, n), *np.linspace(0.7, -0.2, n)]


@functools.cache
def ends_by_scipy(n: int) -> np.ndarray:
    """What all methods are compared with."""
    space: dict = {}
    exec(to_python(stopped(n)), space)
    return np.array([
        solve_ivp(space["rhs"], (0, 6), started(n), "DOP853", args=tuple(cell), rtol=1e-12, atol=1e-13, max_step=0.01).y[:, -1]
        for cell in CELLS
    ])  # fmt: skip


OTHERS = [
    *((method, None, 2) for method in integrators.names() if method not in ("rodas5p", "taylor")),
    ("rodas5p", 1, 2),
    ("rodas5p", 4, 9),
]
"""Kernels whose single steps tests/codegen/steps/test_emit.py compares with their definition, choices among them.

Taylor steps refuse these choices, which jump.
"""


@pytest.mark.parametrize(
    ("method", "width", "n"),
    [("rodas5p", None, 2), ("dop853", 1, 2), *(pytest.param(*other, marks=pytest.mark.long) for other in OTHERS)],
)
def test_choices_by_states_and_parameters_end_where_scipy_says(method, width, n):
    equations, start = stopped(n), started(n)
    assert equations.parameters == ("gap", "stiff", "drag", "sigma")
    outcome = drive(kernel(equations, method, width=width), [start] * 5, CELLS, [(0.0, 6.0)] * 5, 1e-8)
    assert (outcome.counts[:, 0] == 1).all()
    np.testing.assert_allclose(outcome.end, ends_by_scipy(n), rtol=0, atol=3e-6)

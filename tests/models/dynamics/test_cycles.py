"""Cells that repeat themselves bit for bit jump over whole cycles of the drive; nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from samples import TABLE, Outcome, blank, friction_chain, friction_scene, kernel, numbers

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import angular_frequency, common
from synchain.models.mechanics.components import TIME, Node
from synchain.runtime.engines.step_control import control_array

PERIOD = 2 * np.pi / 1.15


def integrate(n: int, records: tuple[str, ...], start, spans, jumps: bool, **values: float) -> Outcome:
    eq = friction_scene(n)
    section = sp.Symbol("v_1", real=True)
    compiled = kernel(eq, "rodas5p", records, section if "section" in records else None, 8)
    start, spans = np.array(start, float), np.array(spans, float)
    spans = np.pad(spans, ((0, 0), (0, 4 - spans.shape[1])))
    spans = np.hstack([spans, np.tile([1e-4, np.pi / 1.15, np.inf], (len(spans), 1))])
    outcome = blank(len(start), 2 * n, 2000 if "section" in records else 0, 0)
    control = control_array(1e-6, 1e-7, np.inf, 1e9, -1.0, jumps)
    table = np.tile(numbers(eq, **values), (len(start), 1))
    compiled.drive(0, len(start), start, table, spans, control, *outcome.arrays)
    assert (outcome.counts[:, 0] == 1).all()
    return outcome


def both(*arguments, **values) -> tuple[Outcome, Outcome]:
    return integrate(*arguments, True, **values), integrate(*arguments, False, **values)


def test_a_periodic_transient_is_jumped_over():
    spans = [[1000 * PERIOD, 1003 * PERIOD, PERIOD], [2001 * PERIOD, 2002 * PERIOD, PERIOD]]
    jumped, full = both(1, (), [[0.3, 0.0], [0.28, 0.0]], spans)
    assert (jumped.counts[:, 4] > [400, 1400]).all()
    assert (full.counts[:, 4] == 0).all()
    assert (jumped.counts[:, 1] < 0.6 * full.counts[:, 1]).all()
    np.testing.assert_allclose(jumped.end, full.end, rtol=0, atol=1e-12)
    assert np.abs(full.end[0] - full.end[1]).max() > 0.1, "the two cells end in different halves of a cycle of two"


@pytest.mark.long
def test_sums_over_a_window_are_those_of_every_period():
    """A step that ends where the window begins, within a period, disturbs an orbit that had repeated itself before."""
    within = [333.3 * PERIOD, 1500.5 * PERIOD, PERIOD]
    spans = [[0.0, 1500 * PERIOD, PERIOD], within, within]
    start = [[0.3, -0.2, 0.0, 0.1], [0.3, -0.2, 0.0, 0.1], [0.3, 0.28, 0.0, 0.0]]
    jumped, full = both(2, ("sync_error",), start, spans, sigma=0.001)
    assert (jumped.counts[:, 4] > 200).all()
    np.testing.assert_allclose(jumped.sums, full.sums, rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(jumped.end, full.end)


@pytest.mark.long
def test_section_points_of_a_window_are_all_there():
    spans = [[1000 * PERIOD, 1064 * PERIOD, PERIOD]]
    jumped, full = both(1, ("section",), [[0.3, 0.0]], spans)
    assert jumped.counts[0, 4] > 400
    assert jumped.counts[0, 3] == full.counts[0, 3] > 30
    np.testing.assert_allclose(jumped.section(0), full.section(0), rtol=1e-13, atol=1e-10)


def test_chaos_never_repeats():
    spans = [[300 * PERIOD, 310 * PERIOD, PERIOD]]
    values = {"omega": 1.4, "sigma": 0.01}
    period = 2 * np.pi / 1.4
    spans = [[300 * period, 310 * period, period]]
    jumped, full = both(2, ("sync_error",), [[0.3, 0.28, 0.0, 0.0]], spans, **values)
    assert jumped.counts[0, 4] == 0
    np.testing.assert_array_equal(jumped.end, full.end)
    np.testing.assert_array_equal(jumped.sums, full.sums)


def test_long_runs_keep_the_phase_of_the_drive():
    # a million periods of the drive after the orbit was reached: the state is that of the first ones
    spans = [[0.0, periods * PERIOD, PERIOD] for periods in (800, 1_000_800)]
    states = integrate(1, (), [[0.3, 0.0]] * 2, spans, True)
    assert states.counts[1, 4] > 1_000_000 - 100
    np.testing.assert_allclose(states.end[1], states.end[0], rtol=0, atol=1e-8)


x, v = sp.symbols("x v", real=True)
a, b = sp.symbols("a b", real=True)


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        (a * sp.cos(b * TIME), b),
        (sp.sin(2 * b * TIME + a) + x * sp.cos(4 * b * TIME), 2 * b),
        (sp.cos(2 * TIME), sp.Integer(2)),
        (sp.cos(a * TIME) + sp.cos(b * TIME), common(a, b)),
        (sp.cos(b * TIME**2), None),
        (TIME * sp.cos(b * TIME), None),
        (sp.cos(b * TIME + x), b),
        (sp.cos(2 * b * TIME) * sp.sin(3 * b * TIME), b),
        (sp.cos(b * TIME / 2) + sp.cos(b * TIME / 3), b / 6),
        (sp.cos(TIME) + sp.cos(sp.sqrt(2) * TIME), common(1, sp.sqrt(2))),
        (sp.cos(x * TIME), None),
        (sp.cos(sp.Piecewise((0, TIME < 5), (1, True))), None),
        (sp.cos(b * TIME) * sp.exp(-TIME), None),
        (-x, None),
    ],
)
def test_the_frequency_of_the_drive_is_derived(force, expected):
    node = Node((x, v), (v, force - v), tuple(sorted((force.free_symbols - {x, v, TIME}), key=str)))
    assert angular_frequency(Equations.of_equal_nodes(node, None, 1)) == expected


def test_the_frequency_of_the_friction_oscillator():
    assert TABLE["omega"] == pytest.approx(1.15)
    assert angular_frequency(friction_chain(2)) == sp.Symbol("omega", real=True)

"""Hard cases as data: scenes at the ends of their parameters, and how each one's end state is known
independently.

Scenes of one group differ in numbers only and share a kernel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.inputs.plugin_files import allow_code
from synchain.models.scenes.scene import Scene

from .stability_events import events
from .stability_models import said

BUDGET = 2_000_000
"""Most steps of a cell."""

REVERSING = str(Path(__file__).with_name("reversing_belt.py"))
"""The oscillator whose belt turns back and forth."""

LENGTH = 6.0
"""Length of a run in non-dimensional time: one slip, one stick and their ends."""


@dataclass(frozen=True, slots=True)
class Case:
    """A scene, and the independent source of its end state, a name in
    `_stability_reference.REFERENCES`.

    `growth`: how much a small change of the state grows until the end, where it is known and large.
    With `skip` it is run as everybody runs it, with whatever `run` may leave out; else every step
    is made.
    """

    group: str
    name: str
    scene: Scene
    reference: str = "radau"
    skip: bool = False
    growth: float = 1.0


def cases(quick: bool = False) -> Iterator[Case]:
    """Yield all cases; `quick` leaves out sizes, most tolerances and the cases with long
    references.
    """
    yield from _steepness(quick)
    yield from _laws(quick)
    yield from _belts(quick)
    yield from _set_valued(quick)
    yield from _coupled(quick)
    yield from _linear(quick)
    yield from _sizes(quick)
    yield from _long(quick)
    for group, name, scene, reference in said(quick):
        yield Case(group, name, scene, reference)
    for name, scene, reference, growth in events(quick):
        yield Case("events", name, scene, reference, growth=growth)


def _scene(n: int = 1, **changes: object) -> Scene:
    given: dict[str, object] = {
        "topology": topology("chain", n),
        "record": (),
        "time_unit": "time",
        "transient": 0.0,
        "window": LENGTH,
        "max_steps": BUDGET,
    }
    return Scene(**{**given, **changes})  # type: ignore[arg-type]


def _steepness(quick: bool) -> Iterator[Case]:
    """How steep the smoothed jump is, at loose and tight tolerances."""
    for power in (0, 5, 11) if quick else range(0, 13, 2):
        scene = _scene(parameters={"kappa": 10.0**power})
        for digits in (2, 8, 11) if quick else (2, 4, 6, 8, 10, 12, 14):
            yield Case("steepness", f"kappa = 1e{power}", scene.replace(rtol=10.0**-digits))


LAWS = {
    "mu_s = mu_k": {"mu_k": 0.3},
    "a = 0": {"a": 0.0},
    "a = 1e4": {"a": 1e4},
    "no drive": {"u": 0.0},
    "drive 1e4": {"u": 1e4},
    "belt at rest": {"theta_b": 0.0},
    "belt reversed": {"theta_b": -0.1},
    "no load": {"epsilon": 0.0},
    "load 1e4": {"epsilon": 1e4},
    "omega = 0": {"omega": 0.0},
    "omega = 1e-3": {"omega": 1e-3},
    "omega = 1e3": {"omega": 1e3},
    "no friction": {"mu_s": 0.0, "mu_k": 0.0},
}
STARTS = {
    "0": (0.0, 0.0),
    "the belt": (0.3, 0.1),
    "above the belt": (0.3, math.nextafter(0.1, 1.0)),
    "below the belt": (0.3, math.nextafter(0.1, 0.0)),
    "the release": (0.6, 0.1),
    "1e-300": (1e-300, 1e-300),
    "1e6": (1e6, 1e6),
}


def _laws(quick: bool) -> Iterator[Case]:
    """Friction laws, drives and belts at the ends of their ranges, and starts on the edges of the
    law.
    """
    left_out = ("omega = 1e3", "load 1e4", "drive 1e4", "1e6") if quick else ()
    for name, numbers in LAWS.items():
        if name not in left_out:
            length = 0.1 if name == "omega = 1e3" else LENGTH
            yield Case("law", name, _scene(parameters=numbers, window=length))
    for name, (x, v) in STARTS.items():
        if name not in left_out:
            yield Case("start", f"start at {name}", _scene(initial={"x": x, "v": v}))


def _belts(quick: bool) -> Iterator[Case]:
    """A belt whose speed turns back and forth, theta_b cos(nu t): slowly, at about the pace of the
    mass, and fast.
    """
    allow_code(REVERSING)
    for nu in (3.0,) if quick else (0.3, 1.0, 3.0, 30.0):
        for kappa in (1e5,) if quick else (1e2, 1e5, 1e12):
            scene = _scene(
                oscillator=REVERSING,
                initial={"x": 0.3, "v": 0.0},
                parameters={"nu": nu, "kappa": kappa},
                window=0.5 if nu > 10 else LENGTH,
            )
            yield Case("reversing belt", f"nu = {nu:g}, kappa = {kappa:g}", scene)


def _set_valued(quick: bool) -> Iterator[Case]:
    """Stick and slip as they are, beside the smoothed law at kappa = 1e12."""
    for sigma in () if quick else (1e-8, 1.0):
        for gap in (0.02, 0.0):
            start = {"x": (0.3, 0.3 - gap), "v": 0.0}
            scene = _scene(2, contact="set-valued", parameters={"sigma": sigma}, initial=start)
            yield Case("set-valued", f"sigma = {sigma:g}, apart by {gap:g}", scene, "smooth")
    for name, numbers in ({} if quick else LAWS).items():
        if name not in ("omega = 1e3", "load 1e4", "drive 1e4"):
            yield Case("set-valued", name, _scene(parameters=numbers, contact="set-valued"), "smooth")


def _coupled(quick: bool) -> Iterator[Case]:
    """Two friction oscillators from none to stiff coupling, apart, close together and equal."""
    pair = _scene(2, integrator="rodas5p")
    for sigma in () if quick else (0.0, 1e-8, 1.0, 1e2):
        for gap in (0.02, 1e-12, 0.0):
            scene = pair.replace(sigma=sigma, initial={"x": (0.3, 0.3 - gap), "v": 0.0})
            yield Case("pair", f"sigma = {sigma:g}, apart by {gap:g}", scene)


def _linear(quick: bool) -> Iterator[Case]:
    """Three oscillators without friction from none to very stiff coupling, and two whose link
    drives them apart.
    """
    free = _scene(3, parameters={"mu_s": 0.0, "mu_k": 0.0}, integrator="rodas5p")
    for sigma in (0.0, 1.0, 1e8) if quick else (0.0, 1e-8, 1.0, 1e2, 1e4, 1e6, 1e8):
        for digits in (8,) if quick else (4, 8, 12):
            scene = free.replace(sigma=sigma, rtol=10.0**-digits)
            yield Case("linear", f"sigma = {sigma:g}", scene, "modes")
    apart = _scene(2, oscillator="harmonic", friction=None, coupling="x->v", integrator="rodas5p")
    for sigma in () if quick else (-1e-3, -0.5, -1.0, -20.0, -1e2, -1e8):
        yield Case("growth", f"sigma = {sigma:g}", apart.replace(sigma=sigma), "growth")


def _sizes(quick: bool) -> Iterator[Case]:
    """Chains in one normal mode, and chains of equal friction oscillators, which move as one."""
    for n in () if quick else (1, 10, 1000, 100_000):
        shape = np.cos(np.pi * (np.arange(n) + 0.5) / n) if n > 1 else np.ones(1)
        strength = {"sigma": 1.0} if n > 1 else {}
        start = {"x": tuple(shape.tolist()), "v": 0.0}
        scene = _scene(n, oscillator="harmonic", friction=None, parameters=strength, initial=start)
        yield Case("size", f"n = {n}", scene, "wave")
    for n in () if quick else (10, 100_000):
        scene = _scene(n, integrator="dop853", initial={"x": 0.3, "v": 0.0}, parameters={"sigma": 1.0, "kappa": 1e2})
        yield Case("size", f"n = {n}, equal starts", scene, "alone")


def _long(quick: bool) -> Iterator[Case]:
    """A driven linear oscillator long after its transient: where it repeats itself whole cycles are
    left out, or not.
    """
    for periods in (1000,) if quick else (1000, 100_000, 1_000_000):
        scene = _scene(
            oscillator="duffing",
            friction=None,
            parameters={"delta": 0.1, "beta": 0.0, "u": 0.3, "omega": 1.15},
            time_unit="period",
            transient=float(periods),
            window=0.3,
            max_steps=100 * periods,
        )
        yield Case("long", f"{periods:g} periods", scene, "steady", skip=True)
        yield Case("long", f"{periods:g} periods, every step", scene, "steady")

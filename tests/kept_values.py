"""A value of every kind of result, made by hand: nothing is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.clusters import clusters
from synchain.runtime.bifurcation.equilibrium import Equilibrium
from synchain.runtime.bifurcation.kinds import BifurcationKind
from synchain.runtime.bifurcation.periodic_result import PeriodicOrbit
from synchain.runtime.bifurcation.results import Bifurcation, Branch, Curve, CurvePoint, Diagram
from synchain.runtime.results.labelled import Labelled
from synchain.runtime.results.reproduction import Reproduction
from synchain.runtime.stability.attractor import Attractor, Motion
from synchain.runtime.stability.cluster_exponents import ClusterExponents
from synchain.runtime.stability.exponent_plane import Plane
from synchain.runtime.stability.exponents import Exponents
from synchain.runtime.stability.lyapunov import Lyapunov
from synchain.runtime.stability.msf import MSF
from synchain.runtime.sweeps.work_precision import WorkPrecision
from synchain.runtime.synchronisation.basin import Basin
from synchain.runtime.synchronisation.criterion import PAPER
from synchain.runtime.synchronisation.critical import Critical
from synchain.runtime.synchronisation.exponent_windows import ExponentWindows
from synchain.runtime.synchronisation.mismatch import Mismatch
from synchain.runtime.synchronisation.probe import Probe
from synchain.runtime.synchronisation.threshold import Sweep, Thresholds
from synchain.runtime.synchronisation.transition import Transition, TransitionCheck

PAIR = Scene(topology=topology("chain", 2), parameters={"omega": 1.15})
ROTORS = Scene(Field({"theta": "w"}, parameters={"w": 0.25}), "theta->theta", topology("chain", 2))


def exponents_on(alpha: np.ndarray) -> Exponents:
    """Exponents that are negative below |alpha| = 0.3, of two starts on two kinds of motion."""
    value = np.abs(alpha) - 0.3
    spread = np.full(len(alpha), 1e-3)
    cycle = Attractor(Motion.PERIODIC, 5.46, np.arange(12.0 * len(alpha)).reshape(3, len(alpha), 2, 2), 2)
    both = np.stack([value, value + 1.0])
    return Exponents(alpha, value, spread, 100.0, 2, both, (cycle, Attractor(Motion.APERIODIC, 0.0)))


def orbit_at(omega: float) -> PeriodicOrbit:
    """An orbit with a state and complex multipliers."""
    return PeriodicOrbit(
        PAIR.replace(omega=omega),
        2,
        np.array([0.1, 0.1, 0.2 * omega, 0.2 * omega]),
        np.array([0.5 + 0.25j, 0.5 - 0.25j]),
        1e-14,
        3,
    )


def at_rest() -> Equilibrium:
    """An equilibrium with a shift and complex eigenvalues."""
    return Equilibrium(
        ROTORS, np.array([0.1, -0.1]), np.array([0.0, -1.5 + 0.5j]), ("theta",), np.array([0.25]), 1e-16, 4
    )


def branch() -> Branch:
    """A branch of three orbits with a bifurcation."""
    omegas = np.array([1.1, 1.2, 1.3])
    turn = Bifurcation(1.25, BifurcationKind.GRAZING, 1e-9, orbit_at(1.25))
    return Branch("omega", omegas, tuple(orbit_at(x) for x in omegas), (turn,), np.zeros(3, int), omegas)


def hopf() -> Bifurcation:
    """A Hopf point of an equilibrium, with its eigenvector."""
    vectors = np.array([[1.0, -0.5j]])
    return Bifurcation(0.5, BifurcationKind.HOPF, 1e-9, at_rest(), "a", 1.5, 2j, vectors=vectors, lyapunov=-0.1)


def curve() -> Curve:
    """A curve of folds in two parameters, with a cusp."""
    values = np.array([[0.1, 0.2], [0.2, 0.3], [0.3, 0.2]])
    cusp = CurvePoint("cusp", (0.2, 0.3), np.array([0.1, -0.1]))
    states, none = np.zeros((3, 2)), np.zeros(3)
    return Curve(ROTORS, BifurcationKind.FOLD, ("a", "b"), values, states, none, np.zeros(3, int), (cusp,), ("a", "b"))


def swept(x: np.ndarray, low: float, high: float) -> Sweep:
    """Verdicts that are good from low to high."""
    good = (x >= low) & (x <= high)
    return Sweep(x, np.where(good, 0.0, np.inf), good.astype(float), ((low, high),))


def basin() -> Basin:
    """Three starts: one synchronous, one not, one without an end."""
    return Basin(
        PAIR,
        FrozenDict({"synchronous": "synchronous"}),
        ("synchronous", "other", "approaching", "not finished", "leaving"),
        PAPER,
        0.95,
        (),
        (),
        start=np.arange(12.0).reshape(1, 3, 4),
        fate=np.array([[0, 1, 3]]),
        error=np.array([[0.0, 0.5, np.inf]]),
        status=np.array([[1, 1, 2]]),
        exponent=np.array([-0.1]),
        stderr=np.array([0.01]),
    )


def thresholds() -> Thresholds:
    """Ranges of a pair, with a warning."""
    sigma = np.linspace(0.0, 0.6, 7)
    return Thresholds(
        PAIR,
        swept(2 * sigma, 0.0, 0.4),
        ((0.0, 0.2),),
        swept(sigma, 0.0, 0.2),
        replace(PAPER, starts=3),
        ExponentWindows(((0.0, 0.2),), ((0.0, 0.01),)),
        ("w",),
    )


def transition() -> Transition:
    """Nodes that are together from strength 0 on, and part at 0.15."""
    return Transition(MSF(PAIR, np.linspace(0.0, 1.0, 5), exponents_on(np.linspace(0.0, 1.0, 21))))


def every_kind() -> dict[str, Labelled]:
    """One value of each kind, by the name of its class."""
    alpha = np.linspace(0.0, 1.0, 5)
    state = clusters(topology("ring", 10), [0, 1] * 5)  # its blocks hold irrational numbers
    values = (
        exponents_on(alpha + 0.1j),
        MSF(PAIR, alpha, exponents_on(np.linspace(0.0, 1.0, 21))),
        Plane(
            PAIR,
            alpha,
            np.array([-0.1, 0.1]),
            np.outer(alpha, [1.0, -1.0]),
            np.ones((5, 2)),
            np.array([[["periodic"]]]),
            9.0,
        ),
        Lyapunov(
            np.array([0.1, -np.inf]),
            np.array([0.01, 0.0]),
            np.array([True, False]),
            np.array([25.0, 50.0]),
            np.array([[0.2, -np.inf], [0.1, -np.inf]]),
            -3.0,
            0.1,
            50.0,
            0.5,
            2,
        ),
        ClusterExponents(
            state, np.array([-0.1, 0.1]), np.full(2, 0.01), 0.0, 0.01, np.array([[0.0, 0.5], [0.5, 0.0]]), 20.0
        ),
        orbit_at(1.2),
        at_rest(),
        hopf(),
        curve(),
        branch(),
        Diagram((branch(), branch())),
        basin(),
        Probe(
            PAIR,
            replace(PAPER, starts=2),
            alpha,
            0.1 * alpha,
            alpha,
            np.array([1.0, 1, 0.5, 0, 0]),
            np.ones((5, 2), int),
        ),
        thresholds(),
        Mismatch(PAIR, ("x", "v"), np.array([-2.0]), np.ones(1), np.ones((1, 2)), np.array([-0.1]), np.ones(1)),
        WorkPrecision(
            PAIR, ("taylor",), np.array([1e-6]), np.ones((1, 1)), np.full((1, 1), 1e-7), np.ones((1, 1)), 1e-9
        ),
        Critical(
            PAIR,
            "sigma",
            np.array([0.2, np.nan]),
            np.array([0.01, np.nan]),
            np.array([-1.0, np.nan]),
            ("-2", ""),
            ("periodic", ""),
            ("", "no zero in the range"),
            np.array([[1.1, 0.1, 0.1, 1e-3], [1.1, 0.3, -0.1, 1e-3]]),
            "omega",
            np.array([1.1, 1.2]),
        ),
        transition(),
        TransitionCheck(transition(), np.array([[0.2, 0.4]]), np.array([[-0.1, np.nan]]), np.ones((1, 2)), ("w",)),
        Reproduction({"threshold": (1.0, 1.1, 0.2), "count": (2.0, 3.0, 0.0)}),
    )
    return {type(value).__name__: value for value in values}

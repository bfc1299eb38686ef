"""Cases of the work-precision benchmark as data: a scene, times, and states that are known far
better than any row.

The friction cases and the smooth one are reference runs in quadruple precision, kept as files in
`data/` that say how they were made. The linear chain needs no run: `normal_modes` gives its states.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from synchain.models.definitions.inline import Lagrangian
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.stability.orbits import unit_of_time

CASES = {
    "friction, n = 1": "trajectory_n1",
    "friction, n = 2": "trajectory_n2",
    "friction, n = 4": "trajectory_n4",
    "smooth, n = 2": "trajectory_smooth",
    "linear, driven, n = 4": "",
}
"""Cases by name: the file of the reference, empty where the solution is exact."""

LINEAR = Lagrangian(
    "v**2/2", "x**2/2 - u*x*cos(omega*t)", coordinates={"x": "v"}, parameters={"u": 0.1, "omega": 1.15}, name="driven"
)
PERIODS = 200
"""Length of the linear case in drive periods."""
GOLDEN = 0.6180339887498949
"""Fraction of the golden section; spreads phases evenly."""

OLD_NAMES = {"vb": "theta_b", "eps": "epsilon"}


@dataclass(frozen=True, slots=True)
class Case:
    """A problem with its solution: times (m,) in non-dimensional time, ascending, and states (m,
    dimension).
    """

    name: str
    scene: Scene
    times: np.ndarray
    states: np.ndarray

    @property
    def period(self) -> float:
        """Period of the drive in non-dimensional time."""
        return unit_of_time(self.scene)

    @property
    def periods(self) -> int:
        """Length of the case in drive periods."""
        return round(float(self.times[-1]) / self.period)

    @property
    def stiff(self) -> bool:
        """True where the smoothed jump of friction holds explicit methods back by stability."""
        values = self.scene.parameters
        return values.get("mu_s", 0.0) * values.get("kappa", 0.0) > 1e3

    @property
    def smoothed(self) -> bool:
        """True for friction without a jump, of any size."""
        return "kappa" in self.scene.parameters

    def within(self, periods: int) -> Case:
        """The same case, shortened to its first periods; its first time stays."""
        count = max(1, int(np.count_nonzero(self.times <= periods * self.period * (1.0 + 1e-12))))
        return Case(self.name, self.scene, self.times[:count], self.states[:count])


def read_case(name: str) -> Case:
    """Return the case of that name; ValueError for an unknown one."""
    if name not in CASES:
        raise ValueError(f"unknown case {name!r}; known: {'; '.join(CASES)}")
    if not CASES[name]:
        scene = _scene(4, {"sigma": 0.1}, {"x": (0.30, 0.28, 0.26, 0.24), "v": 0.0}, oscillator=LINEAR)
        times = _times(PERIODS, unit_of_time(scene))
        return Case(name, scene, times, normal_modes(scene, times))
    data = json.loads(files("benchmarks").joinpath("data", f"{CASES[name]}.json").read_text(encoding="utf-8"))
    parameters = {OLD_NAMES.get(key, key): value for key, value in data["parameters"].items()}
    if data["n"] > 1:
        parameters["sigma"] = data["sigma"]
    times = np.array([float.fromhex(t) for t in data["t"]])
    return Case(name, _scene(data["n"], parameters, data["initial"]), times, np.array(data["state"], dtype=float))


def normal_modes(scene: Scene, times: np.ndarray) -> np.ndarray:
    """States (m, 2 n) of a driven chain without friction, from its normal modes.

    Mode k has the frequency sqrt(1 - sigma gamma_k), gamma_k the eigenvalues of the connectivity
    matrix, and its share of the drive u cos(omega t). Accurate to about 1e-16 times the time.
    Raises ValueError for a scene with friction or links of unequal weight in the two directions.
    Source: Rayleigh, The Theory of Sound, vol. 1, ch. 4-5 (Macmillan, 1877).
    """
    values = scene.parameters
    friction = [values.get(name, 0.0) for name in ("mu_s", "mu_k")]
    if any(friction):
        raise ValueError("normal modes need mu_s = mu_k = 0, found {:g} and {:g}".format(*friction))
    graph = np.array(scene.topology.matrix.tolist(), dtype=float)
    if not np.array_equal(graph, graph.T):
        raise ValueError(f"normal modes need links alike in both directions, found {scene.topology.name!r}")
    gamma, modes = np.linalg.eigh(graph)
    frequency = np.sqrt(1.0 - values.get("sigma", 0.0) * gamma)
    x, v = np.reshape(scene.y0, (2, scene.n)) @ modes
    share = values["u"] * modes.sum(axis=0)
    t, omega = np.asarray(times, dtype=float)[:, None], values["omega"]
    cosine, sine = np.cos(frequency * t), np.sin(frequency * t)
    forced, forced_rate = _driven(frequency, omega, t)
    displacement = x * cosine + v / frequency * sine + share * forced
    velocity = v * cosine - x * frequency * sine + share * forced_rate
    return np.hstack([displacement @ modes.T, velocity @ modes.T])


def _driven(frequency: np.ndarray, omega: float, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution of q'' = -frequency^2 q + cos(omega t) from rest, and its rate; finite at resonance.

    (cos(omega t) - cos(frequency t))/(frequency^2 - omega^2), the difference of cosines written as
    a product.
    """
    half, mean = 0.5 * (frequency - omega), 0.5 * (frequency + omega)
    swing = t * np.sinc(half * t / np.pi)  # sin(half t)/half
    swing_rate = np.cos(half * t)
    scale = 1.0 / (frequency + omega)
    return scale * swing * np.sin(mean * t), scale * (swing_rate * np.sin(mean * t) + swing * mean * np.cos(mean * t))


def _scene(n: int, parameters: dict[str, float], initial: dict[str, object], **node: Any) -> Scene:
    graph = topology("chain", n)
    return Scene(topology=graph, parameters=parameters, initial=initial, record=(), time_unit="time", **node)


def _times(periods: int, period: float) -> np.ndarray:
    """The end of each period, and one time within each, at phases spread by the golden section."""
    whole = np.arange(1, periods + 1)
    return np.sort(np.concatenate([whole, whole - 1.0 + (whole * GOLDEN) % 1.0])) * period

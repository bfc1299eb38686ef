"""Branches, cycles and a basin: digits and time, beside AUTO-07p (bifpy), AUTO of XPPAUT (xpplab) and JaxCont.

Each program follows the same branch of a case with step control and bifurcations located to its tightest useful
tolerances.  Values are compared with closed forms, or with Fourier collocation at 2.5e-14.  A value counts as found if
the program gives one of its kind that is near.  Times are CPU times of all threads and child processes, of the first
call (with compilation by peers, and by us if the cache is empty) and of the fastest later call.  pybasin, which has the
basin too, needs Python 3.12.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.interactions.interaction import Rates
from synchain.models.scenes.scene import Scene
from synchain.runtime.bifurcation.branches import follow
from synchain.runtime.bifurcation.equilibrium import equilibrium
from synchain.runtime.bifurcation.periodic import periodic_orbit
from synchain.runtime.synchronisation.basin import basin

from .peers import followers

COLUMNS = ("case", "program", "found", "largest relative error", "CPU seconds, first", "CPU seconds, again")
REPETITIONS = 3
Row = tuple[object, ...]
Values = Mapping[str, Sequence[float]]


@dataclass(frozen=True, slots=True)
class Case:
    """Expected values of each kind, our way to them, and the relative error of a value that counts as found."""

    name: str
    expected: Values
    own: Callable[[], Values]
    near: float = 1e-3


def rest() -> Values:
    """Folds and Hopf points of the rest of Jansen and Rit's column."""
    sigmoid = "5/(1 + exp(0.56*(6 - {})))".format
    rates = {"y0": "u0", "y1": "u1", "y2": "u2"}
    rates["u0"] = f"325*{sigmoid('(y1 - y2)')} - 200*u0 - 10000*y0"
    rates["u1"] = f"325*(p + 108*{sigmoid('(135*y0)')}) - 200*u1 - 10000*y1"
    rates["u2"] = f"37125*{sigmoid('(135*y0/4)')} - 100*u2 - 2500*y2"
    column = Scene(Field(rates, parameters={"p": -60}, initial=dict.fromkeys(rates, 0)))
    branch = follow(equilibrium(column), "p", to=400)
    return {kind: [each.value for each in branch.points[kind]] for kind in ("fold", "Hopf")}


def antiphase() -> Values:
    """Period and multiplier of the antiphase cycle of two van der Pol oscillators at k = 0.3 and 0.1."""
    node = Field({"x": "v", "v": "(1 - x**2)*v - x"})
    push = Rates({"v": "-k*W*(v_j - v_i)"}, {"k": 0.35})
    pair = Scene(node, push, topology("chain", 2), initial={"x": [2.0, -2.0], "v": 0.0}, transient=50)
    branch = follow(periodic_orbit(pair), "k", to=0.1, values=[0.3, 0.1])
    orbits = [orbit for k, orbit in zip(branch.values, branch.orbits, strict=True) if k in (0.3, 0.1)]
    return {"period": [each.period for each in orbits], "multiplier": [each.multipliers[1].real for each in orbits]}


def unstable() -> Values:
    """Hopf point of Lorenz's equations, and the unstable cycles that are born there, at r = 24, 22 and 20."""
    node = Field({"x": "10*(y - x)", "y": "r*x - y - x*z", "z": "x*y - 8*z/3"}, parameters={"r": 20.0})
    scene = Scene(node, initial={"x": 7.0, "y": 7.0, "z": 19.0})
    (hopf,) = follow(equilibrium(scene), "r", to=26.0).points["Hopf"]
    branch = follow(hopf, "r", to=20.0, values=[24.0, 22.0, 20.0])
    orbits = [orbit for r, orbit in zip(branch.values, branch.orbits, strict=True) if r in (24.0, 22.0, 20.0)]
    cycles = {"period": [each.period for each in orbits], "multiplier": [each.multipliers[0].real for each in orbits]}
    return {"Hopf": [hopf.value], **cycles}


def resonance() -> Values:
    """Both folds of Duffing's resonance in the frequency of the drive."""
    node = Field({"x": "v", "v": "-x - x**3 - v/10 + 0.3*cos(w*t)"}, parameters={"w": 0.8})
    first = periodic_orbit(Scene(node, initial={"x": 0.5, "v": 0.0}, transient=100))
    return {"fold": [each.value for each in follow(first, "w", to=2.2).points["fold"]]}


def locking() -> Values:
    """Share of ten thousand random starts from which a machine locks to its grid."""
    machine = Scene(
        Field({"theta": "v", "v": "0.5 - 0.1*v - sin(theta)"}), time_unit="time", transient=200, window=20, rtol=1e-6
    )
    ranges = {"theta": (-np.pi, np.pi), "v": (-10.0, 10.0)}
    shares = basin(machine, samples=10_000, ranges=ranges, attractors={"locked": "rest"}, show_progress=False).shares
    return {"share": [float(shares.sel(attractor="locked").item())]}


CASES = (
    Case(
        "Jansen-Rit, rest",
        {
            "fold": (113.5862732127988, -41.30141048782859),
            "Hopf": (-12.14749234842, 89.82910796964, 315.69642806882),
        },
        rest,
    ),
    Case(
        "van der Pol pair, antiphase",
        {"period": (7.196573966960774, 6.82122966782178), "multiplier": (0.157520224585, 0.553358926690)},
        antiphase,
    ),
    Case(
        "Lorenz, unstable cycles",
        {
            "Hopf": (470 / 19,),
            "period": (0.679336764198, 0.764386427426, 0.876552253492),
            "multiplier": (1.03208829783, 1.160763014, 1.402070818),
        },
        unstable,
    ),
    Case("Duffing, resonance", {"fold": (1.7797195242986, 1.3242362007706)}, resonance),
    # Stender & Hoffmann, Nonlinear Dynamics 107, 1451 (2022): 10 000 random starts, so that two shares differ by 5 %
    Case("machine at a grid, basin", {"share": (0.152,)}, locking, near=0.1),
)


def notes() -> list[str]:
    """Return a line for each peer that cannot run here."""
    return followers.skipped()


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` calls every program once more, and no peer."""
    rows = []
    for case in CASES:
        programs = {"synchain": case.own} | ({} if quick else followers.of(case.name))
        rows += [row(case, name, run, 1 if quick else REPETITIONS) for name, run in programs.items()]
    return rows


def row(case: Case, program: str, run: Callable[[], Values], repetitions: int) -> Row:
    """Return the row of a program."""
    used = [processor_time()]
    for _ in range(repetitions + 1):
        values = run()
        used.append(processor_time())
    errors = [
        min((abs(value / right - 1.0) for value in values.get(kind, ())), default=np.inf)
        for kind, expected in case.expected.items()
        for right in expected
    ]
    near = [error for error in errors if error < case.near]
    spent = np.diff(used)
    return (
        case.name,
        program,
        f"{len(near)} of {len(errors)}",
        max(near, default=np.nan),
        float(spent[0]),
        float(spent[1:].min()),
    )


def processor_time() -> float:
    """CPU seconds of this process and of its children that have ended."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)

"""Equations of whole networks by sympy.physics.mechanics, and the exact zero test that compares them with ours.

Everything here starts from the energies and forces of the plug-in files and from nothing that the templates do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache

import sympy as sp
from catalogue import real
from parts import coupling_of, oscillator_of
from sympy.physics import mechanics

from synchain.models.graphs.topology import Topology
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.nondimensional import nondimensional

T = mechanics.dynamicsymbols._t
Q_I, Q_J, V_I, V_J, WEIGHT = sp.symbols("q_i q_j v_i v_j weight", real=True)


def vanishes(e: sp.Expr) -> bool:
    """Whether an expression is zero, proved: sines and cosines become letters with s^2 + c^2 = 1, all else is rational."""
    e = sp.expand_trig(e.replace(sp.tanh, lambda a: _odd(sp.tanh, sp.expand(a))))
    inner = sorted({f.args[0] for f in e.atoms(sp.sin, sp.cos)}, key=sp.default_sort_key)
    letters = {a: (sp.Dummy(f"s{k}"), sp.Dummy(f"c{k}")) for k, a in enumerate(inner)}
    e = e.xreplace({sp.sin(a): s for a, (s, _) in letters.items()} | {sp.cos(a): c for a, (_, c) in letters.items()})
    others = sorted(e.atoms(sp.Function, sp.Abs, sp.sign, sp.Derivative), key=sp.default_sort_key)
    e = e.xreplace({f: sp.Dummy(f"f{k}") for k, f in enumerate(others)})
    symbols = sorted(e.free_symbols, key=sp.default_sort_key)
    if not symbols:
        return bool(e == 0)
    top = sp.QQ.frac_field(*symbols).from_sympy(e).numer
    values = dict(zip(symbols, top.ring.gens, strict=True))
    squares = [values[s] ** 2 + values[c] ** 2 - 1 for s, c in letters.values() if s in values and c in values]
    return not top.rem(squares)  # their leading terms are coprime, so that only multiples of them leave nothing


def _odd(function: type[sp.Function], a: sp.Expr) -> sp.Expr:
    return -function(-a) if a.could_extract_minus_sign() else function(a)


@dataclass(frozen=True, slots=True)
class Whole:
    """The Lagrangian of a network in one piece: q and q' as functions of time, T, V and one force for each coordinate.

    `particles` are (mass, across, upward) of every mass; node by node, coordinate by coordinate.
    """

    q: tuple[sp.Expr, ...]
    rates: tuple[sp.Expr, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    forces: tuple[sp.Expr, ...]
    particles: tuple[tuple[sp.Expr, ...], ...]


def whole(oscillator: str, coupling: str | None, graph: Topology, chosen: tuple[str, ...] | None = None) -> Whole:
    """Sum up nodes and links; a link of a coupling with a direction runs from the smaller to the larger number."""
    system = nondimensional(oscillator_of(oscillator))
    names = [s.name for s in system.coordinates]
    q = [[mechanics.dynamicsymbols(f"{name}_{i + 1}") for name in names] for i in range(graph.n)]
    rates = [[x.diff(T) for x in row] for row in q]
    at = [
        {**dict(zip(system.velocities, r, strict=True)), **dict(zip(system.coordinates, x, strict=True)), TIME: T}
        for x, r in zip(q, rates, strict=True)
    ]
    kinetic = sp.Add(*(system.kinetic.xreplace(values) for values in at))
    potential = sp.Add(*(system.potential.xreplace(values) for values in at))
    forces = [force.xreplace(values) for values in at for force in system.forces]
    flat = [r for row in rates for r in row]
    for i, j, weight in graph.links:
        if i > j or coupling is None:
            continue
        law = coupling_of(coupling)
        settings = {WEIGHT: sp.Rational(str(weight))}
        for k in range(len(names)):
            if chosen is not None and names[k] not in chosen:
                continue
            potential += law.potential.xreplace({Q_I: q[i][k], Q_J: q[j][k], **settings})
            lost = law.dissipation.xreplace({V_I: rates[i][k], V_J: rates[j][k], **settings})
            forces = [force - lost.diff(r) for force, r in zip(forces, flat, strict=True)]
    masses = tuple(entry for values in at for entry in particles(oscillator, values))
    return Whole(tuple(x for row in q for x in row), tuple(flat), kinetic, potential, tuple(forces), masses)


def pendulums(
    x: sp.Expr, phi: sp.Expr, psi: sp.Expr, masses: tuple[sp.Expr, ...], lengths: tuple[sp.Expr, ...]
) -> list[tuple[sp.Expr, ...]]:
    """(mass, across, upward) of the masses of a double pendulum, its joint at the height 0."""
    across, upward = x + lengths[0] * sp.sin(phi), -lengths[0] * sp.cos(phi)
    lower = (masses[1], across + lengths[1] * sp.sin(psi), upward - lengths[1] * sp.cos(psi))
    return [(masses[0], across, upward), lower]


PARTICLES: dict[str, Callable[[dict[str, sp.Expr]], list[tuple[sp.Expr, ...]]]] = {
    "double_pendulum": lambda at: pendulums(
        sp.S.Zero, at["phi"], at["psi"], (sp.S.One, real("mass_ratio")), (sp.S.One, real("length_ratio"))
    ),
    "belt_double_pendulum": lambda at: [
        (sp.S.One, at["x"], sp.S.Zero),
        *pendulums(
            at["x"], at["phi"], at["psi"], (real("mass_1"), real("mass_2")), (real("length_1"), real("length_2"))
        ),
    ],
}
"""The masses of oscillators whose mass matrix is full, in units of the first mass, with the coordinates by name."""


def particles(oscillator: str, values: dict) -> Iterable[tuple[sp.Expr, ...]]:
    """(mass, across, upward) of the masses of one node, non-dimensional: of the table, or one on a line for each coordinate."""
    system = nondimensional(oscillator_of(oscillator))
    if oscillator in PARTICLES:
        yield from PARTICLES[oscillator]({x.name: values[x] for x in system.coordinates})
        return
    for x, v in zip(system.coordinates, system.velocities, strict=True):
        mass = system.kinetic.diff(v, 2)
        if mass.free_symbols & {*system.coordinates, *system.velocities, TIME} or system.kinetic.diff(v, x) != 0:
            raise ValueError(f"{oscillator}: the masses depend on the state; write them into PARTICLES")
        yield mass, values[x], sp.S.Zero


@cache
def by_lagrange(system: Whole) -> tuple[sp.Matrix, sp.Matrix]:
    """Mass matrix and forcing by LagrangesMethod; each force acts on a point that moves with its coordinate."""
    frame, loads = _loads(system, system.rates, system.forces)
    method = mechanics.LagrangesMethod(system.kinetic - system.potential, list(system.q), forcelist=loads, frame=frame)
    method.form_lagranges_equations()
    return method.mass_matrix, method.forcing


@cache
def by_kane(system: Whole) -> tuple[sp.Matrix, sp.Matrix]:
    """Mass matrix and forcing by KanesMethod, from the particles; forces and -dV/dq act on points as above."""
    u = [mechanics.dynamicsymbols(f"u_{k}") for k in range(len(system.q))]
    swap = dict(zip(system.rates, u, strict=True))
    pulls = [(f - system.potential.diff(x)).xreplace(swap) for f, x in zip(system.forces, system.q, strict=True)]
    frame, loads = _loads(system, u, pulls)
    bodies = []
    for k, (mass, across, upward) in enumerate(system.particles):
        point = mechanics.Point(f"B{k}")
        speed = [e.diff(T).xreplace(swap) for e in (across, upward)]
        point.set_vel(frame, speed[0] * frame.x + speed[1] * frame.y)
        bodies.append(mechanics.Particle(f"M{k}", point, mass))
    kinematic = [a - b for a, b in zip(u, system.rates, strict=True)]
    method = mechanics.KanesMethod(frame, list(system.q), u, kinematic)
    method.kanes_equations(bodies, loads)
    back = {b: a for a, b in swap.items()}
    return method.mass_matrix.xreplace(back), method.forcing.xreplace(back)


def _loads(system: Whole, speeds: Iterable[sp.Expr], forces: Iterable[sp.Expr]) -> tuple[object, list]:
    frame, loads = mechanics.ReferenceFrame("N"), []
    for k, (speed, force) in enumerate(zip(speeds, forces, strict=True)):
        point = mechanics.Point(f"P{k}")
        point.set_vel(frame, speed * frame.x)
        loads.append((point, force * frame.x))
    return frame, loads


def residual(system: Whole, matrices: tuple[sp.Matrix, sp.Matrix], ours: dict[str, sp.Expr]) -> list[sp.Expr]:
    """Their mass matrix times our accelerations, keyed by coordinate such as "phi_2", less their forcing."""
    plain = {r: sp.Symbol(f"rate_{x.func.__name__}", real=True) for r, x in zip(system.rates, system.q, strict=True)}
    plain |= {x: sp.Symbol(x.func.__name__, real=True) for x in system.q}
    masses, forcing = (m.xreplace(plain).xreplace({T: TIME}) for m in matrices)
    return list(masses * sp.Matrix([ours[x.func.__name__] for x in system.q]) - forcing)

"""Textbook Lagrangians: Goldstein, Poole & Safko, Classical Mechanics (2002); Landau & Lifshitz, Mechanics (1976);
José & Saletan, Classical Dynamics (1998); Taylor, Classical Mechanics (2005).

Each is (coordinates, T, V, forces, dissipation) as text: q is a coordinate, q_ its velocity, t the time.  All other names
are parameters.  The reference is `sympy.physics.mechanics.LagrangesMethod`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, ReferenceFrame, dynamicsymbols

import synchain as sc


@dataclass(frozen=True)
class System:
    """One Lagrangian with generalised forces."""

    coordinates: str
    kinetic: str
    potential: str
    forces: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        return self.coordinates.split()

    @property
    def parameters(self) -> list[str]:
        """All names that are neither states, time nor functions."""
        text = " ".join([self.kinetic, self.potential, *self.forces.values()])
        known = {*self.names, *(f"{q}_" for q in self.names), "t", "sin", "cos", "tan", "sqrt", "exp", "cosh", "tanh"}
        return sorted(set(re.findall(r"[A-Za-z]\w*", text)) - known)


SYSTEMS = {
    "plane pendulum": System("a", "m*l**2*a_**2/2", "-m*g*l*cos(a)"),
    "double pendulum": System(
        "a b",
        "(m + n)*l**2*a_**2/2 + n*k**2*b_**2/2 + n*l*k*a_*b_*cos(a - b)",
        "-(m + n)*g*l*cos(a) - n*g*k*cos(b)",
    ),
    "triple pendulum of equal links": System(
        "a b c",
        "m*l**2*(3*a_**2 + 2*b_**2 + c_**2 + 4*a_*b_*cos(a - b) + 2*a_*c_*cos(a - c) + 2*b_*c_*cos(b - c))/2",
        "-m*g*l*(3*cos(a) + 2*cos(b) + cos(c))",
    ),
    "spherical pendulum": System("a b", "m*l**2*(a_**2 + sin(a)**2*b_**2)/2", "-m*g*l*cos(a)"),
    "cart and pole": System(
        "x a",
        "(M + m)*x_**2/2 + m*l*x_*a_*cos(a) + m*l**2*a_**2/2",
        "m*g*l*cos(a)",
        {"x": "F*cos(w*t) - d*x_"},
    ),
    "cart and two poles": System(
        "x a b",
        "(M + m + n)*x_**2/2 + m*l*x_*a_*cos(a) + m*l**2*a_**2/2 + n*k*x_*b_*cos(b) + n*k**2*b_**2/2",
        "m*g*l*cos(a) + n*g*k*cos(b)",
        {"x": "-d*x_"},
    ),
    "bead on a rotating hoop": System("a", "m*r**2*(a_**2 + w**2*sin(a)**2)/2", "-m*g*r*cos(a)"),
    "bead on a rotating rod": System("r", "m*(r_**2 + w**2*r**2)/2", "m*g*r*sin(w*t)"),
    "bead on a rotating parabola": System("r", "m*((1 + 4*c**2*r**2)*r_**2 + w**2*r**2)/2", "m*g*c*r**2"),
    "elastic pendulum": System("r a", "m*(r_**2 + r**2*a_**2)/2", "k*(r - l)**2/2 - m*g*r*cos(a)"),
    "pendulum of a driven support": System(
        "a", "m*l**2*a_**2/2 + m*l*a_*A*w*sin(w*t)*sin(a)", "-m*g*l*cos(a)", {"a": "-d*a_"}
    ),
    "pendulum on a turning wheel": System("a", "m*l**2*a_**2/2 + m*r*l*w*a_*sin(a - w*t)", "-m*g*l*cos(a)"),
    "pendulum of a sliding support": System(
        "x a", "(M + m)*x_**2/2 + m*(2*l*x_*a_*cos(a) + l**2*a_**2)/2", "-m*g*l*cos(a) + k*x**2/2"
    ),
    "swinging Atwood machine": System("r a", "(M + m)*r_**2/2 + m*r**2*a_**2/2", "M*g*r - m*g*r*cos(a)"),
    "double Atwood machine": System(
        "x y", "m*x_**2/2 + n*(y_ - x_)**2/2 + p*(x_ + y_)**2/2", "-m*g*x - n*g*(y - x) + p*g*(x + y)"
    ),
    "Kepler's problem": System("r a", "m*(r_**2 + r**2*a_**2)/2", "-k/r"),
    "particle on a cone": System("r a", "m*(r_**2/sin(b)**2 + r**2*a_**2)/2", "m*g*r*cos(b)/sin(b)"),
    "particle on a torus": System("a b", "m*(r**2*a_**2 + (R + r*cos(a))**2*b_**2)/2", "m*g*r*sin(a)"),
    "particle on a sphere with friction": System(
        "a b", "m*r**2*(a_**2 + sin(a)**2*b_**2)/2", "m*g*r*cos(a)", {"a": "-d*a_", "b": "-d*sin(a)**2*b_"}
    ),
    "heavy symmetric top": System(
        "a b c",
        "J*(b_**2*sin(a)**2 + a_**2)/2 + K*(c_ + b_*cos(a))**2/2",
        "m*g*l*cos(a)",
    ),
    "disc in a moving wedge": System(
        "x s", "(M + m)*x_**2/2 + 3*m*s_**2/4 + m*x_*s_*cos(b)", "-m*g*s*sin(b)", {"x": "-d*x_"}
    ),
    "rolling cylinder in a cylinder": System("a", "3*m*(R - r)**2*a_**2/4", "-m*g*(R - r)*cos(a)"),
    "rocking half disc": System("a", "m*r**2*(3/4 - 4*c*cos(a)/3)*a_**2", "m*g*r*(1 - c*cos(a))"),
    "Foucault's pendulum": System("x y", "m*((x_ - W*y)**2 + (y_ + W*x)**2)/2", "m*g*(x**2 + y**2)/(2*l)"),
    "charge in crossed fields": System("x y z", "m*(x_**2 + y_**2 + z_**2)/2 + q*B*(x*y_ - y*x_)/2", "-q*E*x"),
    "Hénon and Heiles": System("x y", "(x_**2 + y_**2)/2", "(x**2 + y**2)/2 + x**2*y - y**3/3"),
    "restricted three bodies": System(
        "x y",
        "((x_ - y)**2 + (y_ + x)**2)/2",
        "-(1 - m)/sqrt((x + m)**2 + y**2) - m/sqrt((x - 1 + m)**2 + y**2)",
    ),
    "ball and beam": System("r a", "7*m*r_**2/10 + (J + m*r**2)*a_**2/2", "m*g*r*sin(a)", {"a": "F*sin(w*t)"}),
    "inertia wheel pendulum": System("a b", "(J + K)*a_**2/2 + K*a_*b_ + K*b_**2/2", "m*g*cos(a)", {"b": "F*cos(w*t)"}),
    "Toda's lattice of three": System("x y z", "(x_**2 + y_**2 + z_**2)/2", "exp(x - y) + exp(y - z) + exp(z - x) - 3"),
    "relativistic oscillator": System("x", "-m*c**2*sqrt(1 - x_**2/c**2)", "k*x**2/2"),
    "magnetic pendulum": System(
        "x y",
        "(x_**2 + y_**2)/2",
        "w*(x**2 + y**2)/2 - 1/sqrt((x - 1)**2 + y**2 + h**2) - 1/sqrt((x + 1)**2 + y**2 + h**2)",
        {"x": "-d*x_", "y": "-d*y_"},
    ),
}


def ours(system: System) -> tuple[sc.Scene, list[str]]:
    """The scene of one node with this Lagrangian, and the names of its parameters."""
    texts = {"T": system.kinetic, "V": system.potential}
    velocities = {q: f"{q}_" for q in system.names}
    values = {name: round(0.9 - 0.07 * k, 2) for k, name in enumerate(system.parameters)}
    keywords = {"coordinates": velocities, "parameters": values}
    node = sc.Lagrangian(texts["T"], texts["V"], Q=dict(system.forces), **keywords)
    return sc.Scene(node, None), system.parameters


def reference(system: System) -> tuple[sp.Matrix, sp.Matrix, list[sp.Symbol]]:
    """Mass matrix and forcing of `LagrangesMethod`, of plain symbols: states, time, parameters."""
    t, frame = dynamicsymbols._t, ReferenceFrame("N")
    q = [dynamicsymbols(name) for name in system.names]
    letters = {name: sp.Symbol(name) for name in system.parameters}
    local = {**dict(zip(system.names, q, strict=True)), **letters, "t": t}
    local |= {f"{name}_": x.diff(t) for name, x in zip(system.names, q, strict=True)}

    def read(text: str) -> sp.Expr:
        return sp.sympify(text, locals=local, rational=True)

    forces = [(frame, read(system.forces.get(name, "0")) * frame.x) for name in system.names]
    method = LagrangesMethod(read(system.kinetic) - read(system.potential), q)
    equations = method.form_lagranges_equations()
    accelerations = [x.diff(t, 2) for x in q]
    mass = equations.jacobian(accelerations)
    remainder = equations.xreplace(dict.fromkeys(accelerations, sp.S.Zero))
    forcing = sp.Matrix([force.dot(frame.x) for _, force in forces]) - remainder
    plain = {x.diff(t): sp.Symbol(f"{name}_") for name, x in zip(system.names, q, strict=True)}
    plain |= {x: sp.Symbol(name) for name, x in zip(system.names, q, strict=True)}
    mass, forcing = (matrix.subs(plain).subs(t, sp.Symbol("t")) for matrix in (mass, forcing))
    names = [*system.names, *(f"{name}_" for name in system.names), "t", *system.parameters]
    return mass, forcing, [sp.Symbol(name) for name in names]


def difference(name: str, points: int = 20) -> float:
    """The largest difference of accelerations at random points, relative to the largest acceleration there."""
    system = SYSTEMS[name]
    scene, _ = ours(system)
    mass, forcing, letters = reference(system)
    node = scene.equations.nodes[0]
    names_allowed = {str(symbol) for symbol in letters}
    symbols = {str(s): s for rate in node.rhs for s in rate.free_symbols}
    assert set(symbols) <= names_allowed, f"{name}: {set(symbols) - names_allowed}"
    arguments = [symbols.get(str(s), s) for s in letters]
    places = {str(s): k for k, s in enumerate(node.state)}
    rates = sp.lambdify(arguments, list(node.rhs), "numpy")
    function = sp.lambdify(letters, [mass, forcing], "numpy")
    worst, random = 0.0, np.random.default_rng(5)
    for values in random.uniform(0.4, 0.9, (points, len(letters))):
        matrix, push = function(*values)
        expected = np.linalg.solve(np.asarray(matrix, float), np.asarray(push, float).ravel())
        slopes = np.array(rates(*values), float)
        found = slopes[[places[f"{q}_"] for q in system.names]]
        worst = max(worst, np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-3))
    return float(worst)

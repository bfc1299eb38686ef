"""Exported sources against SymPy in 40 digits: right-hand side and its differences, in three languages, any names."""

from __future__ import annotations

import ctypes
import functools
import math
import random
import shutil
import subprocess
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from samples import CASES, Late, numbered, pendula, real, telescopes

from synchain.codegen.export.c import to_c
from synchain.codegen.export.numba import to_numba
from synchain.codegen.export.portable_names import RESERVED, portable
from synchain.codegen.export.python import to_python
from synchain.codegen.program.lowering import Library, number
from synchain.codegen.program.printers import C99, MATH, NUMPY, Printer
from synchain.graphs import chain, ring, star
from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.graph_products import weighted
from synchain.models.graphs.topology import from_matrix
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.scenes.scene import Scene
from synchain.runtime.cli import main

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC"]
Values = tuple[np.ndarray, np.ndarray]
"""Right-hand side and dense Jacobian."""


def write(e: sp.Expr, printer: Printer) -> str:
    """The text of an expression in a language with a mathematical library."""
    return printer.text(Library()(sp.sympify(e)))


def decimal(e: Any) -> str:
    """The text of a number."""
    return repr(number(e).value)


def one_way(n: int) -> Equations:
    """A one-way ring whose weights are no units, each node with every function that has a counterpart."""
    x, y, a, b = real("x", "y", "a", "b")
    smooth = (
        sp.tan(x / 3)
        + sp.sinh(x)
        - sp.cosh(y) * sp.tanh(a * y)
        + sp.asin(x / 4)
        - sp.acos(y / 5)
        + sp.asinh(b * x)
        + sp.erf(x)
        - sp.acosh(2 + x**2)
        + sp.atanh(sp.sin(y) / 2)
    )
    kinks = sp.Max(x, y, a) - sp.Min(x * y, b) + sp.atan2(x, 3 + y) + sp.floor(10 * x) - sp.ceiling(7 * y)
    chosen = sp.Piecewise((x**2, sp.And(x > y, x < 2)), (y**5 / 7, sp.Or(y >= 1, y <= -1)), (sp.Rational(1, 3), True))
    powers = (
        (2 + x**2) ** sp.Rational(2, 3) / (3 + y**2) ** sp.Rational(3, 2) + sp.sqrt(a) / sp.sqrt(5 + x) + (2 + y) ** a
    )
    node = Node(
        (x, y), (smooth + kinks / b, chosen + powers + sp.log(2 + sp.sin(TIME)) + sp.pi * sp.sqrt(2) / 3), (a, b)
    )
    p, q, r, s, w, sigma = real("p", "q", "r", "s", "w", "sigma")
    edge = Edge((p, q), (r, s), w, (w * sigma * sp.sin(r - p), a * w**2 * (s - q) * p), (sigma, a))
    links = tuple((i, (i + 1) % n, Fraction(i + 1, 3)) for i in range(n))
    return Equations.of_equal_nodes(node, edge, n, tuple(sorted(links)))


def ill_named(n: int) -> Equations:
    """Names that are words of C, of Python, of mathematics, of the text, of no language, or twice the same."""
    names = [
        "lambda",
        "double",
        "μ",
        "state",
        "numbers",
        "exp",
        "NODES",
        "w1",
        "y0",
        "x y",
        "a*/b",
        "_q",
        "x_i",
        "in",
        "mu",
        "i",
    ]
    symbols = real(*names)
    x, v = real("link", "for")
    drive = sp.Add(*((k + 1) * s for k, s in enumerate(symbols)))
    node = Node((x, v), (v + sp.exp(-(x**2)), sp.cos(drive * TIME) * x - sp.sign(x)), tuple(symbols))
    there = real("x_i_2", "w2")
    edge = Edge((x, v), (there[0], there[1]), sp.Symbol("weight", real=True),
                (sp.S.Zero, symbols[0] * sp.Symbol("weight", real=True) * (there[0] - x)), (symbols[0],))  # fmt: skip
    return Equations.of_equal_nodes(node, edge, n, tuple((i, i + 1, Fraction(1, 3)) for i in range(n - 1)))


def heterogeneous(n: int) -> Equations:
    """Driven Duffing oscillators with dampings and frequencies of their own."""
    values = {"delta": [0.1 * i for i in range(n)], "omega": [1 + 0.1 * i for i in range(n)]}
    return Scene(oscillator="duffing", topology=ring(n), parameters=values).equations


def clocks() -> Equations:
    """Two clocks on a beam: an arrow of a mass matrix that depends on the state."""
    return Scene(
        oscillator="clock", nodes=[{"oscillator": "beam", "at": [1]}], coupling="hanging", topology=star(3), record=()
    ).equations


def inertial(n: int) -> Equations:
    """Inerters on a one-way graph whose weights are no units, dampings of their own."""
    graph = from_matrix([[-1 if i == j else int(j == (i + 1) % n) for j in range(n)] for i in range(n)])
    scene = Scene(oscillator="duffing", coupling="inerter", topology=weighted(graph, "1/3"),
                  parameters={"delta": [0.1 * i for i in range(n)]})  # fmt: skip
    return scene.equations


NETWORKS = Late({
    **CASES.makers,
    "sign contact": lambda: Scene(topology=chain(3), contact="sign").equations,
    "friction ring 9": lambda: Scene(topology=ring(9)).equations,
    "stribeck star 9": lambda: Scene(topology=star(9), friction="stribeck", coupling="damper").equations,
    "lorenz 3": lambda: Scene(oscillator="lorenz", topology=ring(3), coupling="x->x, 1/3 y->z").equations,
    "lorenz 10": lambda: Scene(oscillator="lorenz", topology=chain(10), coupling="x->x, 1/3 y->z").equations,
    "chua matrix": lambda: Scene(
        oscillator="chua", topology=from_matrix([["-2/3", "2/3"], ["1/7", "-1/7"]]), coupling="x->x"
    ).equations,
    "double pendulum 2": lambda: Scene(
        oscillator="double_pendulum", topology=chain(2), coupling="friction_damper on phi"
    ).equations,
    "fput 10": lambda: Scene(oscillator="mass", topology=ring(10), coupling="fput").equations,
    **{f"one way {n}": partial(one_way, n) for n in (4, 9)},
    **{f"names {n}": partial(ill_named, n) for n in (2, 9)},
    **{f"varied {n}": partial(heterogeneous, n) for n in (3, 9)},
    "clocks": clocks,
    "two kinds 9": lambda: Scene(
        oscillator="rossler",
        nodes=[{"oscillator": "lorenz", "at": [2, 9]}],
        topology=ring(9),
        coupling="x->y, 1/3 y->y",
        parameters={"a": [0.1 * i for i in range(7)]},
    ).equations,
    **{f"inertial {n}": partial(inertial, n) for n in (3, 9)},
    "pendula": pendula,
    "telescopes": telescopes,
    **{f"numbered {n} {mutual}": partial(numbered, n, mutual) for n in (3, 9) for mutual in (True, False)},
    "alone 9": lambda: Equations.of_equal_nodes(Node((sp.Symbol("x", real=True),), (sp.S.One,), ()), None, 9),
})  # fmt: skip


def point(equations: Equations, seed: int) -> tuple[float, list[float], list[float]]:
    """A time, a state and parameters; all coordinates away from kinks."""
    dice = random.Random(seed)
    state = [dice.uniform(-0.9, 0.9) for _ in equations.state]
    return dice.uniform(0, 3), state, [dice.uniform(0.3, 1.7) for _ in equations.parameters]


@functools.cache
def exact_at(name: str, seed: int) -> Values:
    """The values of a network at a point, which all languages share."""
    return exact(NETWORKS[name], *point(NETWORKS[name], seed))


def exact(equations: Equations, t: float, state: list[float], values: list[float]) -> Values:
    """The right-hand side that SymPy evaluates in 40 digits, and its central differences over a distance of 1e-15."""
    names = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    plain = {s: sp.Symbol(f"q{k}", real=True) for k, s in enumerate(names)}
    forces = sp.lambdify([TIME, *plain.values()], [e.xreplace(plain) for e in equations.rhs()], "mpmath")
    masses = sp.SparseMatrix(equations.dimension, equations.dimension, equations.mass()).xreplace(plain)
    mass = sp.lambdify([TIME, *plain.values()], sp.Matrix(masses), "mpmath")

    def rhs(*at: Any) -> list[Any]:
        return list(mpmath.lu_solve(mass(*at), forces(*at))) if equations.inertial else forces(*at)

    with mpmath.workdps(40):
        at, step = [mpmath.mpf(x) for x in (t, *state, *values)], mpmath.mpf(10) ** -15
        columns = []
        for k in range(1, 1 + equations.dimension):
            above, below = (rhs(*[x + side * step * (i == k) for i, x in enumerate(at)]) for side in (1, -1))
            columns.append([float((a - b) / (2 * step)) for a, b in zip(above, below, strict=True)])
        return np.array([float(x) for x in rhs(*at)]), np.array(columns).T


def run_python(equations: Equations, folder: Path, t: float, state: list[float], values: list[float]) -> Values:
    space: dict[str, Any] = {}
    exec(compile(to_python(equations), "<export>", "exec"), space)
    small = equations.n <= 8 or equations.mixed
    values = values if small else together(equations, values)
    jacobian = space["jac"](t, state, *values)
    matrix = jacobian if small else jacobian.toarray()
    inside = space["sparsity"]().toarray()
    assert set(np.unique(inside)) <= {0.0, 1.0}
    assert not matrix[inside == 0.0].any()
    assert space["STATE"] == list(portable(equations)[0].state)
    return space["rhs"](t, state, *values), matrix


def together(equations: Equations, values: list[float]) -> list[Any]:
    """The arguments of a text of many nodes: parameters that differ come as one list."""
    collected: dict[str, Any] = {}
    for name, value in zip(equations.parameters, values, strict=True):
        node = name.rpartition("_")[0]
        base = node if node in equations.varied else node.rpartition("_")[0]
        if base in equations.differing:
            collected.setdefault(base, []).append(value)
        else:
            collected[name] = value
    return list(collected.values())


def shared_library(text: str, folder: Path) -> ctypes.CDLL:
    source, library = folder / "network.c", folder / "network.so"
    source.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [str(COMPILER), *STRICT, str(source), "-o", str(library), "-lm"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


def array(size: int, values: Any = ()) -> Any:
    return (ctypes.c_double * max(size, 1))(*values)


def run_c(equations: Equations, folder: Path, t: float, state: list[float], numbers: list[float]) -> Values:
    library, size = shared_library(to_c(equations), folder), equations.dimension
    arguments = (ctypes.c_double(t), array(size, state), array(len(numbers), numbers))
    rates = array(size)
    library.rhs(*arguments, rates)
    matrix = np.zeros((size, size))
    if equations.n <= 8 or equations.mixed:
        entries = array(size * size, [7.0] * (size * size))
        library.jacobian(*arguments, entries)
        return np.array(rates), np.array(entries).reshape(size, size)
    count = int(to_c(equations).split("ENTRIES = ")[1].split(" }")[0])
    values, rows, columns = array(count), (ctypes.c_int * max(count, 1))(), (ctypes.c_int * max(count, 1))()
    library.jacobian(*arguments, values)
    library.jacobian_places(rows, columns)
    np.add.at(matrix, (list(rows)[:count], list(columns)[:count]), list(values)[:count])
    return np.array(rates), matrix


def run_numba_text(equations: Equations, folder: Path, t: float, state: list[float], values: list[float]) -> Values:
    """The text for Numba as plain Python, which has no Jacobian."""
    text = to_numba(equations).replace("from numba import cfunc, types", "from numba import types")
    space: dict[str, Any] = {"cfunc": lambda signature: lambda function: function}
    exec(compile(text, "<export>", "exec"), space)
    rates = [math.nan] * equations.dimension
    space["rhs"](t, state, rates, values)
    return np.array(rates), np.empty((0, 0))


RUNS: dict[str, Callable[..., Values]] = {"python": run_python, "c": run_c, "numba": run_numba_text}


@pytest.mark.parametrize("language", RUNS)
@pytest.mark.parametrize("name", NETWORKS)
def test_exported_text_computes_the_equations(name: str, language: str, tmp_path: Path) -> None:
    if name == "inertial 9" and language != "python":
        with pytest.raises(
            ValueError, match=f"links with inertia in {language}: expected at most 8 nodes, found 9; export P"
        ):
            (to_c if language == "c" else to_numba)(NETWORKS[name])
        return
    if language == "c" and COMPILER is None:
        pytest.skip("no C compiler")
    equations = NETWORKS[name]
    t, state, values = point(equations, 3)
    rates, matrix = RUNS[language](equations, tmp_path, t, state, values)
    right, slopes = exact_at(name, 3)
    np.testing.assert_allclose(rates, right, rtol=1e-13, atol=1e-13 * max(1.0, abs(right).max()))
    if matrix.size:
        np.testing.assert_allclose(matrix, slopes, rtol=1e-13, atol=1e-13 * max(1.0, abs(slopes).max()))


@pytest.mark.parametrize("n", [2, 9])
def test_numba_compiles_the_text(n: int) -> None:
    equations = Scene(topology=chain(n)).equations
    space: dict[str, Any] = {}
    exec(compile(to_numba(equations, Scene(topology=chain(n)).parameters), "<export>", "exec"), space)
    t, state, _ = point(equations, 5)
    rates, values = array(equations.dimension), list(space["PARAMETERS"])
    space["rhs"].ctypes(t, array(len(state), state), rates, array(len(values), values))
    assert values == list(Scene(topology=chain(n)).parameters.values())
    np.testing.assert_allclose(np.array(rates), exact(equations, t, state, values)[0], rtol=1e-13, atol=1e-13)


def test_the_signature_is_that_of_numbalsoda() -> None:
    space: dict[str, Any] = {}
    exec(compile(to_numba(CASES["harmonic"]), "<export>", "exec"), space)
    assert str(space["lsoda_sig"]) == "(float64, float64*, float64*, float64*) -> none"
    assert space["rhs"].address > 0


def test_the_module_integrates_with_scipy() -> None:
    """Two harmonic oscillators: modes of frequency 1 and sqrt(1 + 2 sigma)."""
    from scipy.integrate import solve_ivp

    for n in (2, 9):
        space: dict[str, Any] = {}
        scene = Scene(oscillator="harmonic", topology=chain(n), parameters={"sigma": 0.3})
        exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
        mode = np.cos(math.pi * (np.arange(n) + 0.5) / n)  # of the chain, eigenvalue -4 sin^2(pi/2n)
        frequency = math.sqrt(1 + 0.3 * 4 * math.sin(math.pi / (2 * n)) ** 2)
        start = [*mode, *np.zeros(n)]
        solution = solve_ivp(space["rhs"], (0, 5), start, method="Radau", jac=space["jac"], rtol=1e-10, atol=1e-12)
        assert solution.success
        np.testing.assert_allclose(solution.y[:n, -1], mode * math.cos(5 * frequency), atol=1e-8)


def test_large_networks_are_loops() -> None:
    """Apart from the table of links the text has the same size for any n."""
    for make in (to_python, to_c, to_numba):
        small, large = (make(Scene(topology=chain(n)).equations) for n in (30, 3000))
        assert len(large) - len(small) < 2970 * 2 * 3 * 10
        assert abs(sum("[link_]" in line or "np.exp" in line for line in large.splitlines())
                   - sum("[link_]" in line or "np.exp" in line for line in small.splitlines())) == 0  # fmt: skip
        long = [len([row for row in text.splitlines() if not row.startswith("    ") or row[4].isalpha()])
                for text in (small, large)]  # fmt: skip
        assert long[0] == long[1]


# -- names and numbers ---------------------------------------------------------------------------------------


def test_names_are_unique_and_none_is_reserved() -> None:
    model, changed = portable(ill_named(2))
    edge = model.edge
    assert edge is not None
    names_of_symbols = [s.name for s in (*model.node.state, *model.node.parameters)]
    assert len(set(names_of_symbols)) == len(names_of_symbols)
    assert not {*names_of_symbols, *(s.name for s in (*edge.here, *edge.there))} & RESERVED
    assert changed["μ"] == "mu_2"
    assert changed["lambda"] == "lambda_"
    assert "mu" not in changed
    assert len({*names_of_symbols, *(s.name for s in (*edge.here, *edge.there))}) == len(names_of_symbols) + 4
    assert "Renamed: lambda is called lambda_" in to_c(ill_named(2))


def test_names_that_are_fine_stay() -> None:
    model, changed = portable(Scene(oscillator="lorenz", topology=chain(2), coupling="x->x").equations)
    assert changed == {}
    assert [s.name for s in model.node.state] == ["x", "y", "z"]


USUAL = [
    "e",
    "i",
    "j",
    "k",
    "p",
    "h",
    "y",
    "m",
    "mass",
    "rate",
    "error",
    "step",
    "link",
    "weight",
    "right",
    "rows",
    "pivot",
]


def usual(n: int, inertia: bool) -> Equations:
    """The names that mechanics uses most, which are those of this text's own words."""
    symbols = real(*USUAL[3:])
    x, v, x_2, v_2, w = real("i", "j", "i_there", "j_there", "w")
    pull = sp.Add(*((c + 1) * s for c, s in enumerate(symbols)))
    node = Node((x, v), (v, -pull * x), tuple(symbols))
    mass = ((0, 0), (0, w * symbols[5])), ((0, 0), (0, -w * symbols[5]))
    blocks = tuple(tuple(tuple(map(sp.sympify, row)) for row in block) for block in mass) if inertia else ()
    edge = Edge((x, v), (x_2, v_2), w, (sp.S.Zero, symbols[0] * w * (x_2 - x)), (symbols[0], symbols[5]), blocks)
    return Equations.of_equal_nodes(node, edge, n, tuple((i, i + 1, Fraction(1, 3)) for i in range(n - 1)))


@pytest.mark.parametrize(
    ("n", "inertia", "language"),
    [
        *((n, inertia, language) for n, inertia in ((2, False), (9, False), (2, True)) for language in RUNS),
        (9, True, "python"),
    ],
)
def test_exported_functions_keep_the_names_of_mechanics(n: int, inertia: bool, language: str, tmp_path: Path) -> None:
    if language == "c" and COMPILER is None:
        pytest.skip("no C compiler")
    equations = usual(n, inertia)
    assert portable(equations)[1] == {}
    t, state, values = point(equations, 4)
    rates, matrix = RUNS[language](equations, tmp_path, t, state, values)
    right, slopes = exact(equations, t, state, values)
    np.testing.assert_allclose(rates, right, rtol=1e-12, atol=1e-12 * abs(right).max())
    if matrix.size:
        np.testing.assert_allclose(matrix, slopes, rtol=1e-12, atol=1e-12 * abs(slopes).max())


def test_a_name_cannot_leave_its_comment() -> None:
    bad = sp.Symbol("a*/\nint evil;/*\\", real=True)
    x = sp.Symbol("x", real=True)
    equations = Equations.of_equal_nodes(Node((x,), (bad * x,), (bad,)), None, 1)
    for text, mark in ((to_c(equations), " *"), (to_python(equations), "#"), (to_numba(equations), "#")):
        assert all(line.startswith((mark, "/*")) for line in text.splitlines() if "evil" in line and "Renamed" in line)
        assert not any(line.strip().startswith("int evil") for line in text.splitlines())
    head = to_c(equations).split("#include")[0]
    assert head.count("*/") == 1


@pytest.mark.parametrize(("p", "q"), [(1, 3), (2, 3), (10**17 + 1, 3), (-7, 10**25), (1, 10**320), (123456789, 2**70)])
def test_rationals_are_the_nearest_double(p: int, q: int) -> None:
    written = Fraction(float(decimal(sp.Rational(p, q))))
    steps = (math.nextafter(float(written), side) for side in (-math.inf, math.inf))
    assert all(abs(written - Fraction(p, q)) <= abs(Fraction(other) - Fraction(p, q)) for other in steps)


def test_constants_are_the_nearest_double() -> None:
    assert decimal(sp.pi) == repr(math.pi)
    assert decimal(2 / sp.pi) == "0.6366197723675814"
    with mpmath.workdps(60):
        for k in range(2, 400):
            assert decimal(sp.sqrt(k * k + 1) * sp.pi / 3) == repr(float(mpmath.sqrt(k * k + 1) * mpmath.pi / 3))


@pytest.mark.parametrize(
    ("text", "c", "numba"),
    [
        ("x/3", "x/3.0", "x/3.0"),
        ("-(x + y)**2", "-pow(x + y, 2.0)", "-(x + y)**2"),
        ("2*(x - y)/(3*z)", None, None),
        ("x**2/(y*z)", "x*x/(y*z)", "x*x/(y*z)"),
        ("(-x)**7", "-pow(x, 7.0)", "-x**7"),
        ("1/(x*y**2)", "1.0/(x*y*y)", "1.0/(x*y*y)"),
        ("sqrt(x)/y", "sqrt(x)/y", "math.sqrt(x)/y"),
        ("exp(-x)*(y - 1)", "(y - 1.0)*exp(-x)", "(y - 1.0)*math.exp(-x)"),
    ],
)
def test_text(text: str, c: str | None, numba: str | None) -> None:
    symbols = dict(zip("xyz", real("x", "y", "z"), strict=True))
    e = sp.sympify(text, locals=symbols)
    if c is not None and numba is not None:
        assert (write(e, C99), write(e, MATH)) == (c, numba)
    values = {"x": 0.37, "y": 1.91, "z": -2.3}
    for printer in (NUMPY, MATH):
        value = eval(write(e, printer), {"np": np, "math": math, **values})
        assert value == pytest.approx(float(e.subs({symbols[k]: v for k, v in values.items()})), rel=1e-15)


def test_what_cannot_be_written_is_refused() -> None:
    x = sp.Symbol("x", real=True)
    for e, message in ((sp.gamma(x), "gamma"), (x + 0.5, "floating-point"), (sp.Piecewise((x, x > 0)), "no value"),
                     (x * 10**400, "does not fit"), (sp.I * x, "does not fit")):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            write(e, C99)


def test_values() -> None:
    equations = Scene(topology=chain(2)).equations
    with pytest.raises(ValueError, match="unknown parameter 'omga'"):
        to_c(equations, {"omga": 1.0})
    with pytest.raises(ValueError, match="'epsilon' has no value"):
        to_python(equations, {"theta_b": 1.0})
    with pytest.raises(ValueError, match="finite"):
        to_numba(equations, {**Scene(topology=chain(2)).parameters, "omega": math.inf})


def test_oscillators_that_move_together_stay_together() -> None:
    """Every node is computed by the same operations in the same order."""
    for n in (5, 9):
        scene = Scene(topology=ring(n), parameters={"sigma": 0.3})
        space: dict[str, Any] = {}
        exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
        rates = space["rhs"](0.7, [0.123] * n + [-0.0456] * n)
        assert len(set(rates[n:])) == 1
        assert len(set(rates[:n])) == 1


@pytest.mark.parametrize("language", ["python", "c", "numba"])
def test_the_command_prints_the_source_with_the_scenes_values(
    language: str, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = Scene(topology=chain(4))
    assert main(["equations", "figure_7", f"--{language}"]) == 0
    text = capsys.readouterr().out
    assert f"Equations: {scene.equations.digest[:16]}" in text
    assert "omega = 1.15" in text
    assert main(["equations", "figure_7", "--latex", f"--{language}"]) == 2

"""Exponents over two parameters: closed forms, SciPy on whole networks, single layers on the axes, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import Field, Rates, Scene, critical, ends, exponents, lyapunov_spectrum, msf, open_result, plane, run
from synchain.graphs import Topology, chain, circulant, complete, from_matrix, ring, star, topology
from synchain.models.definitions.loader import load_oscillator
from synchain.runtime.stability.interpolation import exact_interpolation, strength_interpolation
from synchain.runtime.stability.march import BlockInterpolation, March
from synchain.runtime.stability.orbits import OrbitProblem
from synchain.runtime.stability.transversal_modes import transversal_modes
from synchain.runtime.sweeps.certify import certify

TARGET, SOURCE, W = ends(load_oscillator("duffing"))
K, C, G = sp.symbols("k c g")
SPRING = Rates({TARGET.v: K * W * (SOURCE.x - TARGET.x)}, {K: 0.1})
DAMPER = Rates({TARGET.v: C * W * (SOURCE.v - TARGET.v)}, {C: 0.1})
PULL = Rates({TARGET.v: G * W * (SOURCE.x - sp.sin(SOURCE.v) / 2)}, {G: 0.1})
"""A link between equal states: it moves the synchronous orbit."""

ALMOST_LINEAR = {"beta": 1e-9, "delta": 0.2}
"""Duffing without its cubic spring, whose modes are integrated all the same."""


def layered(first: Topology, second: Topology, coupling: Rates = DAMPER, **parameters: float) -> Scene:
    return Scene("duffing", links=[(SPRING, first), (coupling, second)], parameters=parameters)


def roots(k: float, c: float) -> float:
    """The exponent of x'' = -(1 + k) x - (0.2 + c) v."""
    return float(np.linalg.eigvals(np.array([[0.0, 1.0], [-1.0 - k, -0.2 - c]])).real.max())


@pytest.mark.parametrize(
    ("second", "modes"),
    [(circulant(6, offsets=(2,)), [(-1, -3), (-3, -3), (-4, 0)]), (complete(6), [(-1, -6), (-3, -6), (-4, -6)])],
)
def test_two_layers_in_closed_form(second: Topology, modes: list[tuple[int, int]]) -> None:
    """The largest exponent of all modes, along an orbit that is integrated."""
    k, c = np.array([0.0, 0.3, 2.0]), np.array([0.0, 0.2, 0.7])
    result = plane(layered(ring(6), second, **ALMOST_LINEAR), k=k, c=c, rtol=1e-9, starts=1, transient=200)
    each = np.array([[[roots(-x * a, -y * b) for a, b in modes] for y in c] for x in k])
    np.testing.assert_allclose(result.exponent, each.max(axis=-1), atol=1e-8)
    assert result.attractors.tolist() == [[["periodic"]]]
    assert result.names == ("k", "c")
    assert sorted(result.modes) == sorted(map(str, modes))
    if second.name == "circulant":  # the mode whose damping does not rise with c decides
        assert result.modes[result.mode[0, 2]] == "(-4, 0)"


@pytest.mark.parametrize("name", ["duffing", "harmonic"])
def test_complex_strengths_of_two_layers_in_closed_form(name: str) -> None:
    """Rings that run opposite ways have conjugate eigenvalues; harmonic oscillators are not integrated."""
    one_way, parameters = topology("one_way_ring", 5), ALMOST_LINEAR if name == "duffing" else {}
    scene = Scene(name, links=[(SPRING, one_way), (DAMPER, from_matrix(one_way.matrix.T))], parameters=parameters)
    k, c = np.array([0.1, 0.4]), np.array([0.0, 0.3])
    result = plane(scene, k=k, c=c, rtol=1e-9, starts=1, transient=200)
    turn = np.exp(2j * np.pi * np.arange(1, 5) / 5)
    pairs, delta = np.stack([turn - 1, turn.conj() - 1], axis=1), 0.2 if name == "duffing" else 0.0

    def exponent(x: float, y: float) -> float:
        matrices = [[[0.0, 1.0], [-1.0 + x * a, -delta + y * b]] for a, b in pairs]
        return float(np.linalg.eigvals(np.array(matrices)).real.max())

    np.testing.assert_allclose(result.exponent, [[exponent(x, y) for y in c] for x in k], atol=1e-8)


def transversal(scene: Scene) -> float:
    """The largest transversal exponent of a driven network by SciPy: the whole network's monodromy on differences."""
    equations, n, period = scene.equations, scene.n, scene.period
    assert period is not None
    symbols = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters, "t")]
    parameter_values = [scene.parameters[name] for name in equations.parameters]
    jacobian = sp.zeros(2 * n, 2 * n)
    for at, e in equations.jacobian().items():
        jacobian[at] = e
    rates, slopes = (sp.lambdify(symbols, expressions, cse=True) for expressions in (list(equations.rhs()), jacobian))
    of_first = sp.lambdify(symbols, list(equations.rhs())[::n], cse=True)

    def of_all(t: float, y: np.ndarray) -> np.ndarray:
        state, basis = y[: 2 * n], y[2 * n :].reshape(2 * n, 2 * n)
        values = (*state, *parameter_values, t)
        return np.concatenate([rates(*values), (np.asarray(slopes(*values)) @ basis).ravel()])

    def of_one(t: float, y: np.ndarray) -> np.ndarray:
        return np.asarray(of_first(*np.repeat(y, n), *parameter_values, t))

    start = solve_ivp(of_one, (0, 100 * period), [0.3, 0.0], method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    joined = np.concatenate([np.repeat(start, n), np.eye(2 * n).ravel()])
    end = solve_ivp(of_all, (0, period), joined, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    monodromy = end[2 * n :].reshape(2 * n, 2 * n)
    differences = np.kron(np.eye(2), np.eye(n) - np.ones((n, n)) / n)
    return float(np.log(np.abs(np.linalg.eigvals(differences @ monodromy @ differences)).max()) / period)


def test_whole_networks_by_scipy() -> None:
    """Springs on a ring and a link between equal states on a complete graph: an orbit for each g, all k along it."""
    scene = layered(ring(4), complete(4), PULL, omega=1.3)
    k, g = np.array([0.1, 0.5]), np.array([0.02, 0.1])
    result = plane(scene, k=k, g=g, rtol=1e-10, starts=1, transient=100)
    for x, y in ((0, 1), (1, 0)):
        assert result.exponent[x, y] == pytest.approx(transversal(scene.replace(k=k[x], g=g[y])), abs=2e-8)
    assert result.attractors.shape == (1, 2, 1)
    assert result.data.attractor.dims == ("g", "start")


@pytest.mark.parametrize("graphs", [(ring(4), star(4)), (chain(5), star(5))])
def test_layers_that_do_not_commute_by_scipy(graphs: tuple[Topology, Topology]) -> None:
    """Blocks of one and two differences, or of all four: the largest exponent is that of the whole network."""
    scene = layered(*graphs, omega=1.3)
    k, c = np.array([-0.3, 0.5]), np.array([0.02, 0.4])
    result = plane(scene, k=k, c=c, rtol=1e-10, starts=1, transient=100)
    for x, y in ((0, 0), (0, 1), (1, 0)):
        assert result.exponent[x, y] == pytest.approx(transversal(scene.replace(k=k[x], c=c[y])), abs=2e-8)
    assert result.modes[-1] == f"({'2' if graphs[0].n == 4 else '4'} differences of the nodes 1 … {graphs[0].n})"
    blocks = np.array([mode.values for mode in transversal_modes(scene)])
    strengths = -np.array([0.5, 0.02])[:, None, None] * blocks
    alone = exponents(scene, strengths, rtol=1e-10, starts=1, transient=100)
    assert alone.exponent.max() == pytest.approx(result.exponent[1, 0], abs=1e-12)
    assert alone.data.alpha.dims == ("mode", "layer", "row", "column")


def test_chaos_of_layers_that_do_not_commute() -> None:
    """The spectrum of the whole network has two exponents of the synchronous motion, then the largest one across."""
    node = Field({"x": "-y - z", "y": "x + 0.2*y", "z": "0.2 + z*(x - 9)"}, initial={"x": 1.0, "z": 1.0})
    of_x, of_y = Rates({"x": "k*W*(x_j - x_i)"}, {"k": 0.15}), Rates({"y": "g*W*(y_j - y_i)"}, {"g": 0.2})
    scene = Scene(node, links=[(of_x, ring(4)), (of_y, star(4))], initial={"x": 1.0, "y": 0.0, "z": 1.0})
    found, spectrum = certify(scene), lyapunov_spectrum(scene, count=3, precision=2e-3, show_progress=False)
    assert found.exponent[0] == pytest.approx(
        spectrum.exponent[2], abs=3 * np.hypot(found.stderr[0], spectrum.stderr[2])
    )
    assert -0.2 < found.exponent[0] < -10 * found.stderr[0]
    zero = critical(scene, "k", between=(0.0, 0.15), g=0.05, precision=3e-3, starts=1, show_progress=False)
    assert zero.modes == ("(1 difference of the nodes 2, 4)",)


def test_a_parameter_of_the_orbit_beside_alpha() -> None:
    """The two strengths of links between equal states: columns are those of `exponents`."""
    scene = Scene("duffing", PULL, ring(4), parameters={"omega": 1.3})
    alpha, g = np.array([-0.2, 0.1, 0.6]), np.array([0.05, 0.1])
    result = plane(scene, alpha, g=g, starts=2, transient=100)
    for j, value in enumerate(g):
        alone = exponents(scene, alpha, g=value, starts=2, transient=100)
        np.testing.assert_array_equal(result.exponent[:, j], alone.exponent)
    assert result.data.exponent.dims == ("alpha", "g")
    assert result.mode is None
    network = plane(scene, g=g, omega=[1.25, 1.3], starts=2, transient=100)
    assert network.exponent[1, 1] == pytest.approx(transversal(scene.replace(g=0.1)), abs=1e-6)
    assert network.attractors.shape == (2, 2, 2)


def test_axes_are_single_layers() -> None:
    """Where one strength is zero, the exponents are those of the other layer alone."""
    k = np.array([0.0, 0.2, 0.9])
    result = plane(layered(ring(4), complete(4), omega=1.3), k=k, c=k, starts=1, transient=100, rtol=1e-9)
    for name, coupling, graph, table in (
        ("k", SPRING, ring(4), result.exponent[:, 0]),
        ("c", DAMPER, complete(4), result.exponent[0]),
    ):
        alone = Scene("duffing", coupling, graph, parameters={"omega": 1.3})
        sizes = np.array([-complex(v).real for v in graph.spectrum.values[1:]])
        line = exponents(alone, np.unique(np.outer(k, sizes)), starts=1, transient=100, rtol=1e-9)
        expected = [line.exponent[np.searchsorted(line.alpha, x * sizes)].max() for x in k]
        np.testing.assert_allclose(table, expected, atol=1e-8, err_msg=name)


def test_certified_runs_of_two_layers_have_the_same_exponents() -> None:
    scene = layered(ring(4), complete(4), omega=1.3).replace(transient=5, window=5)
    axes = {"k": [0.1, 0.5], "c": [0.05, 0.2]}
    certified = run(scene, certified=True, show_progress=False, width=1, **axes)
    result = plane(scene, starts=4, transient=300, **axes)
    np.testing.assert_allclose(certified.data.transversal_exponent.values, result.exponent, atol=1e-9)


def rossler(strengths: np.ndarray) -> tuple[OrbitProblem, np.ndarray]:
    i, j, w = ends(load_oscillator("rossler"))
    links = [(Rates({i.x: K * w * (j.x - i.x)}, {K: 0.1}), ring(4)), (Rates({i.y: G * w * j.z / 9}, {G: 0.1}), ring(4))]
    scene = Scene("rossler", links=links, rtol=1e-11, record=())
    starts = np.array([[1.0, 2.0, 0.5], [3.0, -2.0, 0.4]])
    return OrbitProblem.of_modes(scene, strengths, starts, 1).settled(starts, 10)


def test_propagators_of_two_strengths_by_scipy_and_by_interpolation() -> None:
    """A chaotic orbit with a link between equal states; on each line a few give all strengths."""
    sides = np.linspace(0.0, 1.5, 60), np.linspace(-0.3, 1.2, 5)
    strengths = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    problem, state = rossler(strengths)
    exact, _ = problem.propagators(problem.integrator(state, tolerance_ratio=0.8), 0.4)
    for which in (0, 37, 299):

        def rates(_: float, y: np.ndarray, which: int = which) -> np.ndarray:
            (x, v, z), columns = y[:3], y[3:].reshape(3, 3)
            jacobian = np.array([[0.0, -1.0, -1.0], [1.0, 0.2, 0.1 * 2 / 9], [z, 0.0, x - 9.0]])  # g k / 9 with k = 2
            jacobian[0, 0] -= strengths[which, 0]
            jacobian[1, 2] -= strengths[which, 1] / 9
            flow = [-v - z, x + 0.2 * v + 0.1 * 2 * z / 9, 0.2 + z * (x - 9.0)]
            return np.concatenate([flow, (jacobian @ columns).ravel()])

        joined = np.concatenate([state[0], np.eye(3).ravel()])
        end = solve_ivp(rates, (0, 0.4 * problem.unit), joined, method="DOP853", rtol=1e-12, atol=1e-13).y[3:, -1]
        np.testing.assert_allclose(exact[0, which], end.reshape(3, 3), atol=1e-8 * np.abs(end).max())
    growths = []
    for interpolation in (exact_interpolation(strengths), strength_interpolation(strengths, 13)):
        march = March.begin(problem, state, BlockInterpolation(0.4, interpolation), 0.8)
        growths.append(march.growths(np.array([10])))
    assert len(interpolation.nodes) == 5 * (13 + 3)
    np.testing.assert_allclose(growths[1], growths[0], atol=1e-7)
    assert 0.0 < march.deviations.error < 1e-7


@pytest.mark.parametrize(("turn", "moving"), [(1.0, 0), (1.0 + 0.5j, 2)])
def test_strengths_of_layers_are_interpolated_along_lines(turn: complex, moving: int) -> None:
    """Lines are those of the layer with the most values; one of few strengths has these as its nodes."""
    sides = np.linspace(0.0, 1.0, 90), np.linspace(0.2, 0.4, 3), np.linspace(1.0, 2.0, 2)
    strengths = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3) * turn
    strengths = np.roll(np.concatenate([strengths, [[0.5, 7.0, 7.0]]]), moving, axis=1)
    interpolation = strength_interpolation(strengths, 13)
    assert sorted({len(panel.points) for panel in interpolation.panels}) == ([1, 13] if turn == 1.0 else [1, 26])
    assert sorted(np.concatenate([panel.rows for panel in interpolation.panels])) == list(range(len(strengths)))
    for panel in interpolation.panels:
        for x, weights in ((strengths[panel.rows], panel.weights), (panel.extras, panel.checks)):
            values = (np.exp(each @ np.array([1.0, 0.3, -0.5])) for each in (panel.points, x))
            np.testing.assert_allclose(weights @ next(values), next(values), rtol=1e-9)


def test_a_parameter_may_be_named_as_a_strength(tmp_path: Path) -> None:
    """Duffing's cubic spring is called `beta`, as the imaginary part of a strength is."""
    few = {"starts": 1, "transient": 5, "periods": 50}
    result = plane(ALONE, [0, 0.5], parameters={"beta": [0.5, 2]}, **few)
    for j, value in enumerate(result.up):
        alone = exponents(ALONE, [0, 0.5], parameters={"beta": value}, **few)
        np.testing.assert_array_equal(result.exponent[:, j], alone.exponent)
    assert result.attractors.shape == (1, 2, 1)
    assert result.plot().get_ylabel() == r"$\beta$"
    assert dict(result.summary)["exponents"] == "alpha = -sigma gamma (coupling: rates of v)"
    result.save(tmp_path / "map.nc")
    assert open_result(tmp_path / "map.nc").parameters == ("beta",)
    both = plane(ALONE, parameters={"beta": [0.5, 2], "delta": [0.1, 0.2]}, **few)
    assert both.parameters == ("beta", "delta")
    assert len(both.modes) == 2
    fixed = plane(ALONE, [0, 0.5], [0, 0.1], parameters={"beta": 2}, **few)
    np.testing.assert_allclose(fixed.exponent[:, 0], result.exponent[:, 1], atol=1e-6)
    assert fixed.plot().get_ylabel() == r"$\beta=-\sigma\,\mathrm{Im}\,\gamma$"


def test_the_imaginary_part_is_not_the_parameter_of_that_name() -> None:
    scene = Scene("duffing", "spring", topology=chain(2))
    with pytest.warns(UserWarning, match="imaginary part of strengths, and a parameter of that name"):
        result = plane(scene, [0.0, 1.0], beta=[0.0, 1.0], periods=4, transient=2, starts=1, rtol=1e-4)
    assert "2 beta (imaginary part) from 0 to 1" in dict(result.summary)["grid"]


def test_files_figures_and_threads(tmp_path: Path) -> None:
    reported: list[float] = []
    scene = layered(ring(4), complete(4), PULL, omega=1.3)
    axes = {"k": np.linspace(0.0, 0.5, 3), "g": np.linspace(0.0, 0.1, 4)}
    result = plane(scene, starts=2, transient=50, workers=1, progress=lambda p: reported.append(p.done), **axes)
    other = plane(scene, starts=2, transient=50, workers=2, parameters=axes)
    np.testing.assert_array_equal(result.exponent, other.exponent)
    assert reported == sorted(reported)
    assert reported[-1] == 4 * (50 + 5000)
    result.save(tmp_path / "map.nc")
    opened = open_result(tmp_path / "map.nc")
    assert (opened.names, opened.modes, opened.scene) == (result.names, result.modes, result.scene)
    np.testing.assert_array_equal(opened.mode, result.mode)
    assert opened.attractors.tolist() == result.attractors.tolist()
    axes_of = result.plot()
    assert (axes_of.get_xlabel(), axes_of.get_ylabel()) == ("$k$", "$g$")
    assert "12 k" not in repr(result)
    assert "3 k from 0 to 0.5, 4 g from 0 to 0.1" in repr(result)


SCENE = layered(ring(4), complete(4))
ALONE = Scene("duffing", SPRING, ring(4))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plane(SCENE), "found the axes none; expected alpha and beta"),
        (lambda: plane(SCENE, k=[0, 1]), "found the axes k; expected alpha and beta"),
        (lambda: plane(SCENE, k=[0, 1], c=[0, 1], omega=[1, 2]), "found the axes k, c, omega"),
        (lambda: plane(ALONE, beta=[0, 1], parameters={"delta": [0.1, 0.2]}), "found the axes beta, delta"),
        (lambda: plane(ALONE, [0, 1], [0, 1], parameters={"beta": [0, 1]}), "found an axis of strengths and one of a par"),
        (lambda: plane(SCENE, k=[0, 1], c=[0, 1], starts=-1), "starts = -1"),
        (lambda: plane(SCENE, k=[0, 1], c=[1, 0]), "c: found numbers that do not increase"),
        (lambda: plane(SCENE, k=[0, 1], c=[1]), "expected a row of at least 2 numbers"),
        (lambda: plane(SCENE, k=[0, 1], d=[0, 1]), "unknown parameter or keyword 'd' of plane"),
        (lambda: plane(SCENE, k=[0, 1], delta=[-1, 1]), "delta"),
        (lambda: plane(SCENE, [0, 1], [0, 1]), "found 2 layers of links, so that a mode has as many strengths"),
        (lambda: msf(SCENE), "exponents(scene, alpha) takes a column for each layer, or a matrix"),
        (lambda: plane(SCENE, [0, 1], k=[0, 1]), "found 2 layers of links"),
        (lambda: exponents(SCENE, [0, 1]), "found 2 layers of links"),
        (lambda: exponents(ALONE, [[0.1, 0.2]]), "array of shape (1, 2)"),
        (lambda: msf(SCENE, [0, 1]), "found 2 layers of links"),
        (lambda: plane(ALONE, [0, 1], k=[0, 1]), "expected another parameter: alpha = -k gamma"),
        (lambda: plane(Scene("duffing"), delta=[0, 1], omega=[1, 2]), "a scene without links"),
        (lambda: exponents(layered(ring(4), star(4)), np.zeros((2, 2, 2, 3))), "expected one for each"),
        (lambda: plane(layered(chain(18), star(18)), k=[0, 1], c=[0, 1]), "blocks of 17 differences; expected at most 16"),
        (lambda: plane(layered(ring(4), chain(4), PULL), k=[0, 1], g=[0, 1]), "sums of weights differ from node"),
        (lambda: plane(Scene("friction", "spring", ring(4), contact="set-valued"), sigma=[0, 1], kappa=[1, 2]), "kappa"),
    ],
)  # fmt: skip
def test_what_is_refused(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=r"[a-z]") as error:
        call()
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_exponents_take_the_strengths_of_layers() -> None:
    """A row for each mode; ranges need a line."""
    result = exponents(layered(ring(6), ring(6), **ALMOST_LINEAR), [[0.0, 0.3], [2.0, 0.1]], rtol=1e-9, starts=1)
    np.testing.assert_allclose(result.exponent, [roots(0.0, 0.3), roots(2.0, 0.1)], atol=1e-8)
    assert result.data.alpha.dims == ("mode", "layer")
    assert "negative for alpha" not in repr(result)
    drawn = result.plot()
    assert (drawn.get_xlabel(), drawn.get_ylabel()) == (r"$\alpha_1$", r"$\alpha_2$")
    turned = exponents(layered(ring(6), ring(6), **ALMOST_LINEAR), [[0.0, 0.3j], [2.0, 0.1]], rtol=1e-9, starts=1)
    assert turned.plot().get_xlabel() == "number of the mode"
    with pytest.raises(ValueError, match="those of 2 layers"):
        result.intervals  # noqa: B018

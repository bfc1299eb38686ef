"""The universal probe against the algebra of its ring, linear modes in closed form, and networks simulated directly."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from synchain import Criterion, Scene, run, universal_probe
from synchain.graphs import chain, from_matrix
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Edge, Node
from synchain.results import Status
from synchain.runtime.synchronisation.probe import MODE_ALPHA, MODE_BETA, ring_of_three
from synchain.runtime.synchronisation.threshold import probe

FRICTION = Scene(topology=chain(2), parameters={"omega": 1.15})
SPRINGS = Scene(
    oscillator="duffing", topology=chain(2), parameters={"beta": 0.0, "delta": 0.5, "u": 0.1, "omega": 1.0},
    max_steps=100_000,  # linear modes that grow do so without end, and rounding then costs steps without end
)  # fmt: skip
DAMPERS = Scene(oscillator="harmonic", topology=chain(2), coupling="damper")


@pytest.mark.parametrize(("scene", "column"), [(SPRINGS, 0), (DAMPERS, 3)])
def test_the_ring_has_the_two_conjugate_eigenvalues_exactly(scene, column):
    """-gamma = alpha ± i beta and 0, from the derivatives of the links' forces (rows v_1 … v_3)."""
    jacobian = sp.zeros(3, 3)
    for (row, place), entry in ring_of_three(scene.equations).link_jacobian():
        assert row >= 3
        assert column <= place < column + 3
        jacobian[row - 3, place - column] += entry
    z = sp.Symbol("z")
    expected = z * ((z + MODE_ALPHA) ** 2 + MODE_BETA**2)
    assert sp.expand(jacobian.charpoly(z).as_expr() - expected) == 0
    assert jacobian * sp.ones(3, 1) == sp.zeros(3, 1)
    assert (jacobian * jacobian.T - jacobian.T * jacobian).applyfunc(sp.expand) == sp.zeros(
        3, 3
    )  # normal: no transient growth
    a, b = jacobian[0, 1], jacobian[1, 0]
    assert sp.simplify(sp.Rational(3, 2) * (a + b) - MODE_ALPHA) == 0
    assert sp.simplify(sp.sqrt(3) / 2 * (a - b) - MODE_BETA) == 0


def growth(damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Largest growth rate of d'' = -damping d' - stiffness d, complex numbers."""
    root = np.sqrt(damping**2 / 4 - stiffness + 0j)
    return np.maximum((-damping / 2 + root).real, (-damping / 2 - root).real)


def test_linear_nodes_with_springs_synchronise_inside_a_parabola():
    """d'' = -delta d' - (1 + alpha + i beta) d dies out where alpha > beta^2/delta^2 - 1 (put d = exp(i w t))."""
    delta = 0.5
    alpha, beta = np.meshgrid(np.linspace(-2.0, 3.0, 11), np.linspace(-1.2, 1.2, 13), indexing="ij")
    rate = growth(np.full(alpha.shape, delta), 1 + alpha + 1j * beta)
    inside = alpha > beta**2 / delta**2 - 1
    assert np.array_equal(rate < 0, inside)
    result = universal_probe(SPRINGS, alpha, beta, criterion=Criterion(transient=50, window=5, starts=1))
    clear = np.abs(rate) > 0.05  # exp(-0.05 * 50 * 2 pi) = 2e-7
    assert clear.sum() > 100
    assert inside[clear].any()
    assert np.array_equal(result.synchronous[clear], inside[clear])
    assert np.array_equal(result.share[clear], inside[clear].astype(float))
    assert result.alpha.shape == result.error.shape == (11, 13)


def test_linear_nodes_with_dampers_synchronise_in_the_right_half_plane():
    """d'' = -(alpha + i beta) d' - d: both roots have negative real parts where alpha > 0, whatever beta."""
    alpha, beta = np.array([-0.5, -0.1, 0.1, 0.5, 1.0]), np.array([[-2.0], [-0.5], [0.0], [0.5], [2.0]])
    assert np.array_equal(growth(alpha + 1j * beta, np.ones((5, 5))) < 0, np.broadcast_to(alpha > 0, (5, 5)))
    result = universal_probe(DAMPERS, alpha, beta, criterion=Criterion(transient=1500, window=20, starts=1))
    assert np.array_equal(result.synchronous, np.broadcast_to(alpha > 0, (5, 5)))
    assert np.array_equal(result.beta[:, 0], beta[:, 0])


@pytest.mark.long
def test_without_an_imaginary_part_it_says_what_two_oscillators_say():
    """Friction, omega = 1.15: synchronous up to alpha = 2 * 0.233 (Marszal et al., Eur. Phys. J. Special Topics, 2016)."""
    criterion = Criterion(transient=150, window=20, starts=2)
    alpha = [0.1, 0.3, 0.7, 0.8]
    result = universal_probe(FRICTION, alpha, 0.0, criterion=criterion)
    two = probe(FRICTION, alpha, criterion=criterion, resolution=1.0)
    assert result.share.tolist() == two.share.tolist() == [1.0, 1.0, 0.0, 0.0]
    assert result.synchronous.tolist() == [True, True, False, False]


@pytest.mark.long
def test_a_one_way_ring_is_one_point_of_the_plane():
    """a = sigma and b = 0 are alpha = 3 sigma/2 and beta = sqrt(3) sigma/2: the same three oscillators, the same error."""
    sigma = 0.4
    ring = Scene(
        topology=from_matrix([[-1, 1, 0], [0, -1, 1], [1, 0, -1]]), parameters={"omega": 1.15, "sigma": sigma},
        transient=1.0, window=2.0, rtol=1e-10,
    )  # fmt: skip
    direct = float(run(ring).sync_error)
    criterion = Criterion(transient=1.0, window=2.0, starts=1, rtol=1e-10)
    for sign in (1.0, -1.0):
        result = universal_probe(FRICTION, 1.5 * sigma, sign * np.sqrt(3) / 2 * sigma, criterion=criterion)
        assert result.error.shape == ()
        if sign > 0:
            assert float(result.error) == pytest.approx(direct, rel=1e-6)
        else:  # the other way round the start is another one
            assert abs(float(result.error) - direct) > 1e-4 * direct


class Spy(ThreadPoolExecutor):
    """Notes the kernels of the blocks that it runs."""

    def __init__(self, workers: int, digests: set[str]) -> None:
        super().__init__(workers)
        self.digests = digests

    def submit(self, function, /, *arguments):
        self.digests.add(function.__self__.kernel.digest)
        return super().submit(function, *arguments)


def test_a_plane_needs_one_kernel_and_the_workers_do_not_matter():
    digests = set()
    criterion = Criterion(transient=5, window=2, starts=3)
    alpha, beta = np.linspace(-0.5, 2.0, 30), np.linspace(-1.0, 1.0, 30)
    one, two = (
        universal_probe(SPRINGS, alpha, beta, criterion=criterion, workers=workers, executor=Spy(workers, digests))
        for workers in (1, 2)
    )
    universal_probe(SPRINGS.replace(delta=0.7), 1.0, 0.3, criterion=criterion, executor=Spy(1, digests))
    assert len(digests) == 1
    assert np.array_equal(one.error, two.error)
    assert one.status.shape == (30, 3)


def test_starts_are_moved_as_a_whole_and_the_median_counts():
    """Linear nodes: a common move is no deviation, so the error is that of the unmoved start; friction feels it."""
    criterion = Criterion(transient=5, window=2, starts=3)
    one = universal_probe(SPRINGS, 0.5, 0.1, criterion=replace(criterion, starts=1))
    three = universal_probe(SPRINGS, 0.5, 0.1, criterion=criterion)
    assert float(three.error) == pytest.approx(float(one.error), rel=1e-4)
    moved = [universal_probe(FRICTION, 0.5, 0.1, criterion=replace(criterion, rng=k, starts=2)).error for k in (0, 1)]
    assert abs(moved[0] - moved[1]) > 1e-6


def test_every_strength_has_all_starts_and_its_own_numbers():
    """Several at once are judged as each alone."""
    criterion = Criterion(transient=2, window=2, starts=3)
    alpha, beta = [0.2, 0.5, 0.9], [0.1, -0.3, 0.4]
    together = universal_probe(FRICTION, alpha, beta, criterion=criterion)
    alone = [universal_probe(FRICTION, a, b, criterion=criterion).error for a, b in zip(alpha, beta, strict=True)]
    np.testing.assert_allclose(together.error, alone, rtol=1e-12)
    assert len(np.unique(np.round(alone, 6))) == 3


def test_cells_that_do_not_finish_are_not_synchronous():
    result = universal_probe(SPRINGS.replace(max_steps=3), [0.5], [0.0], criterion=Criterion(transient=5, window=2))
    assert result.share.tolist() == [0.0]
    assert np.isinf(result.error).all()
    assert (result.status == Status.STEP_BUDGET).all()


def model(edge_rhs="sigma*weight*(x_j - x_i)", node_parameters=("c",)) -> Equations:
    """One node x' = -c x … with links of a given rate."""
    x, x_i, x_j, weight, *node_symbols = sp.symbols(("x", "x_i", "x_j", "weight", *node_parameters), real=True)
    rhs = sp.sympify(
        edge_rhs, locals={s.name: s for s in (x_i, x_j, weight)} | {"sigma": sp.Symbol("sigma", real=True)}
    )
    used = tuple(sorted(rhs.free_symbols - {x_i, x_j, weight}, key=str))
    return Equations.of_equal_nodes(
        Node((x,), (-sum(node_symbols) * x,), tuple(node_symbols)), Edge((x_i,), (x_j,), weight, (rhs,), used), 2
    )


def test_nonlinear_couplings_keep_their_form():
    ring = ring_of_three(model("sigma*weight*((x_j - x_i) + (x_j - x_i)**3)"))
    assert ring.parameters == ("c", "mode_alpha", "mode_beta")
    assert len(ring.links) == 6
    x_i, x_j = ring.edge.here[0], ring.edge.there[0]
    one_way = ring.edge.rhs[0].xreplace({ring.edge.weight: sp.S.One})
    assert sp.expand(one_way / (MODE_ALPHA / 3 + MODE_BETA / sp.sqrt(3)) - (x_j - x_i) - (x_j - x_i) ** 3) == 0


@pytest.mark.parametrize(
    ("equations", "message"),
    [
        (model("sigma**2*weight*(x_j - x_i)"), "not proportional to sigma"),
        (model("sigma*weight**2*(x_j - x_i)"), "not proportional to sigma"),
        (model("sigma*weight*x_j"), "acts between equal states"),
        (model("weight*(x_j - x_i)"), "found no parameter; expected sigma"),
        (model(node_parameters=("mode_beta",)), "'mode_beta' is needed for the probe"),
        (Scene(oscillator="harmonic").equations, "no coupling"),
    ],
)
def test_models_that_the_probe_cannot_take_are_refused(equations, message):
    with pytest.raises(ValueError, match=message):
        ring_of_three(equations)


@pytest.mark.parametrize(
    ("alpha", "beta", "message"),
    [([], 0.0, "no values"), (np.nan, 0.0, "not finite"), ([0.0, np.inf], 0.0, "not finite")],
)
def test_strengths_must_be_numbers(alpha, beta, message):
    with pytest.raises(ValueError, match=message):
        universal_probe(SPRINGS, alpha, beta)


def test_a_scene_without_coupling_is_refused():
    with pytest.raises(ValueError, match="coupling"):
        universal_probe(Scene(oscillator="harmonic", coupling=None), 0.5, 0.0)


def test_what_the_scene_observes_changes_nothing():
    """The ring of three is another network, whose kernel has no room for observed values."""
    criterion = Criterion(starts=2, transient=5, window=2)
    watched = SPRINGS.replace(observe={"e": "mean(nodes.mean(v**2))"})
    probed, plain = (universal_probe(s, [0.1, 0.2], 0.1, criterion=criterion) for s in (watched, SPRINGS))
    np.testing.assert_array_equal(probed.error, plain.error)

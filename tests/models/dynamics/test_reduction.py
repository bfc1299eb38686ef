"""Exact reductions: folded parameters, balanced partitions, quotient networks."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import combinations, product

import networkx as nx
import numpy as np
import pytest
import sympy as sp
from parts import edge, node
from samples import friction_chain, harmonic_chain, looped, real

from synchain.graphs import chain, complete, ring, star
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.network import network
from synchain.models.dynamics.reduction import collapse, quotient, substitute_constants
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.symmetries.partitions import coarsest_balanced

HALF = Fraction(1, 2)


def coupled(graph, oscillator: str = "duffing", coupling: str = "spring") -> Equations:
    single = node(oscillator)
    return network(single, edge(coupling, single, oscillator), graph)


def linked(n: int, links) -> Equations:
    """Harmonic oscillators on any links (target, source, weight)."""
    return Equations.of_equal_nodes(harmonic_chain(2).node, harmonic_chain(2).edge, n, tuple(links))


# -- fold ----------------------------------------------------------------------------------------------------


def test_no_forcing_takes_the_frequency_along():
    reduced = substitute_constants(friction_chain(2), {"u": 0})
    assert not reduced.node.forced
    assert set(friction_chain(2).parameters) - set(reduced.parameters) == {"u", "omega"}
    assert reduced.links == friction_chain(2).links


def test_no_coupling_leaves_no_edge():
    reduced = substitute_constants(friction_chain(3), {"sigma": 0})
    assert reduced.edge is None
    assert reduced.links == ()
    assert "sigma" not in reduced.parameters
    assert reduced.n == 3


def test_folded_equations_are_the_substituted_ones():
    full = looped()
    values = {"mu": Fraction(3, 7), "sigma": Fraction(-2), "c": 0}
    reduced = substitute_constants(full, values)
    swap = {sp.Symbol(name, real=True): sp.Rational(v.numerator, v.denominator) for name, v in values.items()}
    for a, b in zip(reduced.rhs(), full.rhs(), strict=True):
        assert sp.simplify(a - b.xreplace(swap)) == 0
    assert reduced.parameters == ("omega", "delta")
    assert reduced.digest != full.digest


def test_nothing_to_fold_changes_nothing():
    assert substitute_constants(looped(), {}) is looped() or substitute_constants(looped(), {}) == looped()


@pytest.mark.parametrize("value", [0.5, True, "1", np.float64(0.0)])
def test_inexact_numbers_are_refused(value):
    with pytest.raises(TypeError, match=r"fold u: found .*expected an int or a Fraction"):
        substitute_constants(friction_chain(1), {"u": value})


def test_unknown_parameters_are_refused():
    with pytest.raises(ValueError, match="unknown parameter 'sigma'; known: theta_b"):
        substitute_constants(friction_chain(1), {"sigma": 0})


def test_a_number_at_which_the_equations_are_undefined_is_refused():
    x, a = real("x", "a")
    with pytest.raises(ValueError, match="undefined at a = 0"):
        substitute_constants(Equations.of_equal_nodes(Node((x,), (-x / a,), (a,)), None, 1), {"a": 0})


# -- partitions ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("graph", "colours", "expected"),
    [
        (chain(4), "abba", (0, 1, 1, 0)),
        (chain(4), "abab", (0, 1, 2, 3)),
        (chain(4), "aaaa", (0, 0, 0, 0)),
        (chain(5), "abcba", (0, 1, 2, 1, 0)),
        (ring(6), "ababab", (0, 1, 0, 1, 0, 1)),
        (ring(6), "abbabb", (0, 1, 1, 0, 1, 1)),
        (ring(6), "abbbbb", (0, 1, 2, 3, 2, 1)),
        (star(5), "abbbb", (0, 1, 1, 1, 1)),
        (star(5), "abcbc", (0, 1, 2, 1, 2)),
        (complete(4), "abba", (0, 1, 1, 0)),
        (chain(1), "a", (0,)),
    ],
)
def test_known_partitions(graph, colours, expected):
    assert coarsest_balanced(graph.n, graph.links, colours) == expected


def test_directions_and_weights_count():
    one_way = [(1, 0, Fraction(1)), (2, 0, Fraction(1))]
    assert coarsest_balanced(3, one_way, "abb") == (0, 1, 1)
    assert coarsest_balanced(3, [one_way[0], (2, 0, HALF)], "abb") == (0, 1, 2)
    split = [(1, 0, Fraction(1)), (2, 0, HALF), (2, 3, HALF)]  # node 2 feels the same total from two of one class
    assert coarsest_balanced(4, split, "abba") == (0, 1, 1, 0)


def test_weights_that_cancel_are_no_link():
    links = [(1, 0, Fraction(1)), (1, 2, Fraction(-1))]
    assert coarsest_balanced(4, links, "abab") == (0, 1, 0, 1)
    assert collapse(linked(4, links), (0, 1, 0, 1)).links == ()


def random_links(numbers: random.Random, n: int):
    weights = [Fraction(1), HALF, Fraction(-1), Fraction(2, 3)]
    share = numbers.choice([0.2, 0.5, 0.9])
    pairs = [(i, j) for i, j in product(range(n), repeat=2) if i != j and numbers.random() < share]
    return tuple((i, j, numbers.choice(weights[: numbers.randint(1, 4)])) for i, j in pairs)


def partitions(n: int):
    """All partitions of n nodes, classes numbered by their first nodes."""
    made = [(0,)]
    for _ in range(n - 1):
        made = [(*p, k) for p in made for k in range(max(p) + 2)]
    return made


def balanced(links, classes) -> bool:
    for i, j in combinations(range(len(classes)), 2):
        if classes[i] == classes[j]:
            for k in set(classes) - {classes[i]}:
                felt = [sum(w for t, s, w in links if t == node and classes[s] == k) for node in (i, j)]
                if felt[0] != felt[1]:
                    return False
    return True


@pytest.mark.parametrize("seed", range(60))
def test_the_partition_is_the_coarsest_of_all_balanced_ones(seed):
    """Every partition of up to six nodes is tried: the found one is balanced, and no balanced one has fewer classes."""
    dice = random.Random(seed)
    n = dice.randint(2, 6)
    if seed % 3:
        links = random_links(dice, n)
    else:
        pairs = nx.gnp_random_graph(n, 0.5, seed=seed).edges
        links = tuple((a, b, Fraction(1)) for i, j in pairs for a, b in ((i, j), (j, i)))
    colours = [dice.choice("ab") if seed % 2 else "a" for _ in range(n)]
    if seed % 5 == 0:
        colours[0] = "first"
    partition = coarsest_balanced(n, links, colours)
    one_colour = [p for p in partitions(n) if len(set(zip(p, colours, strict=True))) == max(p) + 1]
    all_balanced = [p for p in one_colour if balanced(links, p)]
    assert partition in all_balanced
    assert [p for p in all_balanced if max(p) <= max(partition)] == [partition]


def test_large_graphs_are_quick_work():
    """A ring of 30000 with one odd start: every distance from it is a class, which takes the most refinements."""
    n = 30_000
    partition = coarsest_balanced(n, ring(n).links, ["odd", *["even"] * (n - 1)])
    assert partition == tuple(min(i, n - i) for i in range(n))


def test_one_colour_for_each_node():
    with pytest.raises(ValueError, match="found 2 for 3 nodes"):
        coarsest_balanced(3, (), "ab")


# -- quotients -----------------------------------------------------------------------------------------------


def lifted(small: Equations, classes, full: Equations) -> bool:
    """True where the right-hand side of the full network at equal states is that of the quotient."""
    equal = {}
    for i, k in enumerate(classes):
        equal |= dict(zip(full.symbols(i), small.symbols(k), strict=True))
    components = len(full.node.state)
    rates, fewer = full.rhs(), small.rhs()
    return all(
        sp.expand(rates[c * full.n + i].xreplace(equal) - fewer[c * small.n + k]) == 0
        for c in range(components)
        for i, k in enumerate(classes)
    )


@pytest.mark.parametrize("coupling", ["spring", "damper"])
@pytest.mark.parametrize(
    ("graph", "colours", "count"),
    [
        (chain(4), "abba", 2),
        (ring(6), "abbbbb", 4),
        (star(6), "abbbcc", 3),
        (complete(5), "aabbb", 2),
        (ring(5), "aaaaa", 1),
    ],
)
def test_the_quotient_moves_like_the_network(graph, colours, count, coupling):
    full = coupled(graph, coupling=coupling)
    small, classes = quotient(full, colours)
    assert small.n == count
    assert lifted(small, classes, full)


@pytest.mark.parametrize("seed", range(20))
def test_random_quotients_move_like_their_networks(seed):
    """Two copies of a random graph of three nodes, each link shared between the copies of its source."""
    dice = random.Random(seed)
    inner = [(i, j, dice.choice([w / 2, w]), w) for i, j, w in random_links(dice, 3)]
    links = []
    for i, j, share, w in inner:
        for copy in range(2):
            links += [(3 * copy + i, j, share), (3 * copy + i, 3 + j, w - share)]
    full = linked(6, [link for link in links if link[2] != 0])
    small, classes = quotient(full, [i % 3 for i in range(6)])
    assert small.n <= 3
    assert lifted(small, classes, full)


def trajectory(equations: Equations, start: np.ndarray, values: dict[str, float]) -> np.ndarray:
    """States along 600 steps of the classical Runge-Kutta method."""
    names = [*equations.state, *equations.parameters]
    rate = sp.lambdify([TIME, *real(*names)], equations.rhs(), "math")
    parameter_values, y, h = [values[name] for name in equations.parameters], start, 0.01
    built = []
    for k in range(600):
        k1 = np.array(rate(k * h, *y, *parameter_values))
        k2 = np.array(rate((k + 0.5) * h, *(y + h / 2 * k1), *parameter_values))
        k3 = np.array(rate((k + 0.5) * h, *(y + h / 2 * k2), *parameter_values))
        k4 = np.array(rate((k + 1) * h, *(y + h * k3), *parameter_values))
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        built.append(y)
    return np.array(built)


@pytest.mark.parametrize("seed", range(8))
def test_trajectories_of_quotients_are_those_of_random_graphs(seed):
    """Random regular graphs; mirrored by construction, half of the nodes start as their twins do."""
    half = nx.random_regular_graph(2, 4, seed=seed)
    doubled = nx.disjoint_union(half, half)
    dice = random.Random(seed)
    for i, j in dice.sample(sorted(product(range(4), repeat=2)), 5):
        doubled.add_edge(i, 4 + j)
        doubled.add_edge(j, 4 + i)
    links = sorted((a, b, Fraction(1)) for i, j in doubled.edges for a, b in ((i, j), (j, i)))
    full = Equations.of_equal_nodes(coupled(chain(2)).node, coupled(chain(2)).edge, 8, tuple(links))
    small, classes = quotient(full, [i % 4 for i in range(8)])
    assert small.n == 4
    values = {"delta": 0.1, "beta": 1.0, "u": 0.3, "omega": 1.0, "sigma": 0.3}
    begin = np.array([dice.uniform(-1, 1) for _ in range(8)])
    columns = [c * 4 + k for c in range(2) for k in classes]
    complete, fewer = trajectory(full, begin[columns], values), trajectory(small, begin, values)
    assert np.abs(complete - fewer[:, columns]).max() < 1e-12
    wrong = Equations.of_equal_nodes(small.node, small.edge, 4, tuple((a, b, w / 2) for a, b, w in small.links))
    assert np.abs(complete - trajectory(wrong, begin, values)[:, columns]).max() > 1e-2


def test_a_wrong_partition_is_caught():
    full = coupled(chain(4))
    assert collapse(full, (0, 1, 1, 0)).n == 2
    with pytest.raises(
        ValueError, match="nodes 1 and 3 are of one class, but feel class 1 with the total weights 1 and 2"
    ):
        collapse(full, (0, 1, 0, 1))
    for wrong in ((0, 1, 1), (0, 2, 2, 0), (1, 1, 1, 1)):
        with pytest.raises(ValueError, match="expected"):
            collapse(full, wrong)
    merged = Equations.of_equal_nodes(full.node, full.edge, 2, ((0, 1, Fraction(1)), (1, 0, Fraction(2))))
    assert not lifted(merged, (0, 1, 0, 1), full)  # the check of the tests above can fail


def test_links_inside_a_class_leave():
    small, _ = quotient(coupled(complete(4)), "aaaa")
    assert small.links == ()
    assert small.edge is None
    assert "sigma" not in small.parameters


def test_a_network_without_equal_colours_is_itself():
    full = coupled(chain(3))
    assert quotient(full, "abc") == (full, (0, 1, 2))


def test_uncoupled_nodes_of_one_colour_are_one():
    small, classes = quotient(substitute_constants(friction_chain(4), {"sigma": 0}), "abab")
    assert classes == (0, 1, 0, 1)
    assert small.n == 2


def test_couplings_without_an_exact_quotient_are_refused():
    with pytest.raises(ValueError, match="not zero between equal states"):
        quotient(looped(), "aaa")
    x, x_2, w, sigma = real("x", "x_there", "weight", "sigma")
    waves = Edge((x,), (x_2,), w, (sigma * sp.sin(w * (x_2 - x)),), (sigma,))
    links = ((0, 1, Fraction(1)), (1, 0, Fraction(1)))
    with pytest.raises(ValueError, match="not proportional to its weight"):
        quotient(Equations.of_equal_nodes(Node((x,), (-x,), ()), waves, 2, links), "aa")

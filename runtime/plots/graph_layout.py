"""Positions of the nodes of a drawn graph: by its family, or by eigenvectors of its Laplacian.

The eigenvectors of the two smallest eigenvalues above 0 place linked nodes near each other (Hall,
Management Sci. 17, 219 (1970); Koren, Comput. Math. Appl. 49, 1867 (2005)).  If eigenvalues are equal, positions
coincide or depend on rounding.  For graphs of at most DENSE nodes, majorisation of the stress therefore fits the
distances to the lengths of shortest paths (Gansner, Koren & North, Lecture Notes in Computer Science 3383, 239 (2005)).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from synchain.models.graphs.families import FamilyRule
from synchain.models.graphs.links import join
from synchain.models.graphs.topology import Topology

DENSE = 300  # largest number of nodes with dense matrices, whose pseudo-inverse costs n^3 (a choice)
ROUNDS = 80  # number of steps of the majorisation (a choice)


def positions(graph: Topology) -> np.ndarray:
    """Return the positions (n, 2) of the nodes in a box of side 2 about the origin."""
    rule = graph.rule
    layout = _FAMILIES.get(rule.family.name) if isinstance(rule, FamilyRule) else None
    return _fit(_spectral(graph) if layout is None else layout(graph))


def _circle(count: int) -> np.ndarray:
    """Return points (count, 2) on a circle, clockwise from the top."""
    angle = 0.5 * np.pi - 2.0 * np.pi * np.arange(count) / max(count, 1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _ring(graph: Topology) -> np.ndarray:
    return _circle(graph.n)


def _line(graph: Topology) -> np.ndarray:
    return np.stack([np.linspace(-1.0, 1.0, graph.n), np.zeros(graph.n)], axis=1)


def _hub(graph: Topology) -> np.ndarray:
    """Put the first node into the middle of the others."""
    return np.concatenate([np.zeros((1, 2)), _circle(graph.n - 1)])


def _lattice(graph: Topology) -> np.ndarray:
    """Put a grid of two dimensions into rows and columns, any other one by its eigenvectors."""
    rule = graph.rule
    assert isinstance(rule, FamilyRule)
    sides = dict(rule.options).get("shape") or (rule.family.sides(graph.n) if rule.family.sides else (graph.n,))
    if not isinstance(sides, tuple) or len(sides) != 2:
        return _circle(graph.n) if rule.family.name == "torus" and sides == (graph.n,) else _spectral(graph)
    row, column = np.divmod(np.arange(graph.n), int(sides[1]))
    return np.stack([column, -row], axis=1).astype(float)


def _rails(graph: Topology) -> np.ndarray:
    """Put even nodes above odd ones."""
    rung, rail = np.divmod(np.arange(graph.n), 2)
    return np.stack([rung, -rail], axis=1).astype(float)


def _levels(graph: Topology) -> np.ndarray:
    """Put the root of a binary tree at the top: node i has the children 2 i + 1 and 2 i + 2."""
    number = np.arange(1, graph.n + 1)
    level = np.floor(np.log2(number)).astype(int)
    across = (number - 2**level + 0.5) / 2.0**level
    return np.stack([2.0 * across - 1.0, -level / max(level.max(initial=0), 1) * 1.2], axis=1)


def _sides(graph: Topology) -> np.ndarray:
    """Put the two groups into two columns."""
    rule = graph.rule
    assert isinstance(rule, FamilyRule)
    left = int(str(dict(rule.options).get("left") or graph.n // 2))
    columns = []
    for count, x in ((left, -0.7), (graph.n - left, 0.7)):
        y = np.linspace(1.0, -1.0, count) if count > 1 else np.zeros(1)
        columns.append(np.stack([np.full(count, x), y], axis=1))
    return np.concatenate(columns)


# Layout functions of families; other graphs are drawn by eigenvectors.
_FAMILIES: dict[str, Callable[[Topology], np.ndarray]] = {
    **dict.fromkeys(("ring", "one_way_ring", "complete", "circulant", "small_world"), _ring),
    **dict.fromkeys(("chain", "feed_forward"), _line),
    **dict.fromkeys(("star", "wheel"), _hub),
    **dict.fromkeys(("grid", "torus"), _lattice),
    "ladder": _rails,
    "tree": _levels,
    "complete_bipartite": _sides,
}


def _spectral(graph: Topology) -> np.ndarray:
    """Put connected components side by side, each drawn by eigenvectors; put a graph of few links on a circle."""
    part = np.array(join(graph.n, ((target, source) for target, source, _ in graph.links)))
    parts = np.unique(part)
    if len(parts) > graph.n // 2:
        return _circle(graph.n)
    points = np.zeros((graph.n, 2))
    left = 0.0
    for label in parts:
        members = np.flatnonzero(part == label)
        # the area of a component is proportional to its number of nodes
        layout = _fit(_eigenvectors(graph, members)) * np.sqrt(len(members))
        points[members] = layout + np.array([left - layout[:, 0].min(), 0.0])
        left += float(np.ptp(layout[:, 0])) + 0.6 * np.sqrt(len(members)) + 0.4
    return points


def _eigenvectors(graph: Topology, members: np.ndarray) -> np.ndarray:
    """Return the second and third eigenvector (m, 2) of the Laplacian of absolute weights, as an undirected graph."""
    if len(members) <= 3:
        return _circle(len(members))
    index = np.full(graph.n, -1)
    index[members] = np.arange(len(members))
    ends = np.array([(index[t], index[s], abs(float(w))) for t, s, w in graph.links if index[t] >= 0])
    rows, columns, weights = ends[:, 0].astype(int), ends[:, 1].astype(int), ends[:, 2]
    from scipy.sparse import coo_array, csgraph

    adjacency = coo_array((weights, (rows, columns)), shape=(len(members),) * 2).tocsr()
    laplacian = csgraph.laplacian(0.5 * (adjacency + adjacency.T))
    if len(members) <= DENSE:
        start = _fit(np.asarray(np.linalg.eigh(laplacian.toarray())[1][:, 1:3]))
        # Move nodes by majorisation until their distances approach the lengths (m, m) of shortest paths.
        path_lengths = csgraph.shortest_path(adjacency, directed=False, unweighted=True)
        scale = float(path_lengths.max()) / 2.0
        points = scale * start + 0.05 * scale * _circle(len(start))  # separate coinciding nodes
        # each step solves L_w x = L_pull x_old, weights 1/d² (Gansner, Koren & North)
        weight = np.divide(1.0, path_lengths**2, where=path_lengths > 0.0, out=np.zeros_like(path_lengths))
        inverse = np.linalg.pinv(np.diag(weight.sum(axis=1)) - weight)
        for _ in range(ROUNDS):
            now = np.linalg.norm(points[:, None] - points[None], axis=2)
            pull = np.divide(weight * path_lengths, now, where=now > 0.0, out=np.zeros_like(now))
            points = inverse @ ((np.diag(pull.sum(axis=1)) - pull) @ points)
        return np.asarray(points)
    from scipy.sparse.linalg import eigsh

    # the Laplacian is singular, so shift to just below 0; a fixed start vector makes drawings reproducible
    start = np.random.default_rng(0).normal(size=len(members))
    shift = -1e-3 * float(weights.mean())
    values, vectors = eigsh(laplacian.tocsc(), k=3, sigma=shift, v0=start)
    return np.asarray(vectors[:, np.argsort(values)[1:3]])


def _fit(points: np.ndarray) -> np.ndarray:
    """Shift and scale positions into a box of side 2 about the origin, without distortion."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max()) or 1.0
    return np.asarray((points - 0.5 * (low + high)) * (2.0 / size))

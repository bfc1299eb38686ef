"""Cayley graph of a product of cyclic groups (shape: their orders; one of order n); generators: their numbers one
after another (the unit of each group).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from math import lcm, prod

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option

_Element = tuple[int, ...]


def settle(n: int, shape: object, generators: object) -> dict[str, object]:
    """Check the orders (2 or more, product n) and the generators (not neutral, one of each pair of inverses)."""
    orders = (n,) if shape is None else integers_option("shape", shape, 2)
    if prod(orders) != n:
        raise ValueError(f"shape = {orders} has {prod(orders)} elements; expected n = {n}")
    options: dict[str, object] = {} if shape is None else {"shape": orders}
    if generators is None:
        return options
    chosen: dict[_Element, None] = {}
    for element in _elements(generators, orders):
        reduced = tuple(g % order for g, order in zip(element, orders, strict=True))
        if not any(reduced):
            raise ValueError(f"generators: found {element}, which joins nodes to themselves; leave it out")
        inverse = _inverse(reduced, orders)
        chosen[min(reduced, inverse)] = None
    return options | {"generators": tuple(g for element in sorted(chosen) for g in element)}


def _elements(generators: object, orders: _Element) -> list[_Element]:
    """Read group elements from a list of elements, or from a flat list with one number for each cyclic group."""
    if isinstance(generators, list | tuple) and any(isinstance(part, list | tuple) for part in generators):
        wrong = next(
            (part for part in generators if not isinstance(part, list | tuple) or len(part) != len(orders)), None
        )
        if wrong is not None:
            raise ValueError(
                f"generators: found {wrong}; expected {len(orders)} numbers, one for each order in {orders}"
            )
        generators = [number for part in generators for number in part]
    flat, rank = integers_option("generators", generators, 0), len(orders)
    if len(flat) % rank:
        raise ValueError(f"generators = {flat}; expected {rank} numbers for each, one for each order in {orders}")
    return [flat[k : k + rank] for k in range(0, len(flat), rank)]


def _inverse(element: _Element, orders: _Element) -> _Element:
    return tuple(-g % order for g, order in zip(element, orders, strict=True))


def _group(n: int, shape: _Element | None, generators: tuple[int, ...] | None) -> tuple[_Element, list[_Element]]:
    """Return orders and generators, with defaults: one cyclic group, the unit of each group."""
    orders = shape or (n,)
    if generators is None:
        return orders, [tuple(int(i == k) for i in range(len(orders))) for k in range(len(orders))]
    return orders, _elements(generators, orders)


def edges(
    n: int, *, shape: tuple[int, ...] | None = None, generators: tuple[int, ...] | None = None
) -> Iterator[tuple[int, int, int]]:
    """Join each element to its sums with the generators; the last component of an element varies fastest."""
    orders, chosen = _group(n, shape, generators)
    steps = [(g, g == _inverse(g, orders)) for g in chosen]
    for i, here in enumerate(product(*map(range, orders))):
        for g, involution in steps:
            j = 0
            for a, b, order in zip(here, g, orders, strict=True):
                j = j * order + (a + b) % order
            if i < j or not involution:
                yield min(i, j), max(i, j), 1


def count(n: int, *, shape: tuple[int, ...] | None = None, generators: tuple[int, ...] | None = None) -> int:
    """Return the number of edges: n for each generator, n/2 for a generator that is its own inverse."""
    orders, chosen = _group(n, shape, generators)
    return sum(n // 2 if g == _inverse(g, orders) else n for g in chosen)


def spectrum(n: int, *, shape: tuple[int, ...] | None = None, generators: tuple[int, ...] | None = None) -> Eigenvalues:
    """Sum -4 sin²(π Σ_j k_j g_j/m_j) over the generators g, half of it if g = -g; m_j are the orders."""
    from ..algebra.cosine_sums import AngleSum, expressions

    orders, chosen = _group(n, shape, generators)
    unit = lcm(*orders)
    weights = [(g, Fraction(1, 2) if g == _inverse(g, orders) else Fraction(1)) for g in chosen]
    sums = []
    for character in product(*map(range, orders)):
        total = AngleSum.rational(0)
        for g, weight in weights:
            turn = sum(k * a * (unit // m) for k, a, m in zip(character, g, orders, strict=True))
            total += AngleSum.cosine(-2 * weight, weight, turn % unit, unit)
        sums.append((total, 1))
    return expressions(sums)


TOPOLOGY = Family(
    edges,
    minimum=2,
    settle=settle,
    count=count,
    spectrum=spectrum,
    connected=False,
    source="L. Lovász, Period. Math. Hung. 6, 191 (1975); L. Babai, J. Comb. Theory B 27, 180 (1979)",
)

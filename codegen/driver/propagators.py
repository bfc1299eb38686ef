"""The deviations of many strengths, moved by propagators that are interpolated from those of few nodes.

The strengths are divided into panels. A row of `panels` says which registers of strengths belong to a panel, which of its
nodes are interpolated from and which are there for comparison, and where its weights begin. In a panel without weights
every strength is a node itself.
"""

# ruff: noqa: I001  (the long lists of names stay short)
from __future__ import annotations

import math

from numba import njit

from ..simd.elementary import log
from ..simd.lanes import broadcast
from ..simd.lanes import fma
from ..simd.lanes import load
from ..simd.lanes import select
from ..simd.lanes import sqrt
from ..simd.lanes import store
from .names import LANES

# --- kernel text below ---
# Columns of `panels`: registers of strengths, first node, nodes with weights, nodes for comparison, where the weights of
# the first register begin (in registers), and where those of the nodes for comparison begin (in numbers).
FROM, TO, NODE, POINTS, EXTRAS, WEIGHTS, CHECKS = 0, 1, 2, 3, 4, 5, 6


@njit(error_model="numpy")
def tabulate(modes, powers, places, table, exponents, parts, stride):
    """Write the propagators of all nodes, each scaled by a power of two, which is written beside them.

    places (nodes, columns): the deviations that are the columns of a propagator. Number `parts*c + r` of `table` holds
    entry (r, c) of all nodes.
    """
    for node in range(places.shape[0]):
        largest = -math.inf
        for c in range(places.shape[1]):
            k = places[node, c]
            first = (k // LANES * parts) * LANES + k % LANES
            for r in range(parts):
                if modes[first + r * LANES] != 0.0:
                    largest = max(largest, powers[k])
        exponents[node] = largest if largest > -math.inf else 0.0
        for c in range(places.shape[1]):
            k = places[node, c]
            first = (k // LANES * parts) * LANES + k % LANES
            factor = math.ldexp(1.0, int(powers[k] - exponents[node]))
            for r in range(parts):
                table[(parts * c + r) * stride + node] = factor * modes[first + r * LANES]


@njit(error_model="numpy")
def part(modes, powers, places, owners, heads, head_powers, single, registers):
    """Part propagators of two components, of which a landing has left one, into this row and one deviation for each node.

    What becomes of this deviation, which begins with 1 in the component that is left, is what becomes of both columns.
    heads, head_powers: the row, by mode.  single: the deviation of each node, in so many registers.
    """
    left = 1 if owners[0] >= 0 else 0
    for node in range(places.shape[0]):
        for c in range(2):
            k = places[node, c]
            heads[k], head_powers[k] = modes[(2 * (k // LANES) + left) * LANES + k % LANES], powers[k]
    for k in range(registers * LANES):
        first = 2 * (k // LANES) * LANES + k % LANES
        single[first + left * LANES] = 1.0 if k < places.shape[0] else 0.0
        single[first + (1 - left) * LANES] = 0.0
    for k in range(registers * LANES):
        powers[k] = 0.0


@njit(error_model="numpy")
def join(single, powers, places, heads, head_powers, modes):
    """Write the columns of the propagators that `part` has parted."""
    for node in range(places.shape[0]):
        first = 2 * (node // LANES) * LANES + node % LANES
        for c in range(2):
            k = places[node, c]
            head_powers[k] += powers[node]
            for r in range(2):
                modes[(2 * (k // LANES) + r) * LANES + k % LANES] = heads[k] * single[first + r * LANES]
    for node in range(places.shape[0]):
        for c in range(2):
            powers[places[node, c]] = head_powers[places[node, c]]


@njit(error_model="numpy")
def level(node, count, table, exponents, entries, stride):
    """Scale the propagators of some nodes by the same power of two, the largest of theirs."""
    largest = exponents[node]
    for j in range(node, node + count):
        largest = max(largest, exponents[j])
    for j in range(node, node + count):
        if exponents[j] != largest:
            factor = math.ldexp(1.0, int(exponents[j] - largest))
            for slot in range(entries):
                table[slot * stride + j] *= factor
            exponents[j] = largest


@njit(error_model="numpy")
def misfit(panel, weights, table, columns, parts, stride):
    """The largest difference of interpolated from integrated propagators, relative to the size of the propagator."""
    node, points, kinds, worst = panel[NODE], panel[POINTS], parts // columns, 0.0
    for extra in range(panel[EXTRAS]):
        size, gap = 1e-300, 0.0
        for c in range(columns):
            for r in range(columns):
                at = (parts * c + r) * stride + node
                beside = at + columns * stride if kinds == 2 else at
                real, imaginary = table[at + points + extra], table[beside + points + extra] if kinds == 2 else 0.0
                size = max(size, math.hypot(real, imaginary))
                for j in range(points):
                    k = panel[CHECKS] + kinds * (extra * points + j)
                    real -= weights[k] * table[at + j]
                    if kinds == 2:
                        real += weights[k + 1] * table[beside + j]
                        imaginary -= weights[k] * table[beside + j] + weights[k + 1] * table[at + j]
                gap = max(gap, math.hypot(real, imaginary))
        worst = gap / size if not gap / size <= worst else worst  # NaN too
    return worst


@njit(error_model="numpy", forceinline=True)
def two_entries(slot, other, which, panel, weights, table, stride):
    """Two entries of real propagators in a register of strengths."""
    one, two = broadcast(0.0, LANES), broadcast(0.0, LANES)
    at, a, b = panel[WEIGHTS] + which * panel[POINTS], slot * stride + panel[NODE], other * stride + panel[NODE]
    if panel[POINTS] == 0:
        return load(table, a // LANES + which, LANES), load(table, b // LANES + which, LANES)
    for j in range(panel[POINTS]):
        weight = load(weights, at + j, LANES)
        one, two = fma(weight, table[a + j], one), fma(weight, table[b + j], two)
    return one, two


@njit(error_model="numpy", forceinline=True)
def complex_entry(slot, above, which, panel, weights, table, stride):
    """The real and the imaginary part of an entry; the latter of nodes is `above` slots further on."""
    if panel[POINTS] == 0:
        at = (slot * stride + panel[NODE]) // LANES + which
        return load(table, at, LANES), load(table, at + above * stride // LANES, LANES)
    real, imaginary = broadcast(0.0, LANES), broadcast(0.0, LANES)
    at = panel[WEIGHTS] + 2 * which * panel[POINTS]
    for j in range(panel[POINTS]):
        u, v = load(weights, at + 2 * j, LANES), load(weights, at + 2 * j + 1, LANES)
        x, y = table[slot * stride + panel[NODE] + j], table[(slot + above) * stride + panel[NODE] + j]
        real = fma(u, x, fma(v, -y, real))
        imaginary = fma(u, y, fma(v, x, imaginary))
    return real, imaginary


@njit(error_model="numpy")
def transport(panel, weights, table, exponents, travellers, lifts, moved, columns, parts, stride):
    """Apply the propagators of one panel to the deviations of its strengths; powers of two are counted in `lifts`."""
    for s in range(panel[FROM], panel[TO]):
        which, first = s - panel[FROM], parts * s
        for r in range(parts):
            store(moved, r, broadcast(0.0, LANES))
        for c in range(columns):
            if parts == columns:
                x = load(travellers, first + c, LANES)
                for r in range(0, columns, 2):
                    below = min(r + 1, columns - 1)
                    u, v = two_entries(parts * c + r, parts * c + below, which, panel, weights, table, stride)
                    real, other = load(moved, r, LANES), load(moved, below, LANES)
                    store(moved, below, fma(v, x, other))
                    store(moved, r, fma(u, x, real))
            else:
                x, y = load(travellers, first + c, LANES), load(travellers, first + columns + c, LANES)
                for r in range(columns):
                    u, v = complex_entry(parts * c + r, columns, which, panel, weights, table, stride)
                    real, imaginary = load(moved, r, LANES), load(moved, columns + r, LANES)
                    store(moved, r, fma(u, x, fma(v, -y, real)))
                    store(moved, columns + r, fma(u, y, fma(v, x, imaginary)))
        for r in range(parts):
            store(travellers, first + r, load(moved, r, LANES))
        lift = broadcast(exponents[panel[NODE]], LANES)
        if panel[POINTS] == 0:
            lift = load(exponents, panel[NODE] // LANES + which, LANES)
        store(lifts, s, load(lifts, s, LANES) + lift)


@njit(error_model="numpy")
def settle(travellers, lifts, registers, gains, parts):
    """Give all deviations unit length, and write the logarithms of how much they have grown; zeros stay zeros."""
    for s in range(registers):
        square = broadcast(0.0, LANES)
        for r in range(parts):
            value = load(travellers, parts * s + r, LANES)
            square = fma(value, value, square)
        length = sqrt(square)
        store(gains, s, load(lifts, s, LANES) * 0.6931471805599453 + log(length))
        store(lifts, s, broadcast(0.0, LANES))
        scaled = 1.0 / select(length > 0.0, length, 1.0)
        for r in range(parts):
            store(travellers, parts * s + r, scaled * load(travellers, parts * s + r, LANES))

"""The deviations of many strengths, moved by propagators that are interpolated from those of few nodes.

The strengths are divided into panels. A row of `panels` says which registers of strengths belong to a panel, which of its
nodes are interpolated from and which are there for comparison, and where its weights begin. In a panel without weights
every strength is a node itself.
"""

from __future__ import annotations

import math

from numba import njit

from ..simd.addresses import address
from ..simd.elementary import log
from ..simd.lanes import absolute, broadcast, fma, load, maximum, scale_binary, select, split_binary, sqrt, store
from .clock_slots import LANES

# --- kernel text below ---
# Columns of `panels`: registers of strengths, first node, nodes with weights, nodes for comparison, where the weights of
# the first register begin (in registers), and where those of the nodes for comparison begin (in numbers).
FROM, TO, NODE, POINTS, EXTRAS, WEIGHTS, CHECKS = PANEL = 0, 1, 2, 3, 4, 5, 6
# Registers of strengths whose propagators are interpolated together: a number of a node is loaded once for all of them, and
# a weight once for several entries.
TILE = 2


@njit(error_model="numpy")
def scale(modes, powers, registers, parts):
    """Scale every deviation by a power of two to a size between 1 and 2; a deviation of zero stays zero."""
    for register in range(registers):
        size = absolute(load(modes, parts * register, LANES))
        for c in range(1, parts):
            size = maximum(size, absolute(load(modes, parts * register + c, LANES)))
        normal = (size > 1e-290) & (size < 1e290)
        _, power = split_binary(select(normal, size, 1.0), 1.0)
        for c in range(parts):
            value = load(modes, parts * register + c, LANES)
            store(modes, parts * register + c, value * scale_binary(broadcast(1.0, LANES), 6755399441055744.0 - power))
        store(powers, register, load(powers, register, LANES) + power)


@njit(error_model="numpy")
def tabulate(modes, powers, places, nodes, columns, table, exponents, parts, stride):
    """Write the propagators of all nodes, each scaled by a power of two, which is written beside them.

    places (nodes * columns): the deviations that are the columns of a propagator. Number `parts*c + r` of `table` holds
    entry (r, c) of all nodes.
    """
    for node in range(nodes):
        largest = -math.inf
        for c in range(columns):
            k = int(places[columns * node + c])
            first = (k // LANES * parts) * LANES + k % LANES
            for r in range(parts):
                if modes[first + r * LANES] != 0.0:
                    largest = max(largest, powers[k])
        exponents[node] = largest if largest > -math.inf else 0.0
        for c in range(columns):
            k = int(places[columns * node + c])
            first = (k // LANES * parts) * LANES + k % LANES
            factor = 1.0 if powers[k] == exponents[node] else math.ldexp(1.0, int(powers[k] - exponents[node]))
            for r in range(parts):
                table[(parts * c + r) * stride + node] = factor * modes[first + r * LANES]


@njit(error_model="numpy")
def even(panel, table, exponents, entries, stride):
    """Scale the propagators of the nodes of a panel by the same power of two, the largest of theirs."""
    node, count = int(panel[NODE]), int(panel[POINTS]) + int(panel[EXTRAS])
    largest = exponents[node]
    for j in range(node, node + count):
        largest = max(largest, exponents[j])
    for j in range(node, node + count):
        if exponents[j] != largest:
            factor = math.ldexp(1.0, int(exponents[j] - largest))
            for slot in range(entries):
                table[slot * stride + j] *= factor
            exponents[j] = largest


@njit(error_model="numpy", forceinline=True)
def larger(size, other):
    """Return the larger of two sizes; NaN if either is."""
    return other if other > size or other != other else size


@njit(error_model="numpy")
def misfit(panel, weights, table, columns, rows, kinds, stride):
    """Return the largest difference of interpolated from integrated propagators, relative to their size.

    A single number may pass zero, so its size is that of the terms of the interpolation.  kinds: 2 for complex numbers, else 1.
    """
    node, points, worst = int(panel[NODE]), int(panel[POINTS]), 0.0
    for extra in range(int(panel[EXTRAS])):
        size, gap = 1e-300, 0.0
        for c in range(columns):
            for r in range(rows):
                at = (kinds * rows * c + r) * stride + node
                beside = at + rows * stride if kinds == 2 else at
                real, imaginary = table[at + points + extra], table[beside + points + extra] if kinds == 2 else 0.0
                size = max(size, math.hypot(real, imaginary) if kinds == 2 else abs(real))
                for j in range(points):
                    k = int(panel[CHECKS]) + kinds * (extra * points + j)
                    if columns == 1:
                        size = max(size, abs(weights[k] * table[at + j]))
                    real -= weights[k] * table[at + j]
                    if kinds == 2:
                        real += weights[k + 1] * table[beside + j]
                        imaginary -= weights[k] * table[beside + j] + weights[k + 1] * table[at + j]
                gap = larger(gap, math.hypot(real, imaginary) if kinds == 2 else abs(real))
        worst = larger(worst, gap / size)
    return worst


@njit(error_model="numpy")
def real_entries(register, count, panel, weights, table, columns, stride, scratch):
    """Interpolate the real propagators in registers `register` and `register + 1` of a panel of `count`.

    Entry `slot` of the first is register TILE*slot of `scratch`.  Indices beyond the end repeat the last register or entry.
    """
    points, node, first, last = int(panel[POINTS]), int(panel[NODE]), int(panel[WEIGHTS]), columns * columns - 1
    a, b = first + points * register, first + points * min(register + 1, count - 1)
    for slot in range(0, last + 1, 4):
        second, third, fourth = min(slot + 1, last), min(slot + 2, last), min(slot + 3, last)
        p, q, r, s = slot * stride + node, second * stride + node, third * stride + node, fourth * stride + node
        zero = broadcast(0.0, LANES)
        a_p, a_q, a_r, a_s, b_p, b_q, b_r, b_s = zero, zero, zero, zero, zero, zero, zero, zero
        for j in range(points):
            u, v = load(weights, a + j, LANES), load(weights, b + j, LANES)
            x, y = broadcast(table[p + j], LANES), broadcast(table[q + j], LANES)
            a_p, b_p, a_q, b_q = fma(u, x, a_p), fma(v, x, b_p), fma(u, y, a_q), fma(v, y, b_q)
            x, y = broadcast(table[r + j], LANES), broadcast(table[s + j], LANES)
            a_r, b_r, a_s, b_s = fma(u, x, a_r), fma(v, x, b_r), fma(u, y, a_s), fma(v, y, b_s)
        for at, one, two in ((slot, a_p, b_p), (second, a_q, b_q), (third, a_r, b_r), (fourth, a_s, b_s)):
            store(scratch, TILE * at, one)
            store(scratch, TILE * at + 1, two)


@njit(error_model="numpy")
def complex_entries(register, count, panel, weights, table, columns, stride, scratch):
    """Interpolate complex propagators as `real_entries`; the imaginary part of an entry is `columns` slots further on."""
    points, node, last, apart = int(panel[POINTS]), int(panel[NODE]), columns * columns - 1, columns * stride
    for k in range(min(TILE, count - register)):
        at = int(panel[WEIGHTS]) + 2 * points * (register + k)
        for entry in range(0, last + 1, 2):
            other = min(entry + 1, last)
            one, two = entry + entry // columns * columns, other + other // columns * columns
            p, q, zero = one * stride + node, two * stride + node, broadcast(0.0, LANES)
            real_p, imaginary_p, real_q, imaginary_q = zero, zero, zero, zero
            for j in range(points):
                u, v = load(weights, at + 2 * j, LANES), load(weights, at + 2 * j + 1, LANES)
                x, y = table[p + j], table[p + apart + j]
                real_p, imaginary_p = fma(u, x, fma(v, -y, real_p)), fma(u, y, fma(v, x, imaginary_p))
                x, y = table[q + j], table[q + apart + j]
                real_q, imaginary_q = fma(u, x, fma(v, -y, real_q)), fma(u, y, fma(v, x, imaginary_q))
            store(scratch, TILE * one + k, real_p)
            store(scratch, TILE * (one + columns) + k, imaginary_p)
            store(scratch, TILE * two + k, real_q)
            store(scratch, TILE * (two + columns) + k, imaginary_q)


@njit(error_model="numpy")
def node_entries(register, count, panel, table, entries, stride, scratch):
    """Copy the propagators of a panel whose strengths are nodes, as `real_entries`."""
    for k in range(min(TILE, count - register)):
        for slot in range(entries):
            store(
                scratch, TILE * slot + k, load(table, (slot * stride + int(panel[NODE])) // LANES + register + k, LANES)
            )


@njit(error_model="numpy")
def product(first, k, targets, scratch, columns, parts):
    """Apply the propagators of register k of `scratch` to the deviations of one register."""
    moved = address(scratch, TILE * columns * parts * LANES)
    for r in range(columns):
        real, imaginary = broadcast(0.0, LANES), broadcast(0.0, LANES)
        for c in range(columns):
            a, x = load(scratch, TILE * (parts * c + r) + k, LANES), load(targets, first + c, LANES)
            real = fma(a, x, real)
            if parts > columns:
                b, y = (
                    load(scratch, TILE * (parts * c + columns + r) + k, LANES), load(targets, first + columns + c, LANES)
                )  # fmt: skip
                real, imaginary = fma(-b, y, real), fma(a, y, fma(b, x, imaginary))
        store(moved, r, real)
        if parts > columns:
            store(moved, columns + r, imaginary)
    for r in range(parts):
        store(targets, first + r, load(moved, r, LANES))


@njit(error_model="numpy")
def lift(panel, exponents, powers):
    """Add the powers of two of the factors of a panel to those of its numbers."""
    for k in range(int(panel[TO]) - int(panel[FROM])):
        power = broadcast(exponents[int(panel[NODE])], LANES)
        if int(panel[POINTS]) == 0:
            power = load(exponents, int(panel[NODE]) // LANES + k, LANES)
        at = int(panel[FROM]) + k
        store(powers, at, load(powers, at, LANES) + power)


@njit(error_model="numpy")
def transport(panel, weights, table, exponents, targets, lifts, scratch, columns, parts, stride):
    """Apply the propagators of one panel to the deviations of its strengths; powers of two are counted in `lifts`.

    `scratch` has room for the propagators of TILE registers, and for one deviation behind them.
    """
    count = int(panel[TO]) - int(panel[FROM])
    for register in range(0, count, TILE):
        if int(panel[POINTS]) == 0:
            node_entries(register, count, panel, table, columns * parts, stride, scratch)
        elif parts == columns:
            real_entries(register, count, panel, weights, table, columns, stride, scratch)
        else:
            complex_entries(register, count, panel, weights, table, columns, stride, scratch)
        for k in range(min(TILE, count - register)):
            s = int(panel[FROM]) + register + k
            product(parts * s, k, targets, scratch, columns, parts)
    lift(panel, exponents, lifts)


@njit(error_model="numpy")
def largest_misfit(panels, weights, table, exponents, columns, rows, kinds, stride):
    """Scale the propagators of each panel alike, and return the largest error of their interpolation."""
    worst = 0.0
    for k in range(panels.shape[0]):
        panel = address(panels, len(PANEL) * k)
        if int(panel[POINTS]):
            even(panel, table, exponents, kinds * rows * columns, stride)
            worst = larger(worst, misfit(panel, weights, table, columns, rows, kinds, stride))
    return worst


@njit(error_model="numpy")
def apply(panels, weights, table, exponents, targets, lifts, scratch, columns, parts, stride):
    """Apply the propagators of all panels to the deviations; return the largest error of the interpolation."""
    worst = largest_misfit(panels, weights, table, exponents, columns, columns, parts // columns, stride)
    for k in range(panels.shape[0]):
        panel = address(panels, len(PANEL) * k)
        transport(panel, weights, table, exponents, targets, lifts, scratch, columns, parts, stride)
    return worst


@njit(error_model="numpy")
def multiply(panel, weights, factors, products):
    """Multiply each number of a panel by a factor that is interpolated from those of the nodes.

    products: registers of the panel.  factors: of all nodes.
    """
    points, first, count = int(panel[POINTS]), int(panel[FROM]), int(panel[TO]) - int(panel[FROM])
    if points == 0:
        for k in range(count):
            factor = load(factors, int(panel[NODE]) // LANES + k, LANES)
            store(products, first + k, load(products, first + k, LANES) * factor)
        return
    for register in range(0, count, 4):
        second, third, fourth = min(register + 1, count - 1), min(register + 2, count - 1), min(register + 3, count - 1)
        begin, zero = int(panel[WEIGHTS]), broadcast(0.0, LANES)
        a, b, c, d = begin + points * register, begin + points * second, begin + points * third, begin + points * fourth
        p, q, r, s = zero, zero, zero, zero
        for j in range(points):
            factor = broadcast(factors[int(panel[NODE]) + j], LANES)
            p, q = fma(load(weights, a + j, LANES), factor, p), fma(load(weights, b + j, LANES), factor, q)
            r, s = fma(load(weights, c + j, LANES), factor, r), fma(load(weights, d + j, LANES), factor, s)
        p, q = p * load(products, first + register, LANES), q * load(products, first + second, LANES)
        r, s = r * load(products, first + third, LANES), s * load(products, first + fourth, LANES)
        for at, number in ((register, p), (second, q), (third, r), (fourth, s)):
            store(products, first + at, number)


@njit(error_model="numpy")
def settle(targets, lifts, registers, gains, parts, kept, kept_powers, follow):
    """Give all deviations unit length, and write the logarithms of how much they have grown; zeros stay zeros.

    If `follow`, the components at the last landing are scaled alike.
    """
    for s in range(registers):
        square = broadcast(0.0, LANES)
        for r in range(parts):
            value = load(targets, parts * s + r, LANES)
            square = fma(value, value, square)
        length, power = sqrt(square), load(lifts, s, LANES)
        store(gains, s, power * 0.6931471805599453 + log(length))
        store(lifts, s, broadcast(0.0, LANES))
        scaled = 1.0 / select(length > 0.0, length, 1.0)
        for r in range(parts):
            store(targets, parts * s + r, scaled * load(targets, parts * s + r, LANES))
        if follow:
            store(kept, s, scaled * load(kept, s, LANES))
            store(kept_powers, s, load(kept_powers, s, LANES) - power)

"""Deviations of bodies that stick: between two landings a mode has a single number.

A contact that begins to stick takes the velocity of a deviation.  Each interval between two landings therefore multiplies
the rest of the deviation by a number, a smooth function of the strength.  As intervals are short, the numbers are
integrated for few strengths, the nodes of an interval.  They are interpolated to the nodes of the block and multiplied
there over all intervals of the block; the products are interpolated to all strengths.
"""

from __future__ import annotations

from numba import njit

from ..simd.addresses import address
from ..simd.elementary import log
from ..simd.lanes import absolute, broadcast, fma, load, maximum, select, store
from .clock_slots import LANES
from .propagators import (
    FROM,
    NODE,
    PANEL,
    POINTS,
    TO,
    WEIGHTS,
    apply,
    larger,
    largest_misfit,
    lift,
    multiply,
    scale,
    tabulate,
)


# --- kernel text below ---
@njit(error_model="numpy")
def fill_in(factors, registers, value):
    """Set all factors to one value."""
    for register in range(registers):
        store(factors, register, broadcast(value, LANES))


@njit(error_model="numpy")
def copy(factors, registers, out):
    """Copy factors in registers."""
    for register in range(registers):
        store(out, register, load(factors, register, LANES))


@njit(error_model="numpy")
def gather(factors, where, out):
    """Copy factors from registers into the order of the nodes."""
    for node in range(where.size):
        out[node] = factors[int(where[node])]


@njit(error_model="numpy")
def padded_count(stick):
    """Return the length of an array with a number for each node of panels, padded to registers."""
    return int(stick.panels[stick.panels.shape[0] - 1, TO]) * LANES


@njit(error_model="numpy")
def lay_out(modes, powers, registers, nodes):
    """Write the two components of one deviation of each node to the table of propagators, as `tabulate`."""
    for register in range(registers):
        x, y = load(modes, 2 * register, LANES), load(modes, 2 * register + 1, LANES)
        store(nodes.table, register, x)
        store(address(nodes.table, nodes.stride), register, y)
        some = maximum(absolute(x), absolute(y)) > 0.0
        store(nodes.exponents, register, select(some, load(powers, register, LANES), 0.0))


@njit(error_model="numpy")
def multiply_all(panels, weights, factors, exponents, products, powers):
    """Multiply numbers by factors that are interpolated from those of nodes; powers of two are counted."""
    for k in range(panels.shape[0]):
        panel = address(panels, len(PANEL) * k)
        multiply(panel, weights, factors, products)
        lift(panel, exponents, powers)


@njit(error_model="numpy")
def refine(nodes, stick):
    """Write the propagators of the nodes of panels from those that are integrated; return the error."""
    room, table, exponents, stride = padded_count(stick), nodes.table, nodes.exponents, nodes.stride
    powers, worst = (
        address(stick.work, room),
        largest_misfit(stick.panels, stick.weights, table, exponents, 2, 2, 1, stride),
    )
    for slot in range(4):
        fill_in(stick.work, room // LANES, 1.0)
        fill_in(powers, room // LANES, 0.0)
        multiply_all(stick.panels, stick.weights, address(table, slot * stride), exponents, stick.work, powers)
        gather(stick.work, stick.where, address(stick.fine, slot * room))
    gather(powers, stick.where, stick.heights)
    return worst


@njit(error_model="numpy")
def begin_interval(modes, powers, registers):
    """Let the deviation of every node be 1 in the component that a landing leaves."""
    for register in range(registers):
        store(modes, 2 * register, broadcast(1.0, LANES))
        store(modes, 2 * register + 1, broadcast(0.0, LANES))
        store(powers, register, broadcast(0.0, LANES))


@njit(error_model="numpy")
def begin_products(targets, stick):
    """Let the products of intervals begin at a landing, which has left one component of all deviations."""
    for s in range(targets.groups):
        store(targets.kept, s, load(targets.moved, 2 * s, LANES))
    copy(targets.lifts, targets.groups, targets.kept_powers)
    renew_products(targets, stick)


@njit(error_model="numpy")
def renew_products(targets, stick):
    """Let the products of intervals begin anew, and scale the components that are left of all strengths."""
    scale(targets.kept, targets.kept_powers, targets.groups, 1)
    fill_in(stick.share, padded_count(stick) // LANES, 1.0)
    fill_in(stick.share_powers, padded_count(stick) // LANES, 0.0)


@njit(error_model="numpy")
def apply_products(panels, targets, stick):
    """Move the products of earlier intervals to all strengths; return the error."""
    gather(stick.share, stick.where, stick.fine)
    gather(stick.share_powers, stick.where, stick.heights)
    worst = largest_misfit(panels.panels, panels.weights, stick.fine, stick.heights, 1, 1, 1, padded_count(stick))
    multiply_all(panels.panels, panels.weights, stick.fine, stick.heights, targets.kept, targets.kept_powers)
    renew_products(targets, stick)
    return worst


@njit(error_model="numpy")
def close_batch(targets, gains):
    """Write the logarithms of the growth of the components that landings leave, and scale these to 1; zeros stay zeros."""
    kept, kept_powers = targets.kept, targets.kept_powers
    for s in range(targets.groups):
        value = load(kept, s, LANES)
        store(gains, s, load(kept_powers, s, LANES) * 0.6931471805599453 + log(absolute(value)))
        store(kept, s, select(value > 0.0, 1.0, select(value < 0.0, -1.0, value)))
        store(kept_powers, s, broadcast(0.0, LANES))


@njit(error_model="numpy")
def end_interval(nodes, stick):
    """End an interval: multiply the products of intervals by its factors; return the error.

    The powers of two of each interval are counted, so that the products stay within range.
    """
    worst = largest_misfit(stick.panels, stick.weights, nodes.table, nodes.exponents, 1, 1, 1, nodes.stride)
    multiply_all(stick.panels, stick.weights, nodes.table, nodes.exponents, stick.share, stick.share_powers)
    return worst


@njit(error_model="numpy")
def multiply_twice(panel, weights, fine, room, products, out):
    """Write the products of each number of a panel with two factors, as `multiply`, beside each other."""
    points, first, count = int(panel[POINTS]), int(panel[FROM]), int(panel[TO]) - int(panel[FROM])
    x, y = address(fine, int(panel[NODE])), address(fine, room + int(panel[NODE]))
    for register in range(0, count, 2):
        second, zero = min(register + 1, count - 1), broadcast(0.0, LANES)
        a, b = int(panel[WEIGHTS]) + points * register, int(panel[WEIGHTS]) + points * second
        p, q, r, s = zero, zero, zero, zero
        for j in range(points):
            one, two = load(weights, a + j, LANES), load(weights, b + j, LANES)
            p, r = fma(one, broadcast(x[j], LANES), p), fma(two, broadcast(x[j], LANES), r)
            q, s = fma(one, broadcast(y[j], LANES), q), fma(two, broadcast(y[j], LANES), s)
        if points == 0:
            p, q = load(x, register, LANES), load(y, register, LANES)
            r, s = load(x, second, LANES), load(y, second, LANES)
        for at, by_x, by_y in ((first + register, p, q), (first + second, r, s)):
            number = load(products, at, LANES)
            store(out, 2 * at, by_x * number)
            store(out, 2 * at + 1, by_y * number)


@njit(error_model="numpy")
def compose(nodes, panels, targets, stick):
    """Write the deviations of all strengths within an interval, from the components at its beginning; return the error."""
    table, exponents, stride, room = nodes.table, nodes.exponents, nodes.stride, padded_count(stick)
    registers, powers = room // LANES, address(stick.work, room)
    # 1. both components at the nodes of panels: products of earlier intervals times the factors of this one
    worst = largest_misfit(stick.panels, stick.weights, table, exponents, 1, 2, 1, stride)
    for slot in range(2):
        copy(stick.share, registers, stick.work)
        copy(stick.share_powers, registers, powers)
        multiply_all(stick.panels, stick.weights, address(table, slot * stride), exponents, stick.work, powers)
        gather(stick.work, stick.where, address(stick.fine, slot * room))
    gather(powers, stick.where, stick.heights)
    # 2. the same at all strengths
    worst = larger(worst, largest_misfit(panels.panels, panels.weights, stick.fine, stick.heights, 1, 2, 1, room))
    copy(targets.kept_powers, targets.groups, targets.lifts)
    for k in range(panels.panels.shape[0]):
        panel = address(panels.panels, len(PANEL) * k)
        multiply_twice(panel, panels.weights, stick.fine, room, targets.kept, targets.moved)
        lift(panel, stick.heights, targets.lifts)
    return worst


@njit(error_model="numpy")
def interpolate_all(in_interval, old, modes, nodes, panels, targets, stick):
    """Write the present deviations of all strengths; return the error.

    They come from the components that a landing has left, if `in_interval`, else from the deviations at the last cut.
    """
    moved, lifts, found = targets.moved, targets.lifts, targets.found
    if in_interval:
        lay_out(old, modes.powers, modes.node_registers, nodes)
        worst = compose(nodes, panels, targets, stick)
    else:
        tabulate(old, modes.powers, nodes.places, nodes.nodes, 2, nodes.table, nodes.exponents, 2, nodes.stride)
        worst = refine(nodes, stick)
        worst = larger(
            worst,
            apply(
                panels.panels, panels.weights, stick.fine, stick.heights, moved, lifts, found, 2, 2, padded_count(stick)
            ),
        )
    scale(moved, lifts, targets.groups, 2)
    return worst

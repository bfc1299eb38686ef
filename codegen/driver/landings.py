"""Deviations of bodies that stick: from one landing to the next a mode has a single number.

The velocity of a deviation is lost where its contact sticks, so that a leg, the time between two landings, multiplies what
is left of it by a number that is a smooth function of the strength. A leg is short, and few strengths are integrated to tell
these numbers; they are interpolated to the nodes of all legs of some blocks, and multiplied there. The products are
interpolated to all strengths.
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
def fill_in(numbers, registers, value):
    """Let all numbers have one value."""
    for which in range(registers):
        store(numbers, which, broadcast(value, LANES))


@njit(error_model="numpy")
def copy(numbers, registers, out):
    """Copy numbers in registers."""
    for which in range(registers):
        store(out, which, load(numbers, which, LANES))


@njit(error_model="numpy")
def gather(numbers, where, out):
    """Bring what is in registers into the order of the nodes."""
    for node in range(where.size):
        out[node] = numbers[int(where[node])]


@njit(error_model="numpy")
def lay_out(modes, powers, registers, table, exponents, stride):
    """As `tabulate`, of a single deviation of each node."""
    for which in range(registers):
        x, y = load(modes, 2 * which, LANES), load(modes, 2 * which + 1, LANES)
        store(table, which, x)
        store(address(table, stride), which, y)
        some = maximum(absolute(x), absolute(y)) > 0.0
        store(exponents, which, select(some, load(powers, which, LANES), 0.0))


@njit(error_model="numpy")
def multiply_all(panels, weights, factors, exponents, numbers, powers):
    """Multiply numbers by factors that are interpolated from those of nodes; powers of two are counted."""
    for k in range(panels.shape[0]):
        panel = address(panels, len(PANEL) * k)
        multiply(panel, weights, factors, numbers)
        lift(panel, exponents, powers)


@njit(error_model="numpy")
def refine(table, exponents, stride, ways, products):
    """Write the propagators of the nodes of blocks from those of the nodes of legs; returns the error."""
    legs, shares, where = ways
    _, _, fine, heights, work, _, _ = products
    room = int(legs[legs.shape[0] - 1, TO]) * LANES
    powers, worst = address(work, room), largest_misfit(legs, shares, table, exponents, 2, 2, 1, stride)
    for slot in range(4):
        fill_in(work, room // LANES, 1.0)
        fill_in(powers, room // LANES, 0.0)
        multiply_all(legs, shares, address(table, slot * stride), exponents, work, powers)
        gather(work, where, address(fine, slot * room))
    gather(powers, where, heights)
    return worst


@njit(error_model="numpy")
def begin_leg(modes, powers, registers, left):
    """Let the deviation of every node be 1 in the component that a landing leaves."""
    for which in range(registers):
        store(modes, 2 * which + left, broadcast(1.0, LANES))
        store(modes, 2 * which + 1 - left, broadcast(0.0, LANES))
        store(powers, which, broadcast(0.0, LANES))


@njit(error_model="numpy")
def begin_products(moved, lifts, left, legs, products, groups):
    """Let the products of legs begin at a landing, which has left one component of all deviations."""
    _, _, _, _, _, kept, kept_powers = products
    for s in range(groups):
        store(kept, s, load(moved, 2 * s + left, LANES))
    copy(lifts, groups, kept_powers)
    renew_products(legs, products, groups)


@njit(error_model="numpy")
def renew_products(legs, products, groups):
    """Let the products of legs begin anew, and scale what there is of all strengths."""
    share, share_powers, _, _, _, kept, kept_powers = products
    scale(kept, kept_powers, groups, 1)
    fill_in(share, int(legs[legs.shape[0] - 1, TO]), 1.0)
    fill_in(share_powers, int(legs[legs.shape[0] - 1, TO]), 0.0)


@njit(error_model="numpy")
def hand_over(panels, weights, ways, products, groups):
    """Move the products of earlier legs to all strengths; returns the error."""
    legs, _, where = ways
    share, share_powers, fine, heights, _, kept, kept_powers = products
    gather(share, where, fine)
    gather(share_powers, where, heights)
    worst = largest_misfit(panels, weights, fine, heights, 1, 1, 1, int(legs[legs.shape[0] - 1, TO]) * LANES)
    multiply_all(panels, weights, fine, heights, kept, kept_powers)
    renew_products(legs, products, groups)
    return worst


@njit(error_model="numpy")
def close_batch(groups, products, gains):
    """Write the logarithms of how much what landings leave has grown, and give it unit size; zeros stay zeros."""
    _, _, _, _, _, kept, kept_powers = products
    for s in range(groups):
        value = load(kept, s, LANES)
        store(gains, s, load(kept_powers, s, LANES) * 0.6931471805599453 + log(absolute(value)))
        store(kept, s, select(value > 0.0, 1.0, select(value < 0.0, -1.0, value)))
        store(kept_powers, s, broadcast(0.0, LANES))


@njit(error_model="numpy")
def land(table, exponents, stride, left, ways, products):
    """End a leg; returns the error.

    Powers of two of each leg are counted, and what is left of its factors leaves the products within range.
    """
    legs, shares, _ = ways
    share, share_powers, _, _, _, _, _ = products
    numbers = address(table, left * stride)
    worst = largest_misfit(legs, shares, numbers, exponents, 1, 1, 1, stride)
    multiply_all(legs, shares, numbers, exponents, share, share_powers)
    return worst


@njit(error_model="numpy")
def multiply_twice(panel, weights, fine, room, numbers, out):
    """Write the products of each number of a panel with two factors, as `multiply`, beside each other."""
    points, first, count = int(panel[POINTS]), int(panel[FROM]), int(panel[TO]) - int(panel[FROM])
    x, y = address(fine, int(panel[NODE])), address(fine, room + int(panel[NODE]))
    for which in range(0, count, 2):
        second, zero = min(which + 1, count - 1), broadcast(0.0, LANES)
        a, b = int(panel[WEIGHTS]) + points * which, int(panel[WEIGHTS]) + points * second
        p, q, r, s = zero, zero, zero, zero
        for j in range(points):
            one, two = load(weights, a + j, LANES), load(weights, b + j, LANES)
            p, r = fma(one, broadcast(x[j], LANES), p), fma(two, broadcast(x[j], LANES), r)
            q, s = fma(one, broadcast(y[j], LANES), q), fma(two, broadcast(y[j], LANES), s)
        if points == 0:
            p, q = load(x, which, LANES), load(y, which, LANES)
            r, s = load(x, second, LANES), load(y, second, LANES)
        for at, by_x, by_y in ((first + which, p, q), (first + second, r, s)):
            number = load(numbers, at, LANES)
            store(out, 2 * at, by_x * number)
            store(out, 2 * at + 1, by_y * number)


@njit(error_model="numpy")
def compose(table, exponents, stride, panels, weights, ways, products, moved, lifts, groups):
    """Write the deviations of all strengths within a leg, from what was left at its beginning; returns the error."""
    legs, shares, where = ways
    share, share_powers, fine, heights, work, kept, kept_powers = products
    registers = int(legs[legs.shape[0] - 1, TO])
    room = registers * LANES
    powers = address(work, room)
    worst = largest_misfit(legs, shares, table, exponents, 1, 2, 1, stride)
    for slot in range(2):
        copy(share, registers, work)
        copy(share_powers, registers, powers)
        multiply_all(legs, shares, address(table, slot * stride), exponents, work, powers)
        gather(work, where, address(fine, slot * room))
    gather(powers, where, heights)
    worst = larger(worst, largest_misfit(panels, weights, fine, heights, 1, 2, 1, room))
    copy(kept_powers, groups, lifts)
    for k in range(panels.shape[0]):
        panel = address(panels, len(PANEL) * k)
        multiply_twice(panel, weights, fine, room, kept, moved)
        lift(panel, heights, lifts)
    return worst


@njit(error_model="numpy")
def bring(
    parted, modes, powers, spots, few, nodes, table, exponents, stride, panels, weights, ways, products, moved, lifts, found,
    groups,
):  # fmt: skip
    """Write the deviations of all strengths as they are now; returns the error.

    They come from what a landing has left of them, if `parted`, else from what they were when propagators were begun.
    """
    if parted:
        lay_out(modes, powers, few, table, exponents, stride)
        worst = compose(table, exponents, stride, panels, weights, ways, products, moved, lifts, groups)
    else:
        tabulate(modes, powers, spots, nodes, 2, table, exponents, 2, stride)
        worst = refine(table, exponents, stride, ways, products)
        room = int(ways[0][ways[0].shape[0] - 1, TO]) * LANES
        worst = larger(worst, apply(panels, weights, products[2], products[3], moved, lifts, found, 2, 2, room))
    scale(moved, lifts, groups, 2)
    return worst

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
def room_of(legs):
    """Return the length of an array with a number for each node of panels, padded to registers."""
    return int(legs.panels[legs.panels.shape[0] - 1, TO]) * LANES


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
def refine(nodes, legs):
    """Write the propagators of the nodes of panels from those that are integrated; return the error."""
    room, table, exponents, stride = room_of(legs), nodes.table, nodes.exponents, nodes.stride
    powers, worst = (
        address(legs.work, room),
        largest_misfit(legs.panels, legs.weights, table, exponents, 2, 2, 1, stride),
    )
    for slot in range(4):
        fill_in(legs.work, room // LANES, 1.0)
        fill_in(powers, room // LANES, 0.0)
        multiply_all(legs.panels, legs.weights, address(table, slot * stride), exponents, legs.work, powers)
        gather(legs.work, legs.where, address(legs.fine, slot * room))
    gather(powers, legs.where, legs.heights)
    return worst


@njit(error_model="numpy")
def begin_leg(modes, powers, registers):
    """Let the deviation of every node be 1 in the component that a landing leaves."""
    for register in range(registers):
        store(modes, 2 * register, broadcast(1.0, LANES))
        store(modes, 2 * register + 1, broadcast(0.0, LANES))
        store(powers, register, broadcast(0.0, LANES))


@njit(error_model="numpy")
def begin_products(travellers, legs):
    """Let the products of legs begin at a landing, which has left one component of all deviations."""
    for s in range(travellers.groups):
        store(travellers.kept, s, load(travellers.moved, 2 * s, LANES))
    copy(travellers.lifts, travellers.groups, travellers.kept_powers)
    renew_products(travellers, legs)


@njit(error_model="numpy")
def renew_products(travellers, legs):
    """Let the products of legs begin anew, and scale the components that are left of all strengths."""
    scale(travellers.kept, travellers.kept_powers, travellers.groups, 1)
    fill_in(legs.share, room_of(legs) // LANES, 1.0)
    fill_in(legs.share_powers, room_of(legs) // LANES, 0.0)


@njit(error_model="numpy")
def hand_over(panels, travellers, legs):
    """Move the products of earlier legs to all strengths; return the error."""
    gather(legs.share, legs.where, legs.fine)
    gather(legs.share_powers, legs.where, legs.heights)
    worst = largest_misfit(panels.panels, panels.weights, legs.fine, legs.heights, 1, 1, 1, room_of(legs))
    multiply_all(panels.panels, panels.weights, legs.fine, legs.heights, travellers.kept, travellers.kept_powers)
    renew_products(travellers, legs)
    return worst


@njit(error_model="numpy")
def close_batch(travellers, gains):
    """Write the logarithms of the growth of the components that landings leave, and scale these to 1; zeros stay zeros."""
    kept, kept_powers = travellers.kept, travellers.kept_powers
    for s in range(travellers.groups):
        value = load(kept, s, LANES)
        store(gains, s, load(kept_powers, s, LANES) * 0.6931471805599453 + log(absolute(value)))
        store(kept, s, select(value > 0.0, 1.0, select(value < 0.0, -1.0, value)))
        store(kept_powers, s, broadcast(0.0, LANES))


@njit(error_model="numpy")
def land(nodes, legs):
    """End a leg: multiply the products of legs by its factors; return the error.

    The powers of two of each leg are counted, so that the products stay within range.
    """
    worst = largest_misfit(legs.panels, legs.weights, nodes.table, nodes.exponents, 1, 1, 1, nodes.stride)
    multiply_all(legs.panels, legs.weights, nodes.table, nodes.exponents, legs.share, legs.share_powers)
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
def compose(nodes, panels, travellers, legs):
    """Write the deviations of all strengths within a leg, from the components at its beginning; return the error."""
    table, exponents, stride, room = nodes.table, nodes.exponents, nodes.stride, room_of(legs)
    registers, powers = room // LANES, address(legs.work, room)
    # 1. both components at the nodes of panels: products of earlier legs times the factors of this one
    worst = largest_misfit(legs.panels, legs.weights, table, exponents, 1, 2, 1, stride)
    for slot in range(2):
        copy(legs.share, registers, legs.work)
        copy(legs.share_powers, registers, powers)
        multiply_all(legs.panels, legs.weights, address(table, slot * stride), exponents, legs.work, powers)
        gather(legs.work, legs.where, address(legs.fine, slot * room))
    gather(powers, legs.where, legs.heights)
    # 2. the same at all strengths
    worst = larger(worst, largest_misfit(panels.panels, panels.weights, legs.fine, legs.heights, 1, 2, 1, room))
    copy(travellers.kept_powers, travellers.groups, travellers.lifts)
    for k in range(panels.panels.shape[0]):
        panel = address(panels.panels, len(PANEL) * k)
        multiply_twice(panel, panels.weights, legs.fine, room, travellers.kept, travellers.moved)
        lift(panel, legs.heights, travellers.lifts)
    return worst


@njit(error_model="numpy")
def bring(parted, old, modes, nodes, panels, travellers, legs):
    """Write the present deviations of all strengths; return the error.

    They come from the components that a landing has left, if `parted`, else from the deviations at the last cut.
    """
    moved, lifts, found = travellers.moved, travellers.lifts, travellers.found
    if parted:
        lay_out(old, modes.powers, modes.node_registers, nodes)
        worst = compose(nodes, panels, travellers, legs)
    else:
        tabulate(old, modes.powers, nodes.places, nodes.nodes, 2, nodes.table, nodes.exponents, 2, nodes.stride)
        worst = refine(nodes, legs)
        worst = larger(
            worst,
            apply(panels.panels, panels.weights, legs.fine, legs.heights, moved, lifts, found, 2, 2, room_of(legs)),
        )
    scale(moved, lifts, travellers.groups, 2)
    return worst

"""Frames of orthogonal deviations: their growth over blocks of time gives Lyapunov exponents.

Source: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 21 (1980).
"""

from __future__ import annotations

import math

from numba import njit

from .clock_slots import RTOL

# --- kernel text below ---
# Entries of `plan`: blocks in a period of the drive, the next of them, the parameter that shifts the clock or -1, and how many
# states, the last ones, are logarithms of volumes.  Rows of `frame`: least lengths, blocks in which a direction is lost, scratch.
PARTS, NEXT, SHIFT, VOLUMES = 0, 1, 2, 3
LEAST, LOSSES, LENGTHS, PRODUCTS = 0, 1, 2, 3
# A direction shorter than LOST rtol after a block is lost in the error of the integration (a choice); one shorter than 2**GONE
# is lost at any tolerance, and is integrated no further.
LOST, GONE = 10.0, -80.0
# A column of unit length that is this short after the projection is in the span of those before it, to rounding.
EMPTY = 1e-14


@njit(error_model="numpy")
def complete(q, k, size, stride, count):
    """Replace column k, which is zero, by a unit vector that is orthogonal to all other columns."""
    # the axis that is furthest from the span of the others
    axis, least = 0, math.inf
    for c in range(size):
        square = 0.0
        for j in range(count):
            square += q[c * stride + j] ** 2
        if square < least:
            axis, least = c, square
    q[axis * stride + k] = 1.0
    for _ in range(2):
        square = 0.0
        for j in range(count):
            if j != k:
                product = 0.0
                for c in range(size):
                    product += q[c * stride + j] * q[c * stride + k]
                for c in range(size):
                    q[c * stride + k] -= product * q[c * stride + j]
        for c in range(size):
            square += q[c * stride + k] ** 2
        for c in range(size):
            q[c * stride + k] /= math.sqrt(square)


@njit(error_model="numpy")
def orthogonalise(q, size, stride, count, lengths, products):
    """Make the first `count` columns of a matrix, of length 1 or 0, orthonormal; write the diagonal of the triangular factor.

    Modified Gram-Schmidt, twice: the second time removes what rounding left of a column that was nearly in the span of
    those before it.  A column that is zero, or in this span to rounding, has the length 0, and any direction that is left.
    Source: Giraud, Langou & Rozložník, Comput. Math. Appl. 50, 1069 (2005).
    """
    for k in range(count):
        lengths[k] = 1.0
    for _ in range(2):
        for k in range(count):
            square = 0.0
            for c in range(size):
                square += q[c * stride + k] ** 2
            length = math.sqrt(square)
            factor = 1.0 / length if length > EMPTY else 0.0
            lengths[k] *= length if length > EMPTY else 0.0
            for c in range(size):
                q[c * stride + k] *= factor
            for j in range(k + 1, count):
                products[j] = 0.0
            for c in range(size):
                for j in range(k + 1, count):
                    products[j] += q[c * stride + k] * q[c * stride + j]
            for c in range(size):
                for j in range(k + 1, count):
                    q[c * stride + j] -= q[c * stride + k] * products[j]
    for k in range(count):
        if lengths[k] == 0.0:
            complete(q, k, size, stride, count)


@njit(error_model="numpy")
def close_block(growth, volume, whole, control, frame, sums):
    """Add the growth of orthogonal directions over a block to `sums`, and behind it the growth of the volume.

    growth: logarithms of the lengths before the orthogonalisation.  The volume grows as the product of all directions, so that it
    tells the growth of a single lost one if the frame is `whole`.
    """
    count, lost, last, total = frame.shape[1], 0, 0, 0.0
    for k in range(count):
        length = frame[LENGTHS, k] * math.exp(min(growth[k], 0.0))
        frame[LEAST, k] = min(frame[LEAST, k], length)
        if length < LOST * control[RTOL]:
            frame[LOSSES, k] += 1.0
            lost, last = lost + 1, k
        else:
            gain = growth[k] + math.log(frame[LENGTHS, k])
            sums[k] += gain
            total += gain
    sums[count] += volume
    if lost == 1 and whole:
        frame[LOSSES, last] -= 1.0
        sums[last] += volume - total


@njit(error_model="numpy")
def drain(y, dimension, volumes):
    """Return the sum of the logarithms of volumes at the end of a state, and set them to zero."""
    volume = 0.0
    for c in range(dimension - volumes, dimension):
        volume += y[c]
        y[c] = 0.0
    return volume

"""The decision which rows of a node are held after an event, in the text of kernels and of exported programs alike.

`rows` holds GROUPS numbers for each row: its columns MODE, RATE, RATIO and LAW, what the event means for it (ROLE), its
mode and its x before, and from K on its entries of K.  Of all sets of held rows that agree with the laws (held: |x| <= r,
or x >= 0 at a stop; others leave the surface) the one with most held rows is taken, then with fewest changes of mode,
then with the least largest |x|.  If friction does not drop at the start of slip, that set is the only one if K is a
P-matrix (Samelson, Thrall & Wesler, Proc. AMS 9, 805 (1958); Cottle, Pang & Stone, The Linear Complementarity Problem
(Academic Press, 1992), chapter 3).
"""

from __future__ import annotations

import numpy as np
from numba import njit

Doubles = np.ndarray

# The columns and numbers stand in the texts that the functions below become parts of.
MODE = RATE = RATIO = LAW = ROLE = BEFORE = X = K = GROUPS = 0
OF_SIGN = OF_STOP = OPEN = RELEASED = 0
NONE = 0.0


# --- kernel text below ---
@njit(error_model="numpy")
def eliminated(matrix: Doubles, right: Doubles, modes: Doubles, size: int) -> float:
    """Solve the equations of the rows of mode 0 in place of `right`; return the last pivot, 0 if rows are dependent."""
    pivot = 1.0
    for a in range(size):
        if modes[a] == 0.0:
            pivot = matrix[a * size + a]
            scale = 0.0
            for b in range(size):
                if modes[b] == 0.0:
                    scale = max(scale, abs(matrix[a * size + b]))
            if not abs(pivot) > NONE * scale:
                return 0.0
            for r in range(size):
                if modes[r] == 0.0 and r != a:
                    factor = matrix[r * size + a] / pivot
                    for c in range(size):
                        matrix[r * size + c] -= factor * matrix[a * size + c]
                    right[r] -= factor * right[a]
    for a in range(size):
        if modes[a] == 0.0:
            right[a] /= matrix[a * size + a]
    return pivot


@njit(error_model="numpy")
def forces(modes: Doubles, x: Doubles, first: int, size: int, rows: Doubles) -> float:
    """Compute x of all rows of a node, those of mode 0 held; return 0 if these depend on each other."""
    matrix = np.empty(size * size)
    right = np.empty(size)
    for a in range(size):
        x[a] = modes[a] if rows[(first + a) * GROUPS + LAW] == OF_SIGN else 0.0
    for a in range(size):
        at = (first + a) * GROUPS
        right[a] = rows[at + RATE]
        for b in range(size):
            matrix[a * size + b] = rows[at + K + b]
            right[a] -= rows[at + K + b] * x[b]
    pivot = eliminated(matrix, right, modes, size)
    for a in range(size):
        if modes[a] == 0.0:
            x[a] = right[a]
    return pivot


@njit(error_model="numpy")
def positive_minors(first: int, size: int, rows: Doubles) -> int:
    """Return 1 if K of the rows that are decided is a P-matrix; rows that do not feel themselves do not count."""
    matrix = np.empty(size * size)
    right = np.empty(size)
    modes = np.empty(size)
    for subset in range(1, 1 << size):
        bits = subset
        counts = 1
        for a in range(size):
            at = (first + a) * GROUPS
            modes[a] = 1 - bits % 2
            right[a] = 0.0
            bits = bits // 2
            if modes[a] == 0.0 and (rows[at + ROLE] != OPEN or rows[at + K + a] == 0.0):
                counts = 0
            for b in range(size):
                matrix[a * size + b] = rows[at + K + b]
        # all smaller minors are positive, so that the last pivot has the sign of the determinant
        if counts == 1 and eliminated(matrix, right, modes, size) < 0.0:
            return 0
    return 1


@njit(error_model="numpy")
def agrees(modes: Doubles, x: Doubles, slack: float, first: int, size: int, rows: Doubles) -> int:
    """Return 1 if the held rows can be held and the others leave their surfaces."""
    for a in range(size):
        at = (first + a) * GROUPS
        stop = rows[at + LAW] == OF_STOP
        rate = rows[at + RATE]
        scale = abs(rate)
        for b in range(size):
            term = rows[at + K + b] * x[b]
            rate -= term
            scale = max(scale, abs(term))
        if rows[at + ROLE] != OPEN:
            continue
        if modes[a] == 0.0 and stop and x[a] < -slack:
            return 0
        if modes[a] == 0.0 and not stop and abs(x[a]) > rows[at + RATIO] * (1.0 + slack):
            return 0
        # a row leaves to the side of its mode; an open stop has a speed that falls
        if modes[a] != 0.0 and not (-rate if stop else modes[a] * rate) > -slack * scale:
            return 0
    return 1


@njit(error_model="numpy")
def chosen(code: int, modes: Doubles, first: int, size: int, rows: Doubles) -> int:
    """Set the modes of the rows that are decided from the digits of a number in base 3; return 0 for a stop at -1."""
    for a in range(size):
        at = (first + a) * GROUPS
        modes[a] = rows[at + MODE]
        if rows[at + ROLE] == OPEN:
            modes[a] = -1 if code % 3 == 2 else code % 3
            code = code // 3
            if modes[a] < 0.0 and rows[at + LAW] == OF_STOP:
                return 0
    return 1


@njit(error_model="numpy")
def better(modes: Doubles, x: Doubles, best: Doubles, first: int, size: int, rows: Doubles) -> int:
    """Return 1 for modes with more held rows than the best, or with fewer changes, or a smaller largest x, and note them."""
    held = 0.0
    changes = 0.0
    largest = 0.0
    for a in range(size):
        at = (first + a) * GROUPS
        if rows[at + ROLE] == OPEN:
            held += modes[a] == 0.0
            changes += modes[a] != rows[at + BEFORE]
            largest = max(largest, abs(x[a]))
    if held < best[0] or (held == best[0] and changes > best[1]):
        return 0
    if held == best[0] and changes == best[1] and largest >= best[2]:
        return 0
    best[0] = held
    best[1] = changes
    best[2] = largest
    return 1


@njit(error_model="numpy")
def decide(first: int, size: int, rows: Doubles) -> int:
    """Set the modes of the rows of a node after an event; return how many sets agree, at most 1 where laws choose."""
    modes = np.empty(size)
    after = np.empty(size)
    x = np.empty(size)
    best = np.empty(3)
    best[0] = -1.0
    best[1] = 0.0
    best[2] = 0.0
    choices = 1
    drops = 0
    for a in range(size):
        at = (first + a) * GROUPS
        if rows[at + ROLE] == RELEASED:
            rows[at + MODE] = 1.0 if rows[at + LAW] == OF_STOP or rows[at + X] > 0.0 else -1.0
        after[a] = rows[at + MODE]
        if rows[at + ROLE] == OPEN:
            choices *= 3
            if rows[at + LAW] == OF_SIGN and rows[at + RATIO] > 1.0:
                drops = 1
    matches = 0
    for attempt in range(2):
        slack = 1e-9 * attempt
        for code in range(choices if matches == 0 else 0):
            if chosen(code, modes, first, size, rows) == 0 or forces(modes, x, first, size, rows) == 0.0:
                continue
            if agrees(modes, x, slack, first, size, rows) == 0:
                continue
            # on the border of two sets, which are the same motion, several agree
            matches = 1 if attempt == 1 else matches + 1
            if better(modes, x, best, first, size, rows) == 1:
                for a in range(size):
                    after[a] = modes[a]
    for a in range(size):
        rows[(first + a) * GROUPS + MODE] = after[a]
    if drops == 1 and positive_minors(first, size, rows) == 0:
        return 0
    return min(matches, 1) if drops == 1 else matches

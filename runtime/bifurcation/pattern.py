"""Read off how the nodes of a network move along a periodic orbit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

ALIKE = 1e-6  # largest difference of two motions that count as one, relative to the extent of the motion (a choice)
FEW = 12  # most nodes that are listed


def pattern_of(motion: np.ndarray, labels: Sequence[str]) -> str:
    """Describe the motion of nodes; empty if no two of them move alike up to a shift of time.

    Shapes: motion (looks, components, nodes), states at equal times in one period.
    """
    nodes = motion.shape[2]
    if nodes == 1:
        return ""
    lags = [_lag(motion[:, :, 0], motion[:, :, j]) for j in range(nodes)]
    same = [lag is not None and min(lag, 1.0 - lag) < 1e-9 for lag in lags]
    if all(same):
        return "synchronous"
    shifted = [lag for lag in lags if lag is not None]
    if len(shifted) == nodes:
        if all(min(abs(lag), abs(lag - 0.5), abs(lag - 1.0)) < 1e-6 for lag in shifted):
            behind = [label for label, lag in zip(labels, shifted, strict=True) if abs(lag - 0.5) < 1e-6]
            ahead = [label for label in labels if label not in behind]
            return f"antiphase: {_named(behind)} half a period after {_named(ahead)}"
        steps = np.diff([*shifted, shifted[0]]) % 1.0
        if np.ptp(np.exp(2j * math.pi * steps).real) < 1e-5 and np.ptp(np.exp(2j * math.pi * steps).imag) < 1e-5:
            lag = float(steps[0])
            later, share = (True, lag) if lag < 0.5 else (False, 1.0 - lag)
            when = f"{_fraction(share)} of a period {'later' if later else 'earlier'}"
            return f"travelling wave: each node moves as the one before it, {when}"
        lags_text = ", ".join(_fraction(lag) for lag in shifted[:FEW])
        return f"phases of one motion: nodes lag by {lags_text}{' …' if nodes > FEW else ''} of a period"
    # Clusters of nodes that move alike, without shifts.
    extent = np.ptp(motion, axis=0).max(axis=1)
    clusters: list[list[int]] = []
    for j in range(nodes):
        alike = (
            c for c in clusters if np.all(np.abs(motion[:, :, c[0]] - motion[:, :, j]).max(axis=0) <= ALIKE * extent)
        )
        cluster = next(alike, None)
        clusters.append([j]) if cluster is None else cluster.append(j)
    if len(clusters) == nodes:
        return ""
    return "clusters " + ", ".join(
        "{" + _named([labels[j] for j in c]).removeprefix("nodes ").removeprefix("node ") + "}" for c in clusters
    )


def _lag(first: np.ndarray, other: np.ndarray) -> float | None:
    """Return the share of a period by which a motion (looks, components) lags behind another; None if they differ."""
    one, two = np.fft.rfft(first, axis=0), np.fft.rfft(other, axis=0)
    extent = np.maximum(np.ptp(first, axis=0), np.ptp(other, axis=0))
    if np.all(np.abs(first - other).max(axis=0) <= ALIKE * extent):
        return 0.0
    sizes = np.abs(one[1:]).sum(axis=1)
    if not sizes.any():
        return None
    # The strongest harmonic h determines the lag up to 1/h; the difference of the motions decides.
    harmonic = int(sizes.argmax()) + 1
    turned = float(np.angle(np.vdot(two[harmonic], one[harmonic]))) / (2.0 * math.pi * harmonic)
    numbers = np.arange(len(one))[:, None]
    for k in range(harmonic):
        lag = (turned + k / harmonic) % 1.0
        shifted = np.fft.irfft(one * np.exp(-2j * math.pi * numbers * lag), len(first), axis=0)
        if np.all(np.abs(shifted - other).max(axis=0) <= ALIKE * extent):
            return lag
    return None


def _fraction(share: float) -> str:
    """Write a share of a period: as a fraction of small integers if it is one."""
    for denominator in range(2, 65):
        numerator = round(share * denominator)
        if abs(share * denominator - numerator) < 1e-6 * denominator:
            return f"{numerator}/{denominator}" if numerator else "0"
    return f"{share:.6g}"


def _named(labels: Sequence[str]) -> str:
    """Write labels of nodes."""
    shown = ", ".join(map(str, labels[:FEW])) + (", …" if len(labels) > FEW else "")
    return f"node{'s' if len(labels) > 1 else ''} {shown}"

"""Kinds of bifurcations of periodic orbits."""

from __future__ import annotations

from enum import StrEnum


class BifurcationKind(StrEnum):
    """Kind of a bifurcation of periodic orbits, named by the multiplier that passes the unit circle, or by the friction."""

    PERIOD_DOUBLING = "period doubling"  # at -1
    FOLD = "fold"  # at 1; the branch turns back in its parameter
    BRANCH_POINT = "branch point"  # at 1; transcritical or pitchfork
    NEIMARK_SACKER = "Neimark-Sacker"  # a complex pair
    GRAZING = "grazing"  # a phase of stick or slip begins in the middle of another one
    STICK_LOSS = "stick loss"  # a body that landed in stick turns at once

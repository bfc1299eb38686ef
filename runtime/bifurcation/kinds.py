"""Kinds of bifurcations of periodic orbits."""

from __future__ import annotations

from enum import StrEnum


class BifurcationKind(StrEnum):
    """Kind of a bifurcation of periodic orbits."""

    PERIOD_DOUBLING = "period doubling"
    FOLD = "fold"
    BRANCH_POINT = "branch point"
    NEIMARK_SACKER = "Neimark-Sacker"
    GRAZING = "grazing"
    STICK_LOSS = "stick loss"

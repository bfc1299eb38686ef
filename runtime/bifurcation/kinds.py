"""Kinds of bifurcations of equilibria and periodic orbits."""

from __future__ import annotations

from enum import StrEnum


class BifurcationKind(StrEnum):
    """Kind of a bifurcation, named by the eigenvalue or multiplier that passes, or by the friction."""

    FOLD = "fold"  # at 0 or 1; the branch turns back in its parameter
    BRANCH_POINT = "branch point"  # at 0 or 1; transcritical or pitchfork
    HOPF = "Hopf"  # a complex pair of eigenvalues of an equilibrium
    PERIOD_DOUBLING = "period doubling"  # at -1
    TORUS = "torus"  # a complex pair of multipliers; also called Neimark-Sacker
    GRAZING = "grazing"  # a phase of stick or slip begins in the middle of another one
    STICK_LOSS = "stick loss"  # a body that landed in stick turns at once

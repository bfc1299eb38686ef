"""Friction laws, and how a law that jumps is treated at rest."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from ..inputs.frozen import Frozen
from ..inputs.words import Word
from .parameter import Parameter

__all__ = ["KAPPA", "ContactModel", "FrictionLaw", "regularise"]


class ContactModel(Word):
    """How the jump of a friction law at rest is treated."""

    ATAN = "atan"
    """Smoothed by the arcus tangent."""
    SIGN = "sign"
    """Left as it is, with sign(0) = 0."""
    SET_VALUED = "set-valued"
    """Stick and slip."""


KAPPA = Parameter(1e5, "s/m", "steepness of the regularised jump, sgn w = (2/pi) atan(kappa w)", positive=True)


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """The friction coefficient as a function of the sliding velocity.  Equal contents make equal laws.

    Parameters
    ----------
    name : str
        What messages and scene files call it.
    parameters : mapping of str to Parameter
        Parameters of the law, real symbols in its expressions.
    force : Expr
        Friction force over normal load, of the velocity w (`SLIDING`) of the ground relative to the body; w f(w) >= 0.
    static : Expr, optional
        The static friction coefficient if it exceeds f(0+); only set-valued contact knows it.
    order : tuple of (str, str)
        Pairs of parameters of which the first must not exceed the second under set-valued contact.
    self_exciting : bool
        True if the law is meant to feed energy.
    summary, source : str
        What it is, and where it was published.
    """

    name: str
    parameters: Frozen[Parameter]
    force: sp.Expr
    static: sp.Expr | None = None
    order: tuple[tuple[str, str], ...] = ()
    self_exciting: bool = False
    summary: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __str__(self) -> str:
        return self.name

    @property
    def jumps(self) -> bool:
        """True if friction jumps at rest; without a jump nothing sticks."""
        return self.static is not None or self.force.has(sp.sign)


def regularise(expression: sp.Expr, kappa: sp.Symbol) -> sp.Expr:
    """Replace every sign(w) by (2/pi) atan(kappa w).

    The slope at w = 0 becomes 2 kappa/pi, and for |w| >> 1/kappa the error is 2/(pi kappa |w|).

    References
    ----------
    Marszal et al., Eur. Phys. J. Special Topics (2016), eq. 5.
    """
    return expression.replace(sp.sign, lambda w: 2 * sp.atan(kappa * w) / sp.pi)

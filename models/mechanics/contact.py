"""Friction laws f(w), odd functions of the sliding velocity w, and the treatment of their jump at w = 0.

A smoothed law is a function of w.  In a set-valued law f(0) is any number between -f_s and f_s, where f_s is the static
coefficient: the body sticks as long as one of these numbers balances the load (Leine, van Campen, de Kraker & van den
Steen, Nonlinear Dynamics 16, 41 (1998)).  The sign of w is then a state of the oscillator, the mode `slip`: +1 and -1
in slip, 0 in stick.  `synchain.models.mechanics.events` derives the equations and the conditions under which the mode
changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp

from ..inputs.frozen import FrozenDict
from ..inputs.words import Word
from .jumps import rough_at
from .parameter import Parameter, defaults_text


class ContactModel(Word):
    """Treatments of the jump of a friction law at rest."""

    ATAN = "atan"
    """Smoothed by the arcus tangent."""
    SIGN = "sign"
    """The unchanged law, with sign(0) = 0."""
    SET_VALUED = "set-valued"
    """Stick and slip."""


KAPPA = Parameter(1e5, "s/m", "steepness of the regularised jump, sgn w = (2/pi) atan(kappa w)", positive=True)

SLIDING = sp.Symbol("w", real=True)
"""The sliding velocity, the argument of a friction law."""

SLIP = sp.Symbol("slip", real=True)
"""The mode of an oscillator: +1 or -1 while it slips, 0 while it sticks."""

TINY, SMALL = sp.Rational(1, 10**30), 1e-6
"""A sliding velocity close to zero; a change of the coefficient around w = 0 that only a jump exceeds (choices)."""


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """The friction coefficient as a function of the sliding velocity.  Equal contents make equal laws.

    Parameters
    ----------
    name : str
        Name in messages and scene files.
    parameters : mapping of str to Parameter
        Parameters of the law, real symbols in its expressions.
    force : Expr
        Friction force over normal load, of the velocity w (`SLIDING`) of the ground relative to the body; w f(w) >= 0.
        Its jump at w = 0 is written with sign.
    static : Expr, optional
        The static friction coefficient if it exceeds f(0+); only set-valued contact uses it.
    order : tuple of (str, str)
        Pairs of parameters of which the first must not exceed the second under set-valued contact.
    self_exciting : bool
        True if the law may feed energy, w f(w) < 0.
    summary, source : str
        A description, and the publication.

    Raises
    ------
    ValueError
        If the force jumps at w = 0 by more than its signs do.

    See Also
    --------
    synchain.friction_law
    synchain.friction

    Examples
    --------
    >>> import synchain as sc
    >>> law = sc.friction_law("mu*sign(w)", {"mu": 0.3})
    >>> isinstance(law, sc.plugins.FrictionLaw), law.force
    (True, mu*sign(w))
    """

    name: str
    parameters: FrozenDict[Parameter]
    force: sp.Expr
    static: sp.Expr | None = None
    order: tuple[tuple[str, str], ...] = ()
    self_exciting: bool = False
    summary: str = field(default="", compare=False)
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        values = {sp.Symbol(name, real=True): p.default or 1 for name, p in self.parameters.items()} | {
            SLIDING: -sp.Rational(1, 7)
        }
        if _is_complex(self.force, values):
            part = next(e for e in sp.postorder_traversal(self.force) if _is_complex(e, values))
            raise ValueError(
                f"friction law {self.name!r}: found {part}, which is complex for w < 0; expected a real force of both "
                "directions; write it with abs(w) and sign(w), as in abs(w)**(3/2)*sign(w)"
            )
        if _jump(regularise(self.force, SLIDING, sp.S.One), SLIDING):
            raise ValueError(
                f"friction law {self.name!r}: found a jump at w = 0 in {self.force} that is not written with sign(w); "
                "expected it as in mu*sign(w)"
            )

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"FrictionLaw({self.name!r}{defaults_text(self.parameters)})"

    @property
    def jumps(self) -> bool:
        """True if friction jumps at rest; without a jump nothing sticks."""
        return self.static is not None or _jump(self.force, SLIDING)


def regularise(law: sp.Expr, argument: sp.Symbol, kappa: sp.Expr) -> sp.Expr:
    """Replace every sign(w) that holds the argument by (2/pi) atan(kappa w).

    The slope at w = 0 becomes 2 kappa/pi, and for |w| >> 1/kappa the error is 2/(pi kappa |w|).

    References
    ----------
    Marszal et al., Eur. Phys. J. Special Topics (2016), eq. 5.
    """
    return law.replace(sp.sign, lambda w: 2 * sp.atan(kappa * w) / sp.pi if w.has(argument) else sp.sign(w))


def _is_complex(e: sp.Basic, values: Mapping[sp.Symbol, object]) -> bool:
    return isinstance(e, sp.Expr) and abs(sp.im(e.subs(values).evalf())) > SMALL


def _jump(e: sp.Expr, argument: sp.Symbol) -> bool:
    """Return True if an expression jumps where its argument passes zero, at arbitrary values of its other symbols."""
    others = sorted(e.free_symbols - {argument}, key=str)
    values = {symbol: sp.Rational(2 * k + 3, 2 * k + 5) for k, symbol in enumerate(others)}
    above, below = (complex(e.xreplace({**values, argument: w}).evalf(60)) for w in (TINY, -TINY))
    return abs(above - below) > SMALL


def in_slip(law: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """Return the law in slip, with the mode `SLIP` in place of the sign of its argument.

    Raises ValueError for a law that is not odd, or that is not smooth on either side of zero.
    """
    what, speed = f"set-valued contact: the law {law.xreplace({argument: SLIDING})}", sp.Dummy("w", positive=True)
    # Require f(-w) = -f(w): one expression then holds for both directions of slip.
    both = sp.simplify(law.xreplace({argument: speed}) + law.xreplace({argument: -speed}))
    if both != 0:
        raise ValueError(f"{what} has f(w) + f(-w) = {both.xreplace({speed: SLIDING})}; expected 0, an odd law")
    moving = _by_mode(law, argument)
    # Apart from the jump the law must be smooth at w = 0, where series and derivatives are computed.
    slipping = moving.xreplace({SLIP: sp.S.One})
    if coefficient_at_rest(slipping, argument).has(sp.nan, sp.zoo, sp.oo, -sp.oo):
        raise ValueError(f"{what} has no finite value at w = 0; expected one for slow slip")
    if _jump(slipping, argument) or rough_at(slipping, {argument: sp.S.Zero}, [argument]) is not None:
        raise ValueError(f"{what} has another kink at w = 0 than sign(w) and |w| have; expected these alone")
    return moving


def coefficient_at_rest(moving: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """Return the limit of a law in slip as w falls to zero."""
    # Powers w**p with a symbol p > 0 tend to zero.
    speed = sp.Dummy("w", positive=True)
    above = moving.xreplace({argument: speed, SLIP: sp.S.One})
    powers = {p: sp.S.Zero for p in _powers_from_zero(above, speed) if not p.exp.is_number}
    return above.xreplace(powers).xreplace({speed: sp.S.Zero})


def _powers_from_zero(e: sp.Expr, argument: sp.Symbol) -> list[sp.Pow]:
    """Return the non-integer powers in an expression whose base vanishes with the argument."""
    powers = (p for p in e.atoms(sp.Pow) if not p.exp.is_integer and p.base.has(argument))
    return [p for p in powers if p.base.xreplace({argument: sp.S.Zero}) == 0]


def beyond_rest(moving: sp.Expr, argument: sp.Symbol) -> sp.Expr:
    """Write |w|**p for (s w)**p in a law in slip; trial steps overshoot w = 0, where s w < 0 has no real power p."""
    powers = _powers_from_zero(moving, argument)
    return moving.xreplace({p: sp.Abs(p.base.xreplace({SLIP: sp.S.One})) ** p.exp for p in powers})


def _by_mode(e: sp.Basic, argument: sp.Symbol) -> sp.Basic:
    """Replace the sign of each factor by the mode if this sign follows the sign of the argument."""
    if not isinstance(e, sp.Abs | sp.sign):
        return e.func(*(_by_mode(part, argument) for part in e.args)) if e.args else e
    speed = sp.Dummy("w", positive=True)
    product = []
    for factor in sp.Mul.make_args(sp.factor_terms(e.args[0])):
        # Possible if SymPy finds the sign of the factor on both sides of zero.
        above, below = (sp.sign(factor.xreplace({argument: w})) for w in (speed, -speed))
        inner = _by_mode(factor, argument)
        if above.is_number and below.is_number:
            sign = above if above == below else above * SLIP
            product.append(sign if isinstance(e, sp.sign) else sign * inner)
        else:
            product.append(e.func(inner))
    return sp.Mul(*product)

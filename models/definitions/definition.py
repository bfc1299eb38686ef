"""The kinds of plug-in of mechanics.  The types of the values are imported on use, so that lists need no SymPy."""

from __future__ import annotations

from ..inputs.plugins import PluginKind


def _oscillators() -> tuple[type, ...]:
    from ..mechanics.oscillator import Oscillator

    return (Oscillator,)


def _laws() -> tuple[type, ...]:
    from ..mechanics.contact import FrictionLaw

    return (FrictionLaw,)


def _couplings() -> tuple[type, ...]:
    from ..interactions.coupling import COUPLINGS

    return COUPLINGS


OSCILLATOR = PluginKind(
    "oscillator",
    "oscillators",
    _oscillators,
    "Lagrangian(…) or Field(…)",
    near={"roessler": "rossler", "vdp": "van_der_pol"},
)
"""Oscillators: the files of the folder `oscillators`."""

FRICTION_LAW = PluginKind(
    "friction",
    "frictions",
    _laws,
    "friction_law(…)",
    otherwise=", or an expression, friction_law('mu*sign(w)', {'mu': 0.3})",
)
"""Friction laws: the files of the folder `frictions`."""

COUPLING = PluginKind(
    "coupling",
    "couplings",
    _couplings,
    "link_energy(…), Potential(…) or Rates(…)",
    near={"dashpot": "damper"},
    otherwise=", or components such as 'x->x'",
)
"""Couplings: the files of the folder `couplings`."""

"""The kinds of plug-in of mechanics.  The types of the values are imported on use, so that lists need no SymPy."""

from __future__ import annotations

from ..inputs.plugin_files import PluginKind
from ..mechanics.law_plugins import FRICTION_LAW

__all__ = ["COUPLING", "FRICTION_LAW", "OSCILLATOR"]


def _oscillators() -> tuple[type, ...]:
    from ..mechanics.oscillator import Oscillator

    return (Oscillator,)


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

COUPLING = PluginKind(
    "coupling",
    "couplings",
    _couplings,
    "link_energy(…), Potential(…) or Rates(…)",
    near={"dashpot": "damper"},
    otherwise=", or components such as 'x->x'",
)
"""Couplings: the files of the folder `couplings`."""

"""Friction laws by name.  The type of the values is imported on use, so that lists need no SymPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..inputs.plugin_files import PluginKind, load

if TYPE_CHECKING:
    from .contact import FrictionLaw


def _laws() -> tuple[type, ...]:
    from .contact import FrictionLaw

    return (FrictionLaw,)


FRICTION_LAW = PluginKind(
    "friction",
    "frictions",
    _laws,
    "friction_law(…)",
    otherwise=", or an expression, friction_law('mu*sign(w)', {'mu': 0.3})",
)
"""Friction laws: the files of the folder `frictions`."""


def load_friction_law(name: str) -> FrictionLaw:
    """Return the friction law of a plug-in."""
    law: FrictionLaw = load(FRICTION_LAW, name)
    return law

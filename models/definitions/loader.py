"""Load oscillators, friction laws and couplings by name."""

from __future__ import annotations

from dataclasses import replace

from ..inputs.plugin_files import load
from ..interactions.coupling import Coupling, LagrangianCoupling, MatrixCoupling, split
from ..mechanics.law_plugins import load_friction_law
from ..mechanics.oscillator import Oscillator
from .definition import COUPLING, OSCILLATOR

__all__ = ["load_friction_law", "load_oscillator", "read_coupling"]


def load_oscillator(name: str) -> Oscillator:
    """Return the oscillator of a plug-in.

    See Also
    --------
    synchain.Scene
    synchain.Lagrangian
    synchain.Field

    Examples
    --------
    >>> import synchain as sc
    >>> sc.load_oscillator("rossler").states
    ('x', 'y', 'z')
    """
    oscillator: Oscillator = load(OSCILLATOR, name)
    return oscillator


def read_coupling(text: str) -> Coupling:
    """Read a coupling: components such as "x->x", or a plug-in with optional coordinates such as "spring on x"."""
    matrix = MatrixCoupling.parse(text)
    if matrix is not None:
        return matrix
    name, coordinates = split(text)
    coupling: Coupling = load(COUPLING, name)
    if coordinates is None:
        return coupling
    if not isinstance(coupling, LagrangianCoupling):
        raise ValueError(f"coupling {text!r}: {name!r} has no energies of coordinates; leave out 'on'")
    return replace(coupling, coordinates=coordinates)

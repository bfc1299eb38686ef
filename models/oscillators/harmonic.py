"""Undamped linear oscillator of frequency 1; a network of them has frequencies sqrt(1 - sigma gamma_k)."""

from ..definitions.inline import Lagrangian

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="x**2/2",
    coordinates={"x": "v"},
    source="Rayleigh, The Theory of Sound, vol. 1, ch. 4-5 (Macmillan, 1877)",
)

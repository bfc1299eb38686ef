"""Free mass; with the coupling 'fput' a Fermi-Pasta-Ulam-Tsingou chain."""

from ..definitions.inline import Lagrangian

OSCILLATOR = Lagrangian(
    T="v**2/2",
    coordinates={"x": "v"},
    source="Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955); Ford, Phys. Rep. 213, 271 (1992)",
)

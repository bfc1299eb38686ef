"""One node: energies, forces, friction and units become rates of states. Knows no graph."""

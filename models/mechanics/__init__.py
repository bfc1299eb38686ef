"""One node and one link: energies, forces, friction and units become rates of states. Knows no graph."""

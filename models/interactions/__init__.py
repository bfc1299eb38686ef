"""Links between two nodes: couplings as values, and the equations derived from a coupling. Imports no graph."""

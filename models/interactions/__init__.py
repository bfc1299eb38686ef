"""What a link between two nodes is: couplings as values, and the equations that they make. Knows no graph."""

"""Exact algebraic numbers: isolated roots, sums of cosines, balls. Knows nothing of graphs."""

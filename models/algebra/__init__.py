"""Exact algebraic numbers: isolated roots, sums of cosines, balls. It imports nothing of graphs."""

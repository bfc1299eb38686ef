"""Exact algebraic numbers: isolated roots, sums of cosines, balls. Independent of graphs."""

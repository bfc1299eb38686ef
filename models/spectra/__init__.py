"""Exact eigenvalues, multiplicities and Jordan blocks of a matrix, with their proof. Knows no family of graphs."""

"""Exact spectra of matrices: eigenvalues, Jordan blocks, proofs. Knows no family of graphs."""

"""Exact spectra of rational matrices: eigenvalues, Jordan blocks, proofs. Independent of families of graphs."""

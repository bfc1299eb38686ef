"""Compute Lyapunov and transversal exponents along orbits. Modules here use kernels and single cells, but no sweeps."""

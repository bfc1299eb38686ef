"""Lyapunov and transversal exponents along orbits: may know kernels and one cell, no sweeps."""

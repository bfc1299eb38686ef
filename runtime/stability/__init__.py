"""Lyapunov and transversal exponents, master stability functions and the orbits that carry them."""

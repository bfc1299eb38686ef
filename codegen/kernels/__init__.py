"""Kernels: the functions of a scene and the driver that runs them, as modules that are compiled, kept and loaded."""

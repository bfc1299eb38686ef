"""Kernels as text: the functions of a scene, and the driver that runs them."""

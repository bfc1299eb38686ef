"""Kernels as machine code: compiled, kept on disk, loaded; no step and no scene."""

"""Compile kernels to machine code, keep it on disk, load it: `compile.load` is the entry; no step and no scene."""

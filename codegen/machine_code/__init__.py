"""Compile kernels to machine code, store the code on disk and load it; the entry is `compile.load`.

This package imports nothing about steps or scenes.
"""

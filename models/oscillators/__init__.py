"""Oscillators, one file each: the file assigns OSCILLATOR, and the first paragraph of its docstring is its summary.

See docs/plugins.md.
"""

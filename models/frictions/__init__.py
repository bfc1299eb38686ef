"""Friction laws, one file each: the file assigns FRICTION, and the first paragraph of its docstring is its summary.

See docs/plugins.md.
"""

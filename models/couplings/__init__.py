"""Couplings between two oscillators, one file each: the file assigns COUPLING, and the first paragraph of its docstring is
its summary.

Their strength is called ``sigma``. A coupling that is linear in any states needs no file: a text such as "x->x, 1/2 y->z"
is one (`synchain.models.interactions.coupling`). See docs/plugins.md.
"""

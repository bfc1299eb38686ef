"""Equations of motion of a network, their exact reductions and their variational equations.

Knows graphs and the mechanics of one node and one link, and no scene.
"""

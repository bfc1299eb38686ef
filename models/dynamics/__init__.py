"""Equations of motion of a network, their exact reductions and their variational equations.

Uses graphs and the mechanics of one node and one link; imports no scene.
"""

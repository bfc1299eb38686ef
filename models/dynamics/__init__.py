"""Equations of motion of a whole network, their exact reductions and their variational equations. Knows no scene."""

"""Expressions as text: names that cannot collide, statements, common subexpressions. Knows no integrator."""

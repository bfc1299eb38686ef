"""Equations as LaTeX and as plain text. Knows no scene."""

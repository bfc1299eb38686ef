"""Equations as LaTeX, plain text and MathML. Independent of scenes."""

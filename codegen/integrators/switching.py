"""Rodas5P (order 5) while a cell is stiff, DOP853 (order 8) while it is not, each with its own error control.

The product of the step size and a bound of the eigenvalues decides; the generated step computes the
bound from its exact Jacobian (`turned` in codegen/driver/control.py).
"""

KIND = "switching"
STIFF = "rodas5p"
SMOOTH = "dop853"

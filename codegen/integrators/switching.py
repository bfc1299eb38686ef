"""Rodas5P where a cell is stiff at the moment, DOP853 where it is not: of order 5 and 8, each with its own error control.

The change-over hangs on the step times a bound of the eigenvalues, which the generated step knows from its exact Jacobian
(codegen/skeletons/sweep.py, `turned`).
"""

KIND = "switching"
STIFF = "rodas5p"
SMOOTH = "dop853"

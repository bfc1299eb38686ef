"""The power series of the solution, by recurrences that are derived from the expressions (codegen/taylor)."""

KIND = "taylor"
ORDER = 16
"""The order at moderate tolerances; a kernel takes the one that its tolerance asks for."""
SOURCE = "Jorba & Zou, Experimental Mathematics 14, 99 (2005)"

"""The power series of the solution, by recurrences that are derived from the expressions (codegen/taylor)."""

KIND = "taylor"
# The order at moderate tolerances; a kernel uses the order for its own tolerance (codegen/taylor/series_order.py).
ORDER = 16
SOURCE = "Jorba & Zou, Experimental Mathematics 14, 99 (2005)"

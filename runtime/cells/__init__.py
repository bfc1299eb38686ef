"""Convert a scene to the arrays that a kernel reads and fills: reduction, rows of cells, buffers.

* cell: one simulation of a sweep
* row: the numbers that a kernel reads for one cell
* span: the times of a cell
* block: cells that are run, stored and resumed together
"""

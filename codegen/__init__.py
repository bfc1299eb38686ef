"""From equations to machine code: text of one step, modules of kernels and drivers, their
compilation, and exports.

Glossary
--------
kernel        The compiled functions of a scene and the driver that calls them.
step          Generated function that advances a cell by one step of an integrator.
stage         One evaluation of the right-hand side within a step.
driver        Program that calls steps and controls step size and events. Scenes with the same kind of step share it.
recorder      Function that reads one record from accepted steps.
lane          One number of a SIMD register. Each lane integrates another cell.
width         The number of lanes of a kernel: 1, 2, 4, 8 or 16.
dense output  The polynomial through a step, which gives states between its ends.
series        Coefficients of the powers of time of a value, computed by a recurrence.
digest        Checksum of the text of a kernel.
unrolled      Form of a kernel with one statement for each node. Larger networks have loops over nodes and links.
program       Generated code as expressions and statements, before it becomes text.
lowering      Translation of SymPy expressions to expressions of a program.
dialect       Rules of a printer for one language: lanes for Numba, NumPy, Python's math, C99.
golden        A file of expected text in tests/golden, which `pytest --update` rewrites.
"""

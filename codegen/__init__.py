"""From equations to machine code: text of one step, modules of kernels and drivers, their
compilation, and exports.

Glossary
--------
lane          One of the numbers in a SIMD register; each lane integrates a cell of its own.
width         The number of lanes of a kernel: 1, 2, 4, 8 or 16.
program       Generated code before it is text: statements of expressions that keep their order.
lowering      From SymPy to the expressions of a program; decides how powers and constants compute.
dialect       What a printer knows of one language: lanes for Numba, NumPy, Python's math, C99.
step          Generated function: advances all states of one cell by one step of an integrator.
stage         One evaluation of the right-hand side within a step.
driver        Fixed text that calls the step: step size, events, the next cell of a lane.
              It is compiled once for a width and a kind of step.
recorder      Fixed text of a function that the driver calls for one record, if the scene wants it.
kernel        The functions of a scene, a module that Numba compiles, and the driver that runs them.
digest        Hash of the text of a kernel.
record        What a kernel writes: mean errors, section points, trajectories.
dense output  The polynomial through a step, which gives states between its ends.
series        Coefficients of the powers of time for one value, and the recurrence that makes them.
unrolled      Written out node by node; larger networks are looped over their nodes and links.
golden        A file of expected text in tests/golden, which `pytest --update` writes anew.
"""

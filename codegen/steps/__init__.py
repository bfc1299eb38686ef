"""One step of a Runge-Kutta or Rosenbrock method for given equations, as statements.

In this diagram, values are joined by arrows; each arrow is labelled with the modules of this package that it uses.

    Equations ─safe_names─▶ Equations with usable names ─blocks─▶ NodeBlocks, one for each kind of node
              ─places, fields─▶ layout and sums of large networks ─sparse_plan─▶ SparsePlan
              ─UnrolledStep | LoopedStep─▶ statements and functions of one step

`step` holds the stages of all methods. A small network keeps each state in a register (`unrolled_step`, with the
elimination of `elimination`); a large one keeps vectors in memory (`looped_step`, with the elimination of `sparse_plan`).
`mass_solve` adds a mass matrix, `contact_step` the events of set-valued friction.

Why two writers? A single writer of loops, unrolled by a pass that folds zeros and units, would cost explicit steps
hardly any operations. Rosenbrock steps would need 12 to 25 % more operations, and 50 % more with inertia (counted for
23 networks of up to eight nodes). `UnrolledStep` needs fewer for two reasons: SymPy adds up Jacobian entries before any
code is emitted, and each stage state is computed from the state of the previous stage.

This package imports no driver code and reads no files.
"""

"""One step of a Runge-Kutta or Rosenbrock method for given equations, as statements.

    Equations ─safe_names─▶ Equations with usable names ─blocks─▶ NodeBlocks, one for each kind of node
              ─places, fields─▶ layout and sums of large networks ─sparse_plan─▶ SparsePlan
              ─UnrolledStep | LoopedStep─▶ statements and functions of one step

`step` holds the stages of all methods. A small network keeps each state in a register (`unrolled_step`, with the
elimination of `elimination`); a large one keeps vectors in memory (`looped_step`, with the elimination of `sparse_plan`).
`mass_solve` adds a mass matrix, `contact_step` the events of set-valued friction.
The two writers are two programs: the written-out one adds links to Jacobian entries before it emits code and skips zeros
and units, which saves a fifth of the operations of a Rosenbrock step. Loops over memory cannot do that.
The room imports neither the driver nor the disk.
"""

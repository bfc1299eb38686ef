"""One step of a Runge-Kutta or Rosenbrock method for given equations, as statements.

Values stand between the arrows; the words on an arrow are modules of this room.

    Equations ─safe_names─▶ Equations with usable names ─blocks─▶ NodeBlocks, one for each kind of node
              ─places, fields─▶ layout and sums of large networks ─sparse_plan─▶ SparsePlan
              ─UnrolledStep | LoopedStep─▶ statements and functions of one step

`step` holds the stages of all methods. A small network keeps each state in a register (`unrolled_step`, with the
elimination of `elimination`); a large one keeps vectors in memory (`looped_step`, with the elimination of `sparse_plan`).
`mass_solve` adds a mass matrix, `contact_step` the events of set-valued friction.
The two writers are two programs. An unroll pass over the loops, with all zeros and units folded, would hardly change the
operations of explicit steps, but need 12 to 25 % more in a Rosenbrock step, 50 % more with inertia (counted for 23 networks of
up to eight nodes): the written-out step adds up Jacobian entries in SymPy, before it emits code, and goes on from the state
of the stage before.
The room imports neither the driver nor the disk.
"""

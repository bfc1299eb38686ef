"""Compile functions of kernels from their syntax tree to LLVM; all that touches Numba's pipeline is here.

Numba itself reads bytecode: it rebuilds the control flow, converts it to SSA form, infers the types of all variables
together and lowers the result.  A step is thousands of lines of plain arithmetic, for which this takes twice as long
as LLVM needs for the machine code.  Here each expression is read once.  The output of a stage is the input of the
next:

1. `syntax_trees` parses the text of a module: one `ast.FunctionDef` per function.
2. `syntax_reader` types a function for given types of its arguments: every expression becomes a `TypedExpr`, the function
   a `TypedFunction`.  Numba's typing context returns the type of each operator, attribute and call.
3. `emitter` emits LLVM for a `TypedFunction`.  Numba's target context emits operators and calls, and so results have the
   bits of Numba's own pipeline, with the one exception that `syntax_reader` describes.
4. `compiler` wraps 2 and 3 as passes of a Numba compiler: a dispatcher of Numba gets a compiled function as usual.
5. `decorator` defines `njit`, which chooses the compiler of a function.

Fallback: if a stage raises anything (syntax outside the subset that `syntax_reader` reads, or another version of
Numba), Numba's own pipeline compiles this one function, with the same results in two to four times the time.  `load`
in machine_code/compile.py warns once of it.  The environment variable SYNCHAIN_FRONT_END=numba chooses Numba's
pipeline always.

This room has no lanes: `simd` registers their types and operators with Numba.
"""

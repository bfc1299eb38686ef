"""What generated code is before it is text: expressions, statements, functions, and their printers.

Everything that must be known of a program (operations, functions and names in use) is read off its statements.  Knows
SymPy, nothing of oscillators or integrators.
"""

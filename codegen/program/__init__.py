"""Generated code before it is text: expressions, statements and functions, and the passes that make and print them.

    SymPy ─passes─▶ SymPy without repetition ─lowering─▶ Expression ─▶ Statement, Function ─printers─▶ text

Operations, functions and names in use are read off the statements, not off the text. The room imports SymPy, and nothing of
oscillators or integrators.
"""

"""Represent generated code as expressions, statements and functions, with the passes that make and print them.

    SymPy ─passes─▶ SymPy without repetition ─lowering─▶ Expression ─▶ Statement, Function ─printers─▶ text

Operation counts, called functions and used names are computed from the statements, not from the text. This package
imports SymPy, but nothing about oscillators or integrators.
"""

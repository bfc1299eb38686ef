"""Graphs: families, products, readers, Laplacians, closed forms. Independent of oscillators.

A topology is a graph with exact weights.  A family is a function that makes topologies of any size.  The rule of a
topology (its family, or an operation on other graphs) makes its links on first use and its spectrum in closed form.
"""

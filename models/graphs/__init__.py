"""Graphs: families, products, readers, other matrices, closed forms. Knows no oscillator.

A topology is a graph with exact weights, a family makes topologies of any size, a rule says how a
topology came about.
"""

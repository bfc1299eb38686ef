"""Graphs: families, products, readers, symmetries, partitions, closed forms. Knows no oscillator.

A topology is a graph with exact weights, a family makes topologies of any size, a rule says how a
topology came about, a partition puts nodes into classes.
"""

"""Graphs: families, products, readers, other matrices, closed forms. It imports nothing of oscillators.

A topology is a graph with exact weights; a family makes topologies of any size; a rule, of a family or an
operation, makes the links of a topology on first use and gives closed forms of its spectrum.
"""

"""Balanced partitions, automorphisms and cluster states of a graph. Independent of oscillators."""

"""Balanced partitions, automorphisms and cluster states of a graph. It imports nothing of oscillators."""

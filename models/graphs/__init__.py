"""Topologies: families, products, readers, symmetries, partitions and closed forms of graphs. Knows no oscillator."""

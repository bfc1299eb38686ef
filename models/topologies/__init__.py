"""Families of graphs, one file each: what a file holds says `synchain.models.graphs.families.family`."""

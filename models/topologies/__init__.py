"""Families of graphs, one file each; `synchain.models.graphs.families.Family` describes the contents of a file."""

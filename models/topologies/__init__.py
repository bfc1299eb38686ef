"""Families of graphs, one file each; `synchain.models.graphs.families.Family` lists the parts."""

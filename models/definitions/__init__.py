"""How a model is defined: expressions of a notebook or a plug-in file, tables of a scene file. All make the same values."""

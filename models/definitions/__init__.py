"""How a model is said: plug-in files, expressions of a notebook, tables of a scene file. All of them make the same values."""

"""Scenes: a model with its numbers and its records, and the files that hold them."""

"""Scenes: a model with its numbers and records, and scene files."""

"""Labelled results, the files that keep them, and certificates as data. Runs nothing."""

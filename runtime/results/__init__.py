"""Labelled results, their files, and certificates as data. Runs no simulation."""

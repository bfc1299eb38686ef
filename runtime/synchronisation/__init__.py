"""Compute thresholds, the universal probe and basins, and compare prediction with simulation."""

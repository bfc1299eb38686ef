"""Thresholds, the universal probe, basins and the agreement of prediction and simulation."""

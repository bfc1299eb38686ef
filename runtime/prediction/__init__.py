"""Intervals, windows and verdicts from a spectrum alone. Simulates nothing."""

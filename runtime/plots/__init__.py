"""Plots of all results and of graphs, and the tables of numbers beside them; runs no scene but for an orbit."""

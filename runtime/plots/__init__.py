"""Plots of all results and of graphs, and tables of numbers. Only the plot of an orbit runs a scene."""

"""The numbers of all cells of a sweep: parameters, initial states, axes, random draws. Imports no scene."""

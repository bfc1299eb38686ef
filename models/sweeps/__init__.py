"""The numbers of cells: parameters, initial states, axes, and draws along an axis of realisations; no scene."""
